"""What a parameter rests on: a stated size that was off moves it as far as is said."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
from hidden.simulator import Muscle as TrueMuscle
from hidden.simulator import Noise, Truth, dataset, loops, with_baseline, write

from fitting.instruments.sources import ErrorKind, Source
from fitting.least_squares.fit import fit
from fitting.least_squares.rests_on import rests_on, rests_on_instruments
from fitting.recordings.accuracy import Channel
from fitting.recordings.experiment import read_experiment
from fitting.report.text.stated_sizes import by_kind, denied_texts, rests_on_text, rests_on_texts, runs_agree_texts
from mckibben_jax.effects import CoulombFriction, IdealCylinder, PressureGain


@pytest.fixture(scope="module")
def experiment(tmp_path_factory):
    """Loops of an ideal muscle with Coulomb friction, its sizes stated with errors."""
    truth = Truth(TrueMuscle(), with_baseline(f_s=0.012))
    recording = loops(truth, pressures=(1e5, 3e5), speeds=(0.02,), samples=200, noise=Noise(sd=0.5), seed=5)
    folder = tmp_path_factory.mktemp("stated")
    write(dataset(truth, [recording], name="stated", seed=5), folder)
    return read_experiment(folder)


def stated(experiment, shift=0.0):
    """The experiment with a radius that is stated, off by so many of its standard errors."""
    radius = experiment.muscle.radius
    return dataclasses.replace(experiment, priors={"muscle.radius": (radius * (1 + 0.02 * shift), 0.02 * radius)})


def test_a_size_that_is_off_moves_a_parameter_as_far_as_is_said(experiment):
    """Refitted with the radius stated one error off; a gain of the pressure can hardly be told from a radius."""
    effects = [IdealCylinder(), CoulombFriction(), PressureGain()]
    free = ["muscle.radius"]
    here, there = (fit([stated(experiment, shift)], effects, free=free) for shift in (0.0, 0.1))
    for name, on in rests_on(here).items():
        moved = (there.values[name] - here.values[name]) / 0.1 / here.error(name)
        assert np.sqrt(on["muscle.radius"]) == pytest.approx(min(abs(moved), 1.0), rel=0.05, abs=0.02)


def test_beside_a_size_that_a_fit_may_not_deny_instruments_count_as_little_as_readings(experiment):
    """Where a free fit would deny the radius, it rests on what was stated of it, and next to nothing on a gauge."""
    doubtful = dataclasses.replace(stated(experiment), is_confined=True)
    effects = [IdealCylinder(), CoulombFriction(), PressureGain()]
    found = fit([doubtful], effects, free=["muscle.radius"])
    assert found.error("muscle.radius") == pytest.approx(float(found.layout.entry("muscle.radius").prior[1]), rel=0.05)
    of_radius = rests_on(found)["muscle.radius"]["muscle.radius"]
    assert 0.9 < of_radius <= 1.0
    assert sum(rests_on_instruments(found)["muscle.radius"].values()) < 0.1


def test_of_many_causes_the_two_largest_are_named_and_each_kind_once():
    """A drift has a column for each stretch of the recordings: it is one cause, as wide as the widest of them."""
    drifts = [Source(Channel.FORCE, ErrorKind.DRIFT, 1e-4 * n, 1e-4 * n) for n in (1, 2)]
    zero = Source(Channel.PRESSURE, ErrorKind.ZERO, 100.0, 100.0)
    assert dict(by_kind({drifts[0]: 0.2, drifts[1]: 0.3, zero: 0.4})) == {drifts[1]: 0.5, zero: 0.4}
    parts = [(0.5, "this"), (0.2, "that"), (0.2, "a third"), (0.1, "a fourth")]
    assert rests_on_text({"muscle.length": parts}) == (
        "Most of the uncertainty of ⟦muscle.length⟧ comes from this (50 % of it), that (20 % of it) and 2 others."
    )


def test_parameters_that_are_uncertain_for_the_same_causes_share_a_sentence():
    alike = {"tip.k": [(0.5, "this"), (0.2, "that")], "hill.b": [(0.4, "that"), (0.3, "this"), (0.1, "a third")]}
    assert rests_on_text(alike) == (
        "Most of the uncertainty of ⟦tip.k⟧, ⟦hill.b⟧ comes from this (30 % to 50 % of it), that (20 % to 40 % of it) "
        "and one other."
    )


def test_what_rests_on_a_stated_size_is_said(experiment):
    found = fit([stated(experiment)], [IdealCylinder(), CoulombFriction(), PressureGain()], free=["muscle.radius"])
    said = rests_on_texts(found)
    assert any("uncertainty of ⟦pressure_gain.g⟧ comes from ⟦muscle.radius⟧" in text for text in said)
    assert not any(text.startswith("Most of the uncertainty of ⟦muscle.radius⟧") for text in said)


@pytest.mark.parametrize(("copies", "more"), [(4, ""), (6, ", and 2 more sizes that were measured")])
def test_of_many_sizes_that_a_fit_denies_the_farthest_are_named(experiment, copies, more):
    """Three hoses fitted together had nine, with the name of the data set behind each: half a screen."""
    off = [dataclasses.replace(stated(experiment, 10.0 + n), name=f"hose {n}") for n in range(copies)]
    found = fit(off, [IdealCylinder(), CoulombFriction()], free=["muscle.radius"], starts=1)
    assert found.layout.datasets == tuple(one.name for one in off)
    (said,) = denied_texts(found)
    assert said.count("was measured") == 4
    cure = "(--fix muscle.radius would hold them)"
    assert said.endswith(f"errors apart){more}. A model that needs this is wrong somewhere {cure}.")
    farthest = f"muscle.radius@hose {copies - 1}"
    assert said.startswith(f"The fit asks for ⟦{farthest}⟧")


def test_nothing_rests_on_sizes_that_are_held(experiment):
    found = fit([stated(experiment)], [IdealCylinder(), CoulombFriction()], fix=["muscle.radius"])
    assert rests_on(found) == {"coulomb_friction.f_s": {}}
    assert rests_on_texts(found) == []


def test_what_runs_show_of_their_differences_is_said_where_it_is_less(monkeypatch):
    friction = Source(None, ErrorKind.FRICTION_PER_RUN, 0.02, 0.02, presumed=True)
    shown = {(friction, 0): 0.0004, (friction, 1): 0.015}
    monkeypatch.setattr("fitting.report.text.stated_sizes.shown_by_runs", lambda fit: shown)
    two = SimpleNamespace(layout=SimpleNamespace(datasets=("short hose", "long hose"), templates=(1, 2)))
    (said,) = runs_agree_texts(two)
    assert said.startswith("Presumed, for nobody stated it: friction differs by 2 % from run to run.")
    assert "The runs of data set short hose show at most 0.04 %" in said
    (said,) = runs_agree_texts(SimpleNamespace(layout=SimpleNamespace(datasets=("",), templates=(1,))))
    assert "The runs show at most 0.04 %" in said
