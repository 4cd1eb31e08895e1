"""Bands for readings of a new run: closed forms, and what is left out is a true refit."""

import numpy as np
import pytest
from small_muscle import loops, write

from fitting import baseline, fit, read_experiment, use_64_bit
from fitting.comparison.compare import compare
from fitting.least_squares.band_level import band_edges, cautious_width, expected_width, runs_needed
from fitting.least_squares.evaluate import evaluate
from fitting.least_squares.force_band import _refits, _steps, force_bands
from fitting.report.text.bands import band_text, bands_result

use_64_bit()
PRESSURES = tuple(np.linspace(1e5, 4e5, 10))


@pytest.fixture(scope="module")
def spring(tmp_path_factory):
    """Ten runs of a muscle with a spring that the model lacks."""
    folder = tmp_path_factory.mktemp("bands") / "spring"
    rows = loops(lambda eps, p, sign: 60 * eps, pressures=PRESSURES, repeats=1)
    return read_experiment(write(folder, rows))


def test_nine_runs_are_needed_for_nine_readings_of_ten():
    assert [runs_needed(level) for level in (0.5, 0.8, 0.9, 0.95)] == [1, 4, 9, 19]
    eight = [np.array([1.0, 2.0])] * 8
    assert cautious_width(eight, 0.9) == expected_width(eight, 0.9) == np.inf


def test_where_a_run_has_one_error_only_the_largest_of_ten_is_the_width():
    """Of 11 such runs the new one is the worst once: 10 of 11 is the least that is not below 90 %."""
    runs = [np.full(50, float(k)) for k in range(10)]
    assert cautious_width(runs, 0.9) == expected_width(runs, 0.9) == 9.0


def test_where_runs_are_alike_the_width_is_the_quantile_itself():
    runs = [np.arange(1.0, 101.0)] * 20
    assert expected_width(runs, 0.9) == 90.0
    assert cautious_width(runs, 0.9) == 95.0  # 0.9 * 21 / 20 of the readings


def test_every_run_counts_alike_however_many_readings_it_has():
    random = np.random.default_rng(1)
    runs = [np.sort(np.abs(random.normal(size=30))) * (1 + k) for k in range(12)]
    dense = [np.sort(np.repeat(runs[0], 40)), *runs[1:]]
    assert expected_width(dense, 0.9) == expected_width(runs, 0.9)


@pytest.mark.parametrize("own", [0.0, 1.0, 3.0])
def test_the_band_holds_nine_readings_of_ten_of_new_runs(own):
    """Runs with a zero of their own beside the noise of readings, drawn 300 times: within 2 % of 90 %."""
    random = np.random.default_rng(7)
    held = []
    for _ in range(300):
        scores = np.sort(np.abs(random.normal(size=(30, 60)) + own * random.normal(size=(30, 1))))
        width = expected_width(list(scores[:10]), 0.9)
        held.append(np.mean(scores[10:] <= width))
    assert 0.88 <= np.mean(held) <= 0.92


def test_edges_are_the_prediction_and_the_width_where_all_fits_agree():
    random = np.random.default_rng(2)
    runs = [np.sort(np.abs(random.normal(size=50))) for _ in range(10)]
    width, prediction = expected_width(runs, 0.9), np.linspace(0.0, 500.0, 7)
    low, high = band_edges(runs, np.repeat(prediction[None], 10, axis=0), width)
    assert low == pytest.approx(prediction - width, abs=1e-9)
    assert high == pytest.approx(prediction + width, abs=1e-9)
    apart = np.repeat(prediction[None], 10, axis=0) + np.linspace(-30.0, 30.0, 10)[:, None]
    wider_low, wider_high = band_edges(runs, apart, width)
    assert np.all(wider_high - wider_low > high - low + 40)


def test_one_step_leaves_a_run_out_as_a_refit_does(spring):
    """With a missing spring: unknowns to a tenth of their error, residuals to a hundredth of the whole error."""
    found = fit([spring], baseline())
    runs = np.unique(found.samples.run)
    steps, refits = list(_steps(found, runs)), list(_refits(found, runs))
    at = found.layout.at(found.free)
    for run, (vector, rows), (true_vector, true_rows) in zip(runs, steps, refits, strict=True):
        mine = found.samples.run == run
        errors = np.array([found.error(name) for name in found.free])
        assert np.all(np.abs(vector - true_vector)[at] <= 0.1 * errors)
        assert np.any(np.abs(vector - found.vector)[at] > 0.2 * errors) or run
        assert rows[mine] == pytest.approx(true_rows[mine], abs=0.01 * found.rmse / 0.3)


def test_a_comparison_says_how_far_readings_of_a_new_run_lie(spring):
    (band,) = compare(fit([spring], baseline()), [spring]).bands
    assert (band.test, band.runs, band.needed, band.fitted) == ("loop", 10, 9, True)
    assert 0.5 < band.half_width <= band.cautious < 30
    text = band_text(band)
    assert text.startswith("On new loop runs like these 10, 9 readings of 10 lie within +/-")
    (record,) = bands_result([band])
    assert record["half_width_N"] == band.half_width
    assert record["cautious_half_width_N"] == band.cautious


def test_values_from_elsewhere_have_seen_none_of_the_runs(spring):
    found = fit([spring], baseline())
    other = {**found.values, "coulomb_friction.f_s": 1.5 * found.values["coulomb_friction.f_s"]}
    (band,) = force_bands(evaluate([spring], baseline(), other, found.free))
    assert not band.fitted
    assert band_text(band).endswith("Its values were not fitted to these runs.")
    (same,) = force_bands(evaluate([spring], baseline(), found.values, found.free))
    assert same.fitted


def test_few_runs_have_no_band_and_it_is_said_how_many_are_needed(tmp_path):
    experiment = read_experiment(write(tmp_path / "few", loops()))
    (band,) = force_bands(fit([experiment], baseline()))
    assert not band.known
    assert "9 runs are needed, and there are 3" in band_text(band)
    assert bands_result([band])[0]["half_width_N"] is None
