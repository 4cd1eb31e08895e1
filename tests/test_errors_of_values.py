"""Standard errors of fitted values know what instruments may err by: closed forms, drawn errors, and what is said."""

import dataclasses

import numpy as np
import pytest
from hidden.simulator import Muscle as TrueMuscle
from hidden.simulator import Noise, Truth, dataset, loops, with_baseline, write

from fitting.instruments.errors import InstrumentErrors
from fitting.instruments.sources import ErrorKind, Source
from fitting.least_squares.evaluate import evaluate
from fitting.least_squares.fit import fit
from fitting.least_squares.rests_on import rests_on_instruments
from fitting.least_squares.uncertainty import covariances, moved_by
from fitting.recordings.accuracy import Accuracy, Channel, ChannelAccuracy
from fitting.recordings.experiment import read_experiment
from fitting.report.results import fit_result
from fitting.report.text.stated_sizes import rests_on_texts
from mckibben_jax.effects import CoulombFriction, ForceOffset, IdealCylinder, PressureGain

RUNS, EACH = 12, 50
RUN = np.repeat(np.arange(RUNS), EACH)
NO_PRIOR = np.zeros((0, 1))


def errors(per_run, shared):
    """One error that each run has for itself and one that all share, each one column."""
    return InstrumentErrors(
        per_run[:, None],
        shared[:, None],
        (Source(Channel.FORCE, ErrorKind.GAIN_PER_RUN, 0.01, 0.01),),
        (Source(Channel.FORCE, ErrorKind.GAIN, 0.02, 0.02),),
        RUN,
    )


def test_a_gain_moves_the_scale_of_the_force_by_itself():
    """Of rows a f - y a gain of 2 % moves a by 2 %; gains of 1 % in each of n equal runs by 1 % over root n."""
    force = np.tile(np.linspace(50.0, 100.0, EACH), RUNS)
    own, shared = moved_by(errors(0.01 * force, 0.02 * force), force[:, None], NO_PRIOR)
    assert shared == pytest.approx(0.02)
    assert np.sqrt(np.sum(own**2)) == pytest.approx(0.01 / np.sqrt(RUNS))


@pytest.mark.parametrize("runs", [RUNS, 4], ids=["runs tell", "loops tell"])
def test_the_robust_error_is_that_of_drawn_errors(runs):
    """A slope fitted to noise beside drawn errors of instruments scatters by its standard error."""
    rng = np.random.default_rng(3)
    run = np.repeat(np.arange(runs), EACH)
    loop = np.arange(len(run)) // 10
    design = np.tile(np.linspace(0.5, 1.0, EACH), runs)[:, None]
    made = dataclasses.replace(errors(2.0 * design[:, 0], 0.5 * design[:, 0] ** 2), run=run)
    slopes, widths = [], []
    for _ in range(400):
        rows = rng.standard_normal(len(run)) + made.per_run[:, 0] * rng.standard_normal(runs)[run]
        rows += made.shared[:, 0] * rng.standard_normal()
        found = float(np.linalg.lstsq(design, rows, rcond=None)[0][0])
        left = rows - design[:, 0] * found
        slopes.append(found)
        cluster = run if runs >= 8 else loop
        widths.append(covariances(design, left, NO_PRIOR, cluster, made)[1][0, 0])
    assert np.sqrt(np.mean(widths)) == pytest.approx(np.std(slopes), rel=0.15)
    trusted = [covariances(design, rows, NO_PRIOR, run)[0][0, 0]]
    assert np.sqrt(np.mean(trusted)) < 0.5 * np.std(slopes)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Loops of an ideal muscle with Coulomb friction and a gauge that reads its gain exactly."""
    truth = Truth(TrueMuscle(), with_baseline(f_s=0.012))
    recording = loops(truth, pressures=(1e5, 3e5), speeds=(0.02,), samples=200, noise=Noise(sd=0.5), seed=5)
    place = tmp_path_factory.mktemp("gauge")
    write(dataset(truth, [recording], name="gauge", seed=5), place)
    return place


def with_accuracy(folder, **stated):
    """The experiment with these accuracies of the pressure gauge."""
    experiment = read_experiment(folder)
    exact = {"zero": 0.0, "gain": 0.0}
    recordings = []
    for recording in experiment.recordings:
        pressure = dataclasses.replace(recording.accuracy.pressure, **exact | stated)
        recordings.append(
            dataclasses.replace(recording, accuracy=dataclasses.replace(recording.accuracy, pressure=pressure))
        )
    return dataclasses.replace(experiment, recordings=tuple(recordings))


RADIUS, BASE = "muscle.radius", [IdealCylinder(), CoulombFriction()]


def test_a_gauge_of_five_percent_leaves_a_radius_unknown_by_half_of_that(folder):
    """The pull goes with pressure and the square of the radius; a gauge that is exact tells the radius."""
    experiment = with_accuracy(folder, gain=0.05)
    found, exact = (fit([each], BASE, free=[RADIUS]) for each in (experiment, with_accuracy(folder)))
    assert found.error(RADIUS) == pytest.approx(0.025 * found.values[RADIUS], rel=0.02)
    assert exact.error(RADIUS) < 0.003 * found.values[RADIUS]
    assert found.values == pytest.approx(exact.values, rel=1e-6, abs=1e-9)  # the curve of least error is the same
    on = rests_on_instruments(found)[RADIUS]
    assert on[Source(Channel.PRESSURE, ErrorKind.GAIN, 0.05, 0.05)] > 0.9
    assert sum(rests_on_instruments(exact)[RADIUS].values()) < 0.9
    again = evaluate([experiment], BASE, found.values, found.free)
    np.testing.assert_allclose(again.robust, found.robust, rtol=1e-3)


def test_it_is_said_which_instrument_a_value_rests_on(folder):
    found = fit([with_accuracy(folder, gain=0.05)], BASE, free=[RADIUS])
    said = [text for text in rests_on_texts(found) if f"⟦{RADIUS}⟧" in text]
    assert len(said) == 1
    assert "the gain of the pressure gauge, known to 5 %" in said[0]
    assert fit_result(found)["parameters"][RADIUS]["rests_on_instruments"]["pressure.gain"] > 0.9


def test_an_error_that_an_effect_of_the_model_stands_for_is_that_effects_alone(folder):
    """Beside a delay of 96 ms a skew of the clock, known to 100 ms, was the same once more: +/- 54 ms instead of 9."""
    experiment = with_accuracy(folder, gain=0.05)
    found, exact = (fit([each], [*BASE, PressureGain()]) for each in (experiment, with_accuracy(folder)))
    assert found.error("pressure_gain.g") == pytest.approx(exact.error("pressure_gain.g"), rel=1e-6)
    assert not [s for s in found.errors.sources if (s.channel, s.kind) == (Channel.PRESSURE, ErrorKind.GAIN)]
    held = fit([experiment], [*BASE, PressureGain()], free=[RADIUS], fix=["pressure_gain.g"])
    assert held.error(RADIUS) == pytest.approx(0.025 * held.values[RADIUS], rel=0.02)  # held, it makes up for nothing
    without = Accuracy(skew=0.1, pressure=ChannelAccuracy(zero=3.0, gain=0.05)).without(
        [("time", "skew"), ("pressure", "gain")]
    )
    assert without == Accuracy(skew=0.0, pressure=ChannelAccuracy(zero=3.0, gain=0.0))


def test_a_fit_in_which_nothing_varies_has_no_errors(folder):
    found = fit([with_accuracy(folder, gain=0.05)], [IdealCylinder(), ForceOffset()], fix=["force_offset.F_off"])
    assert found.free == ()
    assert rests_on_instruments(found) == {}


def test_a_parameter_that_changes_next_to_nothing_has_no_error_and_leaves_the_others_theirs():
    """Squares of what it would have are no numbers any more; nothing is written of that to the terminal."""
    random = np.random.default_rng(0)
    data, rows = random.standard_normal((100, 3)), 1e12 * random.standard_normal(100)
    data[:, 1] *= 1e-146
    others, cluster = [0, 2], np.repeat(np.arange(10), 10)
    plain, robust = covariances(data, rows, np.zeros((0, 3)), cluster)
    assert not np.isfinite(robust[1, 1])
    alone, robust_alone = covariances(data[:, others], rows, np.zeros((0, 2)), cluster)
    np.testing.assert_allclose(np.diag(plain)[others], np.diag(alone), rtol=0.02)  # one degree of freedom fewer
    np.testing.assert_allclose(np.diag(robust)[others], np.diag(robust_alone), rtol=0.05)
