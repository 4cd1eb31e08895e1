"""What an effect is. One small class of one of four kinds is the only thing a new piece of physics needs."""

import dataclasses
import re
from collections.abc import Callable
from functools import cache
from typing import Any, ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import ArrayLike

from mckibben_jax.muscle import Muscle
from mckibben_jax.state import State


@dataclasses.dataclass(frozen=True)
class Pull:
    """The frictionless pull behind a felt effect, N, at the state that it hands on.

    `rates_matter` tells whether anything is to be differentiated that depends on how fast the muscle moves, and not
    only on the way; a flag that may be traced.
    """

    at: Callable[[State], jax.Array]
    rates_matter: ArrayLike = True

    def __call__(self, state: State) -> jax.Array:
        return self.at(state)


class Loss(eqx.Module):
    """What motion costs: dry friction of `size` (N, never negative) along `direction` in [-1, 1], and `drag` (N).

    `elastic` is the pull of the rubber alone (N), for the effects that act upon it.
    """

    size: jax.Array
    direction: jax.Array
    drag: jax.Array
    elastic: jax.Array

    @property
    def force(self) -> jax.Array:
        """The force lost, N: positive while contracting."""
        return self.size * self.direction + self.drag

    def replace(self, **changes: Any) -> "Loss":
        """A copy with these fields changed."""
        return dataclasses.replace(self, **changes)


INSTRUMENT = "instrument"  # the source of an effect that is none of the muscle's


class Effect(eqx.Module):
    """A physical effect. Subclass one of the four kinds, declare parameters, write the kind's one method.

    `title` is what readers call it; where there is none, its own name in words. `part` is one of `PARTS`, where it
    acts. `formula` is its law in the notation of the review: `a -> b` puts b in the place of a, E is an energy
    whose pull is dE/dl, F_f the size of dry friction, and what is no parameter stands in `SYMBOLS`. `family` names
    rivals that replace each other; `needs` what must be there (a measurement of the muscle, "rubber", "friction");
    `gives` what it provides to others; `suspect` says when to suspect it. `rival` marks printed laws that are unsound:
    they are candidates only on request; so is an effect that says why in `on_request`. `fixed` names constants with a
    unit that stand in the law. An effect that is the error of an instrument says in `misreads` which it is: channel and
    kind of the accuracy, as in ("force", "zero"). `knows_rates` where speed or pressure rate stand in the law by more
    than their signs: where no effect knows them, what a fit needs of rates is not computed.
    """

    stage: ClassVar[str]
    title: ClassVar[str] = ""
    part: ClassVar[str] = ""
    formula: ClassVar[str] = ""
    source: ClassVar[str] = ""
    suspect: ClassVar[str] = ""
    family: ClassVar[str | None] = None
    needs: ClassVar[tuple[str, ...]] = ()
    gives: ClassVar[tuple[str, ...]] = ()
    rival: ClassVar[bool] = False
    on_request: ClassVar[str] = ""
    fixed: ClassVar[tuple[str, ...]] = ()
    misreads: ClassVar[tuple[str, str] | None] = None
    knows_rates: ClassVar[bool] = True


SYMBOLS = {  # of the formulas; the review's where it has one
    "F": "pull", "E": "stored energy, F = dE/dl", "F_f": "size of dry friction", "F0": "isometric pull",
    "F_rubber": "pull of the rubber", "P": "gauge pressure", "P_atm": "1 atm", "P_m": "pressure in the muscle",
    "P_th": "pressure at contact", "P_free": "pressure in a free tube at this hoop stretch (eq 23F)",
    "p": "absolute pressure in the muscle", "p0": "100 kPa", "p1": "higher of both absolute pressures",
    "w": "flow factor of ISO 6358", "V": "volume of the muscle", "V_c": "volume with conical ends",
    "l": "present length", "l0": "length at rest", "l_c": "length of a cone", "x": "shortening l0 eps",
    "v": "speed of shortening", "t": "time", "eps": "contraction 1 - l/l0", "eps_top": "largest contraction so far",
    "r": "present radius of the braid", "r0": "radius at rest", "r_i": "radius of the bore",
    "alpha": "present braid angle", "alpha0": "braid angle at rest", "alpha_f": "braid angle of unbent strands",
    "B": "length of a strand", "T": "tension of all strands", "S": "contact surface of the strands (eq 34)",
    "S_scale": "Hertz's scale factor (eq 38)", "L": "1 kN", "nu": "Poisson's ratio of the strands",
    "A": "cross-section of the wall at rest", "I1": "first invariant of the stretches", "I2": "second invariant",
    "lambda1": "hoop stretch", "lambda2": "axial stretch", "t0": "wall thickness at rest", "h0": "t0/r0",
    "m": "mass", "g": "9.80665 m/s^2", "y": "shortening of the dashpot", "z": "state of the friction, -1 to 1",
    "z_i": "state of one spring", "X_i": "distance at which it slips", "n": "number of springs, 4", "i": "0 to n - 1",
}  # fmt: skip


PARTS = {  # of a muscle in its rig
    "gas": "the gas in the muscle", "bladder": "the rubber wall of the bladder", "strands": "the strands of the braid",
    "ends": "the ends of the muscle", "muscle": "the muscle as a whole", "fittings": "fittings, cable and rig",
    "supply": "the supply of pressure", "pressure gauge": "the pressure gauge", "position gauge": "the position gauge",
    "load cell": "the load cell",
}  # fmt: skip


class Felt(Effect):
    """Changes what the braid feels: `felt` maps a state to a state; `pull` is the frictionless pull behind it, N.

    Rates follow by differentiating `felt`, unless it `states_rates` itself (as whatever remembers must).
    """

    stage: ClassVar[str] = "felt"
    states_rates: ClassVar[bool] = False

    def felt(self, muscle: Muscle, state: State, pull: Pull) -> State:
        """The state that the braid feels."""
        raise NotImplementedError

    def spring(self, muscle: Muscle) -> jax.Array | None:
        """Stiffness of a spring between the rig and the braid, N per contraction of 1; None where there is none."""
        return None


class Energy(Effect):
    """Stores energy: `energy` in J as a function of the felt state; its force is dE/dl at fixed pressure."""

    stage: ClassVar[str] = "stored"
    knows_rates: ClassVar[bool] = False

    def energy(self, muscle: Muscle, state: State) -> jax.Array:
        """The energy stored, J; for the gas -P V."""
        raise NotImplementedError

    def force(self, muscle: Muscle, state: State) -> jax.Array:
        """The pull dE/dl with respect to the felt length, N."""

        def energy(contraction: jax.Array) -> jax.Array:
            return self.energy(muscle, state.replace(contraction=contraction))

        slope = jax.jvp(energy, (state.contraction,), (jnp.ones_like(state.contraction),))[1]
        return -slope / muscle.length


class Pulling(Effect):
    """Pulls without an energy: printed rivals and whatever a user knows only as a force. `force` in N."""

    stage: ClassVar[str] = "stored"

    def force(self, muscle: Muscle, state: State) -> jax.Array:
        """The pull, N, positive when the muscle pulls."""
        raise NotImplementedError


class Lost(Effect):
    """Changes what motion costs: `lose` receives the loss so far and returns it changed."""

    stage: ClassVar[str] = "lost"

    def lose(self, muscle: Muscle, state: State, loss: Loss) -> Loss:
        """The loss with this effect."""
        raise NotImplementedError


class Read(Effect):
    """Changes what the instrument shows of one channel: `read` maps a whole run's signal over `time`.

    Channels are "force" (N), "position" (m of shortening) and "pressure" (Pa): what the muscle gets of what was set.
    """

    stage: ClassVar[str] = "read"
    knows_rates: ClassVar[bool] = False
    channel: ClassVar[str] = "force"

    def read(self, signal: jax.Array, time: jax.Array) -> jax.Array:
        """The signal shown, in the channel's unit."""
        raise NotImplementedError


def measured(muscle: Muscle, name: str) -> jax.Array:
    """A measurement that an effect declares among its needs."""
    value = getattr(muscle, name)
    if value is None:
        raise ValueError(f"the muscle's {name} is not known: give it, Muscle(..., {name}=...), or leave the effect out")
    return value


def name_of(effect: Effect | type[Effect]) -> str:
    """The name by which users call an effect: its class in snake case."""
    return _snake_case(effect.__name__ if isinstance(effect, type) else type(effect).__name__)


def title_of(effect: Effect | type[Effect]) -> str:
    """What readers call an effect: its title, or its name in words."""
    return effect.title or name_of(effect).replace("_", " ").capitalize()


@cache
def _snake_case(name: str) -> str:
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name).lower()


def blend(switch: jax.Array, without: Any, with_: Any) -> Any:
    """`without + switch (with - without)`, leaf by leaf: 0 is exact absence, 1 is presence.

    A leaf that was handed on untouched stays as it is: most effects change one of the seven numbers of a state.
    """
    return jax.tree.map(lambda a, b: a if b is a else a + switch * (b - a), without, with_)
