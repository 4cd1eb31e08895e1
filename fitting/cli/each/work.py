"""One data set of many: the same as `mckibben fit` or `mckibben diagnose` does with it, in plain values.

Runs where the command was typed or on a worker that knows neither the files nor the command line: what is needed comes
along, what is found goes back, and nothing that one data set does wrong touches another.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jax

from fitting.cli.settings import WORK
from fitting.compiled.store import keep_compiled
from fitting.errors import InputError
from fitting.progress import unwatched
from fitting.report.results import comparison_result, diagnosis_result, fit_result, provenance
from fitting.showing import own_units, spoken
from fitting.study.task import Task, fit_task

FIT, DIAGNOSE = "fit", "diagnose"


@dataclass(frozen=True)
class Order:
    """What is to be done with every data set."""

    command: str  # FIT or DIAGNOSE
    candidates: tuple[str, ...] = ()
    rivals: bool = False
    code: str = ""  # of a user's own effects
    typed: str = ""  # the command line, for the results
    through_instruments: bool = False  # whether the models have the likelier values, where there are any


@dataclass(frozen=True)
class Found:
    """What came of one data set: the result as `--json` has it, or an error; the fitted model as a file's text."""

    result: dict[str, Any]
    model: str = ""

    @property
    def failed(self) -> bool:
        """Whether the data set could not be used."""
        return "error" in self.result


def do(order: Order, task: Task) -> Found:
    """Fit or diagnose one data set; whatever goes wrong with it is its result."""
    _make_room()
    own = own_units(given for e in task.experiments for given in e.units)
    try:
        with spoken(own):
            found = _COMMANDS[order.command](order, task)
    except InputError as error:
        return failure(error)
    except Exception as error:  # a defect of the program: it must not cost the others
        problem = f"the program failed: {type(error).__name__}: {error}"
        folder = task.experiments[0].folder
        return failure(InputError(problem, folder, cure=f"'mckibben {order.command} {folder}' shows more"))
    origin = provenance(task) | {"command": order.typed}
    return Found(found.result | {"provenance": origin}, found.model)


def failure(error: InputError) -> Found:
    """The result of a data set that cannot be used."""
    return Found({"error": error.as_dict() | {"message": str(error)}})


def do_packed(sent: bytes) -> Found:
    """The same on a worker."""
    from threadpoolctl import threadpool_limits

    from fitting.cli.cluster.scheduler import unpack

    keep_compiled()  # workers begin cold, and there are many of them
    with jax.enable_x64(True), threadpool_limits(1, "blas"):
        return do(*unpack(sent))


def _fit(order: Order, task: Task) -> Found:
    from fitting.comparison.compare import compare
    from fitting.model_files.writer import model_text

    fit = fit_task(task)
    result = fit_result(fit) | {"comparison": comparison_result(compare(fit, task.experiments))}
    saved = fit.through if order.through_instruments and fit.through else fit
    return Found(result, model_text(saved, task.experiments) if fit.converged else "")


def _diagnose(order: Order, task: Task) -> Found:
    from fitting.study.diagnosing import candidates_of, diagnose_task, following

    candidates = candidates_of(task, order.candidates, order.rivals)
    found, compared = diagnose_task(task, candidates, unwatched)
    planned = following(task, found, unwatched)
    return Found(diagnosis_result(found, compared, planned) | {"converged": found.baseline.converged})


_COMMANDS: dict[str, Callable[[Order, Task], Found]] = {FIT: _fit, DIAGNOSE: _diagnose}


def _make_room() -> None:
    """Drop compiled programs before there are more than a process may have: data sets of many sizes need many."""
    try:
        with Path("/proc/self/maps").open() as maps:
            many = sum(1 for _ in maps) > WORK.maps
    except OSError:  # no Linux, no such limit
        return
    if many:
        jax.clear_caches()
