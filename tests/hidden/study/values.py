"""Values of an effect that was added, under all errors of instruments: do their intervals hold the truth?

The effect is known; what is asked is its value and the standard error beside it. Once as a diagnosis fits it, through
instruments that err; once as `fit` and `add` do: the curve of least error, whose standard errors know the instruments;
and once by a quick posterior around that fit, in which instruments err as far as their accuracy goes.

    python -m tests.hidden.study.values --numbers 20
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
HOW = ("by a diagnosis, through the instruments", "by `fit` and `add`", "by `posterior --quick`")


class Value(NamedTuple):
    """One fitted parameter."""

    how: str
    name: str
    off: float  # from the truth, in standard errors
    error: float  # standard error over the truth
    missed: float  # distance from the truth over the truth


def values_of(name: str, number: int, protocol: str = "rich") -> list[Value]:
    """The parameters of one effect in one recording, fitted either way; none where an error is not known."""
    from fitting.diagnosis.diagnose import one_thread, prepared
    from fitting.diagnosis.estimates import estimate
    from fitting.least_squares.fit import fit
    from fitting.posterior.quick import quick_look
    from fitting.recordings.experiment import read_experiment
    from mckibben_jax.effect import name_of
    from mckibben_jax.effects import LIBRARY
    from mckibben_jax.model import with_effects

    truth = hiding(base_of({}), {name: HIDDEN[name]})
    data = PROTOCOLS[protocol].data(truth, EVERY_NOISE[NOISE], 7000 + 97 * number, RIGS[TOGETHER])
    with TemporaryDirectory() as folder:
        experiment = read_experiment(write(data, Path(folder) / "data", say_accuracy=True))
    known = {name_of(kind): kind for kind in LIBRARY}
    base = [known[each]() for each in base_of({})]
    search = prepared([experiment], base, [known[name]()])
    with one_thread():
        search.fit_singles()
        diagnosed = estimate(search.examiner.seen, search.fits[frozenset([name])], name)
    fitted = fit([experiment], with_effects(base, [known[name]()]))
    known_of = {entry.split(".")[1]: fitted.estimate(entry) for entry in fitted.free if entry.startswith(f"{name}.")}
    sampled = quick_look(fitted, [experiment]).parameters
    drawn = {entry.split(".")[1]: (sampled[entry].median, sampled[entry].sd, "") for entry in sampled if name in entry}
    found = list[Value]()
    for how, estimates in zip(HOW, (diagnosed, known_of, drawn), strict=True):
        for key, (value, error, _) in estimates.items():
            if np.isfinite(error):
                true = HIDDEN[name][key]
                missed = value - true
                found.append(Value(how, f"{name}.{key}", missed / error, error / true, missed / true))
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
@click.option("--out", default="values.md", show_default=True, help="The page.")
@click.option("--about", default="", help="A line for the page: date, version, machine.")
def main(numbers: int, out: str, about: str) -> None:
    """Fit known effects to recordings with erring instruments, and hold the values against the truth."""
    from fitting.compiled.prepare import prepare

    prepare()
    found = [value for number in range(numbers) for name in HIDDEN for value in values_of(name, number)]
    Path(out).write_text(
        page(found, f"python -m tests.hidden.study.values --numbers {numbers}", about), encoding="utf-8"
    )
    click.echo(f"{len(found)} values; {out}")


if __name__ == "__main__":
    main()
