"""What one effect leaves in the data, drawn small: force with it less force without it, in the test that shows it.

The muscle and the tests are the same for all effects, so that pictures can be compared.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from rich.console import RenderableType
from rich.text import Text

from fitting import showing
from fitting.report.pictures.figures import BLUE, INK, VERMILION, panel_axes
from fitting.report.settings import PICTURE
from mckibben_jax.effect import Effect
from mckibben_jax.effects import LIBRARY
from mckibben_jax.model import Model, model
from mckibben_jax.muscle import Muscle, quantities
from mckibben_jax.parameter import parameters
from mckibben_jax.state import State

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SIZES = {
    "length": 0.3, "radius": 7e-3, "braid_angle": np.radians(20.0), "wall_thickness": 5e-4, "shear_modulus": 0.5e6,
    "mooney_c10": 1.2e5, "mooney_c01": 1e4, "strand_width": 3e-4, "strand_modulus": 2e9, "strand_poisson": 0.35,
    "breaking_stress": 28e6, "moving_mass": 0.1,
}  # fmt: skip
MUSCLE = Muscle(**{name: jnp.asarray(value) for name, value in SIZES.items()})
WIDE, HIGH = 60, 12  # characters


@dataclass(frozen=True)
class Trace:
    """What an effect adds to the force (N) along a test, and what that is drawn over."""

    test: str
    over: str
    at: np.ndarray
    added: np.ndarray
    contracting: np.ndarray  # or inflating
    effect: Effect  # with the values of its parameters


def trace(kind: type[Effect]) -> Trace | None:
    """What an effect leaves in the test that shows it; None where it leaves nothing in any."""
    without = model(MUSCLE, *(host() for host in hosts_of(kind)))
    for effect in _instances(kind):
        found = [_added(without, effect, *test) for test in _tests()]
        sizes = [float(np.ptp(each.added)) + float(np.abs(each.added).max()) for each in found]
        if max(sizes) > PICTURE.least:
            plain = PICTURE.plain * max(sizes)
            return next(each for each, size in zip(found, sizes, strict=True) if size >= plain)
    return None


def _instances(kind: type[Effect]) -> list[Effect]:
    """The effect as declared, and at the other places where a search of its parameters begins."""
    declared = parameters(kind)
    away = {p.name: jnp.asarray(p.starts[-1]) for p in declared}
    middle = {p.name: jnp.asarray(p.lower + 0.1 * (p.upper - p.lower)) for p in declared}
    return [kind(), kind(**away), kind(**middle)]


def hosts_of(kind: type[Effect]) -> tuple[type[Effect], ...]:
    """The gas, and the first effects of the library that give what this one needs: it is tested beside them."""
    gas = next(other for other in LIBRARY if other.family == "gas")
    needed = [need for need in kind.needs if need not in quantities()]
    givers = [next(other for other in LIBRARY if need in other.gives and not other.rival) for need in needed]
    return tuple(other for other in dict.fromkeys((gas, *givers)) if other is not kind)


def _added(without: Model, effect: Effect, test: str, over: str, states: State, at: np.ndarray) -> Trace:
    force = eqx.filter_jit(lambda given, run: given.force(run))
    added = np.asarray(force(model(MUSCLE, *without.effects, effect), states) - force(without, states))
    moving = np.asarray(states.rate) if over == "contraction" else np.asarray(states.pressure_rate)
    return Trace(test, over, at, np.where(np.isfinite(added), added, 0.0), moving > 0, effect)


def _tests() -> list[tuple[str, str, State, np.ndarray]]:
    """The tests, the plainest first: how they are called, what they are drawn over, what is imposed."""
    tests = []
    for speed in (0.01, 0.3):
        time, contraction = _along(np.array([0.0, 0.26, 0.1, 0.2, 0.0]), speed / 0.3)
        name = f"a loop at 3 bar and {showing.show(speed, 'm/s')}, with a minor one"
        tests.append((name, "contraction", _states(time, contraction, np.full(PICTURE.samples, 3e5)), contraction))
    held = np.full(PICTURE.samples, 0.1)
    time, pressure = _along(np.array([0.2e5, 5e5, 0.2e5]), 1e5)
    name = "an isometric test, pressure up and down"
    tests.append((name, "pressure [bar]", _states(time, held, pressure), pressure / 1e5))
    time = np.linspace(0, 0.3, PICTURE.samples)
    pressure = np.interp(time, [0, 0.02, 0.03, 0.15, 0.16], [1e5, 1e5, 4e5, 4e5, 1e5])
    tests.append(("a jump of the pressure at a held length", "time [s]", _states(time, held, pressure), time))
    return tests


def _along(turns: np.ndarray, speed: float) -> tuple[np.ndarray, np.ndarray]:
    corners = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(turns)) / speed)])
    time = np.linspace(0.0, corners[-1], PICTURE.samples)
    return time, np.interp(time, corners, turns)


def _states(time: np.ndarray, contraction: np.ndarray, pressure: np.ndarray) -> State:
    rate, rise = np.gradient(contraction, time), np.gradient(pressure, time)
    zero = jnp.zeros(len(time))
    given = (jnp.asarray(values) for values in (contraction, pressure, rate, rise, zero, zero, time))
    return State(*given)


# Drawn ---------------------------------------------------------------------------------------------------------------


def in_characters(kind: type[Effect]) -> list[RenderableType]:
    """The picture for a terminal."""
    found = trace(kind)
    if found is None:
        return [Text("It leaves nothing in the force of a plain test.", style="dim")]
    low, high = min(0.0, float(found.added.min())), max(0.0, float(found.added.max()))
    rows = [Text(f"{line} ") for line in _labels(low, high)]
    for number, row in enumerate(rows):
        for cell, colour in _cells(found, low, high, number):
            row.append(cell, style=colour)
    ends = f"{found.at.min():.3g}".ljust(WIDE - 8) + f"{found.at.max():.3g}".rjust(8)
    about = f"Force with it less force without it, N, in {found.test}, over {found.over}"
    return [Text(about), *rows, Text(" " * 9 + ends, style="dim")]


def _labels(low: float, high: float) -> list[str]:
    """What stands left of each row: the largest, zero, and the smallest."""
    words = [" " * 8] * HIGH
    words[0], words[-1] = f"{high:8.3g}", f"{low:8.3g}"
    zero = round((HIGH - 1) * high / (high - low))
    if 0 < zero < HIGH - 1:
        words[zero] = f"{0:8d}"
    return words


def _cells(found: Trace, low: float, high: float, row: int) -> list[tuple[str, str]]:
    """The characters of one row with their colours: dots of Braille, four to their height and two to their width."""
    x = np.clip(((found.at - found.at.min()) / np.ptp(found.at) * (2 * WIDE - 1)).round().astype(int), 0, 2 * WIDE - 1)
    y = np.clip(((high - found.added) / (high - low) * (4 * HIGH - 1)).round().astype(int), 0, 4 * HIGH - 1)
    mine = y // 4 == row
    cells = []
    for column in range(WIDE):
        here = mine & (x // 2 == column)
        code = sum({DOTS[b, a] for a, b in zip(x[here] % 2, y[here] % 4, strict=True)})
        colour = "cyan" if found.contracting[here].mean() > 0.5 else "yellow" if here.any() else ""
        cells.append((chr(0x2800 + code) if code else " ", colour))
    return cells


DOTS = {(0, 0): 1, (1, 0): 2, (2, 0): 4, (0, 1): 8, (1, 1): 16, (2, 1): 32, (3, 0): 64, (3, 1): 128}


def fingerprint(kind: type[Effect]) -> "tuple[str, Figure | None]":
    """The same for a page, with the words above it; no picture of what leaves nothing."""
    found = trace(kind)
    if found is None:
        return "", None
    figure, axes = panel_axes(4.6, 2.4, found.over, "force added [N]")
    axes.axhline(0, color=INK, linewidth=0.5)
    way = ("contracting", "elongating") if found.over == "contraction" else ("inflating", "deflating")
    for which, colour, name in ((found.contracting, BLUE, way[0]), (~found.contracting, VERMILION, way[1])):
        axes.plot(found.at, np.where(which, found.added, np.nan), color=colour, linewidth=1.3, label=name)
    axes.legend(fontsize=8, frameon=False)
    return f"what it adds to the force in {found.test}", figure
