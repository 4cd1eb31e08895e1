"""What instruments may make of rows: columns by hand, whitening against numpy's covariance, sizes found again."""

from argparse import Namespace
from dataclasses import replace

import numpy as np
import pytest
from test_flips import samples

from fitting.diagnosis import omnibus
from fitting.diagnosis.candidate_fit import CandidateFit
from fitting.diagnosis.flip_groups import flip_groups
from fitting.diagnosis.instrument_answers import WithoutNoise, likeliest_size
from fitting.diagnosis.missing_effect import Ground, missing_effect_test
from fitting.diagnosis.nuisance import Nuisance
from fitting.instruments.columns import clock_time, instrument_errors
from fitting.instruments.errors import InstrumentErrors
from fitting.instruments.settings import INSTRUMENTS
from fitting.instruments.signals import Signal
from fitting.instruments.sources import ErrorKind, Source
from fitting.least_squares import working_noise
from fitting.recordings.accuracy import Accuracy, Channel, ChannelAccuracy

S = samples()
COUNT = len(S)
WHITE = working_noise.white_noise(1.0)
FORCE = 500.0 - 1000.0 * S.contraction
SIGNALS = {
    Channel.PRESSURE: Signal(np.full(COUNT, 2e-3), S.pressure, S.pressure_rate, 5e5),
    Channel.POSITION: Signal(np.full(COUNT, -1e4), 0.3 * S.contraction, 0.3 * S.rate, 0.06),
    Channel.FORCE: Signal(np.full(COUNT, 2.0), FORCE, -1000.0 * S.rate, 500.0),
}
NO_FRICTION = np.zeros((COUNT, 0))


def errors(every=False, friction=NO_FRICTION, skew=None, friction_per_run=None, **channels):
    given = {name: ChannelAccuracy(**given) for name, given in channels.items()}
    accuracy = Accuracy(**given, skew=skew, friction_per_run=friction_per_run)
    return instrument_errors(S, [accuracy], SIGNALS, friction, INSTRUMENTS, every)


def column(found, kind):
    at = [source.kind for source in (*found.sources_per_run, *found.sources_shared)].index(kind)
    return np.hstack([found.per_run, found.shared])[:, at]


def test_each_error_says_whether_its_accuracy_is_presumed():
    stated = Accuracy(force=ChannelAccuracy(zero=3.0), skew=0.01)
    usual = Accuracy(force=ChannelAccuracy(zero=9.0, gain_per_run=0.002), skew=0.1, friction_per_run=0.02)
    found = instrument_errors(S, [stated.presuming(usual)], SIGNALS, np.ones((COUNT, 1)), INSTRUMENTS, False)
    presumed = {(each.channel, each.kind): each.presumed for each in (*found.sources_per_run, *found.sources_shared)}
    assert presumed == {
        (Channel.FORCE, ErrorKind.ZERO): False, (Channel.FORCE, ErrorKind.GAIN_PER_RUN): True,
        (Channel.TIME, ErrorKind.SKEW): False, (None, ErrorKind.FRICTION_PER_RUN): True,
    }  # fmt: skip


def test_columns_are_the_changes_that_errors_make():
    found = errors(
        pressure={"gain": 0.01, "zero_per_run": 200.0}, force={"zero": 3.0, "gain_per_run": 0.002}, skew=0.01,
        position={"zero_per_run": 1e-3},
    )  # fmt: skip
    np.testing.assert_allclose(column(found, ErrorKind.GAIN), 2e-3 * 0.01 * S.pressure)
    np.testing.assert_allclose(column(found, ErrorKind.ZERO), 2.0 * 3.0)
    np.testing.assert_allclose(column(found, ErrorKind.GAIN_PER_RUN), 2.0 * 0.002 * FORCE)
    np.testing.assert_allclose(column(found, ErrorKind.SKEW), 2.0 * 0.01 * -1000.0 * S.rate)
    channels = {(each.channel, each.kind): each.allowed for each in found.sources_per_run}
    assert channels[Channel.PRESSURE, ErrorKind.ZERO_PER_RUN] == 200.0
    assert channels[Channel.POSITION, ErrorKind.ZERO_PER_RUN] == 1e-3
    assert found.per_run.shape[1] == 4
    assert found.shared.shape[1] == 2


def test_what_is_not_allowed_is_there_only_where_all_is_asked_for():
    assert errors(force={"zero": 1.0}).sources == (Source(Channel.FORCE, ErrorKind.ZERO, 1.0, 1.0),)
    every = errors(every=True, force={"zero": 1.0})
    assert len(every.sources) == 3 * 6 + 1
    assert all(source.width > 0 for source in every.sources)
    assert every.allowed.sources == (Source(Channel.FORCE, ErrorKind.ZERO, 1.0, 1.0),)


def test_friction_differs_from_run_to_run_by_a_share_of_itself():
    friction = (20.0 * S.branch)[:, None]
    found = errors(friction=friction, friction_per_run=0.03)
    np.testing.assert_allclose(column(found, ErrorKind.FRICTION_PER_RUN), 0.03 * friction[:, 0])
    assert not errors(friction=friction).count


def test_what_may_go_in_several_ways_varies_in_all_by_the_accuracy_together():
    """A cell's lag of unknown width once it is fully turned, a drift of unknown shape at its end."""
    found = errors(force={"hysteresis": 0.001, "drift": 0.2})
    turned = np.flatnonzero(np.all(np.abs(SIGNALS[Channel.FORCE].lags(S.run, INSTRUMENTS.hysteresis_widths)) == 1, 1))
    kinds = np.array([source.kind for source in found.sources_shared])
    size = {kind: np.sqrt(np.sum(found.shared[:, kinds == kind] ** 2, axis=1)) for kind in set(kinds)}
    assert len(turned)
    np.testing.assert_allclose(size[ErrorKind.HYSTERESIS][turned], 2.0 * 0.001 * 500.0)
    clock = clock_time(S)
    assert size[ErrorKind.DRIFT][-1] == pytest.approx(2.0 * 0.2 * (clock[-1] - clock[0]), rel=0.01)


def test_a_cell_with_play_lags_by_its_width_and_remembers_its_turning_points():
    """Against a walk done by hand: play of 10 to either side, of a full scale of 100."""
    reading = np.array([0.0, 5.0, 20.0, 40.0, 35.0, 20.0, 10.0, 20.0])
    signal = Signal(np.ones(8), reading, np.zeros(8), 100.0)
    lag = signal.lags(np.zeros(8), (0.1,))[:, 0]
    np.testing.assert_allclose(lag, [0.0, 0.5, 1.0, 1.0, 0.5, -1.0, -1.0, 0.0])
    twice = signal.lags(np.array([0, 0, 0, 0, 1, 1, 1, 1]), (0.1,))[:, 0]
    np.testing.assert_allclose(twice[4:], [0.0, -1.0, -1.0, 0.0])  # every run begins in the middle


@pytest.mark.parametrize("begins_again", [True, False])
def test_the_clock_goes_on_from_run_to_run(begins_again):
    """Whether each run's time begins at zero, or goes on with a pause."""
    time = np.concatenate([np.arange(count) for count in np.bincount(S.run)]) * 0.1
    if not begins_again:
        time = time + 100.0 * S.run
    clock = clock_time(replace(S, time=time))
    assert np.all(np.diff(clock) >= 0)
    starts = clock[np.flatnonzero(np.diff(S.run)) + 1]
    lengths = np.bincount(S.run)[:-1]
    np.testing.assert_allclose(starts, np.cumsum((lengths - 1) * 0.1) if begins_again else 100.0 * np.arange(1, 5))


def made(width=1.5, random=None):
    """A zero and a gain of every run, and two errors that all runs share."""
    random = random or np.random.default_rng(0)
    sources = [Source(Channel.FORCE, kind, width, width) for kind in (ErrorKind.ZERO_PER_RUN, ErrorKind.GAIN_PER_RUN)]
    shared = [Source(Channel.PRESSURE, kind, width, width) for kind in (ErrorKind.ZERO, ErrorKind.GAIN)]
    columns = width * np.stack([np.ones(COUNT), FORCE / 500, S.pressure / 1e5, random.normal(size=COUNT)], axis=1)
    return InstrumentErrors(columns[:, :2], columns[:, 2:], tuple(sources), tuple(shared), S.run)


def test_whitening_is_by_the_whole_covariance():
    """W (1 + U U') W' = 1, and the residual is (1 + U U')^-1 of the rows, against numpy."""
    some = np.arange(0, COUNT, 16)
    felt = made().at(some)
    covariance = np.eye(len(some)) + felt.columns @ felt.columns.T
    white = felt.whitener()
    factor = white(np.eye(len(some)))
    np.testing.assert_allclose(factor @ covariance @ factor.T, np.eye(len(some)), atol=1e-9)
    rows = np.random.default_rng(1).normal(size=len(some))
    np.testing.assert_allclose(white.residual(rows), np.linalg.solve(covariance, rows), atol=1e-9)
    np.testing.assert_array_equal(InstrumentErrors.none(felt.run).whitener()(rows), rows)


def test_the_largest_of_the_likeliest_errors_is_that_of_ridge_regression():
    """Of one run that is off by eight widths of its zero: against (1 + U'U)^-1 U' rows of all columns."""
    some = np.arange(0, COUNT, 16)
    felt = made().at(some)
    run = np.unique(felt.run)[2]
    rows = np.random.default_rng(2).normal(size=len(some)) - 8 * felt.per_run[:, 0] * (felt.run == run)
    columns = felt.columns
    ridge = np.linalg.solve(np.eye(columns.shape[1]) + columns.T @ columns, columns.T @ rows)
    source, size = felt.likeliest(rows)
    assert source.kind is ErrorKind.ZERO_PER_RUN
    assert size == pytest.approx(np.abs(ridge).max())
    assert size > 4
    assert InstrumentErrors.none(felt.run).likeliest(rows) == (None, 0.0)


def ground(felt):
    return Ground(S, flip_groups(S, 0.0), omnibus.basis(S), WHITE, felt, 0)


SLOPES = np.stack([S.pressure / 1e5, S.branch], axis=1)
BY = Nuisance(SLOPES, np.zeros(0), np.zeros((0, 2)))
COLUMN = (S.contraction * S.pressure / 1e5)[:, None]


def drawn(felt, random, times=1.0):
    return random.normal(size=COUNT) + times * felt.columns @ random.normal(size=felt.columns.shape[1])


def test_errors_within_their_accuracy_are_nothing_missing_and_without_it_they_are():
    """Forty recordings with instruments at their accuracy: at most three rejected, where exact ones would be most."""
    random, felt = np.random.default_rng(2), made()
    exact = ground(InstrumentErrors.none(S.run))
    rows = [drawn(felt, random) for _ in range(40)]
    assert sum(missing_effect_test(each, BY, COLUMN, ground(felt)).rejected for each in rows) <= 3
    assert sum(missing_effect_test(each, BY, COLUMN, exact).rejected for each in rows) > 20


def test_an_effect_beyond_the_instruments_is_seen_beside_them():
    random, felt = np.random.default_rng(3), made()
    shape = np.maximum(S.contraction - 0.12, 0)[:, None]
    rows = drawn(felt, random) + 30 * shape[:, 0]
    assert missing_effect_test(rows, BY, shape, ground(felt)).p_effects[0] < 0.01


@pytest.mark.parametrize("times", [0.0, 1.0, 4.0])
def test_the_size_of_an_error_is_found_again(times):
    """Of the load cell's zero in five runs: within a factor of two; the other errors are at their accuracy."""
    random, felt = np.random.default_rng(5), made()
    source = felt.sources_per_run[0]
    own = np.linalg.norm(np.array([1.0, -1.2, 0.8, -1.1, 0.6])) / np.sqrt(5)
    zeros = times * felt.per_run[:, 0] * np.array([1.0, -1.2, 0.8, -1.1, 0.6])[S.run]
    rest = felt.chosen(felt.sources[1:])
    rows = drawn(rest, random) + zeros
    step = np.linalg.lstsq(SLOPES, rows, rcond=None)[0]
    fit = CandidateFit(frozenset(), np.zeros(2), ("a", "b"), rows - SLOPES @ step, SLOPES, *BY_PRIORS, ())
    found = likeliest_size(WithoutNoise.of(ground(felt), felt, fit), source, INSTRUMENTS)
    if times:
        assert 0.5 < found / (times * own) < 2.0
    else:
        assert found < 0.3


BY_PRIORS = (np.zeros(0), np.zeros((0, 2)))


def test_noise_beside_instruments_is_that_of_one_projection_from_all_their_columns():
    """Run by run or at once, against least squares by numpy; slopes that the errors make wholly count for nothing."""
    s, random = samples(), np.random.default_rng(4)
    felt = made()
    slopes = np.column_stack([random.normal(size=(len(s), 2)), felt.columns[:, 0] + felt.columns[:, 1]])
    basis = omnibus.basis(s).whole
    kinds = working_noise.Kinds.after_removal(basis, s)
    rows = random.normal(size=len(s)) + felt.columns @ random.normal(size=felt.columns.shape[1])
    everything = np.hstack([basis, slopes, felt.columns])
    rest = rows - everything @ np.linalg.lstsq(everything, rows, rcond=1e-9)[0]
    removed = [np.linalg.matrix_rank(columns, tol=1e-6) for columns in (basis, everything)]
    grown = (len(s) - removed[0]) / (len(s) - removed[1])
    found, expected = kinds.noise_beside(rows, slopes, felt), kinds.noise(np.sqrt(grown) * rest)
    assert found.white == pytest.approx(expected.white, rel=1e-6)
    np.testing.assert_allclose(found.shares, expected.shares, atol=1e-6)


def test_pieces_of_one_length_are_whitened_by_how_far_apart_their_readings_are():
    """A run of every reading, one of every fifth, and the first once more later on: together, nothing is correlated."""
    shares = np.where(np.array(working_noise.NOISE.memories) == 0.9, 0.9, 0.0)
    place, run = np.concatenate([np.arange(10), 5 * np.arange(10), 40 + np.arange(10)]), np.repeat([0, 1, 2], 10)
    white = working_noise.Whitener.of(working_noise.Noise(0.1, shares), Namespace(position=place), run)
    alike = run[:, None] == run
    covariance = alike * 0.9 * 0.9 ** np.abs(place[:, None] - place) + 0.1 * np.eye(30)
    np.testing.assert_allclose(white(white(covariance).T), np.eye(30), atol=1e-10)


def test_noise_beside_instruments_is_not_taken_for_less_where_these_make_most_of_a_few_readings():
    """White noise of one in 40 readings, of which instruments and a fit can make 19: 1, and not 0.57."""
    random, s = np.random.default_rng(8), samples(1)
    source = Source(Channel.FORCE, ErrorKind.ZERO_PER_RUN, 1.0, 1.0)
    own, shared = random.normal(size=(40, 2)), random.normal(size=(40, 3))
    felt = InstrumentErrors(own, shared, (source,) * 2, (source,) * 3, s.run)
    kinds = working_noise.Kinds.after_removal(random.normal(size=(40, 3)), s)
    found = []
    for _ in range(400):
        rows = random.normal(size=40) + 5 * shared.sum(axis=1)
        noise = kinds.noise_beside(rows, random.normal(size=(40, 3)), felt)
        found.append(noise.white + noise.shares.sum())
    assert np.mean(found) == pytest.approx(1.0, abs=0.1)


def test_a_run_of_a_few_readings_keeps_what_its_errors_could_make_of_all_of_them():
    """Of three readings two are one error's and another's: what is left of them would say nothing of the noise."""
    run = np.array([0, 0, 0, 1, 1, 1, 1, 1])
    source = Source(Channel.FORCE, ErrorKind.ZERO_PER_RUN, 1.0, 1.0)
    own = np.random.default_rng(0).normal(size=(8, 2))
    felt = InstrumentErrors(own, np.zeros((8, 0)), (source, source), (), run)
    rows = np.arange(8.0)[:, None] ** 2
    left = working_noise.without_own(rows, felt)
    np.testing.assert_array_equal(left[:3], rows[:3])
    np.testing.assert_allclose(own[3:].T @ left[3:], 0, atol=1e-9)
    assert np.linalg.norm(left[3:]) > 0.1
