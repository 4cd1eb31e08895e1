"""Slips of the pen that would explain why a muscle pulls so much more or less than its sizes say.

The stated sizes alone predict the pull to within a factor of two or three: rubber takes a part of it. What lies outside
is likelier a unit or a size that was written wrong. Each usual slip is put right and the ideal cylinder asked again.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from enum import Enum, auto

import jax.numpy as jnp
import numpy as np

from fitting.comparison.settings import SLIPS
from fitting.least_squares.record import Fit
from mckibben_jax.laws.braid import ideal_force

KGF, LBF, PSI = 9.80665, 4.4482216, 6894.757  # N, N, Pa


class Slip(Enum):
    """What was written in the place of something else; what happens most often stands first."""

    SWAPPED = auto()  # force and pressure
    ANGLE_FROM_HOOP = auto()  # the braid angle from the circumference
    DIAMETER = auto()  # for the radius
    KILOGRAM_FORCE = auto()  # read as N
    TENTH_OF_PRESSURE = auto()  # the true pressure is a tenth of what was read, as hPa under the head kPa
    TEN_TIMES_PRESSURE = auto()  # kPa under the head hPa
    HUNDREDTH_OF_PRESSURE = auto()
    HUNDRED_TIMES_PRESSURE = auto()  # bar under the head kPa
    HALF_RADIUS = auto()
    NEWTON_AS_KILOGRAM_FORCE = auto()  # N under the head kgf
    NEWTON_AS_POUND_FORCE = auto()
    PSI_AS_KILOPASCAL = auto()
    KILOPASCAL_AS_PSI = auto()
    PSI_AS_BAR = auto()
    BAR_AS_PSI = auto()
    POUND_FORCE = auto()
    KILONEWTON = auto()
    NEWTON_AS_KILONEWTON = auto()
    THOUSAND_TIMES_PRESSURE = auto()
    THOUSANDTH_OF_PRESSURE = auto()


SHAPED = frozenset({Slip.SWAPPED, Slip.ANGLE_FROM_HOOP})  # more than a factor between measured and stated force


@dataclass(frozen=True)
class Mended:
    """A slip, and the ratio of measured force to that of the stated sizes once it is put right."""

    slip: Slip
    ratio: float


@dataclass(frozen=True)
class _Told:
    """What a slip may be in: force (N), pressure (Pa), contraction, radius (m) and braid angle (rad) of all samples."""

    force: np.ndarray
    pressure: np.ndarray
    contraction: np.ndarray
    radius: np.ndarray
    angle: np.ndarray


def force_over_stated(fit: Fit) -> float | None:
    """Measured force over that of the ideal cylinder with every size as it was measured; None where that pulls nowhere.

    The other effects of a model are left out: those of a fit that denies a stated size belong to the sizes it found.
    Near the end of the stroke and without pressure other forces are larger: these readings do not count.
    """
    told = _told(fit)
    model = _ideal(told)
    pulls = model > SLIPS.pulls * np.max(model, initial=0.0)
    return float(told.force[pulls] @ model[pulls] / (model[pulls] @ model[pulls])) if pulls.any() else None


def likely_slips(fit: Fit) -> tuple[Mended, ...]:
    """The slips after which the muscle pulls about as much as its sizes say, what happens most often first.

    A slip that is more than a factor also has to bring the ideal cylinder nearer to the course of the force. If one
    does, factors are out of the question.
    """
    told = _told(fit)
    if not len(told.force):
        return ()
    _, before = _beside_ideal(told)
    found = list[Mended]()
    for slip, mended in _mended(told):
        ratio, left = _beside_ideal(mended)
        most = SLIPS.nearer * before if slip in SHAPED else SLIPS.left
        if SLIPS.likely[0] < ratio < SLIPS.likely[1] and left < most:
            found.append(Mended(slip, ratio))
    chosen = [each for each in found if each.slip in SHAPED] or found
    return tuple(sorted(chosen, key=lambda each: each.slip.value)[: SLIPS.most])


def _beside_ideal(told: _Told) -> tuple[float, float]:
    """Measured force over that of the ideal cylinder, and what the cylinder leaves of it, times that ratio."""
    model = _ideal(told)
    ratio = float(told.force @ model / max(float(model @ model), 1e-300))
    return ratio, float(np.linalg.norm(told.force - ratio * model) / max(float(np.linalg.norm(told.force)), 1e-300))


def _ideal(told: _Told) -> np.ndarray:
    """Force of the ideal cylinder, N."""
    return np.asarray(ideal_force(told.contraction, told.pressure, told.radius, jnp.asarray(told.angle)))


def _told(fit: Fit) -> _Told:
    """The readings of force, with the sizes of their muscles as stated."""
    means = [None if entry.prior is None else entry.prior[0] for entry in fit.layout.entries]
    stated = jnp.asarray([here if mean is None else mean for here, mean in zip(fit.vector, means, strict=True)])
    muscles = [fit.layout.model(stated, d).muscle for d in range(len(fit.layout.templates))]
    s, rows = fit.samples, fit.problem.of_force(fit.samples)
    sizes = (np.array([float(getattr(muscle, name)) for muscle in muscles]) for name in ("radius", "braid_angle"))
    radius, angle = (size[s.dataset][rows] for size in sizes)
    return _Told(s.measured[rows], s.pressure[rows], s.contraction[rows], radius, angle)


def _mended(told: _Told) -> Iterator[tuple[Slip, _Told]]:
    """What was told with each slip put right."""
    yield Slip.DIAMETER, replace(told, radius=told.radius / 2)
    yield Slip.HALF_RADIUS, replace(told, radius=told.radius * 2)
    yield Slip.ANGLE_FROM_HOOP, replace(told, angle=np.pi / 2 - told.angle)
    for slip, times in FORCES.items():
        yield slip, replace(told, force=told.force * times)
    for slip, times in PRESSURES.items():
        yield slip, replace(told, pressure=told.pressure * times)
    for unit in (1e3, 1e5, PSI):  # of the column that was taken for newtons
        yield Slip.SWAPPED, replace(told, pressure=told.force * unit, force=told.pressure / unit)


FORCES = {
    Slip.KILOGRAM_FORCE: KGF,
    Slip.POUND_FORCE: LBF,
    Slip.KILONEWTON: 1e3,
    Slip.NEWTON_AS_KILOGRAM_FORCE: 1 / KGF,
    Slip.NEWTON_AS_POUND_FORCE: 1 / LBF,
    Slip.NEWTON_AS_KILONEWTON: 1e-3,
}
PRESSURES = {
    Slip.TEN_TIMES_PRESSURE: 10.0,
    Slip.TENTH_OF_PRESSURE: 0.1,
    Slip.HUNDRED_TIMES_PRESSURE: 100.0,
    Slip.HUNDREDTH_OF_PRESSURE: 0.01,
    Slip.THOUSAND_TIMES_PRESSURE: 1e3,
    Slip.THOUSANDTH_OF_PRESSURE: 1e-3,
    Slip.PSI_AS_KILOPASCAL: PSI / 1e3,
    Slip.KILOPASCAL_AS_PSI: 1e3 / PSI,
    Slip.PSI_AS_BAR: PSI / 1e5,
    Slip.BAR_AS_PSI: 1e5 / PSI,
}
