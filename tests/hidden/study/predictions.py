"""Which values predict the muscle itself better: those of the curve of least error, or the likelier ones?

Effects are known and fitted to recordings in which all instruments err. The same muscle is then measured again without
any error, where it was measured and beyond, and each model is held against that. What is asked is what a designer asks:
how far off is the force of the muscle, not that of a recording.

    python -m tests.hidden.study.predictions --numbers 10
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import click
import numpy as np

from ..instruments import EXACT
from ..simulator import EVERY_NOISE, Noise, Truth, write
from .erring import NOISE, RIGS, TOGETHER
from .first_test import table
from .protocols import PROTOCOLS, Protocol, in_loops
from .sizes import base_of, hiding
from .values import HIDDEN

NO_NOISE = Noise(sd=1e-6)
AGAIN = {
    "the same loops": PROTOCOLS["rich"],
    "pressures between": in_loops(pressures=(1.5e5, 2.5e5, 3.5e5, 4.5e5), speeds=(0.01,), samples=400),
    "7 bar, where 5 were measured": in_loops(pressures=(7e5,), speeds=(0.01,), samples=400),
}


class Prediction(NamedTuple):
    """How far one model is off the muscle itself, rms, N."""

    effect: str
    where: str
    way: str
    off: float


def predictions_of(name: str, number: int) -> list[Prediction]:
    """One recording, fitted in both ways; none where a fit has no likelier values."""
    from fitting.least_squares.fit import fit
    from mckibben_jax.effect import name_of
    from mckibben_jax.effects import LIBRARY

    truth = hiding(base_of({}), {name: HIDDEN[name]})
    known = {name_of(kind): kind for kind in LIBRARY}
    effects = [known[each]() for each in (*base_of({}), name)]
    data = PROTOCOLS["rich"].data(truth, EVERY_NOISE[NOISE], 7000 + 97 * number, RIGS[TOGETHER])
    fitted = fit([_read(data)], effects)
    if fitted.through is None:
        return []
    values = {"least error": fitted.values, "likelier": fitted.through.values}
    return [
        Prediction(name, where, way, _off(protocol, truth, effects, found))
        for where, protocol in AGAIN.items()
        for way, found in values.items()
    ]


def _read(data: Any) -> Any:
    from fitting.recordings.experiment import read_experiment

    with TemporaryDirectory() as folder:
        return read_experiment(write(data, Path(folder) / "data", say_accuracy=True))


def _off(protocol: Protocol, truth: Truth, effects: list[Any], values: dict[str, float]) -> float:
    """Rms distance of a model with these values from the muscle, N."""
    from fitting.least_squares.fit import fit

    again = _read(protocol.data(truth, NO_NOISE, 1, EXACT))
    return fit([again], effects, start=values, fix=tuple(values)).rmse


def page(found: Sequence[Prediction], command: str, about: str) -> str:
    """What was found, in Markdown."""
    parts = ["# Which values predict the muscle itself better?", about, f"`{command}`"]
    for where in AGAIN:
        mine = [each for each in found if each.where == where]
        groups = {name: [each for each in mine if each.effect == name] for name in HIDDEN} | {"all": mine}
        parts += [
            f"## {where[0].upper()}{where[1:]}",
            table(HEADS, [_row(*each) for each in groups.items() if each[1]]),
        ]
    return "\n\n".join(part for part in parts if part) + "\n"


HEADS = ("effect", "curve of least error: rms off", "likelier values: rms off", "likelier are nearer", "recordings")


def _row(name: str, found: Sequence[Prediction]) -> tuple[str, ...]:
    least, likelier = (np.array([each.off for each in found if each.way == way]) for way in ("least error", "likelier"))
    in_newtons = (f"{np.sqrt(np.mean(off**2)):.3g} N" for off in (least, likelier))
    return name, *in_newtons, f"{100 * np.mean(likelier < least):.3g} %", str(len(least))


@click.command()
@click.option("--numbers", default=10, show_default=True, help="Recordings of each effect.")
@click.option("--out", default="predictions.md", show_default=True, help="The page.")
@click.option("--about", default="", help="A line for the page: date, version, machine.")
def main(numbers: int, out: str, about: str) -> None:
    """Fit known effects to recordings with erring instruments, and hold the models against the muscle itself."""
    from fitting.compiled.prepare import prepare

    prepare()
    found = [each for number in range(numbers) for name in HIDDEN for each in predictions_of(name, number)]
    command = f"python -m tests.hidden.study.predictions --numbers {numbers}"
    Path(out).write_text(page(found, command, about), encoding="utf-8")
    click.echo(f"{len(found)} predictions; {out}")


if __name__ == "__main__":
    main()
