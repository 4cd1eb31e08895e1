"""Folders as people make them: every kind of test and every option is read."""

import hashlib
import math
import re
from pathlib import Path

import numpy as np
import pytest
from folders import (
    MUSCLE,
    folder_of,
    isometric_columns,
    loop_columns,
    loop_csv,
    only_run,
    release_columns,
    table,
)
from small_muscle import loops as small_loops
from small_muscle import write as write_small

from fitting import showing
from fitting.errors import InputError
from fitting.recordings.experiment import read_experiment, read_muscle, read_recording, read_single
from fitting.recordings.presumed import allowed

pytestmark = pytest.mark.filterwarnings("error")


# ------------------------------------------------------------------------------------------------ every kind of test


def test_a_loop_recording(tmp_path):
    data, run = only_run(folder_of(tmp_path, loop_csv(), more='noise = "0.5 N"'))
    columns = loop_columns()
    assert (data.file, data.test, data.unit, data.noise) == ("data.csv", "loop", "N", 0.5)
    assert run.time == pytest.approx(columns["time [s]"])
    assert run.pressure == pytest.approx(2e5)
    assert run.contraction == pytest.approx(columns["contraction [%]"] / 100, abs=1e-6)
    assert run.measured == pytest.approx(columns["force [N]"])
    assert run.row.tolist() == list(range(2, 204))
    assert run.half.max() == 3
    assert run.loop.max() == 1
    assert set(run.weight) == {0.0, 1.0}


@pytest.mark.parametrize(
    ("head", "values"),
    [
        ("contraction [1]", lambda eps: eps),
        ("length [mm]", lambda eps: 300 * (1 - eps)),
        ("displacement [cm]", lambda eps: 30 * eps),
    ],
)
def test_three_ways_to_say_where_the_muscle_is(tmp_path, head, values):
    columns = loop_columns()
    eps = columns.pop("contraction [%]") / 100
    _, run = only_run(folder_of(tmp_path, table({**columns, head: values(eps)})))
    assert run.contraction == pytest.approx(eps, abs=1e-6)


@pytest.mark.parametrize("runs", ["named", "told from the length"])
def test_an_isometric_recording(tmp_path, runs):
    columns = isometric_columns()
    if runs == "named":
        columns = {"run": np.repeat(["a", "b", "c"], 160), **columns}
    data = read_experiment(folder_of(tmp_path, table(columns), test="isometric")).recordings[0]
    assert [run.name for run in data.runs] == (["a", "b", "c"] if runs == "named" else ["1", "2", "3"])
    for run, contraction in zip(data.runs, (0, 1 / 15, 2 / 15), strict=True):
        assert run.contraction == pytest.approx(contraction)
        assert (run.rate == 0).all()
        assert run.half.max() == 1
        assert np.sign(run.pressure_rate[run.weight > 0]).tolist() == run.branch[run.weight > 0].tolist()


def test_readings_while_the_length_is_changed_belong_to_no_run(tmp_path):
    columns = isometric_columns()
    between = {
        name: np.insert(np.asarray(values, float), [160, 160, 160], values[0]) for name, values in columns.items()
    }
    lengths = next(name for name in between if name.startswith("length"))
    between[lengths][160:163] = [295.0, 290.0, 285.0]
    between["time [s]"] = np.arange(len(between[lengths])) * 0.1
    data = read_experiment(folder_of(tmp_path, table(between), test="isometric")).recordings[0]
    assert [len(run.time) for run in data.runs] == [160, 160, 160]
    assert any("3 of 483 samples carry no weight: between two lengths" in note for note in data.notes)


@pytest.mark.parametrize(
    ("there", "back"), [("inflate", "deflate"), ("Inflation", "Deflation"), ("shortening", "lengthening")]
)
def test_stated_branches_win(tmp_path, there, back):
    columns = isometric_columns((300,)) | {"branch": [there] * 100 + [back] * 60}
    _, run = only_run(folder_of(tmp_path, table(columns), test="isometric"))
    assert run.branch.tolist() == [1] * 100 + [-1] * 60
    assert run.weight[[96, 99, 102]].sum() == 0


def test_a_static_recording_without_directions(tmp_path):
    csv = "pressure [bar],length [mm],force [N]\n1,300,50\n2,300,90\n1,270,20\n2,270,60\n"
    data, run = only_run(folder_of(tmp_path, csv, test="static"))
    assert run.weight.all()
    assert (run.rate == 0).all()
    assert run.loop.tolist() == run.half.tolist() == [0, 1, 2, 3]
    assert "direction not stated: friction taken as 0" in data.notes


def test_a_static_recording_with_directions(tmp_path):
    csv = (
        "pressure [bar],length [mm],force [N],branch\n1,300,50,contraction\n2,290,90,Elongation\n1,270,20,contraction\n"
    )
    data, run = only_run(folder_of(tmp_path, csv, test="static"))
    assert run.branch.tolist() == [1, -1, 1]
    assert run.rate.tolist() == [1e-9, -1e-9, 1e-9]
    assert data.notes == ()
    assert read_experiment(tmp_path).notes == ("only 3 readings count: any model with that many parameters meets them",)


def test_a_quick_release(tmp_path):
    data, run = only_run(folder_of(tmp_path, table(release_columns()), test="quick release", more='noise = "0.1 mm"'))
    assert (data.unit, data.noise) == ("m", pytest.approx(1e-4))
    assert run.load == pytest.approx(20 * 9.80665)
    assert run.measured.max() == pytest.approx(0.06, rel=1e-3)
    assert run.contraction == pytest.approx(run.measured / 0.3)
    assert (run.weight == (run.time >= 0)).all()
    assert "20 of 220 samples carry no weight: before t = 0" in data.notes


def test_a_load_in_newtons_and_a_spelling(tmp_path):
    _, run = only_run(folder_of(tmp_path, table(release_columns("load [N]")), test="Quick_release"))
    assert run.load == pytest.approx(20)


@pytest.mark.parametrize("columns", [("pressure",), ("set_pressure",), ("pressure", "set_pressure")])
def test_a_pressure_step(tmp_path, columns):
    base = release_columns()
    base.pop("pressure [bar]")
    given = {"pressure": ("pressure [bar]", 2.9), "set_pressure": ("set_pressure [bar]", 3.0)}
    data = base | dict(given[name] for name in columns)
    _, run = only_run(folder_of(tmp_path, table(data), test="step"))
    assert run.pressure == pytest.approx(2.9e5 if "pressure" in columns else 3e5)
    assert (run.set_pressure is None) == ("set_pressure" not in columns)


def test_an_isotonic_recording(tmp_path):
    pressure = 5 * (1 - np.abs(np.arange(201) / 100 - 1)) + 0.1
    columns = {"time [s]": np.arange(201) * 0.1, "pressure [bar]": pressure, "length [mm]": 300 - 10 * pressure}
    _, run = only_run(folder_of(tmp_path, table(columns | {"load [kg]": 5.0}), test="isotonic"))
    assert run.measured == pytest.approx(pressure / 100)
    assert run.branch[run.weight > 0].tolist() == np.sign(run.rate[run.weight > 0]).tolist()
    assert run.half.max() == 1


def test_one_file_without_a_folder(tmp_path):
    folder_of(tmp_path, loop_csv(), toml=MUSCLE)
    muscle, priors, name, source = read_muscle(tmp_path / "muscle.toml")
    data = read_recording(tmp_path / "data.csv", "loop", muscle, {"valid": {"force": ["100 N", "5 kN"]}})
    assert len(data.runs[0]) == 202
    assert (name, source) == ("Braid", {})
    assert set(priors) == {"muscle.radius", "muscle.braid_angle"}
    assert "force outside 100 N .. 5 kN" in " ".join(data.notes)
    assert "4 branches in 1 run, told by the turning points of the length" in data.notes
    whole = read_single(tmp_path / "data.csv", tmp_path / "muscle.toml", "loop")
    assert whole.priors == priors
    assert whole.sha256 == hashlib.sha256(MUSCLE.encode() + loop_csv().encode()).hexdigest()
    with pytest.raises(InputError, match=r"a file, not a folder.*--muscle"):
        read_experiment(tmp_path / "data.csv")


# ----------------------------------------------------------------------------------------------------------- options


def test_sign_of_force_absolute_pressure_and_names(tmp_path):
    columns = loop_columns()
    columns["Load cell (kN)"] = -columns.pop("force [N]") / 1000
    columns["P abs"] = columns.pop("pressure [bar]") + 1.01325
    more = """columns = { force = "Load cell (kN)", pressure = "P abs" }
units = { pressure = "bar" }
pressure = "absolute"
force_sign = -1"""
    _, run = only_run(folder_of(tmp_path, table(columns), more=more))
    assert run.measured == pytest.approx(loop_columns()["force [N]"])
    assert run.pressure == pytest.approx(2e5)


@pytest.mark.parametrize(("head", "unit"), [("contraction [%]", 1.0), ("displacement [mm]", 3.0)])
def test_a_position_that_counts_lengthening_as_positive(tmp_path, head, unit):
    columns = loop_columns()
    columns[head] = -unit * columns.pop("contraction [%]")
    _, run = only_run(folder_of(tmp_path, table(columns), more="position_sign = -1"))
    assert run.contraction == pytest.approx(loop_columns()["contraction [%]"] / 100)


@pytest.mark.parametrize(
    ("head", "unit", "at_rest", "sign"),
    [
        ("displacement [mm]", 3.0, "37.2 mm", -1),
        ("displacement [cm]", 0.3, "-1.2 cm", 1),
        ("displacement [mm]", 3.0, "0.1 m", -1),  # in whatever unit one says it
        ("contraction [%]", 1.0, "2.5 %", 1),
    ],
)
def test_a_sensor_that_reads_something_at_rest(tmp_path, head, unit, at_rest, sign):
    columns, zero = loop_columns(), {"37.2 mm": 37.2, "-1.2 cm": -1.2, "0.1 m": 100.0, "2.5 %": 2.5}[at_rest]
    columns[head] = zero + sign * unit * columns.pop("contraction [%]")
    more = f'position_at_rest = "{at_rest}"\nposition_sign = {sign}'
    _, run = only_run(folder_of(tmp_path, table(columns), more=more))
    assert run.contraction == pytest.approx(loop_columns()["contraction [%]"] / 100)


@pytest.mark.parametrize(
    ("unit", "newtons", "shown"), [("oz", 0.2780139, "N"), ("N", 1.0, "N"), ("lb", 4.4482216, "lbf")]
)
def test_weights_in_any_unit_and_limits_of_them(tmp_path, unit, newtons, shown):
    columns = {f"load [{unit}]": [10.0, 20.0, 50.0, 70.0, 90.0, 100.0], "pressure [bar]": 2.0, "length [mm]": 280.0}
    valid = f'valid = {{ load = ["5 {unit}", "95 {unit}"] }}'
    folder = folder_of(tmp_path, table(columns), test="static", more=valid)
    _, run = only_run(folder)
    assert run.measured[run.usable] == pytest.approx(newtons * np.array([10, 20, 50, 70, 90]), rel=1e-6)
    (stated,) = read_experiment(folder).units
    assert stated["N"] == shown


def test_weights_that_hang_at_rest_are_the_force(tmp_path):
    columns = {"load [kg]": [1.0, 2.0, 5.0, 7.0, 9.0, 10.0], "pressure [bar]": 2.0, "length [mm]": 280.0}
    folder = folder_of(tmp_path, table(columns), test="static")
    _, run = only_run(folder)
    assert run.measured == pytest.approx(9.80665 * np.array(columns["load [kg]"]))
    (stated,) = read_experiment(folder).units
    assert stated["N"] == "kgf"


@pytest.mark.parametrize(
    ("head", "more"),
    [
        ("Load cell (N)", 'columns = { force = "Load cell (N)" }'),
        ("Load cell", 'columns = { force = "Load cell" }\nunits = { force = "N" }'),
        ("Load cell", 'columns = { force = "Load cell (N)" }'),
        ("Load cell [N]", 'columns = { force = "Load cell" }'),
        ("force", 'units = { force = "N" }'),
        ("Force (N)", ""),
        ('"force [N]"', ""),
    ],
)
def test_where_name_and_unit_may_stand(tmp_path, head, more):
    columns = {head if name == "force [N]" else name: values for name, values in loop_columns().items()}
    _, run = only_run(folder_of(tmp_path, table(columns), more=more))
    assert run.measured == pytest.approx(loop_columns()["force [N]"])


def test_readings_outside_valid_carry_no_weight_and_are_counted(tmp_path):
    data, run = only_run(folder_of(tmp_path, loop_csv(), more='valid = { force = ["100 N", "5000 N"] }'))
    outside = loop_columns()["force [N]"] < 100
    assert run.weight[outside].sum() == 0
    assert len(run) == 202
    assert f"{outside.sum()} of 202 samples carry no weight: force outside 100 N .. 5000 N" in data.notes


@pytest.mark.parametrize("gap", ["nan", "", "NaN", "inf"])
@pytest.mark.parametrize("name", ["force", "contraction", "pressure"])
def test_a_missing_reading_costs_its_sample(tmp_path, gap, name):
    columns = {head: np.broadcast_to(values, 202).astype(object) for head, values in loop_columns().items()}
    head = next(head for head in columns if head.startswith(name))
    columns[head] = columns[head].copy()
    columns[head][30] = gap
    data, run = only_run(folder_of(tmp_path, table(columns)))
    assert run.weight[30] == 0
    assert run.weight[[29, 31]].all()
    assert all(np.isfinite(values).all() for values in (run.measured, run.contraction, run.pressure, run.rate))
    assert f"1 of 202 samples carry no weight: no reading in '{head}' (row 32)" in data.notes


def test_runs_keep_the_order_of_the_file(tmp_path):
    columns = {head: np.tile(np.broadcast_to(values, 202), 2) for head, values in loop_columns().items()}
    csv = table({"run": np.repeat([10, 2], 202), **columns})
    data = read_experiment(folder_of(tmp_path, csv)).recordings[0]
    assert [run.name for run in data.runs] == ["10", "2"]
    assert data.runs[1].row[0] == 204


def test_unused_columns_are_named(tmp_path):
    data, _ = only_run(folder_of(tmp_path, table(loop_columns() | {"Temperature [degC]": 21.0})))
    assert "not used: Temperature [degC]" in data.notes


def test_a_vented_loop_can_be_meant(tmp_path):
    more = 'valid = { pressure = ["-1 kPa", "1 kPa"] }'
    _, run = only_run(folder_of(tmp_path, loop_csv(pressure=0.003), more=more))
    assert run.weight.any()


# ------------------------------------------------------------------------------------------------------- muscle.toml


def test_the_muscle_and_its_priors(tmp_path):
    more = 'wall_thickness = "1.8 +/- 0.2 mm"\nwall_outside = "0.9 mm"\nhardness = "45 IRHD"\n[source]\nlicence = "CC0"'
    folder_of(tmp_path, toml=MUSCLE + more)
    muscle, priors, _, source = read_muscle(tmp_path)
    assert float(muscle.length) == pytest.approx(0.3)
    assert float(muscle.braid_angle) == pytest.approx(math.radians(20))
    assert float(muscle.shear_modulus) == pytest.approx(0.54e6, rel=1e-6)
    assert muscle.lacks("strand_width")
    assert priors == {
        "muscle.radius": pytest.approx((7e-3, 1e-4)),
        "muscle.braid_angle": pytest.approx((math.radians(20), math.radians(0.5))),
        "muscle.wall_thickness": pytest.approx((1.8e-3, 2e-4)),
    }
    assert source == {"licence": "CC0"}


def test_the_braid_angle_from_cords(tmp_path):
    turns = 300 * math.tan(math.radians(20)) / (2 * math.pi * 7)
    cord = 300 / math.cos(math.radians(20))
    toml = f"""[muscle]
length = "300 mm"
radius = "7 +/- 0.07 mm"
cord_length = "{cord} mm"
turns = {turns}
"""
    muscle, priors, name, _ = read_muscle(folder_of(tmp_path, toml=toml))
    assert float(muscle.braid_angle) == pytest.approx(math.radians(20))
    expected = 0.01 * math.sin(math.radians(20)) * math.cos(math.radians(20))
    assert priors["muscle.braid_angle"][1] == pytest.approx(expected)
    assert name == tmp_path.name


def test_the_hash_is_that_of_all_files(tmp_path):
    folder = folder_of(tmp_path, loop_csv())
    both = (folder / "muscle.toml").read_bytes() + (folder / "data.csv").read_bytes()
    assert read_experiment(folder).sha256 == hashlib.sha256(both).hexdigest()


# ------------------------------------------------------------------------------------------------- shipped data sets


@pytest.mark.parametrize(
    "folder", sorted(Path(__file__).parent.parent.glob("data/*/muscle.toml")), ids=lambda p: p.parent.name
)
def test_shipped_data_sets_are_read(folder):
    experiment = read_experiment(folder.parent)
    assert sum(len(run) for data in experiment.recordings for run in data.runs) > 0


def test_a_folder_of_data_sets_names_them(tmp_path):
    for name in ("left", "right arm"):
        write_small(tmp_path / name, small_loops(repeats=1))
    with pytest.raises(InputError) as error:
        read_experiment(tmp_path)
    assert error.value.problem == "this folder is no data set, but 2 of its folders are"
    assert error.value.cure.endswith(f"effects: {tmp_path}/left '{tmp_path}/right arm'")


def test_notes_speak_in_the_units_of_the_file(tmp_path):
    folder = write_small(tmp_path, small_loops(repeats=1, pressures=(2e5,)))
    file = folder / "loops.csv"
    file.write_text(file.read_text().replace("[kPa]", "[psi]").replace(",200.000,", ",29.008,"), encoding="utf-8")
    (note,) = read_experiment(folder).notes
    assert "one pressure only, 29.01 psi" in note
    assert showing.show(2e5, "Pa") == "200 kPa"


def test_a_folder_of_folders_without_muscle_says_where_to_begin(tmp_path):
    folder = write_small(tmp_path / "monday", small_loops(repeats=1))
    (folder / "muscle.toml").unlink()
    with pytest.raises(InputError) as error:
        read_experiment(tmp_path)
    assert f"mckibben init {folder}" in error.value.cure


VALID = 'valid = { force = ["2 N", "900 N"] }'


@pytest.mark.parametrize(("slack_below", "valid", "noted"), [(200, "", True), (10, "", False), (200, VALID, False)])
def test_a_muscle_under_pressure_that_hardly_pulls_is_noticed(tmp_path, slack_below, valid, noted):
    columns = isometric_columns()
    pull = np.maximum(columns["pressure [kPa]"] - slack_below, 0.0) * 0.5
    columns["force [N]"] = np.round(pull + 0.1 * np.sin(np.arange(len(pull))), 3)
    notes = read_experiment(folder_of(tmp_path, table(columns), test="isometric", more=valid)).recordings[0].notes
    said = [note for note in notes if "the muscle hangs slack there" in note]
    assert len(said) == noted
    if noted:
        assert "samples pull by less than 1.5 N above 50 kPa" in said[0]
        count, whole = (int(word) for word in re.findall(r"(\d+) of (\d+)", said[0])[0])
        pressure, force = (np.asarray(columns[name]) for name in ("pressure [kPa]", "force [N]"))
        assert 0.9 * np.sum((pressure > 50) & (force < 1.5)) < count <= np.sum((pressure > 50) & (force < 1.5)) < whole


@pytest.mark.parametrize(
    ("columns", "refused"),
    [
        ('force = "Kraft [kgf]"', True),
        ('force = "Kraft [bar]"', True),
        ('force = "Kraft [N]"', False),
        ('force = "Kraft [newton]"', False),  # the same in another spelling
        ('force = "Kraft"', False),
    ],
)
def test_units_that_contradict_each_other_are_refused(tmp_path, columns, refused):
    csv = table(loop_columns()).replace("force [N]", "Kraft [N]")
    mapped = f"columns = {{ {columns} }}"
    if not refused:
        assert len(read_experiment(folder_of(tmp_path, csv, more=mapped)).recordings) == 1
        return
    with pytest.raises(InputError, match="the header gives this column in N") as caught:
        read_experiment(folder_of(tmp_path, csv, more=mapped))
    assert (caught.value.row, caught.value.column) == (1, "Kraft [N]")
    stated = f'{mapped}\nunits = {{ force = "N" }}'
    (recording,) = read_experiment(folder_of(tmp_path, csv, more=stated)).recordings
    assert recording.units["N"] == "N"


ABSOLUTE = table(loop_columns() | {"pressure [bar]": 3.0})


@pytest.mark.parametrize("unit", ["bar abs", "bara", "bar(a)", "bar (abs)"])
@pytest.mark.parametrize(("said", "air"), [("", 1.01325e5), ('ambient = "995 hPa"', 99.5e3)])
def test_absolute_pressures_lose_what_the_air_has(tmp_path, unit, said, air):
    csv = ABSOLUTE.replace("pressure [bar]", f"pressure [{unit}]")
    read = read_experiment(folder_of(tmp_path, csv, more=f'pressure = "absolute"\n{said}')).recordings[0]
    assert read.runs[0].pressure == pytest.approx(3e5 - air)
    assert read.units["Pa"] == "bar"
    told = [note for note in read.notes if "were taken off the absolute pressures" in note]
    assert bool(told) != bool(said)
    assert allowed(read).pressure.zero == pytest.approx(np.hypot(1e-3 * (3e5 - air), 0.0 if said else 2e3))


@pytest.mark.parametrize(
    ("unit", "more", "parts"),
    [
        ("bara", 'pressure = "gauge"', ("'pressure [bara]'", 'units = { pressure = "bar" }', 'pressure = "absolute"')),
        ("bar", 'ambient = "1 bar"', ("ambient belongs to absolute pressures",)),
        ("bar", 'pressure = "absolute"\nambient = "10 bar"', ("no air has this pressure", "10 bar", "barometer")),
        ("bar", 'pressure = "absolute"\nambient = "much"', ("ambient",)),
    ],
)
def test_what_is_said_of_the_air_has_to_be_possible(tmp_path, unit, more, parts):
    csv = ABSOLUTE.replace("pressure [bar]", f"pressure [{unit}]")
    with pytest.raises(InputError) as refused:
        read_experiment(folder_of(tmp_path, csv, more=more))
    assert all(part in str(refused.value) for part in parts)


def test_what_nobody_said_of_the_air_stands_beside_the_zero_of_a_gauge(tmp_path):
    """The data sheet of a gauge knows nothing of the weather."""
    more = 'pressure = "absolute"\n[recording.accuracy]\npressure = { zero = "1 hPa" }'
    read = read_experiment(folder_of(tmp_path, ABSOLUTE, more=more)).recordings[0]
    assert allowed(read).pressure.zero == pytest.approx(np.hypot(1e2, 2e3))


def test_a_regulator_that_is_set_above_the_air_stays_beside_an_absolute_gauge(tmp_path):
    time = np.round(np.arange(200) * 0.01, 3)
    level = np.where(time < 0.5, 0.2, 2.0)
    columns = {"time [s]": time, "set_pressure [bar]": level, "pressure [bara]": level + 1.01325}
    columns |= {"displacement [mm]": 10 * level, "load [kg]": 5.0}
    folder_of(tmp_path, table(columns), test="step", more='pressure = "absolute"')
    (run,) = read_experiment(tmp_path).recordings[0].runs
    assert run.set_pressure.max() == pytest.approx(2e5)
    assert run.pressure.max() == pytest.approx(2e5, rel=1e-3)


@pytest.mark.parametrize(("swept", "runs"), [(True, 1), (False, 2)])
def test_a_pause_in_a_sweep_of_the_pressure_begins_no_run(tmp_path, swept, runs):
    columns = loop_columns()
    time = columns["time [s]"]
    way = columns["contraction [%]"] / 20
    pressure = 0.1 + 3.8 * way if swept else np.where(np.arange(len(time)) < 100, 1.0, 3.0)
    columns |= {"time [s]": time + 3.0 * (np.arange(len(time)) >= (75 if swept else 101)), "pressure [bar]": pressure}
    columns["force [N]"] = 100.0 + 50 * pressure - 100 * way
    read = read_experiment(folder_of(tmp_path, table(columns))).recordings[0]
    assert len(read.runs) == runs
