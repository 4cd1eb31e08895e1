"""A model: what a set of effects makes of a run, whatever the effects."""

import benches
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from benches import MUSCLE

from mckibben_jax.effect import Energy, Felt, Lost, name_of
from mckibben_jax.effects import (
    LIBRARY,
    BladderMooneyRivlin,
    BladderNeoHookean,
    ConstantFriction,
    CoulombFriction,
    DeadBand,
    ForceGain,
    ForceOffset,
    IdealCylinder,
    KineticFriction,
    Mullins,
    PressureOffset,
    SeriesCompliance,
    StrandBending,
    StrandStretch,
    TextileFriction,
    Tip,
    TipPressure,
)
from mckibben_jax.laws import braid
from mckibben_jax.model import contributions, model, with_effects
from mckibben_jax.muscle import Muscle
from mckibben_jax.parameter import parameter, parameters
from mckibben_jax.state import State

LOOP = benches.loop(3e5, 0.02)
EPS, P = LOOP.contraction, LOOP.pressure


def ideal(contraction, pressure):
    """Eq 10 for the muscle of the tests."""
    return braid.ideal_force(contraction, pressure, MUSCLE.radius, MUSCLE.braid_angle)


# Stages --------------------------------------------------------------------------------------------------------------


def test_a_muscle_without_effects_pulls_nothing():
    np.testing.assert_array_equal(model(MUSCLE).force(LOOP), 0.0)


def test_the_ideal_law_is_the_slope_of_its_energy():
    np.testing.assert_allclose(model(MUSCLE, IdealCylinder()).force(LOOP), ideal(EPS, P), rtol=1e-12)


def test_a_felt_contraction_is_put_in_and_not_differentiated_through():
    force = model(MUSCLE, IdealCylinder(), Tip(k=1.2)).force(LOOP)
    np.testing.assert_allclose(force, ideal(1.2 * EPS, P), rtol=1e-12)


def test_everything_behind_the_felt_stage_sees_the_felt_state_and_its_rate():
    seen = jax.vmap(lambda s: model(MUSCLE, Tip(k=1.2)).feel(0, s))(LOOP)
    np.testing.assert_allclose(seen.rate, 1.2 * LOOP.rate, rtol=1e-12)
    rubber = model(MUSCLE, BladderNeoHookean()).force(LOOP.replace(contraction=1.2 * EPS))
    np.testing.assert_allclose(model(MUSCLE, BladderNeoHookean(), Tip(k=1.2)).force(LOOP), rubber, rtol=1e-12)


def test_offsets_come_before_the_dead_band_whatever_the_order_of_adding():
    force = model(MUSCLE, DeadBand(P_th=1e4), IdealCylinder(), PressureOffset(P_off=5e3)).force(LOOP)
    np.testing.assert_allclose(force, ideal(EPS, P - 5e3 - 1e4), rtol=1e-12)


def test_the_gain_of_the_load_cell_comes_before_its_offset():
    force = model(MUSCLE, ForceOffset(F_off=3.0), IdealCylinder(), ForceGain(g=0.1)).force(LOOP)
    np.testing.assert_allclose(force, 1.1 * ideal(EPS, P) + 3.0, rtol=1e-12)


def test_series_compliance_is_where_muscle_and_spring_agree():
    stiff = 1e5
    given = model(MUSCLE, IdealCylinder(), SeriesCompliance(k_s=stiff), Tip(k=1.1))
    force = given.force(LOOP)
    own = EPS + force / (stiff * MUSCLE.length)
    np.testing.assert_allclose(force, ideal(1.1 * own, P), rtol=1e-9)
    whole = model(MUSCLE, IdealCylinder(), SeriesCompliance(k_s=stiff))
    slope = jax.jacfwd(lambda e: whole.force(LOOP.replace(contraction=EPS + e)))(0.0)
    soft = benches.braid_slope(EPS + whole.force(LOOP) / (stiff * MUSCLE.length), P)
    np.testing.assert_allclose(slope, soft / (1 - soft / (stiff * MUSCLE.length)), rtol=1e-7)


def test_strands_that_stretch_make_a_longer_cord():
    """Eq 14 with the cord B (1 + eta), eta by the tension of the unstretched cord."""
    stiffness = 5e4
    angle = braid.angle(EPS, MUSCLE.braid_angle)
    radius = MUSCLE.radius * braid.radius_ratio(EPS, MUSCLE.braid_angle)
    eta = 2 * np.pi * radius**2 * P / (jnp.tan(angle) ** 2 * jnp.cos(angle)) / stiffness
    cord = braid.cord_length(MUSCLE.length, MUSCLE.braid_angle) * (1 + eta)
    expected = braid.ideal_force_gaylord(MUSCLE.length * (1 - EPS), P, cord, MUSCLE.turns)
    found = model(MUSCLE, IdealCylinder(), StrandStretch(EA=stiffness)).force(LOOP)
    np.testing.assert_allclose(found, expected, rtol=1e-10)


def test_a_held_muscle_has_friction_where_strands_stretch_and_none_where_they_do_not():
    held = benches.isometric(0.1, 1e5)
    rigid, stretching = (model(MUSCLE, IdealCylinder(), CoulombFriction(), *more) for more in ((), (StrandStretch(),)))
    np.testing.assert_allclose(rigid.force(held), ideal(0.1, held.pressure), rtol=1e-12)
    frictionless = model(MUSCLE, IdealCylinder(), StrandStretch()).force(held)
    opposing = (frictionless - stretching.force(held)) * jnp.sign(held.pressure_rate)
    assert (opposing[1:20] > 1.0).all()  # the cord lengthens as pressure rises: at a held length the braid opens
    assert (opposing[-20:-1] > 1.0).all()


def test_kinetic_friction_multiplies_whatever_friction_is_there():
    fast = KineticFriction(ratio=3.0, v_s=1e-6)
    plain = model(MUSCLE, CoulombFriction(), ConstantFriction()).force(LOOP)
    np.testing.assert_allclose(
        model(MUSCLE, fast, CoulombFriction(), ConstantFriction()).force(LOOP), 3.0 * plain, rtol=1e-12
    )


def test_mullins_takes_from_the_rubber_only_below_the_largest_contraction():
    up_and_down = benches.loop(0.0, 0.02, turns=(0.0, 0.2, 0.0))
    plain = model(MUSCLE, BladderNeoHookean()).force(up_and_down)
    softened = model(MUSCLE, BladderNeoHookean(), Mullins(m=0.2, w=1e-3)).force(up_and_down)
    half = benches.SAMPLES // 2
    np.testing.assert_allclose(softened[:half], plain[:half], rtol=1e-12)
    np.testing.assert_allclose(softened[half + 2 :], 0.8 * plain[half + 2 :], rtol=1e-3)


def test_strands_formed_straight_are_bent_at_rest():
    at_rest, angle = State(0.0, 0.0), MUSCLE.braid_angle
    assert StrandBending(c_b=30.0).force(MUSCLE, at_rest) == 0.0
    straight = StrandBending(c_b=30.0, alpha_f=0.0).force(MUSCLE, at_rest)
    np.testing.assert_allclose(straight, -30.0 * jnp.cos(angle), rtol=1e-12)


# Energy --------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", [k for k in LIBRARY if issubclass(k, Energy)], ids=name_of)
def test_a_stored_energy_delivers_the_work_of_the_pressure_around_any_cycle(kind):
    """-oint F dl = oint P dV around a closed path of contraction and pressure, the volume being -dE/dP."""
    turn = jnp.linspace(0, 2 * jnp.pi, 2001)
    contraction, pressure = 0.15 + 0.1 * jnp.cos(turn), 3e5 + 2e5 * jnp.sin(turn)
    energy = lambda p, c: kind().energy(MUSCLE, State(c, p))  # noqa: E731
    volume = -jax.vmap(jax.grad(energy))(pressure, contraction)
    force = jax.vmap(lambda c, p: kind().force(MUSCLE, State(c, p)))(contraction, pressure)
    work = jnp.trapezoid(force, MUSCLE.length * contraction)
    np.testing.assert_allclose(work, jnp.trapezoid(pressure, volume), rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("kind", [k for k in LIBRARY if "rubber" in k.gives], ids=name_of)
def test_rubber_pulls_nothing_at_rest(kind):
    assert abs(kind().force(MUSCLE, State(0.0, 2e5))) < 1e-9


@pytest.mark.parametrize(
    ("factor", "strokes"), [(1.25, (0.2091, 0.2594, 0.2759, 0.2890)), (1.0, (0.2614, 0.3242, 0.3448, 0.3612))]
)
def test_rubber_alone_explains_the_short_stroke_at_low_pressure(factor, strokes):
    """Stroke at 1, 2, 3 and 5 bar of a neo-Hookean wall of 7 % and 0.54 MPa, with and without a tip correction."""
    muscle = Muscle(0.3, 7e-3, np.radians(20.0), wall_thickness=0.07 * 7e-3)
    pull = model(muscle, IdealCylinder(), BladderNeoHookean(G=0.54e6), Tip(k=factor)).force
    for bar, stroke in zip((1, 2, 3, 5), strokes, strict=True):
        ends = pull(benches.run([0.0, 1.0], [stroke - 1e-4, stroke + 1e-4], [bar * 1e5] * 2))
        assert ends[0] > 0 > ends[1]


# The set of effects --------------------------------------------------------------------------------------------------


def test_adding_one_by_one_in_any_order_gives_the_same_model():
    effects = [ConstantFriction(), Tip(), IdealCylinder(), ForceOffset(), BladderNeoHookean()]
    one_by_one = model(MUSCLE)
    for effect in effects:
        one_by_one = one_by_one.add(effect)
    assert eqx.tree_equal(one_by_one, model(MUSCLE, *reversed(effects)))


def test_a_rival_of_the_same_family_is_replaced():
    start = model(MUSCLE, IdealCylinder(), CoulombFriction(), Tip(), BladderNeoHookean())
    changed = start.add(TextileFriction(), TipPressure(), BladderMooneyRivlin())
    expected = (TipPressure, IdealCylinder, BladderMooneyRivlin, TextileFriction)
    assert changed.names == tuple(name_of(kind) for kind in expected)
    assert "constant_friction" in start.add(ConstantFriction()).names
    assert "coulomb_friction" in start.add(ConstantFriction()).names


def test_of_two_rivals_that_are_added_at_once_the_last_stays():
    """Wherever effects are added: an explanation holds one of a family."""
    names = [name_of(e) for e in with_effects((IdealCylinder(), Tip()), (TipPressure(), Tip(1.1)))]
    assert names == ["ideal_cylinder", "tip"]
    assert model(MUSCLE, IdealCylinder()).add(Tip(), TipPressure()).names == ("tip_pressure", "ideal_cylinder")


def test_dropping_undoes_adding_and_an_effect_is_found_by_its_name():
    start = model(MUSCLE, IdealCylinder())
    assert eqx.tree_equal(start.add(Tip()).drop("tip"), start)
    assert start.add(Tip(k=1.3))["tip"].k == 1.3


def test_missing_needs_are_named():
    bare = Muscle(0.3, 7e-3, 0.35)
    assert model(bare).missing_needs(BladderNeoHookean) == ("wall_thickness",)
    assert model(bare).missing_needs(Mullins) == ("rubber",)
    assert model(MUSCLE, BladderNeoHookean()).missing_needs(Mullins) == ()


@pytest.mark.parametrize("kind", [k for k in LIBRARY if any(hasattr(MUSCLE, n) for n in k.needs)], ids=name_of)
def test_an_effect_whose_measurement_is_missing_cannot_run_silently(kind):
    bare = Muscle(0.3, 7e-3, 0.35)
    assert model(bare).missing_needs(kind)
    with pytest.raises((ValueError, TypeError)):
        model(bare, kind()).force(LOOP)


def test_every_effect_is_cited():
    everything = model(MUSCLE, *(kind() for kind in LIBRARY))
    assert set(everything.cite()) == {name_of(kind) for kind in LIBRARY}
    assert all(everything.cite().values())


def test_contributions_of_a_sum_add_up():
    given = model(MUSCLE, IdealCylinder(), BladderNeoHookean(), CoulombFriction(), ForceOffset())
    np.testing.assert_allclose(sum(contributions(given, LOOP).values()), given.force(LOOP), rtol=1e-10, atol=1e-10)


# Switches ------------------------------------------------------------------------------------------------------------


def test_one_compiled_function_serves_every_subset():
    kinds = (IdealCylinder, CoulombFriction, SeriesCompliance, Tip, BladderNeoHookean, ForceOffset)
    whole = model(MUSCLE, *(kind() for kind in kinds))

    @jax.jit
    def force(live):
        return eqx.tree_at(lambda m: m.live, whole, live, is_leaf=lambda leaf: leaf is None).force(LOOP)

    for missing in range(len(kinds)):
        rest = model(MUSCLE, *(effect for i, effect in enumerate(whole.effects) if i != missing))
        live = jnp.arange(len(kinds)) != missing
        np.testing.assert_allclose(force(live), rest.force(LOOP), rtol=1e-12, atol=1e-10)


def test_the_signature_of_a_missing_effect_is_the_slope_of_its_switch_at_zero():
    given = model(MUSCLE, IdealCylinder(), Tip(k=1.2))

    def force(switch):
        return eqx.tree_at(lambda m: m.switches, given, jnp.array([switch, 1.0])).force(LOOP)

    expected = 0.2 * EPS * benches.braid_slope(EPS, P)
    np.testing.assert_allclose(jax.jacfwd(force)(0.0), expected, rtol=1e-10, atol=1e-10)


# A user's own --------------------------------------------------------------------------------------------------------


class Squeeze(Felt):
    """The rig squeezes the muscle."""

    P_s: jax.Array = parameter(1e3, "Pa", "pressure that the rig adds", range=(0.0, 1e5))

    def felt(self, muscle, state, pull):
        return state.replace(pressure=state.pressure + self.P_s)


class Rattle(Lost):
    """A loss that the library does not know."""

    A: jax.Array = parameter(2.0, "N", "its size", range=(0.0, 10.0))

    def lose(self, muscle, state, loss):
        return loss.replace(drag=loss.drag + self.A)


def test_a_users_own_effects_count_like_any_other_and_come_last_in_their_stage():
    given = model(MUSCLE, Rattle(), Squeeze(), IdealCylinder(), DeadBand(P_th=1e4), CoulombFriction(f_s=0.0))
    assert given.names == tuple(name_of(k) for k in (DeadBand, Squeeze, IdealCylinder, CoulombFriction, Rattle))
    np.testing.assert_allclose(given.force(LOOP), ideal(EPS, P - 1e4 + 1e3) - 2.0, rtol=1e-12)
    assert [p.name for p in parameters(Squeeze)] == ["P_s"]
