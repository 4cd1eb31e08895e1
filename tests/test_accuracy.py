"""`[recording.accuracy]`: what is stated of instruments is read, refused with a cure, and reaches what uses it."""

import re

import numpy as np
import pytest
from click.testing import CliRunner
from folders import MUSCLE, folder_of, isometric_columns, loop_columns, loop_csv, recording, release_columns, table

from fitting.cli.main import main
from fitting.errors import InputError
from fitting.recordings.accuracy import NOTHING_STATED
from fitting.recordings.experiment import read_experiment, read_single
from fitting.recordings.noise import noise_of
from fitting.recordings.presumed import allowed, presumed
from fitting.recordings.template import write_muscle_file

HOUR = 3600.0
STATED = """[recording.accuracy]
pressure.noise = "150 Pa"
pressure.resolution = "0.1 kPa"
pressure.zero = "0.5 kPa"
pressure.gain = "0.25 %"
pressure.zero_per_run = "0 Pa"
pressure.gain_per_run = "0.1 %"
force    = { zero_per_run = "0.6 N", gain_per_run = "0.2 %", hysteresis = "0.05 %", drift = "5 N/h" }
displacement = { noise = "0.01 mm", zero_per_run = "1 mm" }
time     = { skew = "5 ms" }
friction = { per_run = "1 %" }"""


def read(path, more="", csv=None, test="loop"):
    (found,) = read_experiment(folder_of(path, loop_csv() if csv is None else csv, test=test, more=more)).recordings
    return found


def stated(path, *lines, noise="", **options):
    return read(path, "\n".join([noise, "[recording.accuracy]", *lines]), **options)


# ------------------------------------------------------------------------------------------------------------- reading


def test_every_stated_accuracy_is_read_in_si(tmp_path):
    found = read(tmp_path, STATED).accuracy
    pressure, force, position = found.pressure, found.force, found.position
    assert (pressure.noise, pressure.resolution, pressure.zero) == pytest.approx((150.0, 100.0, 500.0))
    assert (pressure.gain, pressure.zero_per_run, pressure.gain_per_run) == pytest.approx((0.0025, 0.0, 0.001))
    assert (force.zero_per_run, force.gain_per_run, force.hysteresis) == pytest.approx((0.6, 0.002, 0.0005))
    assert force.drift == pytest.approx(5 / HOUR)
    assert (position.noise, position.zero_per_run) == pytest.approx((1e-5, 1e-3))
    assert (found.skew, found.friction_per_run) == pytest.approx((0.005, 0.01))
    assert (pressure.drift, pressure.hysteresis, force.zero, force.noise, position.gain) == (None,) * 5


def test_what_is_not_stated_is_presumed_and_what_is_stated_is_kept(tmp_path):
    found = stated(tmp_path, 'pressure = { gain = "1 %" }')
    filled, guessed = allowed(found), presumed(found)
    assert filled.pressure.gain == 0.01 != guessed.pressure.gain
    assert filled.pressure.zero == guessed.pressure.zero
    assert filled.force == guessed.force
    pressure = {kind for channel, kind in filled.presumed if channel == "pressure"}
    assert pressure == {"noise", "resolution", "zero", "zero_per_run", "gain_per_run", "hysteresis", "drift"}
    assert {("force", "gain_per_run"), ("time", "skew"), ("friction", "friction_per_run")} <= filled.presumed
    skewed = allowed(stated(tmp_path, 'time = { skew = "5 ms" }')).presumed
    assert ("time", "skew") not in skewed


def test_nothing_is_stated_where_there_is_no_table(tmp_path):
    assert read(tmp_path).accuracy == NOTHING_STATED
    assert stated(tmp_path).accuracy == NOTHING_STATED


def test_the_errors_of_a_contraction_are_multiplied_by_the_length_of_the_muscle(tmp_path):
    line = 'contraction = { noise = "0.01 %", zero = "0.1 %", gain = "0.2 %", drift = "0.3 %/h" }'
    position = stated(tmp_path, line).accuracy.position
    assert position.noise == pytest.approx(0.3 * 1e-4)
    assert position.zero == pytest.approx(0.3 * 1e-3)
    assert position.gain == pytest.approx(2e-3)
    assert position.drift == pytest.approx(0.3 * 3e-3 / HOUR)


def test_a_gain_of_the_length_is_a_zero_of_the_displacement_too(tmp_path):
    position = stated(
        tmp_path, 'length = { gain = "0.1 %", zero = "0.4 mm", gain_per_run = "0.1 %" }'
    ).accuracy.position
    assert position.gain == pytest.approx(1e-3)
    assert position.zero == pytest.approx(np.hypot(0.4e-3, 0.3e-3))
    assert position.zero_per_run == pytest.approx(0.3e-3)


@pytest.mark.parametrize("written", ["5 N/h", "5 N / hour", "0.005 kN/h", "0.12 kN/day"])
def test_a_drift_may_be_written_in_any_unit_of_its_kind(tmp_path, written):
    assert stated(tmp_path, f'force = {{ drift = "{written}" }}').accuracy.force.drift == pytest.approx(5 / HOUR)


def test_the_table_may_be_written_in_other_ways_that_toml_has(tmp_path):
    long = '[recording.accuracy.force]\ndrift = "5 N/h"\n[recording.accuracy.time]\nskew = "5 ms"'
    inline = 'accuracy = { force = { drift = "5 N/h" }, time = { skew = "5 ms" } }'
    assert read(tmp_path, long).accuracy == read(tmp_path, inline).accuracy != NOTHING_STATED


def test_each_recording_has_its_own_accuracies(tmp_path):
    one = recording(more='[recording.accuracy]\npressure = { noise = "1 kPa" }')
    two = (
        '[[recording]]\nfile = "held.csv"\ntest = "isometric"\n[recording.accuracy]\nlength = { zero_per_run = "2 mm" }'
    )
    (tmp_path / "held.csv").write_text(table(isometric_columns()), encoding="utf-8")
    first, second = read_experiment(folder_of(tmp_path, loop_csv(), f"{one}\n{two}")).recordings
    assert (first.accuracy.pressure.noise, first.accuracy.position.zero_per_run) == (1000.0, None)
    assert (second.accuracy.pressure.noise, second.accuracy.position.zero_per_run) == (None, 2e-3)


# ----------------------------------------------------------------------------------------------- one noise, two names


def test_the_noise_of_the_measured_channel_may_stand_in_either_place(tmp_path):
    for found in (read(tmp_path, 'noise = "0.7 N"'), stated(tmp_path, 'force = { noise = "0.7 N" }')):
        assert found.noise == noise_of(found) == found.accuracy.force.noise == 0.7
    both = stated(tmp_path, 'force = { noise = "0.0007 kN" }', noise='noise = "0.7 N"')
    assert both.noise == 0.7


def test_in_a_test_that_measures_the_position_it_is_that_of_the_position(tmp_path):
    release = table(release_columns())
    found = stated(tmp_path, 'displacement = { noise = "0.02 mm" }', csv=release, test="quick release")
    assert found.noise == found.accuracy.position.noise == pytest.approx(2e-5)


# ---------------------------------------------------------------------------------------- what estimates the inputs


def gauge(noise=150.0, count=202, wander=0.0):
    """Loops read with a gauge that errs by `noise` (Pa), whose pressure wanders by `wander` (Pa)."""
    random, time = np.random.default_rng(1), np.arange(count) * 0.1
    return 2e5 + wander * np.sin(time / 2) + noise * random.normal(size=count)


def loops_with(pressure):
    return loop_csv(**{"pressure": np.round(pressure / 1e5, 7)})


def test_a_stated_noise_of_the_gauge_is_used_instead_of_estimating_it(tmp_path):
    csv = loops_with(gauge(wander=500.0))
    guessed = read(tmp_path, csv=csv).runs[0]
    small = stated(tmp_path, 'pressure = { noise = "20 Pa" }', csv=csv).runs[0]
    large = stated(tmp_path, 'pressure = { noise = "600 Pa" }', csv=csv).runs[0]
    readings = gauge(wander=500.0)
    left = [np.std(run.pressure - readings) for run in (small, guessed, large)]
    assert left[0] < 40.0 < 130.0 < left[1] < left[2]
    assert np.median(small.pressure_variance) < 20.0**2
    assert np.median(large.pressure_variance) > 4 * np.median(guessed.pressure_variance)


def test_a_stated_noise_of_a_held_pressure_is_that_of_the_mean(tmp_path):
    run = stated(tmp_path, 'pressure = { noise = "300 Pa" }', csv=loops_with(gauge())).runs[0]
    assert np.ptp(run.pressure) == 0
    assert run.pressure_variance == pytest.approx(np.full(202, 300.0**2 / 202))


def test_a_gauge_that_is_stated_to_be_exact_is_taken_as_it_reads(tmp_path):
    run = stated(tmp_path, 'pressure = { noise = "0 Pa" }', csv=loops_with(gauge())).runs[0]
    assert run.pressure == pytest.approx(gauge(), abs=0.01)
    assert not run.pressure_variance.any()


def test_a_stated_resolution_is_the_least_error_of_a_reading(tmp_path):
    coarse = stated(tmp_path, 'pressure = { resolution = "5 kPa" }', csv=loops_with(gauge())).runs[0]
    both = stated(tmp_path, 'pressure = { noise = "20 Pa", resolution = "5 kPa" }', csv=loops_with(gauge())).runs[0]
    for run in (coarse, both):
        assert run.pressure_variance == pytest.approx(np.full(202, 5000.0**2 / 12 / 202))


def test_a_stated_noise_of_the_length_reaches_the_estimate_of_the_contraction(tmp_path):
    random = np.random.default_rng(2)
    csv = loop_csv(contraction=loop_columns()["contraction [%]"] + 0.01 * random.normal(size=202))
    fine, coarse = (
        stated(tmp_path, f'displacement = {{ noise = "{noise}" }}', csv=csv).runs[0] for noise in ("0.006 mm", "0.3 mm")
    )
    assert np.median(fine.contraction_variance) <= (0.006 / 300) ** 2 < np.median(coarse.contraction_variance)


# ------------------------------------------------------------------------------------------------------------ refusals

REFUSED = [
    ('presure = { noise = "150 Pa" }', "unknown column in [recording.accuracy]: 'presure'", "did you mean 'pressure'?"),
    ('pressure = { niose = "150 Pa" }', "[recording.accuracy], pressure: 'niose'", "did you mean 'noise'"),
    ('time = { skw = "5 ms" }', "unknown key in [recording.accuracy], time: 'skw'", "did you mean 'skew'?"),
    ('friction = { gain = "2 %" }', "unknown key in [recording.accuracy], friction: 'gain'", "known: per_run"),
    ('friction = "2 %"', "accuracy: friction is not a table", 'friction = { per_run = "0.1 %" }'),
    ('friction = { per_run = "2" }', "accuracy: friction.per_run has no unit", '"0.1 %"'),
    ('pressure = { noise = "150" }', "accuracy: pressure.noise has no unit", '"150 Pa"'),
    ("pressure = { noise = 150 }", "accuracy: pressure.noise is not a value with a unit", '"150 Pa"'),
    ('force = { gain = "0.25" }', "accuracy: force.gain has no unit", '"0.1 %"'),
    ('force = { gain = "0.25 deg" }', "accuracy: force.gain: 'deg' cannot be the unit", '"0.1 %"'),
    ('pressure = { noise = "0.5 N" }', "accuracy: pressure.noise: 'N' cannot be the unit of a pressure", '"150 Pa"'),
    ('force = { drift = "5 N" }', "accuracy: force.drift: 'N' cannot be the unit of a quantity in N/s", '"5 N/h"'),
    ('pressure = { zero = "-0.5 kPa" }', "accuracy: pressure.zero is negative", "leave the sign out"),
    ('pressure = { zero = "much" }', "accuracy: pressure.zero is not a number with a unit", '"150 Pa"'),
    ('pressure = { zero = "nan Pa" }', "accuracy: pressure.zero is not a number with a unit", '"150 Pa"'),
    ('pressure = { zero = "1e999 Pa" }', "accuracy: pressure.zero is not finite", '"150 Pa"'),
    ('pressure = { noise = "1e200 Pa" }', "accuracy: pressure.noise is larger than anything measured", '"150 Pa"'),
    ('pressure = { zero = "2 kpaa" }', "accuracy: pressure.zero: 'kpaa' is not a unit", "kPa"),
    ('pressure = { zero = "? kPa" }', "accuracy: pressure.zero is still to be filled in", "data sheet"),
    ("pressure = 150", "accuracy: pressure is not a table", 'pressure = { noise = "150 Pa" }'),
    ('time = "5 ms"', "accuracy: time is not a table", 'time = { skew = "5 ms" }'),
    ('length = { noise = "1 mm" }\ndisplacement = { gain = "1 %" }', "length and displacement are one", "keep one"),
    ('force = { noise = "0.6 N" }', "noise and force.noise of this recording mean the same and differ", "leave one"),
    ('force = { noise = "0 N" }', "the noise of the measured force is not positive", "leave it out"),
]  # fmt: skip


@pytest.mark.parametrize(("line", "problem", "cure"), REFUSED, ids=[line for line, *_ in REFUSED])
def test_what_cannot_be_is_refused_with_file_row_value_and_cure(tmp_path, line, problem, cure):
    noise = "" if "0 N" in line else 'noise = "0.7 N"'
    with pytest.raises(InputError) as met:
        stated(tmp_path, line, noise=noise)
    error, lines = met.value, recording(more=f"{noise}\n[recording.accuracy]\n{line}").split("\n")
    assert problem in error.problem
    assert cure in error.cure
    assert error.file == tmp_path / "muscle.toml"
    assert error.row == lines.index("[recording.accuracy]" if "are one" in problem else line) + 1
    # a name that is unknown stands in the problem
    assert cure.startswith(("did you mean", "known:")) or error.value is not None


def test_a_table_that_is_none_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"row 10: accuracy is not a table.*\[recording.accuracy\]"):
        read(tmp_path, 'accuracy = "good"')


@pytest.mark.parametrize("column", ["pressure", "force", "time"])
def test_a_line_without_its_head_is_led_to_it(tmp_path, column):
    with pytest.raises(InputError, match=r"row 10: .*Cure: write a line \[recording.accuracy\] above it"):
        read(tmp_path, f'{column} = {{ gain = "1 %" }}')


def test_no_force_is_read_where_the_position_is_measured(tmp_path):
    with pytest.raises(InputError, match="row 12: accuracy: no force is read in a recording of test = 'quick release'"):
        stated(tmp_path, 'force = { noise = "1 N" }', csv=table(release_columns()), test="quick release")


def test_the_row_is_that_of_the_recording_meant(tmp_path):
    one = '[[recording]]\nfile = "data.csv"\ntest = "loop"\npressure = "gauge"\n'
    good = f'{one}[recording.accuracy]\npressure = {{ gain = "1 %" }}\n'
    toml = f"{MUSCLE}{good}{good.replace('1 %', '1 N')}[source]\n"
    with pytest.raises(InputError) as met:
        read_experiment(folder_of(tmp_path, loop_csv(), toml))
    assert toml.split("\n")[met.value.row - 1] == 'pressure = { gain = "1 N" }'
    toml = f"{MUSCLE}{good}{good.replace('gauge', 'gage')}"
    with pytest.raises(InputError, match="neither gauge nor absolute") as met:
        read_experiment(folder_of(tmp_path, loop_csv(), toml))
    assert toml.split("\n")[met.value.row - 1] == 'pressure = "gage"'


# ------------------------------------------------------------------------------------- of all recordings of a file

COMMON = """[accuracy]
pressure = { gain = "1 %", zero = "0.5 kPa" }
force = { gain_per_run = "0.3 %", noise = "2 N" }
displacement = { zero_per_run = "0.1 mm" }

"""


def common(folder, own="", noise=""):
    """The recordings of a folder whose muscle.toml says something of all, and of the loops something besides."""
    path = folder_of(folder, table(loop_columns()), more=own)
    (path / "release.csv").write_text(table(release_columns()))
    text = (path / "muscle.toml").read_text().replace("[[recording]]", COMMON + "[[recording]]", 1)
    text = text.replace('test = "loop"', f'test = "loop"\n{noise}')
    text += '\n[[recording]]\nfile = "release.csv"\ntest = "quick release"\n'
    (path / "muscle.toml").write_text(text)
    return read_experiment(path).recordings


def test_what_holds_for_all_recordings_is_stated_once(tmp_path):
    """Of a force only where one is read."""
    loop, release = (each.accuracy for each in common(tmp_path))
    for each in (loop, release):
        assert (each.pressure.gain, each.pressure.zero) == (0.01, 500.0)
        assert each.position.zero_per_run == pytest.approx(1e-4)
    assert (loop.force.gain_per_run, loop.force.noise) == (0.003, 2.0)
    assert release.force.gain_per_run is None


def test_a_recording_has_the_last_word(tmp_path):
    """Error by error, and column by column of the position; its own noise too."""
    own = '[recording.accuracy]\npressure = { gain = "2 %" }\nlength = { gain = "1 %" }'
    loop, release = (each.accuracy for each in common(tmp_path, own, 'noise = "0.5 N"'))
    assert (loop.pressure.gain, loop.pressure.zero) == (0.02, 500.0)
    assert (loop.position.gain, loop.position.zero_per_run) == (0.01, None)
    assert loop.force.noise == 0.5
    assert release.pressure.gain == 0.01


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ('pressure = { gian = "1 %" }', "unknown key in [recording.accuracy], pressure: 'gian'"),
        ("pressure = 3", "accuracy: pressure is not a table"),
        ('time = { skew = "5" }', "skew"),
    ],
)
def test_what_is_wrong_for_all_is_said_with_its_row(tmp_path, line, said):
    path = folder_of(tmp_path, table(loop_columns()))
    text = (path / "muscle.toml").read_text().replace("[[recording]]", f"[accuracy]\n{line}\n\n[[recording]]", 1)
    (path / "muscle.toml").write_text(text)
    with pytest.raises(InputError, match=re.escape(said)) as met:
        read_experiment(path)
    assert met.value.row == text.split("\n").index(line) + 1


def test_a_single_file_is_read_with_the_accuracies_of_its_muscle(tmp_path):
    common(tmp_path)
    found = read_single(tmp_path / "data.csv", tmp_path / "muscle.toml", "loop").recordings[0].accuracy
    assert (found.pressure.gain, found.force.gain_per_run) == (0.01, 0.003)


# -------------------------------------------------------------------------------------------------------- round trip


def uncommented(text):
    """The text with the lines of every [recording.accuracy] in force: the signs of its comments are taken away."""
    names = "pressure|force|displacement|length|contraction|time|friction"
    line = re.compile(rf"^# (?=\[recording.accuracy\]|({names}) = \{{)", re.M)
    return line.sub("", text)


def filled(folder):
    write_muscle_file(folder)
    path = folder / "muscle.toml"
    text = path.read_text().replace('length = "? mm"', 'length = "300 mm"', 1)
    text = text.replace('radius = "? mm"', 'radius = "7 mm"').replace('"? deg"', '"20 deg"')
    path.write_text(text)
    return path


def test_what_init_leaves_as_comments_is_what_is_presumed(tmp_path):
    for name, columns in (("rig", loop_columns()), ("held", isometric_columns()), ("release", release_columns())):
        (tmp_path / f"{name}.csv").write_text(table(columns))
    path = filled(tmp_path)
    before = read_experiment(tmp_path).recordings
    assert all(each.accuracy == NOTHING_STATED for each in before)
    path.write_text(uncommented(path.read_text()))
    for each in read_experiment(tmp_path).recordings:
        stated, guessed = each.accuracy, presumed(each)
        assert stated.pressure.zero == pytest.approx(guessed.pressure.zero, rel=0.05)
        assert stated.pressure.gain == pytest.approx(guessed.pressure.gain)
        assert stated.position.zero_per_run == pytest.approx(guessed.position.zero_per_run)
        assert stated.skew == pytest.approx(guessed.skew, rel=0.05)
        assert stated.friction_per_run == guessed.friction_per_run
        if each.test != "quick release":
            assert stated.force.gain_per_run == pytest.approx(guessed.force.gain_per_run)
            assert stated.force.hysteresis == pytest.approx(guessed.force.hysteresis)


def test_init_writes_once_what_recordings_of_one_rig_share(tmp_path):
    """With the zero of the gauge's full scale, which is that of the largest pressure."""
    for bar in (1.0, 4.0, 2.0):
        (tmp_path / f"loops {bar:.0f} bar.csv").write_text(table(loop_columns() | {"pressure [bar]": bar}))
    (tmp_path / "release.csv").write_text(table(release_columns()))
    path = filled(tmp_path)
    text = path.read_text()
    assert text.count("# [accuracy]") == text.count("# [recording.accuracy]") == 1
    assert text.count("# noise, force_sign and so on, as above") == 2
    path.write_text(re.sub(r"^# (?=\[accuracy\])", "", uncommented(text), flags=re.M))
    of_loops = [each.accuracy for each in read_experiment(tmp_path).recordings if each.test == "loop"]
    assert len(of_loops) == 3
    assert {each.pressure.zero for each in of_loops} == {400.0}
    assert {each.force.gain_per_run for each in of_loops} == {0.001}


def test_init_writes_an_accuracy_in_the_units_of_the_file(tmp_path):
    (tmp_path / "rig.csv").write_text(loop_csv())
    assert '# pressure = { zero = "0.002 bar", gain = "0.25 %" }' in filled(tmp_path).read_text()


def test_init_says_where_the_accuracies_belong(tmp_path):
    (tmp_path / "rig.csv").write_text(loop_csv())
    shown = " ".join(CliRunner().invoke(main, ["init", str(tmp_path)]).output.split())
    assert "belongs below [recording.accuracy]" in shown


def test_a_file_without_units_gets_usual_values(tmp_path):
    (tmp_path / "rig.csv").write_text(loop_csv().replace("pressure [bar]", "pressure"))
    write_muscle_file(tmp_path)
    text = (tmp_path / "muscle.toml").read_text()
    assert '# pressure = { zero = "0.5 kPa", gain = "0.25 %" }' in text
