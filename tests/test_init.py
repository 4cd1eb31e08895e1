"""`mckibben init` writes a muscle.toml that only needs its values."""

import json
import tomllib

import numpy as np
import pytest
from click.testing import CliRunner
from folders import folder_of, isometric_columns, loop_columns, loop_csv, release_columns, table

from fitting.cli.main import main
from fitting.errors import InputError
from fitting.recordings.experiment import read_experiment
from fitting.recordings.template import muscle_file, write_muscle_file
from mckibben_jax.muscle import quantities

pytestmark = pytest.mark.filterwarnings("error")


def test_init_writes_a_file_to_fill_in_and_never_overwrites(tmp_path):
    (tmp_path / "rig.csv").write_text(loop_csv().replace("force [N]", "Load cell"))
    (tmp_path / "held lengths.csv").write_text(table(isometric_columns()))
    (tmp_path / "quick_release.csv").write_text(table(release_columns()))
    path = write_muscle_file(tmp_path)
    text = path.read_text()
    for expected in (
        'test = "loop"',
        'test = "isometric"',
        'test = "quick release"',
        'columns = { force = "Load cell" }',
    ):
        assert expected in text
    assert [key for key in quantities() if f"{key} = " not in text] == []
    with pytest.raises(InputError, match="still to be filled in"):
        read_experiment(tmp_path)
    path.write_text(
        text.replace('length = "? mm"', 'length = "300 mm"', 1)
        .replace('radius = "? mm"', 'radius = "7 mm"')
        .replace('"? deg"', '"20 deg"')
        .replace('units = { force = "?" }', 'units = { force = "N" }')
    )
    filled = path.read_text()
    assert [r.test for r in read_experiment(tmp_path).recordings] == ["isometric", "quick release", "loop"]
    with pytest.raises(InputError, match="left alone"):
        write_muscle_file(tmp_path)
    assert path.read_text() == filled


@pytest.mark.parametrize("noise", [0.0, 0.1])
@pytest.mark.parametrize(("speed", "test"), [(0.0, "isometric"), (1.0, "loop")])
def test_a_length_that_stands_but_for_noise_is_held(tmp_path, speed, test, noise):
    """Three lengths one after the other, with a laser that is noisy or not; and a slow loop, 1 mm/s at 50 Hz."""
    time = np.arange(0, 120, 0.02)
    moved = speed * np.abs((time + 30) % 60 - 30) + (5.0 * (time // 40) if not speed else 0.0)
    moved = moved + np.random.default_rng(0).normal(0, noise, len(time))
    pressure = 2 + np.sin(time) * (speed == 0)
    lines = [f"{t:.2f};{p:.3f};{x:.2f};{10 * p - x:.2f}" for t, p, x in zip(time, pressure, moved, strict=True)]
    (tmp_path / "messung 1.csv").write_text("Zeit [s];Druck [bar];Weg [mm];Kraft [N]\n" + "\n".join(lines) + "\n")
    assert f'test = "{test}"' in muscle_file(tmp_path)


def test_init_in_a_folder_without_recordings(tmp_path):
    with pytest.raises(InputError, match="no recording"):
        write_muscle_file(tmp_path)
    with pytest.raises(InputError, match="no such folder"):
        write_muscle_file(tmp_path / "gone")


def test_a_load_that_is_read_all_the_time_is_a_force_and_what_is_not_used_is_said(tmp_path):
    """Load cells are called load; weights that are hung on have few values."""
    rows = "".join(f"{0.01 * i},{0.1 * i},300,{400 - i},7\n" for i in range(60))
    (tmp_path / "monday.csv").write_text("t (s),Stroke (mm),P (kPa),Load (N),Humidity (%)\n" + rows)
    text = muscle_file(tmp_path)
    assert 'force = "Load (N)"' in text
    assert "load = " not in text
    assert '# not used: "Humidity (%)"' in text
    assert 'test = "loop"' in text


def test_what_has_no_name_of_a_column_is_known_by_its_unit_where_only_one_has_it(tmp_path):
    """As LabVIEW calls its channels; of two columns in mm nobody knows which is meant."""
    (tmp_path / "loops.csv").write_text("time [s],Dev1/ai0 [kPa],Encoder [mm],Load cell [N]\n" + "0,1,2,3\n" * 9)
    (tmp_path / "other.csv").write_text(
        "time [s],Dev1/ai0 [kPa],Encoder [mm],Gap [mm],Load cell [N]\n" + "0,1,2,3,4\n" * 9
    )
    first, second = muscle_file(tmp_path).split("[[recording]]")[1:]
    assert 'columns = { pressure = "Dev1/ai0 [kPa]", displacement = "Encoder [mm]", force = "Load cell [N]" }' in first
    assert "displacement" not in second.split("accuracy")[0]
    assert '# not used: "Encoder [mm]", "Gap [mm]"' in second


def test_init_says_what_it_read(tmp_path):
    """A wrong column, unit or sign is seen there before anything is fitted."""
    (tmp_path / "rig.csv").write_text(loop_csv().replace("force [N]", "Load cell"))
    (tmp_path / "torn.csv").write_text("time [s],pressure [bar]\n0,1\n1,two\n")
    said = " ".join(
        CliRunner().invoke(main, ["init", str(tmp_path), "--json", str(tmp_path / "init.json")]).output.split()
    )
    columns = loop_columns()
    least, most = (float(f(columns["pressure [bar]"])) for f in (np.min, np.max))
    assert f"rig.csv: {len(columns['time [s]']):,} rows, taken for a test 'loop'" in said
    assert f"pressure {least:.4g} to {most:.4g} bar" in said
    assert (
        f"force ('Load cell') {columns['force [N]'].min():.4g} to {columns['force [N]'].max():.4g} (which unit?)"
        in said
    )
    assert "torn.csv is taken for a test 'loop', but cannot be read yet" in said
    assert "row 3, column 'pressure [bar]': not a number" in said
    rig, torn = json.loads((tmp_path / "init.json").read_text())["recordings"]
    assert rig["readings"]["pressure"] == {"least": least, "most": most, "unit": "bar"}
    assert rig["readings"]["force"]["unit"] is None
    assert (torn["rows"], torn["readings"]) == (None, {})


def test_a_load_cell_that_reads_kilograms_is_one_of_force(tmp_path):
    (tmp_path / "rig.csv").write_text(loop_csv().replace("force [N]", "load [kg]"))
    text = muscle_file(tmp_path)
    assert 'units = { force = "kgf" }' in text
    filled = text.replace('length = "? mm"', 'length = "300 mm"', 1).replace('radius = "? mm"', 'radius = "7 mm"')
    (tmp_path / "muscle.toml").write_text(filled.replace('"? deg"', '"20 deg"', 1))
    (run,) = read_experiment(tmp_path).recordings[0].runs
    assert run.measured == pytest.approx(9.80665 * loop_columns()["force [N]"])


def test_the_extension_of_a_tensile_machine_is_a_position_that_lengthens(tmp_path):
    """It is no tension, whatever letters are in it, and it falls while the muscle shortens."""
    columns = loop_columns()
    way = [str(value) for value in -0.06 * np.broadcast_to(columns.pop("contraction [%]"), 202)]
    way[17] = ""  # a reading that is missing
    (tmp_path / "cyclic.csv").write_text(table({**columns, "Extension [in]": way}))
    told = CliRunner().invoke(main, ["init", str(tmp_path)]).output
    assert "displacement ('Extension [in]'), lengthening positive," in " ".join(told.split())
    described = tmp_path / "muscle.toml"
    assert 'columns = { displacement = "Extension [in]" }' in described.read_text()
    assert "\nposition_sign = -1" in described.read_text()


@pytest.mark.parametrize("is_held", [False, True])
def test_a_muscle_that_pulls_a_spring_shortens_while_its_force_rises(tmp_path, is_held):
    """Only at a held pressure does a rising force say that lengthening is positive."""
    columns = loop_columns()
    way = np.broadcast_to(columns.pop("contraction [%]"), 202)
    shown = {"displacement [mm]": way, "force [N]": 5 * way, "pressure [bar]": 2.0 if is_held else 0.1 * way}
    (tmp_path / "rig.csv").write_text(table({**columns, **shown}))
    assert ("\nposition_sign = -1" in muscle_file(tmp_path)) is is_held


@pytest.mark.parametrize(("above", "is_turned"), [(0.0, True), (0.5, True), (1.5, False)])
def test_a_position_below_zero_lengthens_at_whatever_pressures(tmp_path, above, is_turned):
    """Three pressures in one file: nothing said that the crosshead counted lengthening, and the fit was of nonsense."""
    columns = loop_columns()
    way = above - np.broadcast_to(columns.pop("contraction [%]"), 202) / 2  # down to -10 mm
    shown = {"displacement [mm]": way, "pressure [bar]": np.repeat([1.5, 4.5], 101)}
    (tmp_path / "rig.csv").write_text(table({**columns, **shown}))
    assert ("\nposition_sign = -1" in muscle_file(tmp_path)) is is_turned


def test_weights_that_are_hung_on_without_a_time_are_static_points(tmp_path):
    heads = "mass [kg],pressure [bar],length [mm],branch"
    rows = [f"{mass},{p},{300 - 8 * p - 2 * mass:.1f},contraction" for mass in (1, 2, 5) for p in (1, 2, 3)]
    (tmp_path / "weights.csv").write_text("\n".join([heads, *rows]) + "\n")
    assert 'test = "static"' in muscle_file(tmp_path)


@pytest.mark.parametrize(
    ("head", "said"),
    [
        ("Pressure abs [kPa]", '\npressure = "absolute"    # a guess'),
        ("p_absolute [kPa]", '\npressure = "absolute"    # a guess'),
        ("Absolutdruck [kPa]", '\npressure = "absolute"    # a guess'),
        ("pAbs [kPa]", '\npressure = "absolute"    # a guess'),
        ("pressure of the absorber [kPa]", "\n# pressure"),
        ("abs(p) pressure [kPa]", "\n# pressure"),
        ("pressure (not absolute) [kPa]", "\n# pressure"),
    ],
)
def test_a_column_that_calls_itself_absolute_is_guessed_to_be(tmp_path, head, said):
    """It was taken for a gauge's without a word, and an atmosphere was missing from every reading."""
    columns = {head if name.startswith("pressure") else name: values for name, values in isometric_columns().items()}
    (tmp_path / "isometric.csv").write_text(table(columns))
    assert said in muscle_file(tmp_path)
    csv = table(isometric_columns()).replace("pressure [kPa]", head)
    called = f'columns = {{ pressure = "{head}" }}'
    assert is_asked(tmp_path, csv, called) == said.startswith("\npressure")
    assert not is_asked(tmp_path, csv, f'{called}\npressure = "gauge"')
    assert not is_asked(tmp_path, csv, f'{called}\npressure = "absolute"')


def is_asked(folder, csv, more):
    """Whether it is asked of an isometric recording if its pressures are absolute."""
    (recording,) = read_experiment(folder_of(folder, csv, test="isometric", more=more)).recordings
    return any("is read as pressure above the atmosphere" in note for note in recording.notes)


@pytest.mark.parametrize(("least", "said"), [(101, "vented once"), (5, "gauge is presumed\n"), (200, "presumed\n")])
def test_a_gauge_that_never_reads_less_than_the_atmosphere_is_asked_about(tmp_path, least, said):
    columns = isometric_columns()
    columns["pressure [kPa]"] = np.maximum(columns["pressure [kPa]"], least)
    (tmp_path / "isometric.csv").write_text(table(columns))
    assert said in muscle_file(tmp_path)


@pytest.mark.parametrize(("least", "name"), [(1.2, "displacement"), (150.0, "length")])
def test_a_position_that_comes_near_0_is_no_length(tmp_path, least, name):
    """A muscle of 180 mm cannot be 1 mm long: its 'position' was taken for its length, and the unit was doubted."""
    columns = release_columns()
    way = columns.pop("displacement [mm]")
    (tmp_path / "quick_release.csv").write_text(table(columns | {"position (mm)": least + way}))
    assert f'columns = {{ {name} = "position (mm)" }}' in muscle_file(tmp_path)


@pytest.mark.parametrize(
    ("encoding", "heads"),
    [
        ("cp932", ("No.", "時刻[s]", "圧力[MPa]", "変位[mm]", "張力[N]")),
        ("gb18030", ("序号", "时间(s)", "气压(kPa)", "位移(mm)", "拉力(N)")),
        ("cp949", ("번호", "시간 [s]", "압력 [bar]", "변위 [mm]", "장력 [N]")),
        ("cp1252", ("Nr.", "Zeit [s]", "Druck [bar]", "Verkürzung: Weg [mm]", "Kraft [N]")),
        ("utf-8", ("N°", "temps (s)", "pression (bar)", "déplacement (mm)", "effort (N)")),
        ("utf-8", ("αρ.", "χρόνος (s)", "πίεση (bar)", "θέση (mm)", "δύναμη (N)")),  # nobody knows but the units
    ],
)
def test_heads_are_read_in_the_languages_and_encodings_of_laboratories(tmp_path, encoding, heads):
    columns = loop_columns()
    ways = zip(heads[1:], ("time [s]", "pressure [bar]", "contraction [%]", "force [N]"), strict=True)
    number, shown = {heads[0]: np.arange(202)}, {head: columns[name] for head, name in ways}
    (tmp_path / "rig.csv").write_bytes(table(number | shown).encode(encoding))
    (entry,) = tomllib.loads(muscle_file(tmp_path))["recording"]
    assert entry["columns"] == dict(zip(("time", "pressure", "displacement", "force"), heads[1:], strict=True))


def test_the_voltage_of_a_gauge_is_no_pressure(tmp_path):
    """In Japanese and Chinese one is written with a letter of the other."""
    columns = loop_columns()
    shown = {"電圧": np.ones(202), "P1 [bar]": columns.pop("pressure [bar]")}
    (tmp_path / "rig.csv").write_text(table(shown | columns), encoding="utf-8")
    assert tomllib.loads(muscle_file(tmp_path))["recording"][0]["columns"] == {"pressure": "P1 [bar]"}


def spring_bench(folder, turned=True, zero=40.0, force=None):
    """Pressure swept against a spring, and the muscle held at two lengths; the laser counts from a place of its own."""
    columns = loop_columns()
    way = 3 * np.broadcast_to(columns.pop("contraction [%]"), 202)
    laser = zero + (-way if turned else way)
    columns |= {"pressure [bar]": 0.5 + 0.1 * way, "force [N]": 5 * way if force is None else force}
    (folder / "sweep.csv").write_text(table(columns | {"laser displacement [mm]": laser}))
    held = isometric_columns()
    held.pop("length [mm]")
    (folder / "held step.csv").write_text(table(held | {"laser displacement [mm]": zero - 12.0}))
    return [tomllib.loads(muscle_file(folder))["recording"][n] for n in (1, 0)]


@pytest.mark.parametrize(
    ("turned", "zero", "asked"), [(True, 200.0, True), (False, -200.0, True), (True, 75.0, True), (True, 0.0, False)]
)
def test_a_sensor_with_a_zero_of_its_own_is_asked_what_it_reads_at_rest(tmp_path, turned, zero, asked):
    """What the sweep betrays of the sensor holds for the recording, too, in which the muscle was held."""
    for entry in spring_bench(tmp_path, turned, zero):
        assert entry.get("position_sign", 1) == (-1 if turned else 1)
        assert entry.get("position_at_rest") == ("? mm" if asked else None)


def test_steps_of_pressure_that_a_load_cell_reads_are_no_test_of_the_position(tmp_path):
    _, held = spring_bench(tmp_path)
    assert held["test"] == "isometric"


def test_one_column_with_a_unit_says_nothing_of_a_file(tmp_path):
    (tmp_path / "rig.csv").write_text(table({"α": np.arange(30), "β [mm]": np.arange(30)}), encoding="utf-8")
    assert "columns" not in tomllib.loads(muscle_file(tmp_path))["recording"][0]


def test_a_muscle_that_is_held_while_it_relaxes_is_not_let_go(tmp_path):
    time = np.round(np.arange(400) * 0.05, 3)
    force = 100 - 5 * (1 - np.exp(-time / 5))
    shown = {"time [s]": time, "displacement [mm]": 10.0, "pressure [kPa]": 200.0, "force [N]": force}
    (tmp_path / "relax.csv").write_text(table(shown))
    assert tomllib.loads(muscle_file(tmp_path))["recording"][0]["test"] == "isometric"


def test_labview_calls_its_time_x_value(tmp_path):
    columns = loop_columns()
    (tmp_path / "rig.csv").write_text(table({"X_Value": columns.pop("time [s]")} | columns))
    (entry,) = tomllib.loads(muscle_file(tmp_path))["recording"]
    assert (entry["columns"]["time"], entry["test"]) == ("X_Value", "loop")
