"""Pressure and length as estimates: against closed forms and scipy's spline, and so that no lag is found in noise."""

import time as clock
from dataclasses import replace

import numpy as np
import pytest
from hidden.simulator import COLOURED, Muscle, Noise, Truth, dataset, isometric, loops, with_baseline, write
from scipy.interpolate import CubicSpline, make_smoothing_spline
from scipy.linalg import cho_solve

from fitting.diagnosis.diagnose import diagnose, prepared
from fitting.recordings.experiment import read_experiment
from fitting.recordings.inputs import WhiteError, as_felt, rounding, smoothed, stamp_error
from fitting.recordings.smoother import estimate
from mckibben_jax.effect import name_of
from mckibben_jax.effects import LIBRARY, CoulombFriction, IdealCylinder, TimeDelay

GAUGE = 150.0  # Pa, 0.03 % of 5 bar
COUNT = 1000
EVEN = np.arange(COUNT) * 0.05
UNEVEN = np.sort(np.random.default_rng(99).uniform(0, 50, COUNT))
BASELINE = (IdealCylinder(), CoulombFriction())
TURNS = (0.0, 10.0, 20.0, 30.0, 40.0, 50.0)


def noise(seed, count=COUNT, sd=GAUGE):
    return sd * np.random.default_rng(seed).normal(size=count)


def estimated(time, reading, turns, white):
    """What enters the laws."""
    return as_felt(time, reading, smoothed(time, reading, turns, white), white)


def triangle(time):
    return np.interp(time, TURNS, 2e5 * (np.arange(6) % 2))


# ------------------------------------------------------------------------------------------------------- closed forms


@pytest.mark.parametrize("time", [EVEN, UNEVEN], ids=["even", "uneven"])
def test_a_constant_is_the_mean_of_its_readings(time):
    readings = [2e5 + noise(seed) for seed in range(100)]
    found = [estimate(time, y) for y in readings]
    constant = [(f, y) for f, y in zip(found, readings, strict=True) if f.constant]
    assert len(constant) >= 96  # a slope at 1 %, a curvature at 0.5 %
    for f, y in constant:
        assert f.level == pytest.approx(np.full(COUNT, y.mean()), rel=1e-12)
        assert f.variance == pytest.approx(np.full(COUNT, f.error**2 / COUNT))
    assert np.mean([f.error for f in found]) == pytest.approx(GAUGE, rel=0.01)
    assert np.std([f.error for f in found]) < 1.3 * GAUGE / np.sqrt(2 * COUNT)


def test_a_straight_line_is_that_of_least_squares():
    y = 1e5 + 100 * UNEVEN + noise(1)
    assert estimate(UNEVEN, y).level == pytest.approx(np.polyval(np.polyfit(UNEVEN, y, 1), UNEVEN), rel=1e-7)


@pytest.mark.parametrize("time", [EVEN, UNEVEN], ids=["even", "uneven"])
def test_a_smooth_signal_is_scipys_smoothing_spline_of_the_likeliest_bandwidth(time):
    """Likelihood, estimate and variance against dense algebra: y = X b + integrated Wiener process + white error."""
    at = (time[::5] - time[0]) / np.mean(np.diff(time[::5]))
    y = 3e3 * np.sin(time[::5] / 3) + noise(2, len(at))
    found = estimate(at, y)
    small, large = np.minimum.outer(at, at), np.maximum.outer(at, at)
    walk, line = small**2 * (3 * large - small) / 6, np.stack([np.ones_like(at), at], 1)

    def dense(ratio):
        factor = np.linalg.cholesky(np.eye(len(at)) + ratio * walk), True
        inverse = cho_solve(factor, np.eye(len(at)))
        normal = line.T @ inverse @ line
        left = inverse - inverse @ line @ np.linalg.solve(normal, line.T @ inverse)
        variance = y @ left @ y / (len(at) - 2)
        sizes = 2 * np.log(np.diag(factor[0])).sum() + np.linalg.slogdet(normal)[1]
        return sizes + (len(at) - 2) * np.log(variance), variance, left

    ratios = 10.0 ** np.arange(-4, 0.01, 0.02)
    best = ratios[np.argmin([dense(ratio)[0] for ratio in ratios])]
    _, variance, left = dense(best)
    assert found.error**2 == pytest.approx(variance, rel=0.01)
    assert found.variance == pytest.approx(variance * (1 - np.diag(left)), rel=0.03)
    spline = make_smoothing_spline(at, y, lam=1 / best)(at)
    assert np.abs(found.level - spline).max() < 0.03 * np.sqrt(found.variance.mean())


def test_the_stated_variance_is_that_of_the_error():
    signal = 3e3 * np.sin(UNEVEN / 3)
    found = [estimate(UNEVEN, signal + noise(seed)) for seed in range(20)]
    scaled = [np.mean((f.level - signal) ** 2 / f.variance) for f in found]
    assert np.mean(scaled) == pytest.approx(1, abs=0.25)


# ------------------------------------------------------------------------------------------------------------- slopes


@pytest.mark.parametrize("time", [EVEN, UNEVEN], ids=["even", "uneven"])
def test_the_slope_is_that_of_the_natural_cubic_spline_through_the_level(time):
    found = estimate(time, 3e3 * np.sin(time / 3) + noise(5))
    apart = np.append(True, np.diff(time) > 0.01)  # nearer, the spline of scipy rounds
    spline = CubicSpline(time, found.level, bc_type="natural")(time, 1)
    assert found.slope[apart] == pytest.approx(spline[apart], abs=1e-6 * 1e3)


def test_the_stated_variance_of_the_slope_is_that_of_a_random_walk_of_the_slope():
    """Signals drawn from the smoother's own model; the stated variance supposes that its bandwidth is known."""
    scaled, ends = [], []
    for seed in range(30):
        walk = np.random.default_rng([7, seed]).normal(size=COUNT) * 30 * np.sqrt(0.05)
        slope = np.cumsum(walk)
        found = estimate(EVEN, np.cumsum(slope) * 0.05 + noise(seed))
        off = (found.slope - slope) ** 2 / found.slope_variance
        scaled.append(off[50:-50].mean())
        ends.append(off[:20].mean())
    assert np.mean(scaled) == pytest.approx(1, abs=0.3)
    assert 0.3 < np.mean(ends) < 1.6


def test_a_triangle_has_the_slopes_of_its_sides():
    corners = np.searchsorted(EVEN, TURNS[1:-1])
    found = estimated(EVEN, triangle(EVEN) + noise(4), corners, WhiteError(0.0))
    off = found.slope - 2e4 * np.where((EVEN // 10) % 2, -1, 1)
    near = np.min(np.abs(np.arange(COUNT)[:, None] - corners), axis=1) <= 4
    assert np.abs(off[~near]).max() < 5 * GAUGE * np.sqrt(12 / 200**3) / 0.05  # five errors of a line through a side


def test_exact_readings_have_no_slope_of_a_smoother():
    assert estimated(EVEN, np.exp(EVEN / 10), np.array([], dtype=int), WhiteError(0.0)).slope is None


# ------------------------------------------------------------------------------------------------- jumps and corners


def test_a_jump_is_not_smeared():
    signal = np.where(EVEN < 17.3, 1e5, 3e5)
    found = estimate(EVEN, signal + noise(3))
    assert np.abs(found.level - signal).max() < GAUGE / 2
    assert found.error == pytest.approx(GAUGE, rel=0.06)


@pytest.mark.parametrize("time", [EVEN, UNEVEN], ids=["even", "uneven"])
def test_the_corners_of_a_triangle_are_kept(time):
    corners = np.searchsorted(time, TURNS[1:-1])
    found = estimated(time, triangle(time) + noise(4), corners, WhiteError(0.0))
    off = np.abs(found.level - triangle(time))
    near = np.min(np.abs(np.arange(COUNT)[:, None] - corners), axis=1) <= 4
    assert off[near].max() < 3.5 * GAUGE  # there the readings stand nearly as they are
    assert np.sqrt(np.mean(off[~near] ** 2)) < 0.25 * GAUGE
    assert off[~near].max() < GAUGE


def test_a_pressure_that_fills_is_followed():
    for tau in (0.05, 0.3, 1.0, 3.0):
        signal = 1e5 + 4e5 * (1 - np.exp(-np.maximum(EVEN - 10.02, 0) / tau))
        found = estimate(EVEN, signal + noise(5))
        assert np.abs(found.level - signal).max() < 7 * GAUGE  # of 4 bar, within a sample of 20 kPa and more
        assert np.sqrt(np.mean((found.level - signal)[10 + 5 * tau < EVEN] ** 2)) < GAUGE / 2


# ---------------------------------------------------------------------------------------- exact and rounded channels


@pytest.mark.parametrize("signal", [
    triangle(EVEN), 3e3 * np.sin(EVEN / 3), 1e5 + 4e5 * (1 - np.exp(-EVEN)), np.where(EVEN < 17, 1e5, 3e5), 30 * EVEN,
    np.full(COUNT, 2e5), np.interp(EVEN, (10, 11, 30, 31), (2e5, 5e5, 5e5, 3e5)),
])  # fmt: skip
def test_an_exact_signal_comes_back(signal):
    found = estimated(EVEN, signal, np.array([], int), WhiteError(0.0))
    assert np.abs(found.level - signal).max() <= 1e-6 * np.ptp(signal)


def test_readings_whose_error_is_not_felt_are_taken_as_read():
    y = triangle(EVEN) + noise(6, sd=1.0)
    assert estimated(EVEN, y, np.array([200, 400, 600, 800]), WhiteError(1.5)).level is y


@pytest.mark.parametrize("sd", [0.0, 20.0, 60.0, 150.0])
def test_twelve_bits_of_ten_bar_are_an_error_of_at_least_their_rounding(sd):
    step = 10e5 / 4096
    y = step * np.round((2e5 + 0.4 * step + noise(7, sd=sd)) / step)
    assert rounding(y) == pytest.approx(step if np.ptp(y) else 0.0, abs=1e-3)
    found = estimated(EVEN, y, np.array([], int), WhiteError(1.5))
    assert found.constant
    assert found.error >= 0.99 * step / np.sqrt(12) or np.ptp(y) == 0
    ramp = 1e5 + 4e3 * EVEN
    rounded = step * np.round((ramp + noise(8, sd=sd)) / step)
    assert np.sqrt(np.mean((estimate(EVEN, rounded, step).level - ramp) ** 2)) < step / 10


@pytest.mark.parametrize("decimals", [1, 4])
def test_the_step_of_rounding_is_found_in_any_unit(decimals):
    values = np.round(np.random.default_rng(9).uniform(0, 80, 300), decimals)
    assert rounding(values * 6894.757) == pytest.approx(10.0**-decimals * 6894.757)
    assert rounding(np.cos(EVEN)) < 1e-6


# ------------------------------------------------------------------------------------------------------------- units


@pytest.mark.parametrize("signal", [triangle(UNEVEN), np.full(COUNT, 2e5), 3e3 * np.sin(UNEVEN)])
def test_other_units_and_another_clock_change_nothing(signal):
    y = signal + noise(10)
    found = estimate(UNEVEN, y)
    other = estimate(1e3 * UNEVEN + 7e5, y * 1.45e-4)
    assert other.level == pytest.approx(found.level * 1.45e-4, rel=1e-6, abs=1e-6 * GAUGE * 1.45e-4)
    assert other.error == pytest.approx(found.error * 1.45e-4, rel=1e-5)


def test_ten_runs_take_well_below_a_second():
    readings = [triangle(UNEVEN) + noise(seed) for seed in range(10)]
    begin = clock.perf_counter()
    for y in readings:
        estimated(UNEVEN, y, np.searchsorted(UNEVEN, TURNS[1:-1]), WhiteError(1.5))
    assert clock.perf_counter() - begin < 1.0


# ------------------------------------------------------------------------------------------------------ from end to end


NAMES = {"supply_lag", "time_delay", "tip", "bladder_neo_hookean", "viscous_damping", "force_offset", "pressure_offset"}
CANDIDATES = [effect() for effect in LIBRARY if name_of(effect) in NAMES]


def rig(kind, errs, seed, hidden=None, **protocol):
    """A recording of a muscle with Coulomb friction and what is hidden."""
    return kind(Truth(Muscle(), with_baseline(**(hidden or {}))), noise=errs, seed=seed, **protocol)


def read(folder, recording, errs):
    return read_experiment(write(dataset(Truth(Muscle(), with_baseline()), [recording], noise=errs), folder))


def test_a_run_keeps_how_well_its_pressure_and_length_are_known(tmp_path):
    errs = replace(COLOURED, pressure=GAUGE, position=5e-5)
    recording = read(tmp_path / "a", rig(loops, errs, 0), errs).recordings[0]
    noisy = recording.runs
    assert "pressure estimated by a Kalman smoother: one reading errs by 0.15 kPa" in recording.notes
    assert np.sqrt([run.pressure_variance.mean() for run in noisy]) == pytest.approx(GAUGE / np.sqrt(1000), rel=0.2)
    assert all(np.ptp(run.pressure) == 0 and not run.pressure_rate.any() for run in noisy)
    off = [0.3 * (run.contraction - true.contraction)[run.weight > 0] for run, true in zip(
        noisy, read(tmp_path / "b", rig(loops, COLOURED, 0), COLOURED).recordings[0].runs, strict=True)]  # fmt: skip
    assert np.sqrt(np.mean(np.concatenate(off) ** 2)) < 5e-5 / 3


def test_a_good_gauge_and_encoder_are_taken_as_read(tmp_path):
    made = rig(loops, COLOURED, 0)
    runs = read(tmp_path, made, COLOURED).recordings[0].runs
    shown = np.round(1e3 * made.columns["displacement"], 4) / 300
    assert all((run.pressure == np.round(run.pressure)).all() for run in runs)
    assert np.concatenate([run.contraction for run in runs]) == pytest.approx(shown, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize(("hidden", "bits"), [
    ({}, False), ({}, True), ({"tip": {"k": 1.15}}, False), ({"bladder_neo_hookean": {"G": 3e5}}, False),
])  # fmt: skip
def test_the_noise_of_a_gauge_is_no_lag_of_the_supply(tmp_path, hidden, bits):
    """It stands both in the signature of the lag and in the residual: of pressure as read, supply_lag was named."""
    errs = Noise(sd=0.3, pressure=GAUGE)
    made = rig(loops, errs, 3, hidden)
    if bits:
        step = 10e5 / 4096
        made.columns["pressure"] = step * np.round(made.columns["pressure"] / step)
    found = diagnose([read(tmp_path, made, errs)], BASELINE, candidates=CANDIDATES)
    assert found.explanations == ((tuple(hidden),) if hidden else ())
    assert found.verdict == ("missing" if hidden else "nothing detectable")


def test_a_lag_of_the_supply_is_found_where_the_pressure_moves(tmp_path):
    errs = replace(COLOURED, pressure=GAUGE)
    made = rig(isometric, errs, 3, {"supply_lag": {"tau": 0.1}}, contractions=(0.0, 0.05, 0.1), samples=600)
    found = diagnose([read(tmp_path, made, errs)], BASELINE, candidates=CANDIDATES)
    assert ("supply_lag",) in found.explanations


def test_a_noisy_encoder_does_not_make_a_law_of_speed_look_easier_to_find(tmp_path):
    """The scatter of a speed from local polynomials, whitened, once made its detection limit a third too low."""

    def limit(name, position):
        errs = replace(COLOURED, position=position)
        search = prepared([read(tmp_path / name, rig(loops, errs, 3), errs)], BASELINE)
        return search.examiner.adequacy(frozenset(), search.base, {}, limits=True).of("kinetic_friction").limit

    assert limit("noisy", 1e-5) == pytest.approx(limit("exact", 0.0), rel=0.1)  # each is drawn to 4 %


def test_a_delayed_force_is_followed_around_turning_points_of_a_noisy_length(tmp_path):
    """Where the direction was unknown, friction was none, and the delayed force of what was measured next was off."""
    errs = replace(COLOURED, position=1e-5)
    data = rig(loops, errs, 3, {"time_delay": {"tau": 0.055}})
    search = prepared([read(tmp_path, data, errs)], BASELINE, [TimeDelay()])
    search.fit_singles()
    assert np.abs(search.fits[frozenset(["time_delay"])].rows).max() < 6


# ------------------------------------------------------------------------------------------------ rounded time stamps


def ramp(step, error=0.0, every=0.0125):
    """A length that runs back and forth at 0.02 1/s, sampled evenly; its time stamps are rounded to `step` (s)."""
    at = np.arange(300) * every
    place = 0.02 * np.abs((at + 0.5) % 2 - 1) + np.random.default_rng(3).normal(size=300) * error
    return np.round(at / step) * step, place


def test_rounded_time_stamps_are_no_error_of_the_length():
    """The force was read with the length, whatever the clock says of the moment."""
    time, place = ramp(0.001)
    assert estimated(time, place, np.array([40, 120, 200, 280]), WhiteError(0.0)).level == pytest.approx(place, abs=0.0)


def test_beside_rounded_time_stamps_an_error_of_the_length_is_still_seen():
    time, place = ramp(0.001, error=5e-5)
    found = estimated(time, place, np.array([40, 120, 200, 280]), WhiteError(0.0))
    assert found.error == pytest.approx(5e-5, rel=0.15)
    assert np.std(found.level - ramp(0.001)[1]) < 3e-5


@pytest.mark.parametrize("step", [1e-3, 2e-3, 5e-3])
def test_what_rounded_time_stamps_seem_to_make_of_a_steady_motion(step):
    time, place = ramp(step, every=0.0125 + 1e-5)
    rounded = np.std(0.02 * (time - np.arange(300) * (0.0125 + 1e-5)))
    assert stamp_error(time, place) == pytest.approx(rounded, rel=0.1)


def test_even_samples_have_no_rounded_time_stamps():
    assert stamp_error(EVEN, triangle(EVEN)) == 0.0
