"""A fitted muscle for somebody else's simulator or controller: a module of plain numpy, or a table of its force."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from string import Template
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fitting import units
from fitting.errors import InputError, unknown_name
from fitting.exporting.numpy_source import UnknownOperation, numpy_source
from fitting.exporting.settings import EXPORT
from fitting.version import program_version
from fitting.writing import write_text, write_whole
from mckibben_jax.effect import name_of
from mckibben_jax.model import Model
from mckibben_jax.motion.stepping import Carried, begin, linearised, slow_force, step
from mckibben_jax.muscle import quantities
from mckibben_jax.parameter import parameters
from mckibben_jax.state import State

RIG = ("contraction", "pressure", "rate", "pressure_rate", "time")  # what the numpy module's state knows of the rig
BRANCHES = {"contraction": 1.0, "elongation": -1.0}


# A module of plain numpy ---------------------------------------------------------------------------------------------


def python_module(whole: Model, source: str) -> str:
    """The text of a module of plain numpy that does what this model does; `source` says where the model is from."""
    _refuse_what_looks_back(whole)
    one = jnp.zeros(())
    rig = State(one, one, memory=None)
    memories, structure = jax.tree.flatten(jax.eval_shape(lambda c, p: begin(whole, c, p).memories, one, one))
    names = memory_names(whole)
    example = {**{name: getattr(rig, name) for name in RIG}, "direction": one}
    example |= {name: jnp.zeros(leaf.shape) for name, leaf in zip(names, memories, strict=True)}

    def start(contraction: jax.Array, pressure: jax.Array) -> list[jax.Array]:
        return jax.tree.leaves(begin(whole, contraction, pressure).memories)

    def advance(*given: jax.Array) -> list[jax.Array]:
        place, rest = dict(zip(RIG, given, strict=False)), given[len(RIG) :]
        remembered = jax.tree.unflatten(structure, rest[1 : 1 + len(memories)])
        carried, force = step(whole, Carried(State(**place), rest[0], remembered), *rest[1 + len(memories) :])
        kept = [getattr(carried.rig, name) for name in RIG]
        return [*kept, carried.direction, *jax.tree.leaves(carried.memories), force]

    place = {"contraction": one, "pressure": one}
    way = place | {"direction": one, "rate": one}
    traced = [
        ("_start", start, place),
        ("_step", advance, example | {"new_pressure": one, "displacement": one, "dt": one}),
        ("_force", lambda *at: [slow_force(whole, *at)], way),
        ("_linearised", lambda *at: linearised(whole, *at), way),
    ]
    return _TEMPLATE.substitute(
        title=_title(whole, source),
        length=repr(float(whole.muscle.length)),
        memories="".join(f"\n    {name}: np.ndarray  # remembered" for name in names),
        laws="\n\n\n".join(_source_of(whole, *one) for one in traced),
    )


def _source_of(whole: Model, name: str, law: Callable, arguments: dict[str, Any]) -> str:
    try:
        return numpy_source(name, law, arguments)
    except UnknownOperation as error:
        cure = f"write a table instead (--to table), or leave one out: {', '.join(whole.names)}"
        raise InputError(f"an effect uses jax's operation '{error}', which has no form in numpy", cure=cure) from None


def memory_names(whole: Model) -> list[str]:
    """A name for each array that is remembered: that of its effect."""
    one = jnp.zeros(())
    per_effect = jax.eval_shape(lambda c, p: begin(whole, c, p).memories, one, one)
    counts = [len(jax.tree.leaves(memory)) for memory in per_effect]
    return [
        f"{name}_memory" if count == 1 else f"{name}_memory_{number}"
        for name, count in zip(whole.names, counts, strict=True)
        for number in range(count)
    ]


def _refuse_what_looks_back(whole: Model) -> None:
    """Refuse an instrument whose reading hangs on earlier ones: a single step knows only the present."""
    time, signal = jnp.arange(EXPORT.window) * 1e-3, jnp.sin(jnp.arange(EXPORT.window))
    for index in whole.at("read"):
        effect = whole.effects[index]
        if np.any(np.asarray(jax.jacfwd(effect.read)(signal, time))[-1, :-1]):
            name = name_of(effect)
            raise InputError(
                f"{name} looks back along the run, which a single step cannot", cure=f"add --without {name}"
            )


def _title(whole: Model, source: str) -> str:
    measured = {name: unit for name, (unit, _) in quantities().items() if getattr(whole.muscle, name) is not None}
    lines = [f"muscle.{name} = {units.show(float(getattr(whole.muscle, name)), u)}" for name, u in measured.items()]
    for effect in whole.effects:
        own = [f"{p.name} = {units.show(float(getattr(effect, p.name)), p.unit)}" for p in parameters(effect)]
        lines.append(f"{name_of(effect)}: {', '.join(own) or 'no parameters'} ({effect.source})")
    text = "\n".join(["", *(f"    {line}" for line in lines), ""])
    written = f"Written by mckibben {program_version()} from {source}"
    return f"{written}. All values are SI: Pa (gauge), m, N, s, rad.\n{text}".replace("\\", "/").replace('"""', "'''")


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

    Friction keeps its direction while the braid stands. `state` is from `start` or from the step before; None for a
    muscle that stood where it is now.
    """
    if not dt > 0:
        raise ValueError(f"dt is {dt}: a step takes time, in seconds")
    state = start(pressure, displacement) if state is None else state
    with np.errstate(all="ignore"):
        *after, pull = _step(*state, np.float64(pressure), np.float64(displacement), np.float64(dt))
    return State(*after), pull


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


# A table -------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Grid:
    """Where a table says the force: contractions, pressures (Pa)."""

    contractions: np.ndarray
    pressures: np.ndarray


def free_contraction(whole: Model, pressure: float) -> float:
    """Contraction at which the force of a muscle at rest vanishes at this pressure; at most one half."""
    contraction = np.linspace(0.0, 0.5, 501)
    force = forces(whole, contraction, np.full_like(contraction, pressure), np.zeros_like(contraction))
    slack = np.flatnonzero(~(force > 0))
    return float(contraction[slack[0]]) if len(slack) else 0.5


def forces(whole: Model, contraction: np.ndarray, pressure: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """Force of slow motion at many places, N."""
    given = (jnp.asarray(a, float) for a in (contraction, pressure, direction, np.zeros_like(contraction)))
    return np.asarray(_forces(whole, *given))


@eqx.filter_jit
def _forces(whole: Model, *at: jax.Array) -> jax.Array:
    return jax.vmap(lambda *one: slow_force(whole, *one))(*at)


def table(whole: Model, grid: Grid) -> dict[str, np.ndarray]:
    """Force over contraction and pressure on both branches; column heads as in a recording of points."""
    axes = np.meshgrid(grid.pressures, list(BRANCHES), grid.contractions, indexing="ij")
    pressure, branch, contraction = (axis.ravel() for axis in axes)
    direction = np.array([BRANCHES[str(name)] for name in branch])
    found = forces(whole, contraction, pressure, direction)
    return {"pressure [kPa]": pressure / 1e3, "contraction [1]": contraction, "branch": branch, "force [N]": found}


def write_table(path: Path, columns: dict[str, np.ndarray], source: str) -> None:
    """Write a table as CSV or, by the file's ending, as Parquet."""
    import pandas as pd

    frame = pd.DataFrame(columns)
    if path.suffix == ".parquet":
        _write_parquet(frame, path)
        return
    head = f"# Force of slow motion on both branches. Written by mckibben {program_version()} from {source}\n"
    write_text(path, head + frame.to_csv(index=False, float_format="%.10g", lineterminator="\n"))


def _write_parquet(frame: Any, path: Path) -> None:
    try:
        write_whole(path, lambda new: frame.to_parquet(new, index=False))
    except ImportError:
        cure = "pip install pyarrow, or name a file that ends in .csv"
        raise InputError("Parquet needs pyarrow", path, cure=cure) from None


def without(whole: Model, names: Sequence[str]) -> Model:
    """A model without these effects."""
    for name in names:
        if name not in whole.names:
            raise unknown_name("effect in --without:", name, whole.names)
    return whole.drop(*names)
