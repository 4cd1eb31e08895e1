"""A braid behind a spring: it sticks where its path turns. Against a simulator that solves for where it slides."""

from types import SimpleNamespace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hidden.rig import force_of, polyline
from hidden.simulator import Muscle, Truth, dataset, static, with_baseline, write

from fitting.least_squares.evaluate import evaluate
from fitting.recordings.experiment import read_experiment
from fitting.report.text.fit import still_texts
from mckibben_jax import Muscle as LibraryMuscle
from mckibben_jax import model
from mckibben_jax.effects import (
    ConstantFriction,
    CoulombFriction,
    IdealCylinder,
    Presliding,
    SeriesCompliance,
    Tip,
    ViscousDamping,
)
from mckibben_jax.laws.sticking import played, share_felt
from mckibben_jax.state import State

MUSCLE = Muscle()
SIZES = LibraryMuscle(MUSCLE.length, MUSCLE.radius, MUSCLE.braid_angle)
F_S, F_C = 0.012, 5.0
DRY = IdealCylinder(), CoulombFriction(F_S), ConstantFriction(F_C)


def course(test, count=200):
    """Time, contraction and pressure of one run, on a fine grid."""
    if test == "isometric":
        time, pressure = polyline([0.2e5, 4e5, 0.5e5, 4e5], 1e5, count, 0.02)
        return time, np.full_like(pressure, 0.1), pressure
    time, contraction = polyline([0.0, 0.2, 0.05, 0.2], 0.02, count, 0.02)
    return time, contraction, np.full_like(time, 3e5)


def states(time, contraction, pressure):
    """The same as states of a run."""
    still = jnp.zeros_like(time)
    rates = {"rate": np.gradient(contraction, time), "pressure_rate": np.gradient(pressure, time)}
    return State(contraction, pressure, time=time, stretch=still, stretch_rate=still, **rates)


@pytest.mark.parametrize("test", ["isometric", "loop"])
@pytest.mark.parametrize(("k_s", "k"), [(3e4, 1.0), (6e4, 1.0), (2e5, 1.0), (3e4, 1.3)])
def test_the_force_is_that_of_a_simulator_that_finds_both_ends_of_the_band(test, k_s, k):
    along = course(test)
    hidden = {"constant_friction": {"F_c": F_C}, "series_compliance": {"k_s": k_s}, "tip": {"k": k}}
    truth = Truth(MUSCLE, with_baseline(f_s=F_S, **hidden))
    force = model(SIZES, *DRY, SeriesCompliance(k_s), Tip(k)).force(states(*along))
    expected = force_of(truth, *along)
    assert np.ptp(expected) > 250
    np.testing.assert_allclose(force, expected, atol=0.5)


@pytest.mark.parametrize("branch", ["contraction", "elongation"])
def test_points_of_a_map_are_those_of_the_simulator(tmp_path, branch):
    """Each is reached along its branch, so that friction has come whole, and the spring's share of it is felt."""
    hidden = {"constant_friction": {"F_c": F_C}, "series_compliance": {"k_s": 3e4}}
    truth = Truth(MUSCLE, with_baseline(f_s=F_S, **hidden))
    points = static(truth, contractions=(0.02, 0.08, 0.15), pressures=(1e5, 3e5), branches=(branch,), seed=1)
    write(dataset(truth, [points], seed=1), tmp_path)
    effects = [*DRY, SeriesCompliance(3e4)]
    found = evaluate([read_experiment(tmp_path)], effects, {}, ())
    exact = dict(zip(found.samples.row - found.samples.row.min(), found.samples.measured + found.residual, strict=True))
    np.testing.assert_allclose([exact[row] for row in sorted(exact)], points.clean, atol=1.5)


def test_a_held_muscle_pulls_the_same_while_its_braid_sticks():
    """From the turn of the pressure on, until the frictionless pull has fallen by twice the friction that is felt."""
    time, contraction, pressure = course("isometric")
    given, free = (model(SIZES, *effects, SeriesCompliance(6e4)) for effects in (DRY, DRY[:1]))
    force, pull = (np.asarray(one.force(states(time, contraction, pressure))) for one in (given, free))
    top = int(np.argmax(pressure[: len(pressure) // 2]))
    friction = pull[top] - force[top]
    assert 5 < friction < 60
    stuck = (np.arange(len(time)) > top) & (pull > pull[top] - 1.8 * friction) & (np.arange(len(time)) < 2 * top)
    assert np.count_nonzero(stuck) > 50
    np.testing.assert_allclose(force[stuck], force[top], atol=0.01 * friction)
    slid = top + int(np.argmax(pull[top:] < pull[top] - 3 * friction))
    assert force[slid] - pull[slid] == pytest.approx(friction, rel=0.3)


def test_behind_a_rigid_spring_friction_changes_sides_at_once():
    along = states(*course("loop"))
    rigid, none = (model(SIZES, *DRY, *more).force(along) for more in ([SeriesCompliance(1e8)], []))
    inside = np.abs(np.asarray(along.rate)) > 0.015
    np.testing.assert_allclose(rigid[inside], none[inside], atol=0.1)


def test_a_new_run_begins_anew():
    """Runs lie one behind another in one array, and a new one begins where the time goes back."""
    along = states(*course("isometric"))
    given = model(SIZES, *DRY, SeriesCompliance(6e4))
    twice = jax.tree.map(lambda x: jnp.concatenate([x, x]), along)
    once = given.force(along)
    np.testing.assert_allclose(given.force(twice), np.concatenate([once, once]), atol=1e-9)


def test_friction_that_gives_way_itself_is_later_still():
    along = states(*course("isometric"))
    stiff, soft, without = (
        np.asarray(model(SIZES, *DRY, *more).force(along))
        for more in ([SeriesCompliance(6e4)], [SeriesCompliance(6e4), Presliding(1e-3)], [Presliding(1e-3)])
    )
    falling = np.asarray(along.pressure_rate) < 0
    assert np.all(soft[falling] <= stiff[falling] + 1e-9)
    assert np.max((stiff - soft)[falling]) > 1
    assert np.max(np.abs(soft - without)) > 1


def test_a_drag_is_no_friction_that_sticks():
    along = states(*course("loop"))
    dry, viscous = (
        model(SIZES, *DRY, *more, SeriesCompliance(6e4)).force(along) for more in ([], [ViscousDamping(50.0)])
    )
    model_without = model(SIZES, IdealCylinder(), SeriesCompliance(6e4))
    dragged = model_without.add(ViscousDamping(50.0)).force(along)
    np.testing.assert_allclose(dry - viscous, model_without.force(along) - dragged, atol=1e-9)


@pytest.mark.parametrize("name", ["radius", "k_s"])
def test_slopes_are_those_of_differences(name):
    along = states(*course("isometric", 60))

    def force(change):
        sizes = LibraryMuscle(MUSCLE.length, MUSCLE.radius * (1 + change * (name == "radius")), MUSCLE.braid_angle)
        return model(sizes, *DRY, SeriesCompliance(3e4 * (1 + change * (name == "k_s")))).force(along)

    slope = jax.jvp(force, (0.0,), (1.0,))[1]
    difference = (force(1e-5) - force(-1e-5)) / 2e-5
    assert np.sqrt(np.mean((slope - difference) ** 2)) < 2e-3 * np.sqrt(np.mean(difference**2))


def test_a_point_of_which_nobody_knows_the_direction_has_no_friction():
    still = jnp.zeros(1)
    point = State(
        still + 0.1, still + 3e5, time=still, rate=still, pressure_rate=still, stretch=still, stretch_rate=still
    )
    dry, free = (model(SIZES, *effects, SeriesCompliance(3e4)).force(point) for effects in (DRY, DRY[:1]))
    np.testing.assert_allclose(dry, free, rtol=1e-12)


@pytest.mark.parametrize(("slope", "share"), [(0.0, 1.0), (-1000.0, 0.5), (-3000.0, 0.25), (500.0, 1.0)])
def test_the_share_of_friction_that_is_felt(slope, share):
    assert float(share_felt(1000.0, slope)) == pytest.approx(share)


def test_play_follows_within_its_width():
    """Prandtl's play by hand: up by 3 within 1, back by 1.5, and on by 5."""
    drive = jnp.array([0.0, 1.0, 3.0, 2.0, 1.5, 6.5])
    found = played(drive, jnp.ones(6), jnp.zeros(6), jnp.arange(6.0))
    np.testing.assert_allclose(found, [0.0, 1.0, 1.0, 0.0, -0.5, 1.0])


def test_slopes_are_finite_at_rest_and_at_zero_pressure():
    still = jnp.zeros(20)
    rest = State(
        still, still, time=jnp.arange(20.0), rate=still, pressure_rate=still, stretch=still, stretch_rate=still
    )
    given = model(SIZES, *DRY, SeriesCompliance(6e4))
    slopes = jax.jacfwd(lambda k: model(SIZES, *DRY, SeriesCompliance(k)).force(rest))(6e4)
    assert np.all(np.isfinite(given.force(rest)))
    assert np.all(np.isfinite(slopes))


@pytest.mark.parametrize(
    ("test", "more", "said"),
    [("isometric", (), True), ("loop", (), False), ("isometric", (SeriesCompliance(),), False)],
)
def test_why_the_friction_of_a_held_muscle_is_not_seen(test, more, said):
    fit = SimpleNamespace(
        held=("coulomb_friction.f_s",),
        layout=SimpleNamespace(templates=[SimpleNamespace(effects=[IdealCylinder(), CoulombFriction(), *more])]),
        problem=SimpleNamespace(blocks=[SimpleNamespace(test=test)]),
    )
    texts = still_texts(fit)
    assert len(texts) == said
    assert all("does not slide" in text and "⟦series_compliance⟧" in text for text in texts)
