"""The whole path of `discover`, under all errors of instruments: is anything added to a model that lacks nothing?

A path goes from model to model, each tested on the same recording. A step is spurious where it adds to a model that
already has all that was hidden. The test of that model, at 1 %, has to reject first, or instruments have to err by far
more than their accuracy: these are counted apart. Recordings hide no effect, one or two.

    python -m tests.hidden.study.paths --numbers 5
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from itertools import combinations
from pathlib import Path
from tempfile import TemporaryDirectory

import click

from ..simulator import EVERY_NOISE, write
from .erring import NOISE, RIGS, TOGETHER
from .first_test import table
from .protocols import PROTOCOLS
from .sizes import base_of, hiding
from .values import HIDDEN

LEVEL = 0.01  # of the test
ALIKE = {"force_offset": "weight"}  # either is one force in every reading
TWO = tuple(combinations(("bladder_neo_hookean", "end_stop", "pressure_drop", "textile_friction", "weight"), 2))


@dataclass(frozen=True)
class Course:
    """One path: what was hidden, what each step added and dropped, its error in N, and the verdict in the end."""

    hidden: tuple[str, ...]
    number: int
    added: tuple[tuple[str, ...], ...]
    rmse: tuple[float, ...]
    p_values: tuple[float, ...]  # of every model on the path
    verdict: str
    dropped: tuple[tuple[str, ...], ...]

    @property
    def last(self) -> set[str]:
        """What the last model has beside what it began with."""
        here = set[str]()
        for names, dropped in zip(self.added, self.dropped, strict=True):
            here = here - set(dropped) | set(names)
        return here

    @property
    def spurious(self) -> tuple[str, ...]:
        """What was added to a model that had all that was hidden."""
        return tuple(name for names, _ in self._beyond() for name in names)

    @property
    def stated(self) -> bool:
        """Whether that model was rejected by the test, whose level is stated for the path."""
        return any(p < LEVEL for _, p in self._beyond())

    def _beyond(self) -> list[tuple[tuple[str, ...], float]]:
        """Every addition to a complete model, and the p-value of that model; an exchange adds nothing."""
        here, found = set[str](), []
        for names, dropped, p in zip(self.added, self.dropped, self.p_values, strict=False):
            if len(names) > len(here & set(dropped)) and set(self.hidden) <= here:
                found.append((names, p))
            here = here - set(dropped) | set(names)
        return found

    @property
    def holds(self) -> bool:
        """Whether the last model has all that was hidden."""
        return set(self.hidden) <= self.last

    @property
    def exact(self) -> bool:
        """Whether it has that and nothing else."""
        return set(self.hidden) == self.last

    @property
    def exact_but_for_likes(self) -> bool:
        """Whether it has that, or what no data can tell from it, and nothing else."""
        alike = lambda names: {ALIKE.get(name, name) for name in names}  # noqa: E731
        return alike(self.hidden) == alike(self.last)


def path_of(hidden: Sequence[str], number: int, protocol: str = "rich") -> Course:
    """Discover what was hidden in one recording."""
    from fitting.diagnosis.discover import discover
    from fitting.recordings.experiment import read_experiment
    from mckibben_jax.effect import name_of
    from mckibben_jax.effects import LIBRARY

    truth = hiding(base_of({}), {name: HIDDEN[name] for name in hidden})
    data = PROTOCOLS[protocol].data(truth, EVERY_NOISE[NOISE], 9000 + 89 * number, RIGS[TOGETHER])
    with TemporaryDirectory() as folder:
        experiment = read_experiment(write(data, Path(folder) / "data", say_accuracy=True))
    known = {name_of(kind): kind for kind in LIBRARY}
    steps = discover([experiment], [known[each]() for each in base_of({})])
    return Course(
        tuple(hidden), number, tuple(step.added for step in steps[1:]), tuple(step.rmse for step in steps),
        tuple(step.diagnosis.p_value for step in steps), str(steps[-1].verdict),
        tuple(step.dropped for step in steps[1:]),
    )  # fmt: skip


def page(paths: Sequence[Course], command: str, about: str) -> str:
    """What the paths add up to, in Markdown."""
    groups = [(f"{count} hidden", [p for p in paths if len(p.hidden) == count]) for count in (0, 1, 2)]
    rows = [_row(name, of) for name, of in [*groups, ("all", list(paths))] if of]
    extra = [f"- {' + '.join(p.hidden) or 'nothing'}, recording {p.number}: {' + '.join(p.spurious)} added, "
             f"{p.rmse[-2]:.3g} N before, {p.rmse[-1]:.3g} N after" for p in paths if p.spurious]  # fmt: skip
    parts = ["# Paths of `discover` under all errors of instruments: is anything added that is not there?", about,
             f"`{command}`", table(HEADS, rows), "## Spurious steps", "\n".join(extra) or "None."]  # fmt: skip
    return "\n\n".join(part for part in parts if part) + "\n"


HEADS = (
    "recordings",
    "paths",
    "added to a complete model that the test rejects",
    "added to a complete model, for instruments err far beyond their accuracy",
    "last model has all",
    "and nothing else",
    "the same, a zero of the load cell for a dead weight allowed",
)


def _row(name: str, of: Sequence[Course]) -> tuple[str, ...]:
    strained = sum(bool(p.spurious) and not p.stated for p in of)
    counts = (
        sum(p.stated for p in of), strained, sum(p.holds for p in of), sum(p.exact for p in of),
        sum(p.exact_but_for_likes for p in of),
    )  # fmt: skip
    return name, str(len(of)), *map(str, counts)


@click.command()
@click.option("--numbers", default=5, show_default=True, help="Recordings of each hidden effect or pair.")
@click.option("--clean", default=20, show_default=True, help="Recordings that hide nothing.")
@click.option("--out", default="paths.md", show_default=True, help="The page; the paths beside it as JSON lines.")
@click.option("--about", default="", help="A line for the page: date, version, machine.")
def main(numbers: int, clean: int, out: str, about: str) -> None:
    """Follow paths of discover in recordings with erring instruments."""
    from fitting.compiled.prepare import prepare

    prepare()
    wanted = [((), number) for number in range(clean)]
    wanted += [((name,), number) for number in range(numbers) for name in HIDDEN]
    wanted += [(pair, number) for number in range(-(-numbers // 2)) for pair in TWO]
    lines, place = list[Course](), Path(out)
    with place.with_suffix(".jsonl").open("w", encoding="utf-8") as kept:
        for hidden, number in wanted:
            lines.append(path_of(hidden, number))
            kept.write(json.dumps(asdict(lines[-1])) + "\n")
            kept.flush()
            command = f"python -m tests.hidden.study.paths --numbers {numbers} --clean {clean}"
            place.write_text(page(lines, command, about), encoding="utf-8")
    click.echo(f"{len(lines)} paths; {out}")


if __name__ == "__main__":
    main()
