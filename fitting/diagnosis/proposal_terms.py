"""The terms that a proposal is made of: dimensionless groups of what a `--define` line may name, times an amplitude.

A term is the text of its formula and of its values, and its column is computed from that very text: what is proposed
can be pasted.
"""

import functools
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product

import numpy as np

from fitting import showing
from fitting.library.expression import Expression, read_expression

STATES = Mapping[str, np.ndarray]  # every name that a formula knows, at every sample, SI
CENTRES, WIDTHS = 10, (0.05, 0.1, 0.2)  # of bumps, as shares of the range of contraction
CYCLES = np.arange(1.0, 12.1, 0.25)  # of ripples, along the stroke
STEPS = np.arange(1.0, 4.1, 0.25)  # of ripples in pressure: periods in double distances of its levels, no finer


@dataclass(frozen=True)
class Shape:
    """A hidden shape: its value in its readers' unit, its range in the same, and the size of that unit in SI."""

    value: float
    lower: float
    upper: float
    unit: str = ""
    size: float = 1.0


@dataclass(frozen=True)
class Term:
    """A formula in which each value stands in braces, `{A}` first, with its hidden shapes and fixed constants."""

    formula: str
    shapes: dict[str, Shape] = field(default_factory=dict)
    constants: dict[str, Shape] = field(default_factory=dict)
    amplitude: str = "N"

    def column(self, states: STATES) -> np.ndarray:
        """The term with amplitude 1, at every sample, N."""
        values = {**self.shapes, **self.constants}
        law = _law(self.formula.format(A=1.0, **{name: name for name in values}), (*states, *values))
        given = {name: np.asarray(value.value * value.size) for name, value in values.items()}
        count = len(next(iter(states.values())))
        return np.broadcast_to(np.asarray(law.value({**states, **given}, np), float), (count,))

    def shaped(self, values: Iterable[float]) -> "Term":
        """This term with other values of its hidden shapes, in their own units."""
        pairs = zip(self.shapes.items(), values, strict=True)
        return replace(self, shapes={name: replace(shape, value=float(value)) for (name, shape), value in pairs})

    def times(self, formula: str, shapes: dict[str, Shape] | None = None, **constants: Shape) -> "Term":
        """This term with one more factor."""
        both = {**self.constants, **constants}
        return Term(f"{self.formula}*{formula}", {**self.shapes, **(shapes or {})}, both, self.amplitude)


@functools.lru_cache(maxsize=2000)
def _law(formula: str, names: tuple[str, ...]) -> Expression:
    return read_expression(formula, names)


def line_of(name: str, terms: Sequence[Term], amplitudes: Sequence[float]) -> str:
    """The definition that adds up these terms with these amplitudes."""
    parts, values, constants = [], [], {}
    for number, (term, amplitude) in enumerate(zip(terms, amplitudes, strict=True), 1):
        suffix = str(number) if len(terms) > 1 else ""
        own = {key: f"{key}{suffix}" for key in ("A", *term.shapes)}
        parts.append(term.formula.format(**own, **{key: key for key in term.constants}))
        values.append(f"{own['A']} = {_amplitude(amplitude, term.amplitude)}")
        values += [
            f"{own[key]} = {_text(shape)} ({shape.lower:.3g}..{shape.upper:.3g})" for key, shape in term.shapes.items()
        ]
        constants |= {key: f"{key} = {_text(shape)}" for key, shape in term.constants.items()}
    return f"{name} = {' + '.join(parts)}, {', '.join([*values, *constants.values()])}"


def _amplitude(value: float, si: str) -> str:
    """An amplitude and its range, in the unit that its readers measure in."""
    unit, size = showing.shown_in(si, abs(value)) if si else ("", 1.0)
    reach = _rounded(5 * abs(value) / size)
    return f"{value / size:.3g} {unit} ({-reach:g}..{reach:g})".replace("  ", " ")


def _text(shape: Shape) -> str:
    return f"{shape.value:.4g} {shape.unit}".strip()


def _constant(value: float, si: str) -> Shape:
    """A number that only says of which size things are."""
    unit, size = showing.shown_in(si, abs(value))
    return Shape(_rounded(value / size), 0, 0, unit, size)


def _around(value: float, lower: float, upper: float, si: str) -> Shape:
    """A shape to be found, given in SI."""
    unit, size = showing.shown_in(si, abs(value))
    return Shape(value / size, lower / size, upper / size, unit, size)


def _rounded(value: float) -> float:
    return float(f"{value:.1g}")


def terms(states: STATES) -> list[Term]:
    """All terms that make sense for these samples."""
    carriers = [Term("{A}")]
    if np.any(states["v"] > 0) and np.any(states["v"] < 0):
        carriers.append(Term("{A}*sign(v)"))
    pressures = list(_pressures(states))
    found = []
    for carrier, pressure, strain in product(carriers, pressures, _strains(states)):
        found.append(_joined(carrier, pressure, strain))
    simple = [Term(""), Term("eps/{e1}", {}, {"e1": _largest(states)})]
    for carrier, strain, ripple in product(carriers, simple, _stairs(states)):
        found.append(_joined(carrier, ripple, strain))
    for speed, pressure, strain in product(_speeds(states), pressures[:2], simple):
        found.append(_joined(speed, pressure, strain))
    for carrier, time in product([*carriers, Term("{A}*F0", amplitude="")], _times(states)):
        found.append(_joined(carrier, time))
    return found


def _joined(first: Term, *factors: Term) -> Term:
    for factor in factors:
        if factor.formula:
            first = first.times(factor.formula, factor.shapes, **factor.constants)
    return first


def _pressures(states: STATES) -> Iterator[Term]:
    yield Term("")
    if np.ptp(states["P"]) > 0.05 * np.max(states["P"]):
        middle = _constant(float(np.median(states["P"])), "Pa")
        yield Term("P/{P1}", {}, {"P1": middle})
        yield Term("(P/{P1})**2", {}, {"P1": middle})


def _strains(states: STATES) -> Iterator[Term]:
    eps = states["eps"]
    low, span = float(np.min(eps)), float(np.ptp(eps))
    yield Term("")
    if span < 1e-3:
        return
    for power in ("eps/{e1}", "(eps/{e1})**2", "(eps/{e1})**3"):
        yield Term(power, {}, {"e1": _largest(states)})
    for share, centre in product(WIDTHS, np.linspace(0.05, 0.95, CENTRES)):
        width, middle = 100 * share * span, 100 * (low + centre * span)
        shapes = {
            "c": Shape(middle, 100 * (low - 0.1 * span), 100 * (low + 1.1 * span), "%", 0.01),
            "w": Shape(width, width / 3, 3 * width, "%", 0.01),
        }
        yield Term("exp(-((eps - {c})/{w})**2)", shapes)
    stroke = float(np.ptp(states["x"]))
    for cycles, wave in product(CYCLES, ("sin", "cos")):
        pitch = stroke / cycles
        yield Term(f"{wave}(2*pi*x/{{p}})", {"p": _around(pitch, pitch / 1.5, 1.5 * pitch, "m")})


def _stairs(states: STATES) -> Iterator[Term]:
    """Waves in pressure, no finer than its levels are apart."""
    levels = np.unique(np.round(states["P"], -4))
    if len(levels) < 4:
        return
    apart = float(np.median(np.diff(levels)) if len(levels) < 12 else np.ptp(levels) / 8)
    for step, wave in product(STEPS, ("sin", "cos")):
        period = 2 * apart * step
        lowest = max(period / 1.5, 1.8 * apart)
        yield Term(f"{wave}(2*pi*P/{{q}})", {"q": _around(period, lowest, 1.5 * period, "Pa")})


def _speeds(states: STATES) -> Iterator[Term]:
    fast = np.abs(states["v"][states["v"] != 0])
    if not len(fast):
        return
    slowest, fastest = (float(np.quantile(fast, q)) for q in (0.05, 0.95))
    yield Term("{A}*v/{v1}", {}, {"v1": _constant(fastest, "m/s")})
    for middle in np.unique(np.round(np.geomspace(slowest, fastest, 4), 6)):
        own = {"u": _around(float(middle), float(middle) / 5, 5 * float(middle), "m/s")}
        yield Term("{A}*v/{u}/(1 + (v/{u})**2)", own)
        yield Term("{A}*sign(v)*exp(-abs(v)/{u})", own)


def _times(states: STATES) -> Iterator[Term]:
    longest = float(np.max(states["t"]))
    if longest <= 0:
        return
    yield Term("t/{t1}", {}, {"t1": Shape(_rounded(longest), 0, 0, "s")})
    for share in (0.05, 0.2, 0.5):
        tau = share * longest
        yield Term("exp(-t/{tau})", {"tau": Shape(tau, tau / 5, 5 * tau, "s")})


def _largest(states: STATES) -> Shape:
    return Shape(_rounded(100 * float(np.max(np.abs(states["eps"])))) or 1.0, 0, 0, "%", 0.01)
