"""What data allow of a parameter at an end of its range: against least squares written out, and refits."""

from dataclasses import replace

import numpy as np
import pytest
from exact_instruments import trusting
from small_muscle import LENGTH, ideal, loops, surface, write

from fitting.least_squares import one_sided as module
from fitting.least_squares.evaluate import evaluate
from fitting.least_squares.fit import fit
from fitting.least_squares.one_sided import OneSided, OneSidedSettings, one_sided
from fitting.least_squares.searches import Alone
from fitting.recordings.experiment import read_experiment
from fitting.report.results import fit_result
from fitting.report.text.bounds import allowed_note, allowed_text
from mckibben_jax.effects import CoulombFriction, IdealCylinder, LinearSpring, StrandStretch

K, EA = "linear_spring.K", "strand_stretch.EA"
SIZES = ("muscle.radius", "muscle.braid_angle")


def fitted(folder, effect, missing, **asked):
    muscle = read_experiment(write(folder, loops(missing, points=40)))
    return [muscle], fit([muscle], [IdealCylinder(), CoulombFriction(), effect], starts=2, fix=SIZES, **asked)


@pytest.fixture(scope="module")
def pushing(tmp_path_factory):
    """A muscle that is pushed by a weak spring: of a pulling one there can only be less than so much."""
    return fitted(tmp_path_factory.mktemp("pushing") / "set", LinearSpring(), lambda eps, *_: -2.0 * LENGTH * eps)[1]


@pytest.fixture(scope="module")
def rigid(tmp_path_factory):
    """A muscle whose strands do not stretch, beside a model in which they may."""
    return fitted(tmp_path_factory.mktemp("rigid") / "set", StrandStretch(), lambda *_: 0.0)


def test_of_what_enters_linearly_it_is_the_estimate_without_a_bound_and_its_error(pushing):
    assert pushing.at_bound == (K,)
    s = pushing.samples
    columns = np.stack([-s.contraction * LENGTH, -surface(s.contraction) * s.pressure * np.sign(s.rate)], axis=1)
    without_bound = np.linalg.lstsq(columns, s.measured - ideal(s.contraction, s.pressure), rcond=None)[0][0]
    found = one_sided(pushing)[K]
    assert without_bound < 0
    assert not found.is_least
    assert found.limit == pytest.approx(without_bound + 1.645 * pushing.error(K), rel=0.02)


def test_a_value_beyond_it_fits_worse_by_as_much_and_one_before_it_does_not(rigid):
    experiments, found = rigid
    assert found.at_bound == (EA,)
    known = one_sided(trusting(found))[EA]
    assert known.is_least
    assert known.limit > 5 * one_sided(found)[EA].limit  # instruments that may err hide a stretch
    assert found.layout.entry(EA).lower < known.limit < found.layout.entry(EA).upper
    risen = []
    for times in (0.25, 1.0, 2.0):
        effects = [IdealCylinder(), CoulombFriction(), StrandStretch()]
        held = fit(experiments, effects, starts=1, fix=(*SIZES, EA), start={**found.values, EA: times * known.limit})
        risen.append((held.cost / found.cost - 1) * len(found.samples))
    assert risen[0] > 1.645**2 > risen[2]
    assert risen == sorted(risen, reverse=True)


def test_where_no_slope_is_left_the_sum_of_squares_tells(rigid, monkeypatch):
    with_slopes = one_sided(rigid[1])[EA].limit
    monkeypatch.setattr(module._Way, "_step_back", lambda *_: 0.0)
    assert module._found(rigid[1])[EA].limit == pytest.approx(with_slopes, rel=0.5)


def test_where_the_model_gives_no_number_a_value_is_excluded(rigid, monkeypatch):
    found, plain = rigid[1], Alone.at
    edge = 10 * one_sided(found)[EA].limit

    def at(self, subset, place, problem=None):
        there, ea = plain(self, subset, place, problem), subset.vector(place)[found.layout.names.index(EA)]
        return there if ea > edge else replace_rows(there, np.nan)

    monkeypatch.setattr(Alone, "at", at)
    assert module._found(found)[EA].limit == pytest.approx(edge, rel=0.2)


def replace_rows(at, value):
    return type(at)(at.place, np.full_like(np.asarray(at.rows), value), at.slopes)


def test_data_that_allow_everything_say_so(pushing, monkeypatch):
    monkeypatch.setattr(module, "ONE_SIDED", OneSidedSettings(errors=101.0))
    assert module._found(pushing)[K] == OneSided(is_least=False, limit=None)
    monkeypatch.setitem(module._KNOWN, pushing, {K: OneSided(is_least=False, limit=None)})
    assert "allow every value of the range" in allowed_text(pushing, K)
    assert allowed_note(pushing, K) == "at its bound"


def test_the_first_excluded_value_counts_where_both_ends_are_allowed(rigid, monkeypatch):
    """An effect that vanishes at both ends of its range, as one with a characteristic speed does."""
    monkeypatch.setattr(module._Way, "excess", lambda _, way: 1.0 if 0.2 < way < 0.7 else -1.0)
    entry = rigid[1].layout.entry(EA)
    limit = module._found(rigid[1])[EA].limit
    assert limit == pytest.approx(entry.upper * (entry.lower / entry.upper) ** 0.2, rel=0.1)


def test_data_that_push_against_the_bound_ask_for_a_value_beyond(tmp_path):
    """Such a muscle has no spring that pulls; not even at its bound does the model fit."""
    _, found = fitted(tmp_path / "set", LinearSpring(), lambda eps, *_: -400.0 * LENGTH * eps)
    assert found.at_bound == (K,)
    assert one_sided(found)[K] == OneSided(is_least=False, limit=None, is_beyond=True)
    assert "ask for a value beyond that end" in allowed_text(found, K)


def test_a_saved_model_whose_bound_other_readings_deny_gets_no_limit(tmp_path):
    experiments, there = fitted(tmp_path / "set", LinearSpring(), lambda eps, *_: 400.0 * LENGTH * eps)
    effects, at_bound = [IdealCylinder(), CoulombFriction(), LinearSpring()], {**there.values, K: 0.0}
    denied = evaluate(experiments, effects, at_bound, there.free)
    assert denied.at_bound == (K,)
    assert one_sided(denied) == {}
    assert allowed_text(denied, K) == "Its standard error means nothing."
    assert allowed_note(denied, K) == "at its bound"


def test_no_place_is_looked_at_twice(rigid, monkeypatch):
    """Each look at a large data set takes a tenth of a second; a second valley must not give a second answer."""
    seen, plain = [], Alone.at
    monkeypatch.setattr(
        Alone, "at", lambda self, subset, place: seen.append(place.tobytes()) or plain(self, subset, place)
    )
    module._found(rigid[1])
    assert len(set(seen)) > 0.8 * len(seen)
    assert len(seen) < 150


def test_sizes_that_are_stated_are_left_out(pushing):
    assert one_sided(replace(pushing, at_bound=("muscle.radius",))) == {}


def test_people_and_programs_read_it(pushing, rigid):
    assert allowed_note(pushing, K).startswith("at most ")
    assert allowed_note(rigid[1], EA).startswith("at least ")
    assert allowed_note(pushing, "coulomb_friction.f_s") == ""
    assert "with a confidence of 95 % that its value is at least " in allowed_text(rigid[1], EA)
    told = fit_result(pushing)["parameters"]
    assert told[K]["at_most"] == one_sided(pushing)[K].limit
    assert told[K]["at_least"] is None
    assert told["coulomb_friction.f_s"]["at_most"] is None
