"""Work through a share of the plan: several processes, each case on a clock, every record kept at once.

A study that was stopped goes on where it stopped: what stands in the file is not done again. A case that crashes or
takes too long is a record too, and counts as a failure.
"""

from __future__ import annotations

import json
import os
import traceback
from collections.abc import Callable, Collection, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, TimeoutError, wait
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import Any
from zlib import crc32

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from .cases import ERRING, Case, Place, chosen, is_pilot, plan, turn
from .erring import TOGETHER

Work = Callable[[Case, dict[str, float], bool], dict[str, Any]]
Limits = dict[Place, dict[str, float]]  # of a noise, a protocol and its instruments: effect -> N
CASES = 60  # after which a process is replaced: compiled programs of every shape pile up to gigabytes


def study(
    out: Path,
    share: float,
    workers: int,
    seed: int = 1,
    limit: float = 900.0,
    rivals: float = 0.25,
    quiet: bool = False,
    work: Work | None = None,
    groups: Collection[str] = (),
    rigs: Collection[str] = (),
) -> list[dict[str, Any]]:
    """Every record of a share of the plan, or of some groups of it, or of some kinds of instruments (`rigs`).

    `limit` is a case's time in s, `rivals` their share of the cases.
    """
    cases = tuple(case for case in plan(seed) if not rigs or case.instruments in rigs)
    return worked(chosen(cases, share, groups), out, workers, limit, rivals, quiet, work or attempted)


def worked(
    cases: Sequence[Case], out: Path, workers: int, limit: float, rivals: float, quiet: bool, work: Work
) -> list[dict[str, Any]]:
    """The records of these cases; what the file holds already is not done again."""
    done = {record["id"]: record for record in records(out)}
    with pool(workers) as working, bar(quiet) as shown:
        number = shown.add_task("cases", total=len(cases), completed=sum(case.id in done for case in cases))
        for stage in (pilots(cases), [case for case in cases if not is_pilot(case)]):
            todo = [case for case in stage if case.id not in done]
            asked = Asked(work, limits_of(done.values()), limit, rivals)
            for record in finished(working, in_order(todo), asked, 2 * workers):
                append(out, record)
                done[record["id"]] = record
                shown.update(number, advance=1, description=record["id"][:60])
    return [done[case.id] for case in cases if case.id in done]


def pilots(cases: Sequence[Case]) -> list[Case]:
    """Clean cases that must come first: detection limits are read off them."""
    return [case for case in cases if is_pilot(case)]


def in_order(cases: Sequence[Case]) -> list[Case]:
    """As if shuffled, so that what a stopped study has done is a fair sample of it."""
    return sorted(cases, key=lambda case: crc32(case.id.encode()))


def limits_of(done) -> Limits:
    """The printed detection limits of every noise, protocol and kind of instruments."""
    clean = (record for record in done if "limits" in record and record["number"] == 0)
    return {place_of(record): record["limits"] for record in clean}


def place_of(record: dict[str, Any]) -> Place:
    """`Case.place` of a record; records from before instruments erred had exact ones."""
    return record["noise"], record["protocol"], record.get("instruments", "exact"), record.get("stated", False)


# ---------------------------------------------------------------------------------------------------------- the clock


@dataclass(frozen=True)
class Asked:
    """What holds for every case of a stage."""

    work: Work
    limits: Limits
    seconds: float
    rivals: float


@contextmanager
def pool(workers: int):
    """Processes that start afresh (compiled code does not survive a fork), stopped at once if the study is."""
    from pebble import ProcessPool

    working = ProcessPool(workers, CASES, initializer=prepared, context=get_context("spawn"))
    try:
        yield working
        working.close()
    finally:
        working.stop()
        working.join()


def prepared() -> None:
    """What a process needs once: 64 bits and the store of compiled code."""
    from fitting.compiled.prepare import prepare

    prepare()


def finished(working, cases: Sequence[Case], asked: Asked, ahead: int) -> Iterator[dict[str, Any]]:
    """Records as they come in, not many more cases waiting than can be worked on."""
    waiting: dict[Any, Case] = {}
    left = list(reversed(cases))
    while left or waiting:
        while left and len(waiting) < ahead:
            case = left.pop()
            own = asked.limits.get(case.place, {})
            given = (case, own, has_rivals(case, asked.rivals))
            waiting[working.schedule(asked.work, args=given, timeout=asked.seconds)] = case
        for future in wait(waiting, return_when=FIRST_COMPLETED).done:
            yield outcome(future, waiting.pop(future), asked.seconds)


def attempted(case: Case, limits: dict[str, float], rivals: bool) -> dict[str, Any]:
    """One case; what goes wrong is written down."""
    from .judge import judged

    try:
        return judged(case, limits, rivals)
    except Exception as error:
        told = traceback.format_exc(limit=-4)
        return failed(case, f"{type(error).__name__}: {error}") | {"traceback": told}


def outcome(future, case: Case, limit: float) -> dict[str, Any]:
    """A record, whatever became of the process."""
    try:
        return future.result()
    except TimeoutError:
        return failed(case, f"not done after {limit:g} s") | {"seconds": limit}
    except Exception as error:
        return failed(case, f"the process died: {error}")


def failed(case: Case, why: str) -> dict[str, Any]:
    """The record of a case without an answer."""
    return {"id": case.id, **vars(case), "error": why}


def has_rivals(case: Case, share: float) -> bool:
    """Whether the rivals answer this case too: an even share of every group."""
    alone = case.group == ERRING and case.instruments != TOGETHER
    unasked = alone or case.group in ("power", "invariance", "next", "kinds")
    return not unasked and turn(crc32(case.id.encode())) < share


# ----------------------------------------------------------------------------------------------------------- the file


def records(path: Path) -> list[dict[str, Any]]:
    """The records of a file; a last line that was torn off is left out."""
    if not path.exists():
        return []
    found = []
    for line in path.read_text().splitlines():
        try:
            found.append(json.loads(line))
        except json.JSONDecodeError:
            continue
    return found


def append(path: Path, record: dict[str, Any]) -> None:
    """Add a record and see it to the disk; a torn line before it is ended first."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("ab+") as file:
        if file.tell() and not ends_a_line(file):
            file.write(b"\n")
        file.write(json.dumps(record, default=plain).encode() + b"\n")
        file.flush()
        os.fsync(file.fileno())


def ends_a_line(file) -> bool:
    """Whether the last byte is a line's end."""
    file.seek(-1, os.SEEK_END)
    return file.read(1) == b"\n"


def plain(value: Any) -> Any:
    """numpy's numbers for JSON."""
    return value.item() if hasattr(value, "item") else str(value)


def bar(quiet: bool) -> Progress:
    """A progress bar on the error output."""
    columns = (BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), TimeRemainingColumn())
    text = TextColumn("{task.description}", markup=False)
    return Progress(*columns, text, console=Console(stderr=True), disable=quiet)
