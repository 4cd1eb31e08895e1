"""Every subset of effects by one compiled function: against the model evaluated, and fits from several starts."""

from dataclasses import replace

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from small_muscle import loops, write

from fitting.diagnosis.examine import Examiner
from fitting.diagnosis.lay_out import universe
from fitting.diagnosis.signatures import signatures
from fitting.least_squares.fit import fit
from fitting.least_squares.search import rows_and_slopes
from fitting.recordings.experiment import read_experiment
from fitting.report.text.reasons import why_text
from mckibben_jax.effects import (
    BladderNeoHookean,
    CoulombFriction,
    EndStop,
    ForceGain,
    ForceOffset,
    HertzFriction,
    IdealCylinder,
    TextileFriction,
    Tip,
    TipPressure,
)

BASE = (IdealCylinder(), CoulombFriction())
CANDIDATES = (Tip(), TipPressure(), EndStop(), ForceOffset(), BladderNeoHookean(), TextileFriction())


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """A stop at a contraction of 0.155: 900 N/mm a metre beyond it."""
    stop = lambda eps, pressure, sign: 6e3 * np.maximum(eps - 0.155, 0)  # noqa: E731
    return read_experiment(write(tmp_path_factory.mktemp("stop"), loops(stop, points=30, repeats=2)))


@pytest.fixture(scope="module")
def world(recorded):
    return universe([recorded], BASE, CANDIDATES)


@pytest.fixture(scope="module")
def base(world):
    return world.fit(world.with_added(()), world.start)


def cost_of(found):
    """Sum of squares over all rows, priors included."""
    priors = np.asarray(found.problem.prior_rows(jnp.asarray(found.vector)))
    return float(np.sum((found.residual / found.samples.sigma) ** 2) + np.sum(priors**2))


def test_a_subset_is_fitted_as_if_it_were_alone(world, base, recorded):
    """Against the fit that knows no other effect: the cost, and the values."""
    alone = fit([recorded], BASE, starts=2)
    assert base.cost == pytest.approx(cost_of(alone), rel=1e-4)
    own = world.layout.at(["coulomb_friction.f_s"])[0]
    assert base.vector[own] == pytest.approx(alone.values["coulomb_friction.f_s"], rel=1e-2)
    larger = world.fit(world.with_added(["end_stop"]), base.vector, ["end_stop"])
    assert larger.cost == pytest.approx(cost_of(fit([recorded], (*BASE, EndStop()), starts=4)), rel=1e-3)


def test_the_best_of_several_starts_is_kept(world, base):
    """A stop is looked for at several contractions; from most of them the search ends elsewhere."""
    names = world.layout.of_effect("end_stop")
    ended = []
    for shape in world.shapes("end_stop"):
        vector = base.vector.copy()
        vector[world.layout.at(names)] = [shape[name] for name in names]
        ended.append(world.fit(world.with_added(["end_stop"]), vector).cost)
    best = world.fit(world.with_added(["end_stop"]), base.vector, ["end_stop"])
    assert max(ended) > 1.05 * min(ended)  # or this shows nothing
    assert best.cost <= 1.001 * min(ended[1:])


@pytest.mark.parametrize("name", ["end_stop", "tip_pressure"])
def test_the_best_of_several_starts_is_searched_to_the_end(world, base, name):
    """Another search from there finds nothing more; those that ended sooner, at a step worth 30 %, left something."""
    effects, world = world.with_added([name]), replace(world, settings=replace(world.settings, screened=0.3))
    found = world.fit(effects, base.vector, [name], decide=False)
    further = world.fit(effects, found.vector, decide=False)
    rough = world.fit(effects, base.vector, [name], decide=False, enough=world.settings.screened)
    assert further.cost == pytest.approx(found.cost, rel=1e-9)
    assert rough.cost > found.cost * (1 + 1e-7)


def test_signatures_are_slopes_of_the_rows_along_a_switch(world, base):
    """Against a small step of the switch; a rival goes out as far as the new one comes in."""
    wanted = [("tip", {}), ("force_offset", {}), ("textile_friction", {})]
    found = signatures(world, base, wanted)
    step, rows_at = 1e-5, eqx.filter_jit(lambda given, *point: given.data_rows(*point))

    def rows(switched):
        switches = world.switches(base.effects) + sum(
            sign * step * world.switches([name]) for name, sign in switched.items()
        )
        return np.asarray(rows_at(world.problem, jnp.asarray(base.vector), jnp.asarray(switches)))[world.real]

    zero = rows({})
    for column, switched in zip(
        found.T, ({"tip": 1}, {"force_offset": 1}, {"textile_friction": 1, "coulomb_friction": -1}), strict=True
    ):
        np.testing.assert_allclose(column, (rows(switched) - zero) / step, rtol=1e-3, atol=1e-3 * np.abs(column).max())


@pytest.mark.parametrize("more", [(), ("bladder_neo_hookean",), ("bladder_neo_hookean", "tip")])
def test_slopes_two_at_a_time_are_those_of_all_together(world, base, more):
    """An odd and an even number of what varies; behind it stands what only fills the standard size."""
    effects = world.with_added(more)
    subset = world.subset(effects, world.layout.at(world.free(effects)), base.vector)
    place, count = subset.place(subset.full), int(subset.varying)
    rows, slopes = rows_and_slopes(world.problem, subset, place)
    alike, together = rows_and_slopes(world.problem, replace(subset, varying=None, beside=None), place)
    np.testing.assert_allclose(rows, alike, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(slopes, together, rtol=1e-9, atol=1e-9 * float(np.abs(together).max()))
    assert np.any(np.asarray(slopes)[:, :count] != 0, axis=0).all()
    assert not np.asarray(slopes)[:, count:].any()


def test_slopes_are_left_undone_where_the_cost_is_not_below_what_was_asked(world, base):
    effects = world.with_added(["bladder_neo_hookean", "tip"])
    subset = world.subset(effects, world.layout.at(world.free(effects)), base.vector)
    place, seen = subset.place(subset.full), world.seen_through(np.ones((len(world.samples), 1))).through
    rows, slopes = rows_and_slopes(world.problem, subset, place, seen)
    cost = 0.5 * float(rows @ rows)
    for below in (1.001 * cost, np.inf):
        same, whole = rows_and_slopes(world.problem, subset, place, seen, jnp.asarray(below))
        np.testing.assert_array_equal(same, rows)
        np.testing.assert_array_equal(whole, slopes)
    same, part = rows_and_slopes(world.problem, subset, place, seen, jnp.asarray(0.999 * cost))
    np.testing.assert_array_equal(same, rows)
    assert not np.asarray(part)[:, 2:].any()
    assert np.asarray(slopes)[:, 2].any()


def test_what_a_test_rests_on_is_that_of_its_own_set(world, base):
    """Also after another set was tested."""
    larger = world.fit(world.with_added(["end_stop"]), base.vector, ["end_stop"])
    examiner = Examiner(world, base, seed=0)
    for each in (base, larger, base):
        ground = examiner.ground(each)
        left = each.slopes - ground.explained @ (ground.explained.T @ each.slopes)
        assert np.abs(left).max() < 1e-6 * np.abs(each.slopes).max()
        assert ground.noise is examiner.noise(each)
        assert ground.errors is examiner.errors(each)


def test_what_was_only_looked_at_is_fitted_to_the_end_before_it_is_tested(world, base):
    effects = world.with_added(["tip", "end_stop"])
    whole = world.fit(effects, base.vector, decide=False)
    sooner = world.fit(effects, base.vector, decide=False, enough=10.0)
    assert sooner.cost > 1.0005 * whole.cost  # or this shows nothing
    assert not sooner.is_decided
    assert world.decided(sooner).cost == pytest.approx(whole.cost, rel=1e-4)


def test_sets_hold_together(recorded, world):
    """One of a family; what an effect needs is stated."""
    assert world.with_added(["textile_friction"]) == {"ideal_cylinder", "textile_friction"}
    assert world.possible(world.with_added(["tip", "end_stop"]), ["tip", "end_stop"])
    assert not world.possible(world.with_added(["tip", "tip_pressure"]), ["tip", "tip_pressure"])
    assert "needs" in why_text(universe([recorded], BASE, [HertzFriction()]).untestable["hertz_friction"])


def test_what_is_read_off_a_load_cell_needs_one(recorded, world):
    """Its gain and its zero; any other effect may be seen in a position as well."""
    recording = recorded.recordings[0]
    motion = replace(recorded, recordings=(replace(recording, test="quick release"),))
    told = universe([motion], BASE, (ForceOffset(), ForceGain(), BladderNeoHookean(), EndStop())).untestable
    words = {name: why_text(why) for name, why in told.items()}
    assert words == dict.fromkeys(("force_offset", "force_gain"), "cannot be tested: no force was measured")
    assert "force_offset" not in world.untestable


def test_runs_left_out_are_foretold_by_a_fit_to_the_others(world, base):
    """By refitting each time, against one step from the fit to all: alike, and farther off than what was fitted."""
    group = world.samples.run
    refitted, glance = (world.left_out(base, group, glance) for glance in (False, True))
    rms = lambda rows: float(np.sqrt(np.mean(rows**2)))  # noqa: E731
    assert rms(refitted - base.rows) > 1e-3 * rms(base.rows)
    assert rms(refitted) > rms(base.rows)
    assert rms(refitted - glance) < 0.2 * rms(refitted - base.rows)


def test_instruments_are_allowed_for_where_runs_are_left_out(world, base):
    """A zero in every run and a gain of all: the others alone say what the parameters and these errors are.

    Against generalised least squares in numpy, one step from the fit; a fit that trusts every reading ends elsewhere.
    """
    group = world.samples.run
    gain = 0.1 * world.samples.measured / world.samples.sigma
    errors = np.column_stack([30.0 * (group[:, None] == np.unique(group)), gain])
    seen = world.seen_through(errors)
    fit = seen.settled(base.effects, base.vector)
    expected, whitened = fit.rows.copy(), fit.rows.copy()
    for run in np.unique(group):
        others = group != run
        cause = np.linalg.inv(np.eye(others.sum()) + errors[others] @ errors[others].T)
        slopes = fit.slopes[others].T @ cause
        curvature = slopes @ fit.slopes[others] + fit.prior_slopes.T @ fit.prior_slopes
        pull = slopes @ fit.rows[others] + fit.prior_slopes.T @ fit.prior_rows
        free = [name not in fit.at_bound for name in fit.free]
        step = np.linalg.lstsq(curvature[np.ix_(free, free)], pull[free], rcond=1e-12)[0]
        at_others = fit.rows - fit.slopes[:, free] @ step
        expected[~others], whitened[~others] = at_others[~others], seen.as_seen(at_others)[~others]
    rms = lambda rows: float(np.sqrt(np.mean(rows**2)))  # noqa: E731
    moved = rms(expected - fit.rows)
    assert rms(seen.left_out(fit, group) - expected) < 0.2 * moved
    assert rms(world.left_out(fit, group) - expected) > 0.5 * moved
    apart = rms(seen.as_seen(expected) - whitened)  # where every fit has errors of its own
    assert rms(seen.left_out(fit, group, whitened=seen.as_seen) - whitened) < 0.2 * apart


# ----------------------------------------------------------------------- what stands at the end of its range, and why


@pytest.fixture(scope="module")
def lifted(tmp_path_factory):
    """A load cell that reads 700 N too much, where its zero may be off by 500 N."""
    rows = loops(lambda eps, *_: 700.0 + 0.0 * eps, points=30, repeats=2)
    return read_experiment(write(tmp_path_factory.mktemp("lifted"), rows))


@pytest.fixture(scope="module")
def softened(tmp_path_factory):
    """A spring that pushes: no rubber pulls less than none."""
    return read_experiment(
        write(tmp_path_factory.mktemp("soft"), loops(lambda eps, *_: -2e3 * eps, points=30, repeats=2))
    )


@pytest.mark.parametrize(
    ("data", "effect", "parameter", "held"),
    [
        ("lifted", ForceOffset(), "force_offset.F_off", True),
        ("lifted", TipPressure(), "tip_pressure.P_k", False),
        ("softened", BladderNeoHookean(), "bladder_neo_hookean.G", False),
        ("softened", Tip(), "tip.k", True),
    ],
)
def test_data_hold_a_parameter_at_its_end_or_would_as_soon_have_it_inside(data, effect, parameter, held, request):
    """Against a fit of the library's own, with the parameter a tenth of its range inside and all others free."""
    experiment = request.getfixturevalue(data)
    world = universe([experiment], BASE, CANDIDATES)
    start = world.fit(world.with_added(()), world.start).vector
    name = parameter.split(".")[0]
    seen = world.fit(world.with_added([name]), start, [name], decide=False)
    assert parameter in seen.at_bound
    asked = world.decided(seen)
    assert (parameter in asked.at_bound) == held

    entry, values = world.layout.entry(parameter), dict(zip(world.layout.names, seen.vector.tolist(), strict=True))
    upper = entry.upper - values[parameter] < values[parameter] - entry.lower
    inside = _at_place(entry, 0.9 if upper else 0.1)
    effects = [_with_value(effect, parameter, inside), *BASE]
    others = {known: value for known, value in values.items() if known != parameter}
    there = fit([experiment], effects, fix=[parameter], start=others, starts=1)
    rise, scatter = cost_of(there) - seen.cost, float(np.mean(seen.rows**2))
    assert rise > 20 * scatter if held else rise < 2 * scatter


def _at_place(entry, place):
    """A value at so much of a range, counted as a search counts it."""
    if entry.logarithmic:
        return entry.lower * (entry.upper / entry.lower) ** place
    return entry.lower + place * (entry.upper - entry.lower)


def _with_value(effect, parameter, value):
    return replace(effect, **{parameter.split(".")[1]: jnp.asarray(value)})
