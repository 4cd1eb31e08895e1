"""Where a muscle stands behind a spring, and its pull near there: values, and slopes by differences."""

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import optimistix as optx
from jaxtyping import ArrayLike

from mckibben_jax.state import State

PLACE = ("contraction", "pressure", "stretch")  # what a pull is a function of
STRAIN_STEP = 1e-5  # of contraction, middle of a difference to its ends; good in single precision (C) too
STRETCH_STEP = 2e-6  # of stretch, of the same
PRESSURE_STEP = 1.0  # Pa, of the same
OwnPull = Callable[[jax.Array, jax.Array, jax.Array], jax.Array]  # N, of `PLACE`


class Near(NamedTuple):
    """The pull near a contraction, N: there, its first two slopes over contraction, over time (N/s), and over both."""

    contraction: jax.Array
    pull: jax.Array
    slope: jax.Array
    bend: jax.Array
    drift: jax.Array
    drift_slope: jax.Array


class Stands(NamedTuple):
    """A contraction, and the slopes of the pull there over contraction and over time (N/s), without derivatives."""

    contraction: jax.Array
    slope: jax.Array
    drift: jax.Array


def standing(pull: OwnPull, state: State, give: jax.Array) -> Stands:
    """Where a muscle stands that a spring makes shorter by pull/`give`, found by optimistix, as plain numbers.

    A Newton step that follows has the root's exact derivative. The solver is given the slope by a difference: it then
    needs no derivative of the pull, which would make the compiled program larger. The pull is taken as the mean of the
    two ends of this difference, so the search ends within 1e-8 of the root; the Newton step that follows does the rest.
    The drift, of which the sign alone counts, is that at one end: 0 where nothing moves.
    """
    plain, constants = jax.closure_convert(pull, *(getattr(state, name) for name in PLACE))
    fixed = jax.lax.stop_gradient((state, give, constants))

    def looked(at: jax.Array, fixed: tuple) -> tuple[jax.Array, jax.Array, jax.Array]:
        state, give, constants = fixed
        pause = _pause(state)
        along, later = STRAIN_STEP * jnp.array([-1.0, 1.0, 1.0]), pause * jnp.array([0.0, 0.0, 1.0])
        before, beyond, after = jax.vmap(lambda *place: plain(*place, *constants))(
            at + along, state.pressure + later * state.pressure_rate, state.stretch + later * state.stretch_rate
        )
        gap = at - state.contraction - (before + beyond) / 2 / give
        return gap, (beyond - before) / (2 * STRAIN_STEP), (after - beyond) / pause

    seen = jax.custom_jvp(looked)

    @seen.defjvp
    def _(primals, tangents):  # type: ignore[no-untyped-def]
        gap, slope, drift = looked(*primals)
        still = jnp.zeros_like(slope)
        return (gap, slope, drift), ((1 - slope / primals[1][1]) * tangents[0], still, still)

    def gap(at: jax.Array, fixed: tuple) -> tuple[jax.Array, tuple[jax.Array, jax.Array]]:
        gap, slope, drift = seen(at, fixed)
        return gap, (slope, drift)

    found = optx.root_find(
        gap, optx.Newton(rtol=1e-6, atol=1e-7), fixed[0].contraction, args=fixed, max_steps=30, throw=False,
        has_aux=True,
    )  # fmt: skip
    return jax.lax.stop_gradient(Stands(found.value, *found.aux))


def near_by(pull: OwnPull, stands: Stands, state: State, rates_matter: ArrayLike) -> Near:
    """The pull near where a muscle stands, by central differences.

    Unless `rates_matter`, slopes are those that the search has found, which carry no derivatives: the contraction needs
    none of them, the rate does. Then one lane carries derivatives in place of seven.

    Seven lanes give all of it: jax's own slopes, differentiated again for the fit, were half of the compiled program of
    a diagnosis. Relative error of the muscle's rate below 1e-8, and of what a fit needs of its derivatives below 1e-5,
    where the pull has no kink within a step.
    """
    pause = _pause(state)
    along = STRAIN_STEP * jnp.array([0.0, -1.0, -1.0, 0.0, 0.0, 1.0, 1.0])
    later = pause * jnp.array([0.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0])

    def lane(along: jax.Array, later: jax.Array) -> jax.Array:
        moved = state.pressure + later * state.pressure_rate, state.stretch + later * state.stretch_rate
        return pull(stands.contraction + along, *moved)

    def found(pulls: jax.Array) -> Near:
        here, around = pulls[0], pulls[1:].reshape(3, 2)
        (before, middle, beyond), drifts = around.mean(1), jnp.diff(around)[:, 0] / (2 * pause)
        slope, bend = (beyond - before) / (2 * STRAIN_STEP), (beyond - 2 * middle + before) / STRAIN_STEP**2
        return Near(stands.contraction, here, slope, bend, drifts[1], (drifts[2] - drifts[0]) / (2 * STRAIN_STEP))

    def plain(here: jax.Array) -> Near:
        none = jnp.zeros_like(here)
        return Near(stands.contraction, here, stands.slope, none, stands.drift, none)

    if isinstance(rates_matter, bool):
        return found(jax.vmap(lane)(along, later)) if rates_matter else plain(lane(along[0], later[0]))
    # one lane after the other: the pull is then compiled once, however many lanes are asked for
    step = lambda k, pulls: pulls.at[k].set(lane(along[k], later[k]))  # noqa: E731
    pulls = jax.lax.fori_loop(0, jnp.where(rates_matter, 7, 1), step, jnp.zeros(7))
    return jax.tree.map(lambda a, b: jnp.where(rates_matter, a, b), found(pulls), plain(pulls[0]))


def _pause(state: State) -> jax.Array:
    """Seconds from the middle of a difference over time to its ends."""
    speed = jnp.abs(state.pressure_rate) / PRESSURE_STEP + jnp.abs(state.stretch_rate) / STRETCH_STEP
    return jax.lax.stop_gradient(1 / (speed + 1e-6))
