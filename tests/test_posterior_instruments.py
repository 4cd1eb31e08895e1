"""The posterior knows what instruments may err by: the density against scipy, and what becomes of a gauge's gain."""

from argparse import Namespace
from dataclasses import replace

import numpy as np
import pytest
from hidden.simulator import EVERY_NOISE, Truth, dataset, with_baseline, write
from hidden.simulator import Muscle as TrueMuscle
from hidden.simulator import Noise as TrueNoise
from hidden.simulator import loops as hidden_loops
from hidden.study.erring import NOISE, RIGS, TOGETHER
from hidden.study.protocols import PROTOCOLS
from hidden.study.sizes import base_of, hiding
from scipy import stats

from fitting.instruments.errors import InstrumentErrors
from fitting.instruments.sources import ErrorKind, Source
from fitting.least_squares.fit import fit, fit_problem
from fitting.least_squares.held_out import rms
from fitting.least_squares.unbent import left_beyond
from fitting.posterior.evaluation import in_batches
from fitting.posterior.explicit import LIKELIEST, Explicit
from fitting.posterior.instruments import Instruments
from fitting.posterior.noise import noise_of_rows
from fitting.posterior.quick import quick_look
from fitting.posterior.robust import most_asked, robust_share
from fitting.posterior.setup import set_up
from fitting.problem.residuals import problem
from fitting.problem.unknowns import unknowns
from fitting.problem.varying import Varying
from fitting.recordings.accuracy import Channel
from fitting.recordings.experiment import read_experiment
from fitting.report.text.search import search_text
from mckibben_jax.effect import name_of
from mckibben_jax.effects import LIBRARY, CoulombFriction, IdealCylinder, PressureGain
from mckibben_jax.model import with_effects

COUNTS = (25, 18, 11)  # readings of each run; the last run is of a second recording
RUN = np.repeat(np.arange(3), COUNTS)


def some_rows(random):
    """Rows of three runs with gaps, in two recordings, and the errors of instruments in them."""
    position = np.concatenate([np.cumsum(random.integers(1, 4, count)) for count in COUNTS])
    samples = Namespace(recording=np.array([0, 0, 1])[RUN], run=RUN, position=position)
    source = lambda kind: Source(Channel.FORCE, kind, 1.0, 1.0)  # noqa: E731
    own = (source(ErrorKind.ZERO_PER_RUN), source(ErrorKind.GAIN_PER_RUN))
    shared = (source(ErrorKind.ZERO), source(ErrorKind.GAIN), source(ErrorKind.DRIFT))
    columns = 3 * random.standard_normal((sum(COUNTS), 5))
    return samples, InstrumentErrors(columns[:, :2], columns[:, 2:], own, shared, RUN)


@pytest.mark.parametrize(
    "parts",
    [(("size",), ("size",)), (("size", "remembered", "memory", "run"), ("size",))],
    ids=["white", "remembered in one recording"],
)
def test_the_density_is_that_of_the_whole_covariance(parts):
    """Noise beside errors of instruments, against scipy with the covariance C + U U'."""
    random = np.random.default_rng(0)
    samples, errors = some_rows(random)
    noise = noise_of_rows(samples, parts, [1.0, 2.0])
    place = np.full(len(noise.lower), 0.5)
    place[: len(parts[0])] = [0.55, 0.6, 0.4, 0.3][: len(parts[0])]
    size, remembered, memory, shared = (np.asarray(each)[samples.recording] for each in noise._by_recording(place))
    apart = np.abs(samples.position[:, None] - samples.position[None, :])
    fades = remembered * np.exp(-apart / memory) + (1 - remembered) * np.eye(len(RUN))
    alone = size[:, None] * size * (RUN[:, None] == RUN) * (shared + (1 - shared) * fades)
    law = stats.multivariate_normal(np.zeros(len(RUN)), alone + errors.columns @ errors.columns.T)
    instruments = Instruments.of(errors, samples, noise, place)
    rows = law.rvs(3, random_state=random)
    ours = [
        float(np.sum(noise.terms(row, place)) + instruments.log_weight(noise, row, place))
        - 0.5 * len(RUN) * np.log(2 * np.pi)
        for row in rows
    ]
    np.testing.assert_allclose(ours, law.logpdf(rows), rtol=1e-9)


def test_what_can_hardly_be_told_is_left_out():
    """A column twice is one direction with twice the variance; errors far below the noise are none."""
    samples, errors = some_rows(np.random.default_rng(1))
    noise = noise_of_rows(samples, (("size",), ("size",)), [1.0, 1.0])
    place = np.full(2, 0.5)
    twice = errors.changed(errors.per_run[:, [0, 0]], errors.shared)
    assert Instruments.of(twice, samples, noise, place).own.shape[-1] == 1
    assert Instruments.of(errors, samples, noise, place).own.shape[-1] == 2
    assert Instruments.of(errors.changed(1e-4 * errors.per_run, 1e-4 * errors.shared), samples, noise, place) is None


@pytest.fixture(scope="module")
def experiment(tmp_path_factory):
    """Loops of an ideal muscle with Coulomb friction, read with an exact gauge."""
    truth = Truth(TrueMuscle(), with_baseline(f_s=0.012))
    recording = hidden_loops(truth, pressures=(1e5, 3e5), speeds=(0.02,), samples=200, noise=TrueNoise(sd=0.5), seed=5)
    folder = tmp_path_factory.mktemp("exact")
    write(dataset(truth, [recording], name="exact", seed=5), folder)
    return read_experiment(folder)


def with_gauge(experiment, gain):
    """The same with a gauge whose gain is known so well, and nothing else that errs in pressure."""
    recordings = [
        replace(rec, accuracy=replace(rec.accuracy, pressure=replace(rec.accuracy.pressure, zero=0.0, gain=gain)))
        for rec in experiment.recordings
    ]
    return replace(experiment, recordings=tuple(recordings))


EFFECTS = (IdealCylinder(), CoulombFriction())


def fitted(experiment, gain, effects=EFFECTS, free=("muscle.radius",)):
    experiments = [with_gauge(experiment, gain)]
    return fit(experiments, effects, free=free), experiments


def test_the_gain_of_a_gauge_is_the_width_of_what_rests_on_it(experiment):
    """The pull goes with pressure and the square of the radius: by the posterior as by the fit."""
    posterior = quick_look(*fitted(experiment, 0.05), seed=1)
    found = posterior.parameters["muscle.radius"]
    assert found.sd == pytest.approx(0.025 * found.median, rel=0.1)
    assert found.robust_error == pytest.approx(found.sd, rel=0.15)  # runs cannot tell more than the gauge
    exact = quick_look(*fitted(experiment, 0.0), seed=1).parameters["muscle.radius"]
    assert exact.sd < 0.0025 * exact.median
    assert any("pressure gauge" in note for note in posterior.notes)


def test_a_gain_that_the_model_has_is_known_as_well_as_the_readings_tell(experiment):
    """The accuracy of the gauge would be the same error once more, and share its size."""
    known = [
        quick_look(*fitted(experiment, gain, (*EFFECTS, PressureGain()), ()), seed=1).parameters["pressure_gain.g"]
        for gain in (0.05, 0.0)
    ]
    assert known[0].sd == pytest.approx(known[1].sd, rel=0.05)
    assert known[0].sd < 0.005


def test_the_likeliest_errors_are_those_of_ridge_regression(experiment):
    """Given the parameters, errors of one standard deviation each beside white noise: (1 + U'U)^-1 U'r."""
    found, _ = fitted(experiment, 0.05)
    setup = set_up(found, (), noise=[("size",)])
    explicit = Explicit.of(setup)
    z = np.zeros((1, len(setup.names)))
    size = float(setup.target.natural(z)[0, -1])
    columns = np.asarray(explicit.columns) / size
    rows = np.asarray(setup.target.parts(z[0]).rows) / size
    ridge = np.linalg.solve(np.eye(columns.shape[1]) + columns.T @ columns, columns.T @ rows)
    np.testing.assert_allclose(in_batches(LIKELIEST, explicit, z)[0], ridge, rtol=1e-6, atol=1e-9)
    source, most = most_asked(setup, z[None])
    assert most == pytest.approx(np.abs(ridge).max(), rel=1e-6)
    assert source in found.errors.sources
    random = np.random.default_rng(0)
    share = robust_share(setup, random.standard_normal((2, 400, 8, len(setup.names))), found.samples.loop)
    assert share[list(setup.names).index("muscle.radius")] == pytest.approx(1.0, rel=0.15)


def end_stop(folder, seed):
    """Loops that end at a stop, in which every instrument errs, and the effects that made them."""
    truth = hiding(base_of({}), {"end_stop": {"K": 270.0, "eps_s": 0.2}})
    data = PROTOCOLS["rich"].data(truth, EVERY_NOISE[NOISE], seed, RIGS[TOGETHER])
    known = {name_of(kind): kind for kind in LIBRARY}
    experiment = read_experiment(write(data, folder, say_accuracy=True))
    return experiment, with_effects([known[name]() for name in base_of({})], [known["end_stop"]()])


@pytest.fixture(scope="module")
def stopped(tmp_path_factory):
    """Such loops of which the curve of least error has two valleys."""
    return end_stop(tmp_path_factory.mktemp("stopped") / "data", 7000)


def test_a_fit_leaves_a_valley_that_instruments_made(stopped):
    """The curve of least error has a weak stop from the beginning of the stroke on; noise alone is not left there."""
    experiment, effects = stopped
    layout = unknowns([experiment], effects)
    trusting = fit_problem(layout, *problem([experiment], layout), layout.start.copy(), Varying().names(layout))
    found = fit([experiment], effects)
    assert trusting.values["end_stop.eps_s"] < 0.05
    assert found.values["end_stop.eps_s"] == pytest.approx(0.2, abs=0.03)
    assert trusting.rmse < found.rmse < 1.5 * trusting.rmse
    assert found.search.unbent
    assert not trusting.search.unbent
    assert "errors that instruments may have made" in search_text(found)
    left = [
        np.sqrt(
            np.mean(left_beyond(one.residual / one.samples.sigma, one.slopes[: len(one.samples)], found.errors) ** 2)
        )
        for one in (trusting, found)
    ]
    assert left[1] < 1.1 < left[0]


def test_a_fit_is_what_instruments_explain_where_no_valley_is_left(tmp_path):
    """From the true stop the error falls all the way to a weak one at the beginning of the stroke."""
    experiment, effects = end_stop(tmp_path / "data", 9000)
    found = fit([experiment], effects, start={"end_stop.K": 270.0, "end_stop.eps_s": 0.2})
    assert found.search.unbent
    for name, true in {"end_stop.K": 270.0, "end_stop.eps_s": 0.2}.items():
        error = found.error(name)
        assert abs(found.values[name] - true) < 3 * error
        assert error < 0.15 * true


def test_an_end_stop_is_found_where_it_is_by_the_posterior(stopped):
    experiment, effects = stopped
    found = fit([experiment], effects)
    posterior = quick_look(found, [experiment], draws=1000, rows=1500)
    for name, true in {"end_stop.K": 270.0, "end_stop.eps_s": 0.2}.items():
        one = posterior.parameters[name]
        assert abs(one.median - true) < 3.5 * one.sd
        assert one.sd < 0.1 * true
    assert any("the fit trusts every reading" in note and "end_stop.K" in note for note in posterior.notes)
    assert np.mean([band.inside for band in posterior.bands]) == pytest.approx(0.9, abs=0.04)


def test_what_is_left_beyond_instruments_does_not_know_their_sizes_by_heart():
    """Rows made by noise and errors: the noise is left, but for what the parameters take."""
    random = np.random.default_rng(4)
    run = np.repeat(np.arange(6), 50)
    columns = 20 * random.standard_normal((300, 3))
    source = lambda kind: Source(Channel.FORCE, kind, 1.0, 1.0)  # noqa: E731
    own, shared = (source(ErrorKind.GAIN_PER_RUN),), (source(ErrorKind.ZERO), source(ErrorKind.GAIN))
    errors = InstrumentErrors(columns[:, :1], columns[:, 1:], own, shared, run)
    slopes = random.standard_normal((300, 2))
    noise = 2.0 * random.standard_normal(300)
    rows = noise + errors.columns @ random.standard_normal(8) + slopes @ [30.0, -7.0]
    assert rms(left_beyond(rows, slopes, errors)) == pytest.approx(rms(noise), rel=0.05)
    nothing = InstrumentErrors.none(run)
    np.testing.assert_array_equal(left_beyond(rows, slopes, nothing), rows)
