"""A study that goes through its cases in several processes, and goes on where it was stopped."""

import traceback
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, wait
from pathlib import Path
from typing import Any, Protocol

from tests.hidden.study.run import append, bar, pool, records


class Case(Protocol):
    """What is judged by itself: a group of cases, and a name that says everything."""

    group: str

    @property
    def id(self) -> str:
        """The name."""
        ...


Judged = Callable[[Any], dict[str, Any]]  # the record of a case


def attempted(judged: Judged, case: Case) -> dict[str, Any]:
    """One case; what goes wrong is written down."""
    try:
        return judged(case)
    except Exception as error:
        where = traceback.format_exc(limit=-3)
        return {"id": case.id, "group": case.group, "error": f"{type(error).__name__}: {error}", "traceback": where}


def work_through(judged: Judged, cases: Sequence[Case], place: Path, workers: int, what: str) -> None:
    """Judge the cases, called `what` on the terminal; what the file holds already is not done again."""
    done = {record["id"] for record in records(place)}
    todo = [case for case in cases if case.id not in done]
    with pool(workers) as working, bar(False) as shown:
        number = shown.add_task(what, total=len(cases), completed=len(cases) - len(todo))
        waiting = {working.schedule(attempted, args=(judged, case)) for case in todo}
        while waiting:
            ended, waiting = wait(waiting, return_when=FIRST_COMPLETED)
            for future in ended:
                record = future.result()
                append(place, record)
                shown.update(number, advance=1, description=record["id"])
