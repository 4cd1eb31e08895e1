"""A fitted muscle as a module of plain numpy."""

from string import Template

from fitting.exporting.laws import NOTHING, Told, laws, memory_names, title
from fitting.exporting.numpy_source import constant, numpy_source
from fitting.exporting.python_family import family_in_python
from mckibben_jax.model import Model


def python_module(whole: Model, source: str, told: Told = NOTHING) -> str:
    """The text of a module of plain numpy that does what this model does; `source` says where the model is from."""
    names, prefix = ((), "") if told.draws is None else (told.draws.names, "_drawn")
    written = [
        law.source(whole, "numpy", lambda name, *rest: numpy_source(f"{prefix}{name}", *rest))
        for law in laws(whole, names)
    ]
    return _TEMPLATE.substitute(
        title=title(whole, source, told),
        length=repr(float(whole.muscle.length)),
        error=constant(told.error.newtons),
        family="" if told.draws is None else family_in_python(whole, told.draws),
        memories="".join(f"\n    {name}: np.ndarray  # remembered" for name in memory_names(whole)),
        laws="\n\n\n".join(written),
    )


_TEMPLATE = Template('''"""A McKibben muscle in plain numpy: step, force, stiffness, linearise, pressure_for.

$title
`contraction` is (l0 - l)/l0 and `displacement` l0 - l, both positive when shorter; `force` is positive when pulling.
`direction` is the way of the braid: 1 contracting, -1 elongating, 0 at rest without friction. `force`, `stiffness`,
`linearise` and `pressure_for` are of a muscle that has long been on its way slowly, arrays element by element; `step`
follows any motion and remembers it. Below the public functions stands the arithmetic, as it was traced.
"""

from typing import NamedTuple

import numpy as np

LENGTH = $length  # m, at rest
HIGHEST_PRESSURE = 1e6  # Pa: pressure_for looks from 0 to here
FORCE_ERROR = $error  # N, the largest force error to expect: what it is and how it was found stands above
$family

class State(NamedTuple):
    """What one step leaves to the next. `direction` is that of friction, kept while the muscle stands."""

    contraction: float
    pressure: float  # Pa
    rate: float  # 1/s
    pressure_rate: float  # Pa/s
    time: float  # s
    direction: float$memories


class Linear(NamedTuple):
    """Near a state: force - stiffness dx + gain dP - damping dv, x and v the displacement and its speed."""

    force: np.ndarray  # N
    stiffness: np.ndarray  # N/m
    gain: np.ndarray  # N/Pa
    damping: np.ndarray  # N s/m


def start(pressure=0.0, displacement=0.0):
    """The state of a muscle that has stood at this pressure (Pa) and displacement (m) for long."""
    contraction, pressure = np.float64(displacement) / LENGTH, np.float64(pressure)
    zero = np.float64(0.0)
    with np.errstate(all="ignore"):
        return State(contraction, pressure, zero, zero, zero, zero, *_start(contraction, pressure))


def step(state, pressure, displacement, dt):
    """The state and the force (N) after `dt` seconds in which pressure (Pa) and displacement (m) went straight here.

    Friction keeps its direction while the braid stands, and turns round with any motion: a displacement that jitters,
    as a sensor's does, makes the force jump by twice the friction. Give a smooth one. `state` is from `start` or from
    the step before; None for a muscle that stood where it is now.
    """
    if not dt > 0:
        raise ValueError(f"dt is {dt}: a step takes time, in seconds")
    state = start(pressure, displacement) if state is None else state
    with np.errstate(all="ignore"):
        *after, pull = _step(*state, np.float64(pressure), np.float64(displacement), np.float64(dt))
    return State(*after), pull


def step_parts(state, pressure, displacement, dt):
    """As `step`, with the force in two: the state, the pull without dry friction, how much that can resist, both N.

    The force is pull - direction * friction; a simulator that knows sticking takes the second as a budget.
    """
    if not dt > 0:
        raise ValueError(f"dt is {dt}: a step takes time, in seconds")
    state = start(pressure, displacement) if state is None else state
    with np.errstate(all="ignore"):
        *after, pull, friction = _parts(*state, np.float64(pressure), np.float64(displacement), np.float64(dt))
    return State(*after), pull, friction


def force(contraction, pressure, direction=0.0, rate=0.0):
    """Force, N, of slow motion in a direction; `rate` (1/s, positive when contracting) adds what depends on speed."""
    return _each(_force, contraction, pressure, direction, rate)[0]


def linearise(contraction, pressure, direction=0.0, rate=0.0):
    """Force and its slopes near a state, as a `Linear`."""
    value, per_metre, gain, per_speed = _each(_linearised, contraction, pressure, direction, rate)
    return Linear(value, -per_metre, gain, -per_speed)


def stiffness(contraction, pressure, direction=0.0):
    """How much more it pulls per metre that it is longer, N/m, at constant pressure."""
    return linearise(contraction, pressure, direction).stiffness


def pressure_for(force, contraction, direction=0.0):
    """The pressure, Pa, at which the muscle pulls with this force (N); NaN where none up to HIGHEST_PRESSURE does."""
    return _each(_pressure_for, force, contraction, direction)[0]


def pressure_for_step(state, force, displacement, dt):
    """The pressure, Pa, with which the next step, `dt` seconds long and to this displacement, ends with this force (N).

    What the muscle remembers and the direction of its friction are taken into account. NaN where no pressure up to
    HIGHEST_PRESSURE does it.
    """
    off = lambda pressure: step(state, pressure, displacement, dt)[1] - force
    low, high = np.float64(0.0), np.float64(HIGHEST_PRESSURE)
    below, above = off(low), off(high)
    if not below <= 0 <= above:
        return np.nan
    for turn in range(200):
        if high - low <= 1e-13 * HIGHEST_PRESSURE:
            break
        halve = turn % 3 == 2 or not above > below
        found = (low + high) / 2 if halve else low - below * (high - low) / (above - below)
        here = off(found)
        if here == 0:
            return found
        if here < 0:
            low, below = found, here
        else:
            high, above = found, here
    return (low + high) / 2


def _pressure_for(wanted, contraction, direction):
    """Newton's method, halving what is left of the range where it would leave it."""
    low, high, zero = np.float64(0.0), np.float64(HIGHEST_PRESSURE), np.float64(0.0)
    ends = [_force(contraction, end, direction, zero)[0] for end in (low, high)]
    if not ends[0] <= wanted <= ends[1]:
        return (np.nan,)
    found = low + (high - low) * (wanted - ends[0]) / (ends[1] - ends[0] or 1.0)
    for _ in range(200):
        value, _, gain, _ = _linearised(contraction, found, direction, zero)
        low, high = (found, high) if value < wanted else (low, found)
        closer = found + (wanted - value) / gain
        closer = closer if low <= closer <= high else (low + high) / 2
        if abs(closer - found) <= 1e-13 * HIGHEST_PRESSURE:
            break
        found = closer
    return (closer,)


def _each(law, *arguments):
    """A law of numbers, applied to arrays element by element."""
    arrays = np.broadcast_arrays(*(np.asarray(argument, np.float64) for argument in arguments))
    with np.errstate(all="ignore"):
        rows = [law(*numbers) for numbers in zip(*(array.ravel() for array in arrays))]
    return [np.reshape(column, arrays[0].shape)[()] for column in np.array(rows, np.float64).reshape(len(rows), -1).T]


$laws
''')
