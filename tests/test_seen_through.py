"""The values of a fit where instruments may err: against dense algebra and the truth, and as commands give them."""

import json
from dataclasses import replace

import numpy as np
import pytest
from hidden.simulator import EVERY_NOISE, write
from hidden.study.erring import NOISE, RIGS, TOGETHER
from hidden.study.protocols import PROTOCOLS
from hidden.study.sizes import base_of, hiding
from typed import run

from fitting.least_squares import seen_through
from fitting.least_squares.evaluate import evaluate
from fitting.least_squares.fit import fit
from fitting.least_squares.held_out import rms
from fitting.least_squares.searches import Alone
from fitting.least_squares.unbent import left_beyond
from fitting.least_squares.working_noise import white_noise
from fitting.model_files.model_file import read_model
from fitting.recordings.accuracy import Accuracy, ChannelAccuracy
from fitting.recordings.experiment import read_experiment
from fitting.report.text.likelier import likelier_rows
from mckibben_jax.effects import CoulombFriction, IdealCylinder, LinearSpring

STIFFNESS = 60.0
EFFECTS = (IdealCylinder(), CoulombFriction(), LinearSpring())
NAMES = ("ideal_cylinder", "coulomb_friction", "linear_spring")
K = "linear_spring.K"


def measured(protocol, folder, stiffness=STIFFNESS):
    """A muscle with a weak spring in parallel, read by instruments of a laboratory whose accuracy is stated."""
    truth = hiding(base_of({}), {"linear_spring": {"K": stiffness}})
    data = PROTOCOLS[protocol].data(truth, EVERY_NOISE[NOISE], 7000, RIGS[TOGETHER])
    return write(data, folder, say_accuracy=True)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return measured("rich", tmp_path_factory.mktemp("weak") / "spring")


@pytest.fixture(scope="module")
def experiment(folder):
    return read_experiment(folder)


@pytest.fixture(scope="module")
def found(experiment):
    return fit([experiment], EFFECTS, starts=2)


def covariance_of_readings(found, noise):
    """Of the rows of the measurements in standard deviations, written out: noise, and every error that may be.

    Noise fades along a run; readings of different stretches of some 400 are taken as independent.
    """
    errors, samples = found.errors, found.samples
    whole = errors.shared @ errors.shared.T
    for column in errors.per_run.T:
        whole += np.outer(column, column) * (errors.run[:, None] == errors.run)
    for one in np.unique(samples.run):
        at = np.flatnonzero(samples.run == one)
        for piece in np.array_split(at, -(-len(at) // 400)):
            apart = np.abs(samples.position[piece][:, None] - samples.position[piece])
            fading = sum(share * memory**apart for share, memory in zip(noise.shares, noise.memories, strict=True))
            whole[np.ix_(piece, piece)] += fading + noise.white * np.eye(len(piece))
    return whole


def test_the_values_are_those_of_generalised_least_squares(tmp_path):
    """Where few loops were measured: none of the dense algebra knows how the program makes rows small."""
    read = read_experiment(measured("poor", tmp_path / "poor"))
    # a radius that is stated weighs more beside readings that are said to be noisier than they are
    noisy = [
        replace(r, accuracy=replace(r.accuracy, force=replace(r.accuracy.force, noise=1.5))) for r in read.recordings
    ]
    experiment = replace(read, recordings=tuple(noisy), priors={"muscle.radius": (read.muscle.radius, 1e-5)})
    found = fit([experiment], EFFECTS, starts=2)
    through, sigma, count = found.through, found.samples.sigma, len(found.samples)
    inverse = np.linalg.inv(covariance_of_readings(found, seen_through.noise_of(found)))
    slopes, priors = through.slopes[:count], through.slopes[count:]
    gradient = slopes.T @ inverse @ (through.residual / sigma) + priors.T @ through.prior_rows
    curvature = slopes.T @ inverse @ slopes + priors.T @ priors
    rows = through.residual / sigma
    left = rows @ inverse @ rows / (count - len(through.free))  # beside the noise with which they were sought
    error = np.sqrt(np.diag(np.linalg.inv(slopes.T @ inverse @ slopes / left + priors.T @ priors)))
    assert np.all(np.abs(np.linalg.solve(curvature, gradient)) < 1e-3 * error)
    assert [through.error(name, robust=False) for name in through.free] == pytest.approx(error, rel=1e-3)
    plain = found.slopes[:count].T @ inverse @ (found.residual / sigma) + found.slopes[count:].T @ found.prior_rows
    assert np.max(np.abs(np.linalg.solve(curvature, plain)) / error) > 1.0  # the curve of least error is elsewhere


def test_the_truth_is_told_closer_where_instruments_may_err(found):
    """The curve of least error has 40 % more than the spring, for it follows the gain of the gauge."""
    through = found.through
    assert abs(through.values[K] - STIFFNESS) < 2 * through.error(K)
    assert through.error(K) < 0.3 * found.error(K)
    assert abs(through.values[K] - STIFFNESS) < 0.2 * abs(found.values[K] - STIFFNESS)
    assert found.rmse < through.rmse < 1.6 * found.rmse
    assert through.through is None
    assert through.free == found.free


def test_no_error_is_below_that_beside_noise_that_does_not_fade(found):
    noise = rms(left_beyond(found.residual / found.samples.sigma, found.slopes[: len(found.samples)], found.errors))
    white = seen_through._sought(found, Alone.of(found.problem), white_noise(noise**2))
    known = [(found.through.error(name), white.error(name)) for name in found.free]
    assert all(told >= (1 - 1e-9) * least for told, least in known)
    assert [found.through.values[name] for name in found.free] != [white.values[name] for name in found.free]


def test_a_covariance_is_widened_and_stays_as_correlated():
    widened = seen_through._at_least(np.array([[4.0, 1.0], [1.0, 1.0]]), np.array([[1.0, 0.0], [0.0, 9.0]]))
    np.testing.assert_allclose(widened, [[4.0, 3.0], [3.0, 9.0]])


def test_at_its_values_the_model_leaves_what_it_says(found, experiment):
    again = evaluate([experiment], EFFECTS, found.through.values, found.free)
    assert again.rmse == pytest.approx(found.through.rmse, rel=1e-9)
    np.testing.assert_allclose(again.slopes, found.through.slopes, rtol=1e-6, atol=1e-6 * np.abs(again.slopes).max())


@pytest.fixture(scope="module")
def stiff(tmp_path_factory):
    """The same with a spring ten times as stiff."""
    return measured("rich", tmp_path_factory.mktemp("stiff") / "spring", 10 * STIFFNESS)


def test_a_model_that_lacks_something_has_no_likelier_values(stiff):
    """What it lacks is no error of the instruments."""
    assert fit([read_experiment(stiff)], EFFECTS[:2], starts=2).through is None


def test_values_that_deny_a_stated_size_are_not_the_likelier_ones(experiment, monkeypatch):
    """Seven errors from the radius that was measured: something else is wrong."""
    radius = experiment.muscle.radius
    denied = replace(experiment, priors={"muscle.radius": (1.02 * radius, 0.02 * radius / 7)})
    assert fit([denied], EFFECTS, starts=2).through is None
    monkeypatch.setattr(seen_through, "BELIEVED", 10.0)
    assert fit([denied], EFFECTS, starts=2).through is not None


def test_values_that_ask_too_much_of_an_instrument_are_not_the_likelier_ones(experiment, monkeypatch):
    """One run is pulled by a friction that is ten times as far from that of the others as friction may differ."""
    assert fit([experiment], EFFECTS, starts=2).through is not None
    (recording, *others) = experiment.recordings
    first, *runs = recording.runs
    rubs = replace(first, measured=first.measured - 0.2 * first.branch * rubbing(experiment, first))
    odd = replace(experiment, recordings=(replace(recording, runs=(rubs, *runs)), *others))
    assert fit([odd], EFFECTS, starts=2).through is None
    monkeypatch.setattr(seen_through, "MOST_ASKED", 1e3)
    assert fit([odd], EFFECTS, starts=2).through is not None


def rubbing(experiment, run):
    """The size of a muscle's friction along a run, N."""
    friction, muscle = CoulombFriction(), experiment.muscle
    angle = np.arccos(np.cos(muscle.braid_angle) * (1 - run.contraction))
    surface = 2 * np.pi * muscle.radius * muscle.length * np.sin(2 * muscle.braid_angle) / np.sin(2 * angle)
    return float(friction.f_s) * np.asarray(surface) * run.pressure


def test_an_error_wider_than_the_range_is_unknown(found):
    wide = replace(found, through=replace(found.through, robust=1e30 * np.eye(len(found.free))))
    assert [row[2] for row in likelier_rows(wide)] == ["unknown"] * len(found.free)
    assert "unknown" not in [row[2] for row in likelier_rows(found)]


EXACT = ChannelAccuracy(**dict.fromkeys(
    ("noise", "resolution", "zero", "gain", "zero_per_run", "gain_per_run", "hysteresis", "drift"), 0.0
))  # fmt: skip


def test_exact_instruments_leave_one_set_of_values(experiment):
    accuracy = Accuracy(EXACT, EXACT, replace(EXACT, noise=20.0), 0.0, 0.0)  # so much noise that nothing is missing
    exact = replace(experiment, recordings=tuple(replace(r, accuracy=accuracy) for r in experiment.recordings))
    assert fit([exact], EFFECTS, starts=2).through is None


def test_readings_that_the_model_has_made_up_have_one_set_of_values(found):
    """No instrument has bent them, and the little that is left says nothing of how they err."""
    exact = replace(found, residual=0.01 * found.residual)
    assert seen_through.seen_through_instruments(exact, Alone.of(found.problem)) is None


def test_too_many_errors_are_not_held_in_memory(found, monkeypatch):
    monkeypatch.setattr(seen_through, "MOST_NUMBERS", 100)
    assert seen_through.seen_through_instruments(found, Alone.of(found.problem)) is None


def fitted(folder, tmp_path, *more, effects=NAMES):
    """What a fit prints and writes, and the model that it saves."""
    model, out = tmp_path / "model.toml", tmp_path / "fit.json"
    typed = run("fit", folder, "--effects", *effects, "--save", model, "--json", out, "--starts", 2, *more)
    again = tmp_path / "again.json"
    run("compare", folder, "--model", model, "--json", again)
    return " ".join(typed.stdout.split()), json.loads(out.read_text()), json.loads(again.read_text())


def test_both_values_are_printed_and_the_curve_of_least_error_is_saved(folder, found, tmp_path):
    said, told, again = fitted(folder, tmp_path)
    assert "LIKELIER The curve of least error (1.57 N) follows the errors of the instruments" in said
    assert "with them the model errs by 2.03 N" in said
    stiffness = told["parameters"][K]
    assert stiffness["value"] == pytest.approx(found.values[K], rel=1e-4)
    assert stiffness["through_instruments"]["value"] == pytest.approx(found.through.values[K], rel=1e-3)
    assert stiffness["through_instruments"]["robust_error"] == pytest.approx(found.through.error(K), rel=0.01)
    assert told["rmse_through_instruments_N"] == pytest.approx(found.through.rmse, rel=1e-4)
    assert again["rmse_N"] == pytest.approx(told["rmse_N"], rel=1e-4)


def test_the_likelier_values_are_saved_where_they_are_asked_for(folder, tmp_path):
    said, told, again = fitted(folder, tmp_path, "--through-instruments")
    assert "model.toml, with the values that are likelier where instruments err" in said
    assert again["rmse_N"] == pytest.approx(told["rmse_through_instruments_N"], rel=1e-4)
    assert again["fit"]["parameters"][K]["value"] == pytest.approx(
        told["parameters"][K]["through_instruments"]["value"], rel=1e-4
    )


def test_each_of_many_muscles_is_saved_as_asked(folder, tmp_path):
    def stiffness(*more):
        run("fit", "--each", folder, "--effects", *NAMES, "--starts", 2, "--out", tmp_path / "each", *more)
        return read_model(next((tmp_path / "each").glob("*.toml"))).values[K]

    found = stiffness()
    told = json.loads(next((tmp_path / "each").glob("*.json")).read_text())["result"]["parameters"][K]
    assert found == pytest.approx(told["value"], rel=1e-4)
    # another order: what is there does not count
    assert stiffness("--through-instruments") == pytest.approx(told["through_instruments"]["value"], rel=1e-4)


def test_it_is_said_that_there_are_none(stiff, tmp_path):
    said, told, again = fitted(stiff, tmp_path, "--through-instruments", effects=NAMES[:2])
    assert "LIKELIER" not in said
    assert "These are the values of the curve of least error" in said
    assert told["rmse_through_instruments_N"] is None
    assert all(each["through_instruments"] is None for each in told["parameters"].values())
    assert again["rmse_N"] == pytest.approx(told["rmse_N"], rel=1e-4)


def test_the_page_has_both(folder, tmp_path):
    page = tmp_path / "fit.html"
    run("fit", folder, "--effects", *NAMES, "--no-save", "--html", page, "--starts", 2)
    text = page.read_text()
    assert "The likelier values, where instruments may err" in text
