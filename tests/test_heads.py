"""What a header cell says: its name, its unit in brackets or behind the name, and what the name means."""

from pathlib import Path

import numpy as np
import pytest
from folders import folder_of, loop_columns, only_run, table

from fitting.errors import InputError
from fitting.recordings.guesses import guesses_of
from fitting.recordings.heads import plain_name, split_head
from fitting.recordings.tables import _called


@pytest.mark.parametrize(
    ("head", "name", "unit"),
    [
        ("strain [-]", "strain", "-"),
        ("Set pressure (bar)", "Set pressure", "bar"),
        ("travel_mm", "travel", "mm"),
        ("p_psi", "p", "psi"),
        ("load_g", "load", "g"),
        ("F_N", "F", "N"),
        ("time_s", "time", "s"),
        ("x_m", "x", "m"),
        ("set_pressure_kPa", "set_pressure", "kPa"),
        ("laser1_mm", "laser1", "mm"),
        ("millis", "millis", "ms"),
        ("p_g", "p_g", None),  # a gauge's pressure, no grams
        ("p_s", "p_s", None),  # of the supply
        ("room_m", "room_m", None),  # nobody knows what it measures
        ("force_mm", "force_mm", None),
        ("set_pressure", "set_pressure", None),
        ("run_1", "run_1", None),
        ("mm", "mm", None),
        ("extension_mm", "extension", "mm"),  # no tension, whatever letters are in it
        ("compression_mm", "compression_mm", None),  # nobody knows that word; in pressures there are no millimetres
        ("pull_length_mm", "pull_length", "mm"),
        ("Millis", "Millis", "ms"),
        ("travel_mm [cm]", "travel_mm", "cm"),  # brackets have the last word
    ],
)
def test_a_unit_stands_in_brackets_or_behind_a_name_that_it_fits(head, name, unit):
    assert split_head(head) == (name, unit)


def made(folder):
    folder.mkdir()
    return folder


def test_a_column_with_its_unit_behind_its_name_is_read(tmp_path):
    """As in loops that say it in brackets."""
    columns = loop_columns()
    folder_of(made(tmp_path / "usual"), table(columns))
    heads = ("time_s", "pressure_bar", "contraction [%]", "force_N")
    folder_of(made(tmp_path / "behind"), table(dict(zip(heads, columns.values(), strict=True))))
    (_, usual), (_, behind) = only_run(tmp_path / "usual"), only_run(tmp_path / "behind")
    for signal in ("time", "pressure", "contraction", "measured"):
        np.testing.assert_array_equal(getattr(behind, signal), getattr(usual, signal))


def test_of_two_columns_that_of_the_usual_head_is_read(tmp_path):
    """A logger that writes the force twice says so; two heads in brackets are a mistake."""
    columns = loop_columns()
    folder_of(made(tmp_path / "twice"), table({"force_kgf": 1.0, **columns}))
    found, run = only_run(tmp_path / "twice")
    assert np.max(run.measured) == np.max(columns["force [N]"])
    assert "not used: force_kgf" in found.notes
    folder_of(made(tmp_path / "positions"), table({"length_mm": 250.0, **columns}))
    found, run = only_run(tmp_path / "positions")
    assert run.contraction.max() == pytest.approx(columns["contraction [%]"].max() / 100)
    assert "not used: length_mm" in found.notes
    folder_of(made(tmp_path / "mistake"), table({"force [kgf]": 1.0, **columns}))
    with pytest.raises(InputError, match="two columns are called force"):
        only_run(tmp_path / "mistake")


def test_what_a_hobby_board_writes_is_known(tmp_path):
    """No unit is left to be stated, and grams of a load cell are a force."""
    columns = loop_columns()
    heads = ("millis", "p_psi", "travel_mm", "load_g")
    (tmp_path / "board.csv").write_text("# board v2, 3 bar\n" + table(dict(zip(heads, columns.values(), strict=True))))
    (guess,) = guesses_of(tmp_path)
    assert guess.columns == {"time": "millis", "pressure": "p_psi", "displacement": "travel_mm", "force": "load_g"}
    assert guess.units == {"force": "gf"}
    assert guess.test == "loop"


def test_a_plain_name_has_no_unit():
    assert [plain_name(head) for head in ("Set pressure [bar]", "force_N", "p_g")] == ["set_pressure", "force", "p_g"]


@pytest.mark.parametrize(
    ("heads", "named", "read"),
    [
        (("travel_mm [mm]", "x [mm]"), "travel_mm", 0),  # a unit may be part of a name
        (("F_N [N]", "F [kN]"), "F_N", 0),
        (("F [kN]", "F_N [N]"), "F_N", 1),
        (("F [kN]", "G [N]"), "F", 0),
        (("F_N", "G [N]"), "F", 0),
    ],
)
def test_a_column_is_found_by_what_it_is_called_before_its_unit_is_taken_off(heads, named, read):
    assert _called("force", named, list(heads), Path("rig.csv")) == read


def test_what_tells_no_more_than_the_usual_columns_stays_unused(tmp_path):
    columns = loop_columns()
    folder_of(made(tmp_path / "load"), table({"load_kg": 1.0, **columns}))
    found, _ = only_run(tmp_path / "load")
    assert "not used: load_kg" in found.notes
    twice = {"force_kgf": 1.0, "force_N": columns.pop("force [N]"), **columns}
    folder_of(made(tmp_path / "twice"), table(twice))
    with pytest.raises(InputError, match="two columns are called force"):
        only_run(tmp_path / "twice")
