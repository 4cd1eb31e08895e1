"""Bands for readings of a new run: closed forms, and what is left out is a true refit."""

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner
from small_muscle import ideal, loops, surface, write

from fitting import baseline, fit, read_experiment, use_64_bit
from fitting.cli.main import main
from fitting.comparison.compare import compare
from fitting.least_squares.band_level import band_edges, cautious_width, expected_width, runs_needed
from fitting.least_squares.evaluate import evaluate
from fitting.least_squares.force_band import _refits, _steps, fitted_to_these, force_bands
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


def test_what_stands_at_its_bounds_was_fitted_and_what_never_varied_was_not(spring):
    found = fit([spring], baseline())
    assert fitted_to_these(replace(found, at_bound=found.free))
    assert not fitted_to_these(evaluate([spring], baseline(), found.values, ()))


def test_a_comparison_says_how_far_readings_of_a_new_run_lie(spring):
    (band,) = compare(fit([spring], baseline()), [spring]).bands
    assert (band.test, band.runs, band.needed, band.fitted) == ("loop", 10, 9, True)
    assert 0.5 < band.half_width <= band.cautious < 30
    text = band_text(band)
    assert text.startswith("Record another loop run like these 10: 9 readings of 10 will lie within +/-")
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


@pytest.fixture(scope="module")
def stored(spring):
    """The folder of the muscle with its fitted model beside the data."""
    done = CliRunner().invoke(main, ["fit", str(spring.folder), "--quiet"])
    assert done.exit_code == 0, done.output
    return spring.folder


def simulated(stored, out, *options):
    """What `simulate` says, its result for machines, and the rows of the band where there is one."""
    record = out.with_suffix(".json")
    done = CliRunner().invoke(
        main, ["simulate", str(stored / "model.toml"), "--out", str(out), "--json", str(record), *options]
    )
    assert done.exit_code == 0, done.output
    file = next(out.glob("*_band.csv"), None)
    rows = None if file is None else np.genfromtxt(file, delimiter=",", skip_header=1)
    return " ".join(done.output.split()), json.loads(record.read_text())["band"], rows


def test_a_simulated_loop_has_a_band_that_holds_new_runs(stored, tmp_path):
    """The truth is the closed form with its spring, at pressures between those that were measured."""
    options = ("--pressures", "120 kPa,230 kPa,380 kPa", "--turns", "0.02,0.18,0.02", "--speed", "17 mm/s")
    said, record, rows = simulated(stored, tmp_path / "loop", *options)
    assert "9 readings of 10 will lie within" in said
    assert record["samples_beyond"] == 0
    force, low, high = rows[:, 2:].T
    assert np.all((low < force) & (force < high))
    assert (high - low).mean() == pytest.approx(2 * record["half_width_N"], rel=0.2)
    recorded = np.genfromtxt(tmp_path / "loop" / "loop.csv", delimiter=",", skip_header=1)
    pressure, contraction = 1e3 * recorded[:, 2], recorded[:, 3] / 250
    sign = np.sign(np.gradient(contraction))
    truth = ideal(contraction, pressure) - 0.012 * surface(contraction) * pressure * sign - 60 * contraction
    reading = truth + np.random.default_rng(3).normal(0, 0.3, len(truth))
    assert np.mean((low <= reading) & (reading <= high)) > 0.85


def test_a_band_is_empty_beyond_what_was_measured(stored, tmp_path):
    said, record, rows = simulated(stored, tmp_path / "far", "--pressure", "6 bar", "--turns", "0,0.2,0")
    assert record["samples_beyond"] == record["samples"] == len(rows)
    assert np.all(np.isnan(rows[:, 3:]))
    assert np.all(np.isfinite(rows[:, 2]))
    assert "beyond the measured pressures and contractions" in said


def test_another_kind_of_test_has_no_band_and_it_is_said_why(stored, tmp_path):
    said, record, rows = simulated(stored, tmp_path / "held", "--test", "isometric", "--pressures", "1 bar,3 bar")
    assert rows is None
    assert record["file"] is None
    assert "no isometric run was measured" in said
    alone = tmp_path / "alone"
    alone.mkdir()
    shutil.copy(stored / "model.toml", alone / "model.toml")
    said, record, rows = simulated(alone, tmp_path / "nodata")
    assert rows is None
    assert "there are no data beside the model file" in said


def test_a_model_that_was_written_by_hand_has_no_band(stored, tmp_path):
    """Though data of some muscle lie beside it."""
    shutil.copytree(stored, tmp_path / "by_hand")
    text = (stored / "model.toml").read_text(encoding="utf-8")
    (tmp_path / "by_hand" / "model.toml").write_text(text.split("[fitted_to]")[0], encoding="utf-8")
    said, record, _ = simulated(tmp_path / "by_hand", tmp_path / "nothing")
    assert "the model was fitted to no data" in said
    assert record["file"] is None


def test_an_export_takes_its_misfit_from_runs_that_were_left_out(stored, tmp_path):
    """The misfit is the 99 % quantile of the left-out readings, which a fit to all of them would understate."""
    record = tmp_path / "told.json"
    options = ["--to", "python", "--out", str(tmp_path / "m.py"), "--json", str(record)]
    done = CliRunner().invoke(main, ["export", str(stored / "model.toml"), *options])
    assert done.exit_code == 0, done.output
    told, (band,) = json.loads(record.read_text()), force_bands(fit([read_experiment(stored)], baseline()))
    misfit = np.quantile(np.concatenate(band.scores), 0.99, method="higher")
    assert f"is the sum of two: {misfit:.3g} N" in told["force_error"]
    assert "each run predicted from the others" in told["force_error"]
    assert told["bands"][0]["half_width_N"] == pytest.approx(band.half_width, rel=1e-3)
    assert told["force_error_N"] > band.half_width
    assert "9 readings of 10 will lie within" in " ".join(done.output.split())
