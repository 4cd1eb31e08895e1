"""Values of an effect that was added, under all errors of instruments: do their intervals hold the truth?

The effect is known; what is asked is its value and the standard error beside it. Once as a diagnosis fits it, through
instruments that err; once as `fit` and `add` do: the curve of least error, whose standard errors know the instruments;
once as they do through instruments, which are the values after LIKELIER; and once by a quick posterior around that fit,
in which instruments err as far as their accuracy goes.

    python -m tests.hidden.study.values --numbers 20
    python -m tests.hidden.study.values --numbers 20 --way fit --way likelier
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import click
import numpy as np

from ..simulator import EVERY_NOISE, write
from .erring import NOISE, RIGS, TOGETHER
from .first_test import table
from .protocols import PROTOCOLS
from .sizes import base_of, hiding

HIDDEN: dict[str, dict[str, float]] = {
    "bladder_neo_hookean": {"G": 6e4},
    "end_stop": {"K": 270.0, "eps_s": 0.2},
    "linear_spring": {"K": 60.0},
    "pressure_drop": {"tau": 0.006},
    "textile_friction": {"f_s": 0.014, "beta": 0.8},
    "time_delay": {"tau": 0.05},
    "viscous_damping": {"B": 120.0},
    "weight": {"m": 1.0},
}
DIAGNOSED, FITTED, SAMPLED = "by a diagnosis, through the instruments", "by `fit` and `add`", "by `posterior --quick`"
LIKELIER = "by `fit` and `add`, the likelier values"
WAYS = {"diagnosis": DIAGNOSED, "fit": FITTED, "likelier": LIKELIER, "posterior": SAMPLED}
HOW = tuple(WAYS.values())


class Value(NamedTuple):
    """One fitted parameter."""

    how: str
    name: str
    off: float  # from the truth, in standard errors
    error: float  # standard error over the truth
    missed: float  # distance from the truth over the truth


def values_of(name: str, number: int, protocol: str = "rich", ways: Sequence[str] = HOW) -> list[Value]:
    """The parameters of one effect in one recording, in each of these ways; none where an error is not known."""
    from fitting.recordings.experiment import read_experiment
    from mckibben_jax.effect import name_of
    from mckibben_jax.effects import LIBRARY

    truth = hiding(base_of({}), {name: HIDDEN[name]})
    data = PROTOCOLS[protocol].data(truth, EVERY_NOISE[NOISE], 7000 + 97 * number, RIGS[TOGETHER])
    with TemporaryDirectory() as folder:
        experiment = read_experiment(write(data, Path(folder) / "data", say_accuracy=True))
    known = {name_of(kind): kind for kind in LIBRARY}
    base, effect = [known[each]() for each in base_of({})], known[name]()
    found = list[Value]()
    for how, estimates in _estimates(experiment, base, effect, name, ways).items():
        for key, (value, error) in estimates.items():
            if np.isfinite(error):
                true = HIDDEN[name][key]
                missed = value - true
                found.append(Value(how, f"{name}.{key}", missed / error, error / true, missed / true))
    return found


def _estimates(
    experiment: Any, base: list[Any], effect: Any, name: str, ways: Sequence[str]
) -> dict[str, dict[str, tuple[float, float]]]:
    """Values and errors of an effect's parameters (SI) by each of these ways."""
    from fitting.diagnosis.diagnose import one_thread, prepared
    from fitting.diagnosis.estimates import estimate
    from fitting.least_squares.fit import fit
    from fitting.posterior.quick import quick_look
    from mckibben_jax.model import with_effects

    found = {}
    if DIAGNOSED in ways:
        search = prepared([experiment], base, [effect])
        with one_thread():
            search.fit_singles()
            told = estimate(search.examiner.seen, search.fits[frozenset([name])], name)
        found[DIAGNOSED] = {key: (one.value, one.error) for key, one in told.items()}
    fitted = fit([experiment], with_effects(base, [effect]))
    own = [entry for entry in fitted.free if entry.startswith(f"{name}.")]
    if FITTED in ways:
        found[FITTED] = {entry.split(".")[1]: (fitted.values[entry], fitted.error(entry)) for entry in own}
    if LIKELIER in ways and fitted.through is not None:
        found[LIKELIER] = {e.split(".")[1]: (fitted.through.values[e], fitted.through.error(e)) for e in own}
    if SAMPLED in ways:
        drawn = quick_look(fitted, [experiment]).parameters
        found[SAMPLED] = {entry.split(".")[1]: (drawn[entry].median, drawn[entry].sd) for entry in own}
    return found


def coverage(values: Sequence[Value], width: float) -> float:
    """The share of intervals of so many standard errors that hold the truth."""
    return float(np.mean([abs(value.off) < width for value in values]))


def page(values: Sequence[Value], command: str, about: str) -> str:
    """What the values add up to, in Markdown."""
    parts = ["# Values of an effect under all errors of instruments: do their intervals hold the truth?", about,
             f"`{command}`"]  # fmt: skip
    for how in HOW:
        mine = [value for value in values if value.how == how]
        if not mine:
            continue
        names = dict.fromkeys(value.name for value in mine)
        groups = [*((name, [v for v in mine if v.name == name]) for name in names), ("all", mine)]
        parts += [f"## Fitted {how}", table(HEADS, [_row(name, of) for name, of in groups])]
    return "\n\n".join(part for part in parts if part) + "\n"


HEADS = (
    "parameter",
    "68 % intervals hold",
    "90 % intervals hold",
    "median error",
    "rms distance from the truth",
    "values",
)


def _row(name: str, of: Sequence[Value]) -> tuple[str, ...]:
    percent: Any = lambda share: f"{100 * share:.3g} %"  # noqa: E731
    error, missed = np.median([v.error for v in of]), np.sqrt(np.mean([v.missed**2 for v in of]))
    return name, percent(coverage(of, 1.0)), percent(coverage(of, 1.645)), percent(error), percent(missed), str(len(of))


@click.command()
@click.option("--numbers", default=20, show_default=True, help="Recordings of each effect.")
@click.option("--way", "ways", type=click.Choice(list(WAYS)), multiple=True, default=list(WAYS), help="All, if none.")
@click.option("--out", default="values.md", show_default=True, help="The page.")
@click.option("--about", default="", help="A line for the page: date, version, machine.")
def main(numbers: int, ways: Sequence[str], out: str, about: str) -> None:
    """Fit known effects to recordings with erring instruments, and hold the values against the truth."""
    from fitting.compiled.prepare import prepare

    prepare()
    asked = [WAYS[way] for way in ways]
    found = [value for number in range(numbers) for name in HIDDEN for value in values_of(name, number, ways=asked)]
    chosen = "" if len(ways) == len(WAYS) else "".join(f" --way {way}" for way in ways)
    command = f"python -m tests.hidden.study.values --numbers {numbers}{chosen}"
    Path(out).write_text(page(found, command, about), encoding="utf-8")
    click.echo(f"{len(found)} values; {out}")


if __name__ == "__main__":
    main()
