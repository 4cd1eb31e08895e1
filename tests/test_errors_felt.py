"""How errors of channels are felt in the rows of a model: against the derivatives of a model in closed form."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from test_flips import samples

from fitting.instruments.columns import clock_time, instrument_errors, most_errors
from fitting.instruments.felt import errors_felt
from fitting.instruments.settings import INSTRUMENTS
from fitting.instruments.signals import channel_signals
from fitting.instruments.sources import ErrorKind
from fitting.recordings.accuracy import Accuracy, Channel, ChannelAccuracy

AREA, SIGMA, LENGTH = 2e-4, 0.5, 0.3  # m^2, N, m
FRICTION = {"coulomb_friction": 3.0, "viscous_damping": 40.0}  # N; N s
S = replace(samples(), sigma=np.full(len(samples()), SIGMA), measured=60 * np.linspace(0.1, 1.0, len(samples())))
S = replace(S, recording=S.run // 3, pressure=S.pressure * (1 + 0.1 * np.sin(S.time)), pressure_rate=np.cos(S.time))


@dataclass(frozen=True)
class ClosedForm:
    """Force a P (1 - 2 eps)^2 less friction, at readings that may be shifted."""

    kinds: tuple[bool, ...] = (True, True)
    pressure: float = 0.0
    contraction: float = 0.0

    @property
    def blocks(self):
        return tuple(replace(Block(), of_force=each) for each in self.kinds)

    def shifted(self, pressure=0.0, contraction=0.0):
        return replace(self, pressure=pressure, contraction=contraction)

    def rows(self, without):
        eps, p = S.contraction + self.contraction, S.pressure + self.pressure
        moved = {"coulomb_friction": S.branch, "viscous_damping": S.rate}
        lost = sum(size * moved[name] for name, size in FRICTION.items() if name not in without)
        return (AREA * p * (1 - 2 * eps) ** 2 - lost - S.measured) / SIGMA


@dataclass(frozen=True)
class Block:
    of_force: bool = True


def rows_at(problem, without):
    return problem.rows(without)


BY_PRESSURE = AREA * (1 - 2 * S.contraction) ** 2 / SIGMA
BY_CONTRACTION = -4 * AREA * S.pressure * (1 - 2 * S.contraction) / SIGMA


def signals(problem=None, read=S, length=LENGTH):
    problem = problem or ClosedForm()
    return channel_signals(problem, read, problem.rows(()), rows_at, np.array([length]))  # type: ignore[arg-type]


def test_slopes_are_the_derivatives_of_the_model():
    found = signals()
    np.testing.assert_allclose(found[Channel.PRESSURE].slope, BY_PRESSURE, rtol=1e-6)
    np.testing.assert_allclose(found[Channel.POSITION].slope, BY_CONTRACTION / LENGTH, rtol=1e-6)
    np.testing.assert_allclose(found[Channel.FORCE].slope, -1 / SIGMA)


def test_readings_rates_and_full_scales_are_in_the_unit_of_the_channel():
    found = signals()
    np.testing.assert_array_equal(found[Channel.PRESSURE].reading, S.pressure)
    np.testing.assert_array_equal(found[Channel.PRESSURE].rate, S.pressure_rate)
    np.testing.assert_allclose(found[Channel.POSITION].reading, LENGTH * S.contraction)
    np.testing.assert_allclose(found[Channel.POSITION].rate, LENGTH * S.rate)
    predicted = AREA * S.pressure * (1 - 2 * S.contraction) ** 2
    friction = FRICTION["coulomb_friction"] * S.branch + FRICTION["viscous_damping"] * S.rate
    np.testing.assert_allclose(found[Channel.FORCE].reading, predicted - friction)
    change = (BY_PRESSURE * S.pressure_rate + BY_CONTRACTION * S.rate) * SIGMA
    np.testing.assert_allclose(found[Channel.FORCE].rate, change, rtol=1e-6)
    scales = [found[channel].full_scale for channel in (Channel.PRESSURE, Channel.POSITION, Channel.FORCE)]
    assert scales == pytest.approx([S.pressure.max(), LENGTH * S.contraction.max(), 60.0])


def test_a_force_that_stays_the_same_is_late_by_what_the_pressure_is():
    """Of a load that hangs: the force is never late, but the pressure may be against the length."""
    still = replace(S, measured=np.full(len(S), 60.0))
    found = channel_signals(ClosedForm(), still, ClosedForm().rows(()), rows_at, np.array([LENGTH]))  # type: ignore[arg-type]
    np.testing.assert_allclose(found[Channel.FORCE].rate, BY_PRESSURE * S.pressure_rate * SIGMA, rtol=1e-6)


def test_rows_that_measure_the_position_feel_its_gauge_by_itself():
    """A motion's rows are predicted less measured position: no model stands between them and the gauge."""
    found = signals(ClosedForm(kinds=(True, False)))
    first = S.recording == 0
    np.testing.assert_allclose(found[Channel.POSITION].slope[first], (BY_CONTRACTION / LENGTH)[first], rtol=1e-6)
    np.testing.assert_allclose(found[Channel.POSITION].slope[~first], -1 / SIGMA)
    np.testing.assert_array_equal(found[Channel.FORCE].slope[~first], 0.0)


def test_a_channel_that_reads_nothing_has_finite_slopes():
    still = replace(S, contraction=0 * S.contraction, measured=0 * S.measured)
    found = signals(read=still)
    assert found[Channel.POSITION].full_scale == found[Channel.FORCE].full_scale == pytest.approx(0.0, abs=1e-12)
    assert all(np.isfinite(each.slope).all() for each in found.values())


def felt(*accuracies):
    return errors_felt(ClosedForm(), S, rows_at, tuple(FRICTION), np.array([LENGTH]), accuracies, every=False)  # type: ignore[arg-type]


def test_friction_is_what_each_effect_that_is_lost_does_to_the_rows():
    found = felt(*[Accuracy(friction_per_run=0.02)] * 2)
    assert found.shared.shape[1] == 0
    expected = np.column_stack([FRICTION["coulomb_friction"] * S.branch, FRICTION["viscous_damping"] * S.rate])
    np.testing.assert_allclose(found.per_run, -0.02 * expected / SIGMA, atol=1e-12)


def test_recordings_of_one_accuracy_were_read_by_the_same_instruments_and_others_by_others():
    """One zero of the gauge for two recordings whose files say the same; one each where they do not."""
    say = lambda zero: Accuracy(pressure=ChannelAccuracy(zero=zero))  # noqa: E731
    same, other = felt(say(100.0), say(float("100"))), felt(say(100.0), say(200.0))
    np.testing.assert_allclose(same.shared, 100.0 * BY_PRESSURE[:, None], rtol=1e-6)
    first = S.recording == 0
    expected = np.column_stack([np.where(first, 100.0, 0.0), np.where(first, 0.0, 200.0)]) * BY_PRESSURE[:, None]
    np.testing.assert_allclose(other.shared, expected, rtol=1e-6)


def test_what_is_read_by_other_instruments_does_not_feel_a_skew_or_another_friction_either():
    found = felt(Accuracy(skew=0.01, friction_per_run=0.02), Accuracy())
    assert found.per_run.shape[1] == 3
    np.testing.assert_array_equal(found.per_run[S.recording == 1], 0.0)
    assert np.all(np.abs(found.per_run[S.recording == 0]).max(axis=0) > 0)


def test_no_more_columns_are_reserved_than_an_accuracy_can_need():
    """By hand: a zero, a skew and two frictions in each of five runs; a gain, hysteresis in four widths, two drifts."""
    accuracy = Accuracy(
        pressure=ChannelAccuracy(zero_per_run=100.0, gain=0.01),
        force=ChannelAccuracy(hysteresis=0.001, drift=0.1),
        skew=0.001,
        friction_per_run=0.02,
    )
    runs = len(np.unique(S.run))
    needed = runs * (1 + 1 + 2) + 1 + len(INSTRUMENTS.hysteresis_widths) + 2
    assert most_errors([accuracy, accuracy], runs, lost=2) == needed == felt(accuracy, accuracy).count
    assert most_errors([Accuracy()], runs, lost=2) == 0


def test_an_error_of_which_no_accuracy_is_known_begins_small():
    """A thousandth of a reading, of full scale, or of full scale within the time of all recordings."""
    found = instrument_errors(S, [Accuracy()] * 2, signals(), np.zeros((len(S), 0)), every=True)
    widths = {(each.channel, each.kind): each.width for each in found.sources}
    small, scale = INSTRUMENTS.least_share, S.pressure.max()
    clock = clock_time(S)
    assert widths[Channel.PRESSURE, ErrorKind.GAIN] == widths[Channel.PRESSURE, ErrorKind.HYSTERESIS] == small
    assert widths[Channel.PRESSURE, ErrorKind.ZERO] == pytest.approx(small * scale)
    assert widths[Channel.PRESSURE, ErrorKind.DRIFT] == pytest.approx(small * scale / (clock[-1] - clock[0]))
    assert widths[Channel.TIME, ErrorKind.SKEW] == INSTRUMENTS.least_skew


def test_a_cell_lags_in_every_width_with_its_share_of_the_variance():
    found = felt(*[Accuracy(force=ChannelAccuracy(hysteresis=0.001))] * 2)
    force, widths = signals()[Channel.FORCE], INSTRUMENTS.hysteresis_widths
    lags = force.lags(S.run, widths)
    expected = 0.001 * force.slope[:, None] * 60.0 * lags / np.sqrt(len(widths))
    np.testing.assert_allclose(found.shared, expected, rtol=1e-6, atol=1e-9)
    assert np.any((np.abs(lags) > 0.1) & (np.abs(lags) < 0.9))  # not only cells that are fully turned


def test_a_drift_is_steady_or_dies_away_as_what_warms_up_does():
    """Both from the first reading on, each with its share of the variance: t, and T (1 - exp(-t / 0.2 T))."""
    found = felt(*[Accuracy(pressure=ChannelAccuracy(drift=3.0))] * 2)
    since = clock_time(S) - clock_time(S)[0]
    whole = since[-1]
    dying = whole * (1 - np.exp(-since / (INSTRUMENTS.warming_share * whole)))
    expected = 3.0 / np.sqrt(2) * BY_PRESSURE[:, None] * np.column_stack([since, dying])
    np.testing.assert_allclose(found.shared, expected, rtol=1e-6, atol=1e-9)


def test_one_source_is_widened_and_no_other():
    found = felt(*[Accuracy(pressure=ChannelAccuracy(zero=100.0, gain=0.01), skew=0.001)] * 2)
    zero = found.sources_shared[0]
    wider = found.widened(zero, 3.0)
    np.testing.assert_allclose(wider.shared, found.shared * [3.0, 1.0])
    np.testing.assert_array_equal(wider.per_run, found.per_run)
    skew = found.sources_per_run[0]
    np.testing.assert_allclose(found.widened(skew, 0.5).per_run, 0.5 * found.per_run)
