"""Recordings in Excel workbooks: the same checks as of a CSV. No formula is evaluated, its kept value is read."""

import datetime
import io
import re
import sys
import zipfile

import numpy as np
import pytest
from folders import folder_of, loop_csv, only_run
from other_files import full_columns, read_as, refused_as, rows_of, workbook

from fitting.errors import InputError
from fitting.recordings.experiment import read_experiment
from fitting.recordings.tables import read_table
from fitting.recordings.template import write_muscle_file

pytest.importorskip("openpyxl", reason="openpyxl is not installed: pip install 'mckibben-jax[files]'")
pytestmark = pytest.mark.filterwarnings("error")


def read(folder, content, more=""):
    return read_as("loops.xlsx", folder, content, more)


def refused(folder, content, more=""):
    return refused_as("loops.xlsx", folder, content, more)


def changed(at, cell, value):
    """The rows of the loop with one cell changed; row and column as in `rows_of`."""
    rows = rows_of()
    rows[at][cell] = value
    return rows


# --------------------------------------------------------------------------------------------------------- what is read


@pytest.mark.parametrize(
    "around",
    [
        lambda rows: {"loops": rows},
        lambda rows: {"Sheet1": [], "loops": rows, "Sheet3": [[]]},
        lambda rows: {"loops": [["# rig 3, Monday"], [], *rows]},
        lambda rows: {"loops": [rows[0], [], *rows[1:], [], [None, " "]]},
        lambda rows: {"loops": [[*row, "" if k else "remark", None] for k, row in enumerate(rows)]},
        lambda rows: {
            "loops": [[head.split(" [")[0] for head in rows[0]], ["s", "(bar)", "%", "[N]", None], *rows[1:]]
        },
    ],
    ids=["one sheet", "empty sheets", "remarks above", "empty rows", "an empty column", "a row of units"],
)
def test_a_sheet_is_read_as_the_same_csv(tmp_path, around):
    (run,) = read(tmp_path, workbook(around(rows_of()))).recordings[0].runs
    (tmp_path / "csv").mkdir()
    _, expected = only_run(folder_of(tmp_path / "csv", loop_csv()))
    for name in ("time", "pressure", "contraction", "measured", "weight", "branch"):
        np.testing.assert_array_equal(getattr(run, name), getattr(expected, name))


def test_rows_are_counted_as_the_spreadsheet_counts_them(tmp_path):
    rows = [["# a remark"], [], *changed(5, 3, "n/a")]
    said = refused(tmp_path, workbook({"loops": rows}))
    assert "row 8, column 'force [N]': not a number (found: 'n/a')" in said


def test_one_sheet_of_several_is_named(tmp_path):
    content = workbook({"Monday": rows_of(), "Tuesday": changed(1, 3, 201.0)})
    said = refused(tmp_path, content)
    assert "2 sheets with cells: 'Monday', 'Tuesday'" in said
    assert 'add sheet = "Monday"' in said
    (run,) = read(tmp_path, content, 'sheet = "Tuesday"').recordings[0].runs
    assert run.measured[0] == 201
    assert "did you mean 'Tuesday'" in refused(tmp_path, content, 'sheet = "tuesdy"')


def test_a_sheet_of_notes_is_passed_by(tmp_path):
    content = workbook({"Notes": [["operator", "A B"], ["room", 21.5]], "Loops": rows_of()})
    (run,) = read(tmp_path, content).recordings[0].runs
    assert run.measured[0] == 200
    (tmp_path / "muscle.toml").unlink()
    text = write_muscle_file(tmp_path).read_text()
    assert text.count("[[recording]]") == 1
    assert "# loops.xlsx, sheet Notes, is left out" in text


def test_init_writes_a_recording_for_every_sheet(tmp_path):
    (tmp_path / "monday.xlsx").write_bytes(workbook({"loops": rows_of(), "more loops": changed(1, 3, 201.0)}))
    text = write_muscle_file(tmp_path).read_text()
    assert text.count('file = "monday.xlsx"') == 2
    assert 'sheet = "more loops"' in text
    text = re.sub(r'"\? (mm|deg)"', r'"20 \1"', text).replace('length = "20 mm"', 'length = "300 mm"')
    (tmp_path / "muscle.toml").write_text(text)
    found = read_experiment(tmp_path).recordings
    assert [each.file for each in found] == ["monday.xlsx, sheet loops", "monday.xlsx, sheet more loops"]
    assert {each.stored_in for each in found} == {"monday.xlsx"}


def test_the_value_that_was_kept_beside_a_formula_is_read(tmp_path):
    content = with_cell(workbook({"loops": rows_of()}), "D2", "<f>999*2</f><v>200</v>")
    (run,) = read(tmp_path, content).recordings[0].runs
    assert run.measured[0] == 200


def with_cell(content, place, inside, head=b""):
    """A workbook in which one cell of the first sheet holds something else, as XML; `head` begins the sheet."""
    source, out = zipfile.ZipFile(io.BytesIO(content)), io.BytesIO()
    with zipfile.ZipFile(out, "w") as target:
        for name in source.namelist():
            text = source.read(name)
            if name.endswith("sheet1.xml"):
                pattern = rf'(<c r="{place}"[^>]*>).*?(</c>)'.encode()
                text, count = re.subn(pattern, rb"\1" + inside.encode() + rb"\2", text)
                assert count == 1
                text = head + text
            target.writestr(name, text)
    return out.getvalue()


# ------------------------------------------------------------------------------------------------------ what is refused


def test_a_formula_without_a_value_is_refused(tmp_path):
    said = refused(tmp_path, workbook({"loops": changed(3, 3, "=A4*2")}))  # openpyxl writes formulas only
    assert "row 4, column 'force [N]': the formula in this cell has no value (found: '=A4*2')" in said
    assert "save it" in said


@pytest.mark.parametrize(
    ("value", "words"),
    [
        ("#DIV/0!", "the formula in this cell has failed"),
        (datetime.datetime(2026, 5, 1, 12, 0, 1), "seconds from the beginning"),
        (datetime.time(12, 0, 1), "seconds from the beginning"),
        (True, "not a number"),
        ("2,5", "write decimal points"),
        ("2.5 s", "its unit in the header: [s]"),
        (1e200, "the number is too large"),
    ],
)
def test_a_cell_that_is_no_reading_is_named(tmp_path, value, words):
    said = refused(tmp_path, workbook({"loops": changed(4, 0, value)}))
    assert "row 5, column 'time [s]'" in said
    assert words in said


def test_merged_head_cells_are_noticed(tmp_path):
    rows = rows_of()
    rows[0] = ["time [s]", "pressure [bar]", "contraction [%]", None]
    content = workbook({"loops": rows}, lambda book: book.active.merge_cells("C1:D1"))
    said = refused(tmp_path, content)
    assert "row 1: the head of column D is empty, and readings stand below it" in said
    assert "merged" in said


def test_columns_are_called_as_the_spreadsheet_calls_them(tmp_path):
    """Behind Z comes AA: readings without a head in the 28th column."""
    rows = [[*row[:3], *([f"note {k}" for k in range(24)] if at == 0 else ["-"] * 24), None if at == 0 else 1.0]
            for at, row in enumerate(rows_of())]  # fmt: skip
    assert "the head of column AB is empty" in refused(tmp_path, workbook({"loops": rows}))


@pytest.mark.parametrize(
    ("sheets", "words"),
    [
        ({"a": []}, "the workbook is empty"),
        ({"a": [["# only remarks"]]}, "the sheet is empty"),
        ({"a": [["time [s]", "force [N]"]]}, "a header but no row of readings"),
        ({"a": rows_of()[1:]}, "there is no header"),
        ({"a": [row[:3] for row in rows_of()]}, "needs a column force"),
    ],
)
def test_a_sheet_that_is_no_recording_says_what_lacks(tmp_path, sheets, words):
    assert words in refused(tmp_path, workbook(sheets))


def test_an_option_of_another_kind_of_file_is_refused(tmp_path):
    (tmp_path / "data.csv").write_text(loop_csv())
    with pytest.raises(InputError, match="only an Excel file has a sheet"):
        read_experiment(folder_of(tmp_path, more='sheet = "a"'))
    assert "only a MATLAB file has a variable" in refused(tmp_path, workbook({"a": rows_of()}), 'variable = "a"')
    with pytest.raises(InputError, match="sheet is not text"):
        read(tmp_path, b"", "sheet = 2")


def test_an_old_workbook_is_told_from_a_damaged_one(tmp_path):
    assert "of the old kind (.xls)" in refused(tmp_path, b"\xd0\xcf\x11\xe0" + bytes(1000))
    assert "no Excel workbook" in refused(tmp_path, b"time,force\n")
    assert "no Excel workbook" in refused(tmp_path, workbook({"a": rows_of()})[:-100])


def test_without_openpyxl_the_message_says_what_to_install(tmp_path, monkeypatch):
    content = workbook({"a": rows_of()})
    monkeypatch.setitem(sys.modules, "openpyxl", None)
    said = refused(tmp_path, content)
    assert "an Excel file needs openpyxl" in said
    assert "pip install 'mckibben-jax[files]'" in said


def test_text_that_would_steer_a_screen_is_made_harmless(tmp_path):
    rows = [[*row, "x"] for row in rows_of()]
    rows[0][-1] = "note_x001b_[2J"  # how Excel writes an escape character
    notes = read(tmp_path, workbook({"a": rows})).recordings[0].notes
    assert all(note.isprintable() for note in notes)


def test_entities_are_not_expanded(tmp_path):
    """A text that stands for ten of another, nine times over, and one that stands for a file of this machine."""
    lines = "".join(f'<!ENTITY l{k + 1} "{f"&l{k};" * 10}">' for k in range(9))
    (tmp_path / "secret.txt").write_text("999")
    for entities, use in ((f'<!ENTITY l0 "ha">{lines}', "&l9;"), ('<!ENTITY f SYSTEM "secret.txt">', "&f;")):
        head = f"<?xml version='1.0'?><!DOCTYPE x [{entities}]>".encode()
        content = with_cell(workbook({"a": rows_of()}), "D2", f"<v>{use}</v>", head)
        assert "the workbook is damaged" in refused(tmp_path, content)


def test_damaged_workbooks_end_in_one_message(tmp_path):
    """Bytes of the parts inside changed: read or refused, never anything else."""
    content, scatter, path = workbook({"a": rows_of()}), np.random.default_rng(0), tmp_path / "f.xlsx"
    source = zipfile.ZipFile(io.BytesIO(content))
    for _ in range(60):
        parts = {name: bytearray(source.read(name)) for name in source.namelist()}
        victim = parts[str(scatter.choice([*parts]))]
        for place in scatter.integers(len(victim), size=3):
            victim[place] = int(scatter.choice(list(b'0123456789<>"=/ aznr')))
        with zipfile.ZipFile(path, "w") as target:
            for name, part in parts.items():
                target.writestr(name, bytes(part))
        assert is_read_or_refused(path)


def is_read_or_refused(path):
    """Whether the file is read, or refused with a cure."""
    try:
        read_table(path)
    except InputError as error:
        return bool(error.cure)
    return True


def test_full_columns_are_those_of_the_csv():
    assert [*full_columns()] == loop_csv().split("\n")[0].split(",")
