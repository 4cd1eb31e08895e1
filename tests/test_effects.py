"""What every effect of the library must pass; an effect is tested when it is listed.

Each effect stands in the smallest model that gives what it needs. Nothing here knows an effect by name.
"""

import dataclasses
import itertools

import benches
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from benches import HARD, VISIBLE, bench, host_force, hosts
from hidden import physics
from hidden.rig import force_of
from scipy.optimize import least_squares
from unit_exponents import exponents, rescaling

from mckibben_jax.effect import Loss, blend, name_of
from mckibben_jax.effects import LIBRARY
from mckibben_jax.memory import Memory
from mckibben_jax.model import model
from mckibben_jax.muscle import quantities
from mckibben_jax.parameter import parameters

STATE_UNITS = {
    "contraction": "1", "pressure": "Pa", "rate": "1/s", "pressure_rate": "Pa/s", "stretch": "1", "stretch_rate": "1/s",
    "time": "s",
}  # fmt: skip

RATES = {"contraction": "rate", "pressure": "pressure_rate", "stretch": "stretch_rate"}

every_effect = pytest.mark.parametrize("kind", LIBRARY, ids=name_of)
every_memory = pytest.mark.parametrize("kind", [k for k in LIBRARY if issubclass(k, Memory)], ids=name_of)
every_parametrised = pytest.mark.parametrize("kind", [k for k in LIBRARY if parameters(k)], ids=name_of)
every_constant = pytest.mark.parametrize("kind", [k for k in LIBRARY if k.fixed], ids=name_of)
every_felt = pytest.mark.parametrize("kind", [k for k in LIBRARY if k.stage == "felt"], ids=name_of)
every_loss = pytest.mark.parametrize("kind", [k for k in LIBRARY if k.stage == "lost"], ids=name_of)


# What is declared ----------------------------------------------------------------------------------------------------


@every_effect
def test_an_effect_says_what_it_is_where_it_comes_from_and_when_to_suspect_it(kind):
    assert kind.__doc__.endswith(".") or ".\n" in kind.__doc__
    assert kind.source
    assert kind.suspect
    assert "\n" not in kind.suspect


@every_effect
def test_a_parameter_declares_unit_meaning_and_a_range_that_holds_its_values(kind):
    for p in parameters(kind):
        exponents(p.unit)
        assert p.meaning
        assert np.isfinite([p.lower, p.upper]).all()
        assert all(p.lower <= value <= p.upper for value in (p.default, *p.starts))


@every_effect
def test_its_parameters_are_all_that_varies(kind):
    """A number that is no array would be a constant to the compiler, an array not declared unknown to a fit."""
    leaves = jax.tree.leaves(kind())
    assert [leaf.dtype for leaf in leaves] == [np.float64] * len(parameters(kind))
    assert kind(**{p.name: p.upper for p in parameters(kind)}).stage in ("felt", "stored", "lost", "read")


def test_names_are_unique_and_every_need_can_be_met():
    names = [name_of(kind) for kind in LIBRARY]
    given = {thing for kind in LIBRARY for thing in kind.gives} | set(quantities())
    assert len(names) == len(set(names))
    assert {need for kind in LIBRARY for need in kind.needs} <= given


# Switches ------------------------------------------------------------------------------------------------------------


@every_effect
@pytest.mark.parametrize("runs", ["visible", "hard"])
def test_it_is_absent_with_its_switch_at_zero_and_when_not_live(kind, runs):
    it, states = bench(kind), {"visible": VISIBLE, "hard": HARD}[runs]
    without = host_force(hosts(kind), runs)
    dead = eqx.tree_at(lambda m: m.live, it.model, it.model.live.at[it.index].set(False))
    size = 1e-13 * np.abs(without).max()
    np.testing.assert_allclose(it.force(it.vector(switch=0.0), states), without, rtol=1e-12, atol=size)
    np.testing.assert_allclose(it.force(it.vector(), states, dead), without, rtol=1e-12, atol=size)
    assert not it.slopes(it.vector(switch=0.0), states)[..., :-1].any()


@every_effect
def test_it_is_present_with_its_switch_at_one(kind):
    it = bench(kind)
    change = it.force(it.vector()) - host_force(hosts(kind), "visible")
    assert np.abs(change).max() > 0.1


@every_effect
def test_a_switch_in_between_blends_without_and_with(kind):
    it, s = bench(kind), 0.3
    if kind.stage == "felt":
        felt = [_felt(it.model, it.index, switch) for switch in (0.0, 1.0, s)]
        expected = blend(jnp.asarray(s), felt[0], felt[1])
        jax.tree.map(lambda a, b: np.testing.assert_allclose(a, b, rtol=1e-9, atol=1e-12), felt[2], expected)
    else:
        without, with_, between = (it.force(it.vector(switch=switch)) for switch in (0.0, 1.0, s))
        np.testing.assert_allclose(between, without + s * (with_ - without), rtol=1e-9, atol=1e-9)


def _felt(given, index, switch):
    switched = eqx.tree_at(lambda m: m.switches, given, given.switches.at[index].set(switch))
    return switched.felt(jax.tree.map(lambda a: a[4], VISIBLE))


def test_the_order_of_adding_changes_nothing():
    random = np.random.default_rng(0)
    effects = [kind() for kind in LIBRARY]
    shuffled = [effects[i] for i in random.permutation(len(effects))]
    assert eqx.tree_equal(model(benches.MUSCLE, *effects), model(benches.MUSCLE, *shuffled))


# Finite, differentiable, the same however it is computed -----------------------------------------------------------


@every_effect
def test_force_and_slopes_are_finite_in_the_awkward_places(kind):
    it = bench(kind)
    starts = itertools.product(*(p.starts for p in it.declared))
    for values, switch in itertools.product([(), *starts], (0.0, 1.0)):
        assert np.isfinite(it.force(it.vector(*values, switch=switch), HARD)).all()
        assert np.isfinite(it.slopes(it.vector(*values, switch=switch), HARD)).all()


@every_effect
def test_force_and_slopes_are_finite_at_the_ends_of_every_range(kind):
    it = bench(kind)
    for values in itertools.product(*((p.lower, p.upper) for p in it.declared)):
        assert np.isfinite(it.force(it.vector(*values))).all()
        assert np.isfinite(it.slopes(it.vector(*values))).all()


@every_effect
def test_slopes_are_those_of_finite_differences(kind):
    it = bench(kind)
    at = np.array(it.vector(*it.away, switch=0.9))
    slopes = it.slopes(at)
    for i, value in enumerate(at):
        step = np.zeros_like(at)
        step[i] = 1e-5 * abs(value)
        difference = (it.force(at + step) - it.force(at - step)) / (2 * step[i])
        scale = np.abs(slopes[..., i]).max()
        assert scale > 0
        np.testing.assert_allclose(slopes[..., i], difference, rtol=1e-5, atol=1e-5 * scale)


@every_effect
def test_it_knows_rates_just_where_twice_the_speed_changes_what_it_does(kind):
    """The same way in the same time, but for the rates: of what knows none only their signs may count."""
    it, faster = bench(kind), VISIBLE.replace(**{rate: 2 * getattr(VISIBLE, rate) for rate in RATES.values()})
    changes = [it.force(it.vector(), runs) - it.force(it.vector(switch=0.0), runs) for runs in (VISIBLE, faster)]
    moved = np.abs(changes[1] - changes[0]).max()
    assert kind.knows_rates == bool(moved > 1e-6 * np.abs(changes[0]).max()), moved


@every_felt
def test_what_is_felt_moves_at_the_rate_that_it_says(kind):
    """Against differences along a smooth run, where nothing jumps; what is remembered has settled by then.

    At a constant speed: a state has no acceleration, which what depends on the speed would need.
    """
    time = jnp.linspace(0.0, 2.0, 4001)
    felt = bench(kind).model.felt(benches.run(time, 0.05 + 0.05 * time, 3e5 + 1e5 * jnp.cos(2 * jnp.pi * time)))
    settled = slice(2000, -1)
    for name, rate in RATES.items():
        expected = np.gradient(getattr(felt, name), time)[settled]
        close = 1e-4 * np.abs(expected).max() + 1e-9
        np.testing.assert_allclose(getattr(felt, rate)[settled], expected, rtol=0, atol=close)


@every_effect
def test_compiled_and_batched_is_the_same_as_one_run_step_by_step(kind):
    it = bench(kind)
    whole = it.force(it.vector())
    for row in (5, 9):
        beginning = jax.tree.map(lambda a, row=row: a[row, :3], VISIBLE)
        np.testing.assert_allclose(it.model.force(beginning), whole[row, :3], rtol=1e-9, atol=1e-9)


@every_effect
def test_runs_one_behind_another_are_the_same_as_each_for_itself(kind):
    """Where the time goes back a new run begins: a sample that stands between two is later than both."""
    it, half = bench(kind), benches.SAMPLES // 2
    whole, late = it.force(it.vector()), float(VISIBLE.time.max()) + 1.0
    next_one = jax.tree.map(lambda a: jnp.roll(a, 1, axis=0), VISIBLE)
    behind = jax.tree.map(lambda a, b: jnp.concatenate([a[:, :half], b[:, :half]], axis=1), VISIBLE, next_one)
    behind = behind.replace(time=behind.time.at[:, half - 1].set(late))
    shown = it.force(it.vector(), behind)
    np.testing.assert_allclose(shown[:, : half - 1], whole[:, : half - 1], rtol=1e-12, atol=1e-9)
    np.testing.assert_allclose(shown[:, half:], np.roll(whole, 1, axis=0)[:, :half], rtol=1e-12, atol=1e-9)


# Units ---------------------------------------------------------------------------------------------------------------


@every_effect
@pytest.mark.parametrize("seed", [1, 2])
def test_the_force_changes_as_a_newton_when_the_units_change(kind, seed):
    unit = rescaling(np.random.default_rng(seed), tuple(constant.split(maxsplit=1)[1] for constant in kind.fixed))
    assert _misfit_after_rescaling(kind, unit) < 1e-8


@every_constant
def test_a_constant_that_is_declared_fixed_is_there(kind):
    unit = rescaling(np.random.default_rng(1))
    assert _misfit_after_rescaling(kind, unit) > 1e-4


def _misfit_after_rescaling(kind, unit) -> float:
    it = bench(kind)
    scaled = it.force(_vector_in(it, unit), _runs_in(unit), _model_in(it.model, unit))
    expected = it.force(it.vector()) * unit("N")
    return np.abs(scaled - expected).max() / np.abs(expected).max()


def _vector_in(it, unit):
    return it.vector(*(p.default * unit(p.unit) for p in it.declared))


def _runs_in(unit):
    return VISIBLE.replace(**{name: getattr(VISIBLE, name) * unit(of) for name, of in STATE_UNITS.items()})


def _model_in(given, unit):
    muscle = eqx.tree_at(
        lambda m: [getattr(m, name) for name in quantities()],
        given.muscle,
        [getattr(given.muscle, name) * unit(of) for name, (of, _) in quantities().items()],
    )
    effects = tuple(type(e)(**{p.name: p.default * unit(p.unit) for p in parameters(e)}) for e in given.effects)
    return eqx.tree_at(lambda m: (m.muscle, m.effects), given, (muscle, effects))


# Against laws written by others ------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", [k for k in LIBRARY if not k.rival], ids=name_of)
def test_it_is_the_law_that_was_written_independently_in_numpy(kind):
    it = bench(kind)
    known = {field.name for field in dataclasses.fields(physics.Muscle)}
    muscle = physics.Muscle(**{name: float(getattr(benches.MUSCLE, name)) for name in known})
    effects = {name_of(e): {p.name: float(p.default) for p in parameters(e)} for e in it.model.effects}
    given = (np.asarray(a) for a in (VISIBLE.time, VISIBLE.contraction, VISIBLE.pressure))
    runs = zip(*given, strict=True)
    expected = [force_of(physics.Truth(muscle, effects), *run) for run in runs]
    np.testing.assert_allclose(it.force(it.vector()), expected, rtol=1e-8, atol=1e-8)


# Physics -------------------------------------------------------------------------------------------------------------


@every_loss
def test_a_closed_loop_loses_work_and_dry_friction_is_never_negative(kind):
    it = bench(kind)
    for row in (2, 3, 4, 5, 6, 7):
        states = jax.tree.map(lambda a, row=row: a[row], VISIBLE)
        loss = _loss(it.model, states)
        path = benches.MUSCLE.length * states.contraction
        assert jnp.trapezoid(loss.force, path) >= 0
        assert (loss.size >= 0).all()
        assert (jnp.abs(loss.direction) <= 1).all()
    assert (_loss(it.model, jax.tree.map(lambda a: a[1], HARD)).size >= 0).all()


@eqx.filter_jit
def _loss(given, states) -> Loss:
    felt = given.felt(states)
    _, elastic = jax.vmap(given.pull)(felt)
    return given.lost(felt, elastic)


@every_memory
def test_a_memory_does_not_know_how_finely_a_straight_path_is_sampled(kind):
    it = bench(kind)
    coarse = jax.tree.map(lambda a: a[:, ::3], VISIBLE)
    fine = jax.tree.map(lambda a: _subdivided(a, 3)[:, : benches.SAMPLES], coarse)
    fine = fine.replace(rate=jnp.repeat(coarse.rate, 3, axis=1))
    kept = _as_long(coarse)
    seen, expected = it.force(it.vector(), fine)[:, ::3], it.force(it.vector(), kept)[:, : coarse.time.shape[1]]
    np.testing.assert_allclose(seen, expected, rtol=1e-9, atol=1e-9)


def _subdivided(a, times):
    shares = jnp.arange(times) / times
    steps = jnp.concatenate([jnp.diff(a, axis=1), jnp.zeros_like(a[:, :1])], axis=1)
    return (a[..., None] + steps[..., None] * shares).reshape(a.shape[0], -1)


def _as_long(states):
    missing = benches.SAMPLES - states.time.shape[1]
    return jax.tree.map(lambda a: jnp.concatenate([a, jnp.repeat(a[:, -1:], missing, axis=1)], axis=1), states)


# Recovery ------------------------------------------------------------------------------------------------------------


@every_parametrised
def test_it_is_recovered_from_its_own_data_from_where_a_search_starts(kind):
    it = bench(kind)
    truth = np.array(it.away)
    data = it.force(it.vector(*truth))
    starts = list(itertools.product(*(p.starts for p in it.declared)))
    fits = (_fitted(it, data, np.array(start)) for start in starts)
    assert all(not np.allclose(start, truth, rtol=0.05) for start in starts)
    assert any(np.allclose(found, truth, rtol=1e-4) for found in fits)


def _fitted(it, data, start):
    lower, upper = (np.array([getattr(p, end) for p in it.declared]) for end in ("lower", "upper"))
    inside = np.clip(start, lower + 1e-6 * (upper - lower), upper - 1e-6 * (upper - lower))
    scale = np.abs([p.default for p in it.declared])
    found = least_squares(
        lambda x: (it.force(it.vector(*x)) - data).ravel(),
        inside,
        jac=lambda x: it.slopes(it.vector(*x))[..., :-1].reshape(data.size, -1),
        bounds=(lower, upper),
        x_scale=scale,
        xtol=1e-12,
        ftol=1e-14,
        gtol=1e-12,
    )
    return found.x
