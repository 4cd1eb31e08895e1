"""One step of the speed of a muscle that slides and sticks: dry friction as it is, not smeared over low speeds.

The muscle is held where it is while its speed runs over the step; u is the speed of sliding (1/s, in contraction) and
`law(u, direction)` the acceleration (1/s^2) at that speed with friction acting against that direction. The law is taken
as a straight line with its exact slope over the speeds passed through, solved in closed form, and what it bends away
from the line is added by Simpson's rule. A stop is found in closed form; from there the muscle stays where friction can
hold it and sets off where it cannot. A muscle at rest stays at rest exactly.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

Law = Callable[[jax.Array, jax.Array], jax.Array]

LEAST_SPAN = 1e-6  # 1/s: speeds closer than this show no slope, the law is asked that far away
MOST_GROWTH = 2.0  # exponent per step: breaking away grows exponentially while friction falls with speed, not for long


class Slide(NamedTuple):
    """Speed at the end of a stretch of time (1/s), and how far the muscle slid in it (in contraction)."""

    speed: jax.Array
    way: jax.Array


class Departure(NamedTuple):
    """How a step begins: speed (1/s), direction (-1, 0 at rest held by friction, 1) and acceleration (1/s^2)."""

    speed: jax.Array
    direction: jax.Array
    acceleration: jax.Array

    def ahead(self, speed: jax.Array) -> jax.Array:
        """This speed, or 0 if it points against the direction of sliding."""
        return jnp.maximum(speed * self.direction, 0.0) * self.direction


def push(law: Law, speed: jax.Array, step: jax.Array) -> Slide:
    """The speed of sliding after `step` seconds, and the way; a stop and a start from rest inside the step resolved."""
    rest = from_rest(law, jnp.zeros_like(speed))
    sliding = Departure(speed, jnp.sign(speed), law(speed, jnp.sign(speed)))
    start = _choose(speed == 0, rest, sliding)
    slope = jnp.minimum(secant(law, start, step), MOST_GROWTH / step)
    on, stops = slide_on(law, start, slope, step)
    halt, left = slide_to_stop(start, slope, step)
    off = slide(rest, slope, left, jnp.expm1(slope * left))
    return _choose(stops, Slide(off.speed, halt + off.way), on)


def from_rest(law: Law, rest: jax.Array) -> Departure:
    """Where a resting muscle goes: up or down where friction cannot hold it, else nowhere."""
    up, down = law(rest, jnp.ones_like(rest)), law(rest, -jnp.ones_like(rest))
    direction = jnp.where(up > 0, 1.0, jnp.where(down < 0, -1.0, 0.0))
    return Departure(rest, direction, jnp.where(up > 0, up, jnp.where(down < 0, down, 0.0)))


def secant(law: Law, start: Departure, step: jax.Array) -> jax.Array:
    """Slope of the law (1/s) from the first speed to that of an Euler step, or to 0 if that would turn back."""
    span = start.ahead(start.speed + step * start.acceleration) - start.speed
    tangent = jnp.where(start.direction < 0, -LEAST_SPAN, LEAST_SPAN)
    span = jnp.where(jnp.abs(span) < LEAST_SPAN, tangent, span)
    return (law(start.speed + span, start.direction) - start.acceleration) / span


def slide(start: Departure, slope: jax.Array, time: jax.Array, grown: jax.Array) -> Slide:
    """Solution of du/dt = a + slope (u - u0) after `time`; `grown` = exp(slope time) - 1."""
    once, twice = _growths(slope * time, grown)
    gain = start.acceleration * time
    return Slide(start.speed + gain * once, time * (start.speed + gain * twice))


def slide_on(law: Law, start: Departure, slope: jax.Array, step: jax.Array) -> tuple[Slide, jax.Array]:
    """Sliding through the whole step, and whether the muscle stops before its end (then the slide does not hold)."""
    half = jnp.expm1(slope * step / 2)
    end = slide(start, slope, step, half * (half + 2))
    middle = slide(start, slope, step / 2, half)

    def bend(at: jax.Array) -> jax.Array:
        at = start.ahead(at)
        return law(at, start.direction) - start.acceleration - slope * (at - start.speed)

    inside = bend(middle.speed) * (half + 1)
    speed = start.ahead(end.speed + step * (4 * inside + bend(end.speed)) / 6)
    return Slide(speed, end.way + step**2 * inside / 3), end.speed * start.direction <= 0


def slide_to_stop(start: Departure, slope: jax.Array, step: jax.Array) -> tuple[jax.Array, jax.Array]:
    """How far the muscle slides until it stops, at log(1 - slope u0/a)/slope, and how much of the step is left, s."""
    slows = start.speed * start.acceleration < 0
    straight = jnp.where(slows, -start.speed / jnp.where(slows, start.acceleration, 1.0), 0.0)
    grown = jnp.maximum(slope * straight, -1 + 1e-12)
    small = jnp.abs(grown) < 1e-6
    safe = jnp.where(small, 1.0, grown)
    stop = straight * jnp.where(small, 1 - grown / 2 + grown**2 / 3, jnp.log1p(safe) / safe)
    stop = jnp.clip(stop, 0.0, step)
    return slide(start, slope, stop, grown).way, step - stop


def _growths(exponent: jax.Array, grown: jax.Array) -> tuple[jax.Array, jax.Array]:
    """(exp(z) - 1)/z and (exp(z) - 1 - z)/z^2, given exp(z) - 1; 1 and 1/2 at z = 0."""
    z, small = exponent, jnp.abs(exponent) < 1e-4
    safe = jnp.where(small, 1.0, z)
    once = jnp.where(small, 1 + z / 2 + z**2 / 6, grown / safe)
    return once, jnp.where(small, 0.5 + z / 6 + z**2 / 24, (once - 1) / safe)


def _choose(condition: jax.Array, one: Any, other: Any) -> Any:
    return jax.tree.map(lambda a, b: jnp.where(condition, a, b), one, other)
