"""What a muscle is worth to its designer: numbers of a model, differentiable in the muscle's dimensions.

Forces here are those of the frictionless muscle itself, felt stage included: nothing is lost to motion and no
instrument reads. Every law is called where it stands; nothing is written twice.
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp

from mckibben_jax.design.stroke import free_contraction, friction, integral, pull
from mckibben_jax.effect import Effect, measured
from mckibben_jax.laws import braid, gas, working_pressure
from mckibben_jax.model import Model, model
from mckibben_jax.muscle import Muscle
from mckibben_jax.parameter import parameters

At = dict[str, Any]  # the conditions of a quantity, see CONDITIONS; and the stroke there, where it is known already
RUBBER = {"G": "shear_modulus", "C10": "mooney_c10", "C01": "mooney_c01"}  # parameter of a wall: what is measured of it


# The muscle with its model -------------------------------------------------------------------------------------------


def built(muscle: Muscle, effects: Sequence[Effect]) -> Model:
    """The model of a muscle. What was measured of its rubber is the rubber of its wall; else the effect's own holds."""
    return model(muscle, *(_of_rubber(effect, muscle) for effect in effects))


def _of_rubber(effect: Effect, muscle: Muscle) -> Effect:
    if "rubber" not in effect.gives:
        return effect
    for p in parameters(effect):
        known = getattr(muscle, RUBBER[p.name]) if p.name in RUBBER else None
        if known is not None:
            effect = eqx.tree_at(lambda e, name=p.name: getattr(e, name), effect, known)
    return effect


def rubber_constants(given: Model) -> tuple[jax.Array, jax.Array] | None:
    """Mooney-Rivlin constants of the rubber, Pa: as measured, else those of the model's wall; None if neither knows."""
    muscle = given.muscle
    if muscle.mooney_c10 is not None:
        return muscle.mooney_c10, jnp.asarray(0.0) if muscle.mooney_c01 is None else muscle.mooney_c01
    if muscle.shear_modulus is not None:
        return muscle.shear_modulus / 2, jnp.zeros_like(muscle.shear_modulus)
    for effect in given.effects:
        names = {p.name for p in parameters(effect)} if "rubber" in effect.gives else set()
        if "G" in names:
            return effect.G / 2, jnp.zeros_like(effect.G)  # type: ignore[attr-defined]
        if "C10" in names:
            return effect.C10, effect.C01  # type: ignore[attr-defined]
    return None


def _rubber(given: Model) -> tuple[jax.Array, jax.Array]:
    constants = rubber_constants(given)
    if constants is None:
        raise ValueError("the rubber is not known: give the muscle a shear_modulus")
    return constants


# Quantities ----------------------------------------------------------------------------------------------------------


def force(given: Model, at: At) -> jax.Array:
    """Frictionless force, N."""
    return pull(given, jnp.asarray(at["contraction"]), jnp.asarray(at["pressure"]))


def stiffness(given: Model, at: At) -> jax.Array:
    """How fast the force falls as the muscle shortens at constant pressure, -dF/d(shortening), N/m."""
    slope = braid.slope(lambda eps: pull(given, eps, jnp.asarray(at["pressure"])), at["contraction"])
    return -slope / given.muscle.length


def stroke(given: Model, at: At) -> jax.Array:
    """Contraction at which the force first vanishes at this pressure.

    Where a muscle does not pull at rest, the (negative) contraction at which it would, by the slope at rest: a search
    is led back from there. Its derivative is that of the implicit function.
    """
    if "stroke" in at:
        return at["stroke"]
    return free_contraction(lambda eps: pull(given, eps, jnp.asarray(at["pressure"])))


def work(given: Model, at: At) -> jax.Array:
    """Work (J) delivered at constant pressure from rest to where the force vanishes."""
    return _over_the_stroke(given, at, lambda eps: pull(given, eps, jnp.asarray(at["pressure"])))


def _over_the_stroke(given: Model, at: At, law: Callable[[jax.Array], jax.Array]) -> jax.Array:
    return given.muscle.length * integral(law, stroke(given, at))


def hysteresis_loss(given: Model, at: At) -> jax.Array:
    """Work (J) lost in one slow closed loop at constant pressure, from rest over the stroke and back.

    l0 int (lost while contracting - lost while lengthening) d eps, by `friction`. Zero where a model has no friction.
    """
    pressure = jnp.asarray(at["pressure"])
    width = lambda eps: friction(given, eps, pressure, 1.0) - friction(given, eps, pressure, -1.0)  # noqa: E731
    return _over_the_stroke(given, at, width)


def efficiency(given: Model, at: At) -> jax.Array:
    """Work of one slow stroke at constant pressure, friction deducted, over the energy of the air that it draws.

    The muscle is filled from the atmosphere out of a supply at this pressure, delivers its stroke, and is vented: the
    air is lost with what it could still do (`gas.supply_energy`). Volumes by `gas_volume`.
    """
    pressure, end = jnp.asarray(at["pressure"]), stroke(given, at)
    lost = _over_the_stroke(given, at, lambda eps: friction(given, eps, pressure, 1.0))
    full, empty = (gas_volume(given, {"contraction": eps}) for eps in (end, 0.0))
    return (work(given, at) - lost) / gas.supply_energy(pressure, full, empty)


def response_time(given: Model, at: At) -> jax.Array:
    """Time (s) until the pressure in the muscle has reached 90 % of a step from the atmosphere: `gas.filling_time`.

    The gas volume is that at `contraction`, unless given that at the end of the stroke, where it is largest; the valve
    has the sonic `conductance`, 1 dm^3/(s bar) unless given. Inertia is left out: slow where the valve is slow.
    """
    volume = gas_volume(given, {"contraction": at["contraction"] if "contraction" in at else stroke(given, at)})
    return gas.filling_time(at["pressure"], volume, at.get("conductance", gas.CONDUCTANCE))


def _wall_ratio(muscle: Muscle) -> jax.Array:
    return measured(muscle, "wall_thickness") / muscle.outer_radius


def _end(given: Model, at: At) -> jax.Array:
    return jnp.asarray(at.get("contraction", braid.largest_contraction(given.muscle.braid_angle)))


def minimum_pressure(given: Model, at: At) -> jax.Array:
    """Pressure (Pa) that a thick wall keeps for itself (23 for any wall), at the end of the ideal law's stroke."""
    muscle = given.muscle
    return working_pressure.minimum_pressure(
        _end(given, at), muscle.braid_angle, _wall_ratio(muscle), *_rubber(given)
    )  # fmt: skip


def minimum_pressure_thin(given: Model, at: At) -> jax.Array:
    """The same of a thin neo-Hookean wall, Pa (23 corrected)."""
    c10, c01 = _rubber(given)
    muscle = given.muscle
    return working_pressure.minimum_pressure_thin(
        _end(given, at), muscle.braid_angle, _wall_ratio(muscle), 2 * (c10 + c01)
    )


def burst_pressure(given: Model, at: At) -> jax.Array:
    """Pressure (Pa) that breaks a wall left alone with it (24), at the end of the ideal law's stroke."""
    muscle = given.muscle
    return working_pressure.burst_pressure(
        _end(given, at), muscle.braid_angle, _wall_ratio(muscle), measured(muscle, "breaking_stress")
    )


def fatigue_cycles(given: Model, at: At) -> jax.Array:
    """Cycles to failure at this contraction, or at the full stroke of this pressure."""
    return working_pressure.fatigue_cycles(at["contraction"] if "contraction" in at else stroke(given, at))


def gas_volume(given: Model, at: At) -> jax.Array:
    """Volume (m^3) of the gas at this contraction: inside the braid, less the rubber that lies there."""
    m = given.muscle
    inside = braid.cylinder_volume(at["contraction"], m.length, m.radius, m.braid_angle)
    rubber = 0.0 if m.wall_thickness is None else jnp.pi * (m.radius**2 - m.inner_radius**2) * m.length
    return inside - rubber


def strand_length(given: Model, at: At) -> jax.Array:
    """Length of one strand from end to end, m."""
    return braid.cord_length(given.muscle.length, given.muscle.braid_angle)


def outer_radius(given: Model, at: At) -> jax.Array:
    """Outer radius (m) at this contraction, rubber outside the braid included."""
    m = given.muscle
    lies = m.radius * braid.radius_ratio(at["contraction"], m.braid_angle)
    return jnp.sqrt(lies**2 + (m.outer_radius**2 - m.radius**2) / (1 - at["contraction"]))


class Merit(NamedTuple):
    """A quantity: its unit, the conditions it is taken at (one of each group), and what must be known of the muscle."""

    law: Callable[[Model, At], jax.Array]
    unit: str
    at: tuple[tuple[str, ...], ...] = ()
    needs: tuple[str, ...] = ()
    may_have: tuple[str, ...] = ()  # conditions that may be given


_STATE, _PRESSURE, _PLACE = (("contraction",), ("pressure",)), (("pressure",),), (("contraction",),)
_END = ("contraction",)
QUANTITIES: dict[str, Merit] = {
    "force": Merit(force, "N", _STATE),
    "stroke": Merit(stroke, "1", _PRESSURE),
    "work": Merit(work, "J", _PRESSURE),
    "stiffness": Merit(stiffness, "N/m", _STATE),
    "minimum_pressure": Merit(minimum_pressure, "Pa", (), ("wall_thickness", "rubber"), _END),
    "minimum_pressure_thin": Merit(minimum_pressure_thin, "Pa", (), ("wall_thickness", "rubber"), _END),
    "burst_pressure": Merit(burst_pressure, "Pa", (), ("wall_thickness", "breaking_stress"), _END),
    "fatigue_cycles": Merit(fatigue_cycles, "1", (("contraction", "pressure"),)),
    "gas_volume": Merit(gas_volume, "m^3", _PLACE),
    "strand_length": Merit(strand_length, "m"),
    "outer_radius": Merit(outer_radius, "m", _PLACE),
    "hysteresis_loss": Merit(hysteresis_loss, "J", _PRESSURE),
    "efficiency": Merit(efficiency, "1", _PRESSURE),
    "response_time": Merit(response_time, "s", _PRESSURE, (), ("contraction", "conductance")),
}
CONDITIONS = {"contraction": "1", "pressure": "Pa", "conductance": "m^3/(s Pa)"}
_OF_THE_STROKE = ("stroke", "work", "fatigue_cycles", "hysteresis_loss", "efficiency", "response_time")


def evaluate(given: Model, wanted: Sequence[tuple[str, At]]) -> jax.Array:
    """Several quantities, each at its own conditions; the stroke at a pressure is sought once."""
    strokes: dict[float, jax.Array] = {}

    def value(name: str, at: At) -> jax.Array:
        if name in _OF_THE_STROKE and "pressure" in at:
            pressure = at["pressure"]
            strokes[pressure] = strokes[pressure] if pressure in strokes else stroke(given, at)
            at = at | {"stroke": strokes[pressure]}
        return jnp.asarray(QUANTITIES[name].law(given, at), dtype=float)

    return jnp.stack([value(name, at) for name, at in wanted])


def missing(given: Model, quantity: str) -> tuple[str, ...]:
    """What this quantity needs and the muscle, or the model's wall, does not have."""
    lacking = [need for need in QUANTITIES[quantity].needs if need != "rubber" and given.muscle.lacks(need)]
    rubber = "rubber" in QUANTITIES[quantity].needs and rubber_constants(given) is None
    return (*lacking, "shear_modulus") if rubber else tuple(lacking)
