"""Data that cannot say what they are asked: the right sentence, not a number that pretends to mean something."""

import numpy as np
import pytest
from click.testing import CliRunner
from folders import MUSCLE, folder_of, isometric_columns, loop_columns, recording, release_columns, table
from small_muscle import loops, write

from fitting.cli.main import main
from fitting.errors import InputError
from fitting.recordings.experiment import read_experiment
from fitting.recordings.noted import notes_of

pytestmark = pytest.mark.filterwarnings("error")
FORCE = loop_columns()["force [N]"]
NOISE = np.random.default_rng(0).normal(0, 0.3, len(FORCE))


def with_force(values):
    return table(loop_columns() | {"force [N]": values})


def headed(old, new, values=None):
    """The loops with a column under another head."""
    columns = {(new if name == old else name): v for name, v in loop_columns().items()}
    return table(columns | ({} if values is None else {new: values}))


def exchanged(one, other):
    columns = loop_columns() | {"pressure [bar]": np.full(len(FORCE), 20.0)}
    return table(columns | {one: columns[other], other: columns[one]})


# what the file holds -> (table, what the message must say)
REFUSED = {
    "constant force": (with_force(150.0), ("row 1", "'force [N]'", "stays the same", "dead load cell", "isotonic")),
    "constant force, noisy": (with_force(np.round(150 + NOISE, 3)), ("stays the same", "changes by 1.2")),
    "saturated throughout": (with_force(np.minimum(FORCE, 20.0)), ("stays the same", "saturated")),
    "all slack": (with_force(0.0), ("row 1", "'force [N]'", "all but nothing", "434 N", "slack")),
    "all slack, noisy": (with_force(NOISE), ("all but nothing", "at most 0.7", "not connected")),
    "kN for N": (with_force(FORCE / 1000), ("all but nothing", "0.2 N", "N or kN")),
    "mN for N": (with_force(FORCE * 1000), ("row 2", "461 times", "200000 N", "units of force", "valid =")),
    "bar for kPa": (headed("pressure [bar]", "pressure [kPa]"), ("46.1 times", "4.34 N", "units of force")),
    "kPa for Pa": (headed("pressure [bar]", "pressure [Pa]", 200.0), ("never reaches 1 kPa",)),
    "Pa for kPa": (headed("pressure [bar]", "pressure [kPa]", 2e5), ("above 5 MPa", "200 MPa")),
    "m for mm": (
        headed("contraction [%]", "displacement [mm]", 0.003 * loop_columns()["contraction [%]"]),
        ("row 1", "'displacement [mm]'", "falls by 80 %", "unit of this column"),
    ),
    "1 for %": (headed("contraction [%]", "contraction [%]", FORCE * 0 + 0.1 - FORCE / 2000), ("falls by 80 %",)),
    "mm for m": (headed("contraction [%]", "displacement [m]"), ("contraction outside -0.2 .. 0.6",)),
    "counts of 12 bit": (
        with_force(np.round(2048 + 8 * FORCE).clip(0, 4095).astype(int)),
        ("row 2", "'force [N]'", "8.41 times", "'3648 N'", "raw counts", "calibration"),
    ),
    "counts of 24 bit": (with_force((2**23 + 20000 * FORCE).astype(int)), ("raw counts",)),
    "one wild reading": (with_force(np.where(np.arange(202) == 30, 1e9, FORCE)), ("row 32", "check this reading")),
    "force and contraction": (exchanged("force [N]", "contraction [%]"), ("contraction outside",)),
    "force and pressure": (
        table({"time [s]": loop_columns()["time [s]"], "pressure [kPa]": FORCE, "force [N]": 200.0}
              | {"contraction [%]": loop_columns()["contraction [%]"]}),
        ("stays the same", "force and pressure are exchanged"),
    ),
    "pulling counted negative": (with_force(-FORCE), ("rises where that of a muscle falls", "force_sign = -1")),
    "the wrong way round": (
        with_force(240 - FORCE), ("rises where that of a muscle falls", "Cure: if it counts lengthening as positive")
    ),
}  # fmt: skip


@pytest.mark.parametrize(
    ("test", "more", "cure"),
    [
        ("loop", "", "Cure: if it counts lengthening as positive"),
        ("loop", "position_sign = -1", "Cure: leave position_sign out"),
        ("isometric", "", "Cure: if the rig counts pulling as negative"),
    ],
)
def test_the_cure_for_a_force_that_rises_is_one_that_helps(tmp_path, test, more, cure):
    """Not the sign that is written already, nor one of a length that is held."""
    columns = loop_columns() if test == "loop" else isometric_columns()
    if not more:  # else the position is turned, which was right
        columns["force [N]"] = 240 - np.asarray(columns["force [N]"])
    with pytest.raises(InputError, match="rises where that of a muscle falls") as caught:
        read_experiment(folder_of(tmp_path, table(columns), test=test, more=more))
    assert cure in str(caught.value)


@pytest.mark.parametrize("case", REFUSED)
def test_readings_that_no_muscle_gives_are_refused(tmp_path, case):
    csv, said = REFUSED[case]
    with pytest.raises(InputError) as caught:
        read_experiment(folder_of(tmp_path, csv))
    message = str(caught.value)
    assert all(part in message for part in said), message
    assert caught.value.cure
    assert caught.value.file


def test_who_knows_better_is_believed(tmp_path):
    data = read_experiment(folder_of(tmp_path, with_force(FORCE * 100), more='valid = { force = ["0 N", "90 kN"] }'))
    assert data.recordings[0].runs[0].measured.max() == pytest.approx(20000)


@pytest.mark.parametrize("factor", [0.2, 1, 3])
def test_a_muscle_may_pull_a_good_deal_more_or_less_than_the_ideal_one(tmp_path, factor):
    read_experiment(folder_of(tmp_path, with_force(FORCE * factor)))


def test_a_vented_muscle_and_its_rubber_are_left_alone(tmp_path):
    read_experiment(folder_of(tmp_path, headed("pressure [bar]", "pressure [bar]", 0.0)))


@pytest.mark.parametrize("test", ["quick release", "isotonic"])
def test_a_muscle_that_does_not_move(tmp_path, test):
    with pytest.raises(InputError, match="does not move in any run"):
        read_experiment(folder_of(tmp_path, table(release_columns() | {"displacement [mm]": 5.0}), test=test))


def test_a_load_of_twenty_tons(tmp_path):
    with pytest.raises(InputError, match=r"row 2, column 'load \[t\]'.*the load is"):
        read_experiment(folder_of(tmp_path, table(release_columns(load="load [t]")), test="quick release"))


def test_held_lengths_whose_force_does_not_follow_the_pressure(tmp_path):
    with pytest.raises(InputError, match="force stays the same"):
        read_experiment(folder_of(tmp_path, table(isometric_columns() | {"force [N]": 50.0}), test="isometric"))


# ------------------------------------------------------------------------------------------- read, and said what lacks


def noted(folder):
    return " | ".join(notes_of([read_experiment(folder)]))


def test_one_pressure_and_one_branch_are_said(tmp_path):
    half = {name: np.broadcast_to(v, 202)[:50] for name, v in loop_columns().items()}
    notes = noted(folder_of(tmp_path, table(half)))
    assert "only contracting was recorded: friction cannot be told" in notes
    assert "one pressure only, 2 bar" in notes


def test_loops_faster_than_muscles_are_doubted(tmp_path):
    """Seconds that stand under a head of milliseconds: a stroke of 50 mm in 3 ms."""
    folder = write(tmp_path / "fast", loops())
    called = (folder / "loops.csv").read_text().replace("time [s]", "time [ms]")
    (folder / "loops.csv").write_text(called)
    assert "is the unit of the time right?" in noted(folder)
    assert "is the unit of the time right?" not in noted(write(tmp_path / "slow", loops()))


def test_several_pressures_and_both_branches_are_not(tmp_path):
    notes = noted(write(tmp_path / "m", loops()))
    assert "only" not in notes


def test_two_points_are_said_to_be_two(tmp_path):
    csv = table({"pressure [bar]": [2, 2], "contraction [%]": [0, 10], "force [N]": [400, 250]})
    assert "only 2 readings count: any model with that many parameters" in noted(
        folder_of(tmp_path, csv, test="static")
    )


def test_one_missing_reading_costs_its_sample_and_its_row_is_named(tmp_path):
    force = FORCE.astype(object)
    force[[29, 30]] = "", "inf"
    folder = folder_of(tmp_path, with_force(force))
    assert "2 of 202 samples carry no weight: no reading in 'force [N]' (rows 31, 32)" in noted(folder)
    assert read_experiment(folder).recordings[0].runs[0].weight[[29, 30]].sum() == 0


def test_a_copied_run_is_no_repeat(tmp_path):
    columns = {name: np.tile(np.broadcast_to(v, 202), 3) for name, v in loop_columns().items()}
    columns["force [N]"] = columns["force [N]"] + np.r_[np.zeros(404), NOISE]
    folder = folder_of(tmp_path, table({"run": np.repeat([1, 2, 3], 202)} | columns))
    first, copy, repeat = read_experiment(folder).recordings[0].runs
    assert (first.weight.any(), copy.weight.any(), repeat.weight.any()) == (True, False, True)
    assert "run 2 of data.csv is a copy of run 1 of data.csv" in noted(folder)


def test_a_copied_file_is_refused(tmp_path):
    folder = folder_of(
        tmp_path, table(loop_columns()), toml=recording() + recording(file="copy.csv").replace(MUSCLE, "")
    )
    (folder / "copy.csv").write_bytes((folder / "data.csv").read_bytes())
    with pytest.raises(InputError, match=r"copy\.csv.*is a copy of run 1 of data\.csv.*leave one"):
        read_experiment(folder)


# ------------------------------------------------------------------------------------------------------- the commands


def said_by(command, folder):
    result = CliRunner().invoke(main, [command, str(folder)])
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result


@pytest.mark.parametrize("command", ["compare", "diagnose", "fit", "discover", "plan", "posterior"])
def test_every_command_refuses_with_one_line(tmp_path, command):
    result = said_by(command, folder_of(tmp_path, with_force(0.0)))
    assert result.exit_code == 2
    assert result.stderr.startswith("mckibben: ")
    assert result.stderr.count("\n") == 1


NAME = "a 'b' \"c\" <script>alert(1)</script> ../../é ß"


@pytest.mark.slow
def test_names_are_shown_as_text_and_written_nowhere_else(tmp_path):
    folder = tmp_path / "data <b> é"
    write(folder, loops(points=20, repeats=2), name="x")
    toml = (folder / "muscle.toml").read_text().replace('name = "x"', f"name = '''{NAME}'''")
    (folder / "muscle.toml").write_text(toml.replace("loops.csv", "l <i> é.csv"), encoding="utf-8")
    (folder / "loops.csv").rename(folder / "l <i> é.csv")
    before = set(tmp_path.rglob("*"))
    page, result = tmp_path / "page.html", tmp_path / "result.json"
    done = CliRunner().invoke(main, ["fit", str(folder), "--html", str(page), "--json", str(result)])
    assert done.exit_code == 0, done.output
    assert set(tmp_path.rglob("*")) - before == {page, result, folder / "model.toml"}
    text = page.read_text(encoding="utf-8")
    assert "<script>alert(1)" not in text
    assert "l <i> é.csv" not in text
    assert "&lt;script&gt;alert(1)" in text


@pytest.mark.slow
@pytest.mark.parametrize(
    ("rows", "said"),
    [
        (loops(pressures=(3e5,)), "one pressure only, 300 kPa"),
        ([row for row in loops(repeats=1) if row[1] < 2.99], "only contracting was recorded"),
        ([(*row[:4], min(row[4], 300.0)) for row in loops()], "reading saturated or muscle slack"),
        ([(*row[:4], np.nan if k == 40 else row[4]) for k, row in enumerate(loops())], "(row 42)"),
    ],
    ids=["one pressure", "one branch", "saturated", "one missing"],
)
def test_compare_says_what_these_data_cannot(tmp_path, rows, said):
    result = said_by("compare", write(tmp_path / "m", rows))
    assert result.exit_code == 0
    assert said in " ".join(result.output.split())
