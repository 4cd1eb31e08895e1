"""What is said of every channel: the errors that were found, stated and presumed, and the readings behind them."""

import dataclasses
import json

import numpy as np
import pytest
import small_muscle
from click.testing import CliRunner
from folders import loop_columns, release_columns, table
from test_accuracy import gauge, loops_with, read, stated

from fitting.cli.main import main
from fitting.recordings.accuracy import Channel
from fitting.recordings.channel_errors import channel_errors, found_errors
from fitting.recordings.experiment import read_experiment
from fitting.report.pictures.figures import as_svg
from fitting.report.pictures.readings import estimated_channels, readings_picture
from fitting.report.text.instruments import channel_lines

ACCURATE = 'noise = "0.3 N"\n[recording.accuracy]\npressure = { gain = "0.3 %" }'


def errors_of(recording):
    return {each.channel: each for each in channel_errors(recording)}


def test_of_every_channel_it_is_known_what_was_found_stated_and_presumed(tmp_path):
    lines = ['pressure = { zero = "0.5 kPa", gain = "1 %" }', 'time = { skew = "5 ms" }', 'friction.per_run = "0 %"']
    found = stated(tmp_path, *lines, csv=loops_with(np.round(gauge(), -1)), noise='noise = "0.7 N"')
    errors = errors_of(found)
    pressure, force, time = errors[Channel.PRESSURE], errors[Channel.FORCE], errors[Channel.TIME]
    assert pressure.noise == pressure.found.noise == pytest.approx(150.0, rel=0.2)
    assert pressure.resolution == pytest.approx(10.0)
    assert pressure.stated == ("zero", "gain")
    assert pressure.systematic == pytest.approx(
        {"zero": 500.0, "gain": 0.01, "zero_per_run": 0.0, "gain_per_run": 0.0, "hysteresis": 0.0, "drift": 0.0}
    )
    assert (force.noise, force.stated) == (0.7, ("noise",))
    assert force.found.noise < 0.1
    assert (time.systematic, time.stated) == ({"skew": 0.005}, ("skew",))
    friction, usual = errors[Channel.FRICTION], errors_of(read(tmp_path))[Channel.FRICTION]
    assert (friction.systematic, friction.stated) == ({"friction_per_run": 0.0}, ("friction_per_run",))
    assert (usual.systematic, usual.stated) == ({"friction_per_run": 0.02}, ())


def test_the_steps_of_a_set_point_are_no_rounding(tmp_path):
    pressure = np.repeat([1e5, 1.5e5], 101)
    stepped = errors_of(read(tmp_path, csv=loops_with(pressure)))[Channel.PRESSURE]
    assert (stepped.noise, stepped.resolution) == (0.0, None)
    coarse = 244.0 * np.round((gauge(20.0) + 200.0) / 244.0)  # between two steps of a converter
    assert errors_of(read(tmp_path, csv=loops_with(coarse)))[Channel.PRESSURE].resolution == pytest.approx(244.0)


def test_a_stated_noise_stands_beside_the_noise_that_was_found(tmp_path):
    errors = errors_of(stated(tmp_path, 'pressure = { noise = "20 Pa" }', csv=loops_with(gauge())))[Channel.PRESSURE]
    assert errors.noise == 20.0
    assert errors.found.noise == pytest.approx(150.0, rel=0.2)


@pytest.mark.parametrize(
    ("step", "noise", "said"), [("1 kPa", 288.7, "0.29 kPa (stated)"), ("10 Pa", 150.0, "kPa (found)")]
)
def test_a_stated_rounding_is_the_least_that_a_reading_errs_by(tmp_path, step, noise, said):
    """Readings that keep in step with a rounding show nothing of it."""
    found = stated(tmp_path, f'pressure = {{ resolution = "{step}" }}', csv=loops_with(gauge()))
    assert errors_of(found)[Channel.PRESSURE].noise == pytest.approx(noise, rel=0.2 if step == "10 Pa" else 1e-3)
    assert said in channel_lines(channel_errors(found))[0]


def test_arithmetic_is_no_noise(tmp_path):
    """A pressure that rises in even steps, of which the last digits alone differ."""
    (run, *_) = read(tmp_path).runs
    even = dataclasses.replace(run, pressure=2e5 + 1e3 * np.arange(len(run)) / 3.0)
    assert found_errors([even], "loop", 0.3).pressure.noise == 0.0
    rough = dataclasses.replace(even, pressure=even.pressure + np.random.default_rng(1).normal(size=len(run)))
    assert found_errors([rough], "loop", 0.3).pressure.noise == pytest.approx(1.0, rel=0.3)


def test_points_have_no_time_and_motions_no_load_cell(tmp_path):
    release = read(tmp_path, csv=table(release_columns()), test="quick release")
    assert set(errors_of(release)) == {Channel.PRESSURE, Channel.POSITION, Channel.TIME, Channel.FRICTION}
    columns = {"pressure [bar]": [1, 2, 3], "contraction [%]": [0, 5, 10], "force [N]": [90, 150, 170]}
    static = errors_of(read(tmp_path, csv=table(columns), test="static"))
    assert set(static) == {Channel.PRESSURE, Channel.POSITION, Channel.FORCE, Channel.FRICTION}
    assert static[Channel.FORCE].found.noise is None


def test_rounded_time_stamps_are_no_noise_of_the_length(tmp_path):
    time = np.arange(202) * 0.01317
    place = 20 * np.abs((np.arange(202) / 101 + 0.5) % 1 - 0.5) * 2
    columns = loop_columns() | {"time [s]": np.round(time, 3), "contraction [%]": place}
    columns["force [N]"] = np.round(200 - 8 * place, 4)
    smooth = errors_of(read(tmp_path, csv=table(columns)))[Channel.POSITION]
    assert smooth.found.noise < 2e-6


def test_one_line_says_what_a_channel_may_err_by(tmp_path):
    lines = ['pressure = { noise = "150 Pa", gain = "1 %" }', 'force = { drift = "5 N/h", zero_per_run = "0 N" }']
    lines = channel_lines(channel_errors(stated(tmp_path, *lines, csv=loops_with(gauge()), noise='noise = "0.7 N"')))
    assert lines[0] == "pressure: one reading errs by 0.15 kPa (stated); stated: gain 1 %; presumed: zero 0.2 kPa"
    assert lines[2] == (
        "force: one reading errs by 0.7 N (stated); stated: zero 0 N from run to run, drift 5 N/h; "
        "presumed: gain 0.1 % from run to run, hysteresis 0.05 % of full scale"
    )
    assert lines[3] == "time: presumed: 29 ms between channels"


def test_recordings_that_differ_share_a_line(tmp_path):
    one = errors_of(stated(tmp_path, 'pressure = { zero = "1 kPa" }'))
    other = errors_of(stated(tmp_path, 'pressure = { zero = "2 kPa" }'))
    (line,) = channel_lines([one[Channel.PRESSURE], other[Channel.PRESSURE]])
    assert "stated: zero 1 kPa to 2 kPa" in line


def test_compare_prints_the_channels_and_writes_them(tmp_path):
    small_muscle.write(tmp_path / "small", small_muscle.loops(), extra=ACCURATE)
    out, page = tmp_path / "c.json", tmp_path / "c.html"
    shown = CliRunner().invoke(main, ["compare", str(tmp_path / "small"), "--json", str(out), "--html", str(page)])
    assert shown.exit_code == 0
    assert "CHANNELS  pressure: stated: gain 0.3 %; presumed: zero 0.4 kPa" in shown.output
    channels = {each["channel"]: each for each in json.loads(out.read_text())["channels"]}
    assert set(channels) == {"pressure", "position", "force", "time", "friction"}
    assert channels["force"].items() >= {"file": "loops.csv", "noise": 0.3, "unit": "N", "stated": ["noise"]}.items()
    assert channels["pressure"]["allowed"]["gain"] == pytest.approx(0.003)
    assert channels["pressure"]["stated"] == ["gain"]
    assert "Instruments: what each may err by" in page.read_text()


# ------------------------------------------------------------------------------------------------- read and estimated


def test_readings_are_kept_beside_the_signal_that_was_estimated_from_them(tmp_path):
    noisy = read(tmp_path, csv=loops_with(gauge())).runs[0]
    assert noisy.pressure_reading == pytest.approx(gauge(), abs=0.01)
    assert np.ptp(noisy.pressure) == 0
    exact = read(tmp_path).runs[0]
    assert exact.pressure_reading is None
    assert exact.contraction_reading is None


def test_a_page_shows_readings_only_where_a_signal_was_estimated(tmp_path):
    read(tmp_path)
    assert estimated_channels([read_experiment(tmp_path)]) == []
    read(tmp_path, csv=loops_with(gauge()))
    (pair,) = estimated_channels([read_experiment(tmp_path)])
    assert pair.name == "data.csv, run 1: pressure"
    assert np.std(pair.reading - pair.estimate) == pytest.approx(150.0, rel=0.2)
    picture = as_svg(readings_picture([pair]), "readings")
    assert "reading less estimate" in picture
    assert "[kPa]" in picture
