"""Many data sets, one after the other or on a cluster: each is read here, done anywhere, and written here, once."""

import dataclasses
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fitting.cli.each.folder import Folder, mark
from fitting.cli.each.work import FIT, Found, Order, do, do_packed, failure
from fitting.errors import InputError
from fitting.progress import Progress, unwatched
from fitting.report.text.each import row
from fitting.showing import own_units
from fitting.study.data_sets import DataSet
from fitting.study.request import Request
from fitting.study.task import Task, task_of

Job = tuple[DataSet, Order, Task]
Work = Callable[[Iterator[Job]], Iterator[tuple[DataSet, Found]]]


@dataclass(frozen=True)
class All:
    """What came of all data sets, in their order; `computed` of them by this call."""

    sets: tuple[DataSet, ...]
    results: tuple[dict[str, Any], ...]
    place: Path
    computed: int
    units: Mapping[str, str]  # that their owners read values in, where all agree: SI unit -> their own


def each(
    sets: Sequence[DataSet], request: Request, order: Order, place: Path, work: Work | None = None,
    progress: Progress = unwatched,
) -> All:  # fmt: skip
    """Do with every data set what is ordered, unless it is done already, and write what comes of it."""
    folder, results, marks = Folder(place, models=not request.no_save), {}, {}
    stated: list[Mapping[str, str]] = []

    def keep(one: DataSet, found: Found) -> None:
        """Write what came of a data set."""
        folder.write(one, marks.get(one), found)
        results[one] = found.result
        bad = sum("error" in result for result in results.values())
        told = f"{len(results)} of {len(sets)}" + (f", {bad} cannot be used" if bad else "")
        progress(told, len(results) / len(sets))

    def left() -> Iterator[Job]:
        """The data sets that are not done, each read when its turn comes."""
        for one in sets:
            task = _read(one, request)
            if isinstance(task, InputError):
                keep(one, failure(task))
                continue
            stated.extend(given for e in task.experiments for given in e.units)
            marks[one] = mark(order, task)
            known = folder.known(one, marks[one], fitted=order.command == FIT)
            if known is None:
                yield one, order, task
            else:
                results[one] = known

    computed = 0
    for one, found in (work or here)(left()):
        keep(one, found)
        computed += 1
    ordered = tuple(results[one] for one in sets)
    folder.write_table([row(one, result) for one, result in zip(sets, ordered, strict=True)])
    return All(tuple(sets), ordered, place, computed, own_units(stated))


def _read(one: DataSet, request: Request) -> Task | InputError:
    try:
        return task_of(dataclasses.replace(request, data=(one.path,)))
    except InputError as error:
        return error
    except OSError as error:
        return InputError(f"it cannot be read: {error.strerror or error}", error.filename or one.path)


def here(jobs: Iterator[Job]) -> Iterator[tuple[DataSet, Found]]:
    """Do the data sets in this process."""
    for one, order, task in jobs:
        yield one, do(order, task)


def on(address: str) -> Work:
    """How data sets are done on the workers of the Dask scheduler at this address."""
    from fitting.cli.cluster.scheduler import connect, pack, spread

    client = connect(address)

    def work(jobs: Iterator[Job]) -> Iterator[tuple[DataSet, Found]]:
        pieces = ((one, (pack((order, task)),)) for one, order, task in jobs)
        for one, found, error in spread(client, do_packed, pieces):
            yield one, found if error is None else _lost(one, error)

    return work


def _lost(one: DataSet, error: Exception) -> Found:
    """A data set that the workers could not do: they died of it, or cannot run the program."""
    cure = "look at the log of the workers; they need the same version of the program, and memory enough"
    return failure(InputError(f"the workers could not do it: {type(error).__name__}: {error}", one.path, cure=cure))
