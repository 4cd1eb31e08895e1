"""Evidence that grows: how often a right model is ever excluded, and how soon one that lacks an effect is.

One muscle, one set of instruments, session after session. Of clean muscles it is counted how many ever reach the
evidence that excludes a model, at whatever session; beside it how many a test of each session by itself rejects at
least once. Of muscles that hide one effect at the printed detection limit of one session it is counted how many are
excluded after so many sessions, and how many the test of all these sessions together rejects, which may be looked at
only once.

    python -m tests.hidden.study.sessions --clean 40 --power 3
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import click
import numpy as np

from tests.case_by_case import work_through

from ..simulator import EVERY_NOISE, dataset, write
from .erring import MEASURED, NOISE, RIGS, TOGETHER, case_of, one_of_each_family
from .first_test import groups, table, words
from .judge import hidden_of
from .protocols import PROTOCOLS
from .run import records
from .sizes import base_of, hiding

SESSIONS = 6
HIDING = ("rich", "poor")
TOGETHER_AFTER = (1, 2, 4)  # sessions that the fixed test takes together
Record = dict[str, Any]


@dataclass(frozen=True)
class Muscle:
    """A muscle measured in several sessions; `group` is clean or hidden."""

    group: str
    hidden: str
    protocol: str
    instruments: str
    number: int
    seed: int

    @property
    def id(self) -> str:
        """A name that says everything."""
        return f"{self.group}/{self.hidden or 'nothing'}/{self.protocol}/{self.instruments}/{self.number}"


def plan(clean: int, power: int, seed: int) -> list[Muscle]:
    """`clean` muscles of each protocol with exact instruments and with all errors; `power` of each effect."""
    nothing = product(range(clean), MEASURED, ("exact", TOGETHER))
    hidden = product(range(power), HIDING, one_of_each_family())
    return [
        *(Muscle("clean", "", protocol, rig, number, seed) for number, protocol, rig in nothing),
        *(Muscle("hidden", name, protocol, TOGETHER, number, seed) for number, protocol, name in hidden),
    ]


def judged(muscle: Muscle) -> Record:
    """The record of one muscle: evidence and p value after each session, and p values of several together."""
    from fitting.diagnosis.diagnose import one_thread, prepared
    from fitting.evidence.bets import bets_of
    from fitting.evidence.growing import log_evidence, log_mean
    from fitting.recordings.experiment import read_experiment
    from mckibben_jax.effect import name_of
    from mckibben_jax.effects import LIBRARY

    hidden = _hidden(muscle)
    record = {"id": muscle.id, **vars(muscle), "parameters": hidden}
    if hidden is None:
        return record
    known, bets, p_values = {name_of(kind): kind for kind in LIBRARY}, [], []
    model = [known[name]() for name in base_of(hidden)]
    with TemporaryDirectory() as folder:
        sessions = [read_experiment(place) for place in _written(muscle, hidden, Path(folder))]
    for session in sessions:
        search = prepared([session], model)
        with one_thread():
            bets.append(bets_of(search.examiner, search.base))
            p_values.append(search.examiner.adequacy(frozenset(), search.base, {}).test.p)
    record |= {"log_evidence": log_mean(log_evidence(bets)).tolist(), "p": p_values}
    return record | ({"p_together": _together(sessions, model)} if hidden else {})


def _together(sessions: Sequence[Any], model: Sequence[Any]) -> dict[int, float]:
    """The p value of the first sessions in one test."""
    from fitting.diagnosis.diagnose import one_thread, prepared

    found = {}
    for count in TOGETHER_AFTER:
        search = prepared(sessions[:count], model)
        with one_thread():
            found[count] = search.examiner.adequacy(frozenset(), search.base, {}).test.p
    return found


def _hidden(muscle: Muscle) -> dict[str, dict[str, float]] | None:
    """What is hidden, with its parameters; None where these recordings could not show it."""
    if not muscle.hidden:
        return {}
    case = case_of((muscle.hidden,), 1.0, "limit", muscle.protocol, muscle.number, muscle.seed, muscle.instruments)
    return hidden_of(case, _limits(muscle.protocol, muscle.seed))[0]


@cache
def _limits(protocol: str, seed: int) -> dict[str, float]:
    """Detection limits (N) that one clean session prints, all errors together and stated."""
    from .first_test import answer

    return answer(replace(case_of((), 0.0, "sigma", protocol, 0, seed), stated=True), {}, False)["limits"]


def _written(muscle: Muscle, hidden: dict[str, dict[str, float]], folder: Path) -> Iterable[Path]:
    """The data sets of the sessions: one stated muscle, one set of instruments, noise of their own."""
    protocol, noise, truth = PROTOCOLS[muscle.protocol], EVERY_NOISE[NOISE], hiding(base_of(hidden), hidden)
    first = int(np.random.default_rng([muscle.seed, muscle.number]).integers(2**31))
    rig = replace(RIGS[muscle.instruments], number=first)
    for session in range(SESSIONS):
        made = protocol.recordings(truth, noise, first + 100 * session, instruments=rig)
        data = dataset(truth, made, "Hidden", noise, first, **protocol.errors)
        yield write(data, folder / f"session_{session}", say_accuracy=muscle.instruments != "exact")


def excluded(record: Record, after: int = SESSIONS) -> bool:
    """Whether the evidence was ever enough in so many sessions."""
    from fitting.evidence.settings import EVIDENCE

    return max(record["log_evidence"][:after]) >= np.log(EVIDENCE.enough)


def page(found: Sequence[Record], command: str, about: str) -> str:
    """What the records add up to, in Markdown."""
    failed, done = [r for r in found if "error" in r], [r for r in found if "log_evidence" in r]
    clean, hidden = [r for r in done if not r["hidden"]], [r for r in done if r["hidden"]]
    parts = ["# Evidence that grows from session to session", about, f"`{command}`",
             f"{len(failed)} of {len(found)} muscles ended in an error."]  # fmt: skip
    parts += [f"The first: {failed[0]['error']}"] if failed else []
    parts += [f"## Clean muscles, {SESSIONS} sessions each: share ever excluded (stated: at most 1 %), and share that "
              "a test at 1 % of each session by itself rejects at least once", _clean_table(clean)]  # fmt: skip
    parts += ["## One effect at the detection limit of one session, all errors together: how many are excluded, and "
              "how many one test of all these sessions together rejects", _power_table(hidden)]  # fmt: skip
    return "\n\n".join(part for part in parts if part) + "\n"


def _clean_table(clean: Sequence[Record]) -> str:
    kinds = [*groups(clean, lambda r: f"{r['protocol']}/{r['instruments']}"), ("all/", clean)]
    rejected = lambda r: min(r["p"]) < 0.01  # noqa: E731
    rows = [(*kind.split("/"), words(excluded, of), words(rejected, of), str(len(of))) for kind, of in kinds]
    return table(("protocol", "instruments", "excluded", "rejected by some session", "muscles"), rows)


def _power_table(hidden: Sequence[Record]) -> str:
    heads = [f"after {count}: {what}" for count in TOGETHER_AFTER for what in ("evidence", "one test")]
    rows = [_power_row(*each) for each in [*groups(hidden, lambda r: r["hidden"]), ("all", hidden)]]
    return table(("effect", *heads, f"after {SESSIONS}: evidence", "muscles"), rows)


def _power_row(name: str, of: Sequence[Record]) -> tuple[str, ...]:
    cells = []
    for count in TOGETHER_AFTER:
        cells.append(f"{sum(excluded(r, count) for r in of)}")
        cells.append(f"{sum(r['p_together'][str(count)] < 0.01 for r in of)}")
    return (name, *cells, f"{sum(map(excluded, of))}", str(len(of)))


@click.command()
@click.option("--clean", default=40, show_default=True, help="Clean muscles of each protocol, exact and erring.")
@click.option("--power", default=3, show_default=True, help="Muscles of each effect and protocol.")
@click.option("--workers", default=2, show_default=True, help="Processes.")
@click.option("--seed", default=1, show_default=True, help="Of the plan.")
@click.option("--out", default="sessions.jsonl", show_default=True, help="Records; a stopped study goes on.")
@click.option("--about", default="", help="A line for the page: date, version, machine.")
def main(clean: int, power: int, workers: int, seed: int, out: str, about: str) -> None:
    """Count right models that are ever excluded, and wrong ones that are not yet."""
    place = Path(out)
    work_through(judged, plan(clean, power, seed), place, workers, "muscles")
    found = records(place)
    command = f"python -m tests.hidden.study.sessions --clean {clean} --power {power} --seed {seed}"
    place.with_suffix(".md").write_text(page(found, command, about), encoding="utf-8")
    click.echo(f"{len(found)} muscles; {place.with_suffix('.md')}")


if __name__ == "__main__":
    main()
