"""The muscle behind a spring: its slopes by differences are those of the implicit-function theorem."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from mckibben_jax.effects import BladderNeoHookean, IdealCylinder, SeriesCompliance, StrandStretch, TipPressure
from mckibben_jax.model import Model
from mckibben_jax.muscle import Muscle
from mckibben_jax.state import State

MUSCLE = Muscle(length=0.25, radius=0.008, braid_angle=np.radians(23.0), wall_thickness=6e-4)
RUN = State(
    contraction=jnp.array([-0.02, 0.05, 0.12, 0.2]),
    pressure=jnp.array([1e5, 2e5, 3e5, 1.5e5]),
    rate=jnp.array([0.3, -0.2, 0.0, 0.1]),
    pressure_rate=jnp.array([0.0, 2e5, -1e5, 3e4]),
    stretch=jnp.zeros(4),
    stretch_rate=jnp.array([0.0, 1e-3, -2e-3, 0.0]),
    time=jnp.arange(4.0),
)
BEHIND = {"alone": (), "before others": (TipPressure(), StrandStretch())}


def behind_spring(stiffness, others):
    effects = (SeriesCompliance(k_s=stiffness), *others, IdealCylinder(), BladderNeoHookean())
    return Model(MUSCLE, effects, jnp.ones(len(effects)))


def exact_rate(stiffness, others):
    """d(contraction)/dt of eps = reading + F/(k l) by nested derivatives, at the contraction that the effect gives."""
    whole = behind_spring(stiffness, others)
    at = jax.vmap(lambda state: whole.feel(0, state).contraction)(RUN)

    def one(state, contraction):
        def gap(contraction, read, pressure, stretch):
            own = state.replace(contraction=contraction, pressure=pressure, stretch=stretch)
            return contraction - read - whole._pull_behind(0)(own) / (stiffness * MUSCLE.length)

        at = (contraction, state.contraction, state.pressure, state.stretch)
        slope = jax.jvp(gap, at, (1.0, 0.0, 0.0, 0.0))[1]
        drift = jax.jvp(gap, at, (0.0, state.rate, state.pressure_rate, state.stretch_rate))[1]
        return -drift / slope

    return jax.vmap(one)(RUN, at)


@pytest.mark.parametrize("stiffness", [1e4, 2e5, 1e8])
@pytest.mark.parametrize("others", BEHIND.values(), ids=BEHIND)
def test_rates_and_their_slopes_are_the_exact_ones(stiffness, others):
    rate = lambda k: jax.vmap(lambda state: behind_spring(k, others).feel(0, state).rate)(RUN)  # noqa: E731
    both = (rate, lambda k: exact_rate(k, others))
    given, exact = (jax.jit(lambda k, f=f: jax.jvp(f, (k,), (1.0,)))(stiffness) for f in both)
    np.testing.assert_allclose(given[0], exact[0], rtol=1e-8, atol=1e-12)
    np.testing.assert_allclose(given[1], exact[1], rtol=1e-5, atol=1e-9 * float(jnp.max(jnp.abs(exact[1]))))


def test_the_muscle_stands_where_spring_and_muscle_agree():
    whole = behind_spring(3e4, BEHIND["before others"])
    felt = jax.vmap(lambda state: whole.feel(0, state))(RUN)
    give = jax.vmap(whole._pull_behind(0))(RUN.replace(contraction=felt.contraction)) / (3e4 * MUSCLE.length)
    np.testing.assert_allclose(felt.contraction, RUN.contraction + give, rtol=1e-12)


@pytest.mark.parametrize("stiffness", [1e4, 2e5])
@pytest.mark.parametrize("traced", [False, True], ids=["known beforehand", "traced"])
def test_without_derivatives_of_rates_the_muscle_stands_as_with_them(stiffness, traced):
    """The contraction and its derivative are the same; the rate, of which the sign is used, is nearly so."""
    matters = (lambda flag: jnp.asarray(flag)) if traced else bool
    others = BEHIND["before others"]

    def felt(flag):
        feel = lambda k: jax.vmap(lambda state: behind_spring(k, others).feel(0, state, flag))(RUN)  # noqa: E731
        return jax.jvp(feel, (stiffness,), (1.0,))

    (exact, exact_slope), (plain, slope) = felt(True), felt(matters(False))
    np.testing.assert_allclose(plain.contraction, exact.contraction, rtol=1e-12)
    np.testing.assert_allclose(slope.contraction, exact_slope.contraction, rtol=1e-6)
    np.testing.assert_allclose(plain.rate, exact.rate, rtol=1e-3)
    again, again_slope = felt(matters(True))
    np.testing.assert_allclose(again.rate, exact.rate, rtol=1e-9)
    np.testing.assert_allclose(again_slope.rate, exact_slope.rate, rtol=1e-5)


@pytest.mark.parametrize("flag", [True, False, jnp.asarray(True), jnp.asarray(False)], ids=str)
def test_what_stands_still_has_no_rate(flag):
    """Not even a rate of 1e-12: friction takes its sign, and would hold a muscle that is at rest."""
    still = RUN.replace(**{rate: jnp.zeros(4) for rate in ("rate", "pressure_rate", "stretch_rate")})
    felt = jax.vmap(lambda state: behind_spring(2e5, BEHIND["before others"]).feel(0, state, flag))(still)
    assert not np.any(np.asarray(felt.rate))
