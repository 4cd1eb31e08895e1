"""Rows above the header: what loggers write about the rig and the day does not hide the table below it."""

import numpy as np
import openpyxl
import pytest

from fitting.errors import InputError
from fitting.recordings.tables import read_heads, read_table

ROWS = [[0.0, 1.0037, 0.0, 185.76], [0.01, 1.0048, 0.05, 182.07], [0.02, 1.0078, 0.1, 180.53]]
GERMAN = ["Zeit [s]", "Druck [bar]", "Weg [mm]", "Kraft [N]"]
CALLED = dict(zip(("time", "pressure", "displacement", "force"), GERMAN, strict=True))
LABVIEW = ("Prüfstand 3, LabVIEW Messdatei", "Datum: 17.06.2025 14:11:11", "Abtastrate;100;Hz", "")


def written(path, *above, heads=GERMAN, mark=",", separator=";", units=(), end=""):
    rows = [[str(value).replace(".", mark) for value in row] for row in ROWS]
    table = [separator.join(cells) + end for cells in (heads, *([units] if units else []), *rows)]
    path.write_text("\r\n".join([*above, *table]) + "\r\n", encoding="cp1252")
    return path


@pytest.mark.parametrize("end", ["", ";"])
def test_rows_of_a_logger_above_the_header_are_passed_over(tmp_path, end):
    table = read_table(written(tmp_path / "a.csv", *LABVIEW, end=end), CALLED)
    assert table.header_row == len(LABVIEW) + 1
    np.testing.assert_array_equal(table.row, len(LABVIEW) + 2 + np.arange(len(ROWS)))
    np.testing.assert_allclose(table["force"], [row[3] for row in ROWS])
    np.testing.assert_allclose(table["pressure"], [1e5 * row[1] for row in ROWS])


def test_a_row_of_units_still_stands_below_the_header(tmp_path):
    heads, units = [head.split(" ")[0] for head in GERMAN], ["s", "bar", "mm", "N"]
    assert read_heads(written(tmp_path / "a.csv", *LABVIEW, heads=heads, units=units)) == GERMAN


@pytest.mark.parametrize(
    "above",
    [
        ["Key;Value"] + [f"Setting {k};{k}" for k in range(9)],  # more rows than the table has
        ["Prüfstand 3;;;", "Datum;17.06.2025;;"],  # as spreadsheets save them
        ["Prüfstand 3", "Kanal;A;B;C"],  # as wide as the table
        ["Length;260"],  # with a word that heads a column elsewhere
    ],
)
def test_whatever_stands_above_the_header_is_passed_over(tmp_path, above):
    table = read_table(written(tmp_path / "a.csv", *above), CALLED)
    assert table.header_row == len(above) + 1
    assert len(table["force"]) == len(ROWS)


def test_a_first_row_that_is_wider_than_the_table_is_its_header(tmp_path):
    """A slow sensor or a remark stands in the last column of a few rows."""
    heads, rows = [*GERMAN, "Temp [C]"], [[*map(str, row), ""] for row in ROWS]
    rows[0][-1] = "20.1"
    path = tmp_path / "a.csv"
    path.write_text("\n".join(";".join(cells) for cells in (heads, *rows, *rows[1:])))
    assert read_heads(path) == heads


def test_separators_inside_quotes_cut_no_head_in_two(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text('"Zeit, gemessen","Druck, p"\ns,bar\n0,1\n1,1\n2,1\n')
    assert read_heads(path) == ["Zeit, gemessen [s]", "Druck, p [bar]"]


@pytest.mark.parametrize("ending", ["csv", "xlsx"])
def test_readings_above_the_header_are_not_lost_in_silence(tmp_path, ending):
    heads, path = ["time [s]", "pressure [bar]", "displacement [mm]", "force [N]"], tmp_path / f"a.{ending}"
    rows = [*ROWS, heads, *ROWS]
    if ending == "csv":
        path.write_text("\n".join(",".join(map(str, cells)) for cells in rows))
    else:
        book = openpyxl.Workbook()
        for cells in rows:
            book.active.append(cells)
        book.save(path)
    with pytest.raises(InputError, match="there are readings above the header") as refused:
        read_table(path)
    assert "row 4" in str(refused.value)


def test_heads_that_the_program_knows_are_found_whatever_stands_above(tmp_path):
    """Even rows with as many cells as the table has."""
    heads = ["time [s]", "pressure [bar]", "displacement [mm]", "force [N]"]
    path = written(tmp_path / "a.csv", "Channel,1,2,3", "Gain,10,10,2", heads=heads, mark=".", separator=",")
    assert read_table(path).header_row == 3


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        (["Rig 3", "0;1;2;3", "1;1;2;3", "2;1;2;3"], "there is no header"),
        (["Zeit [s];Druck [bar];Weg [mm]", "0;1;2;3", "1;1;2;3"], "the row has 4 cells, the header 3"),
        (["Rig 3", "Zeit [s];Druck [bar];Weg [mm]", "0;1;2;3", "1;1;2;3"], "the row has 4 cells, the header 3"),
    ],
)
def test_what_is_wrong_below_such_rows_is_said_as_ever(tmp_path, lines, said):
    path = tmp_path / "a.csv"
    path.write_text("\n".join(lines))
    called = {name: head for name, head in CALLED.items() if name != "force"}
    with pytest.raises(InputError, match=said):
        read_table(path, called)


def test_rows_above_the_header_of_a_sheet_are_passed_over(tmp_path):
    book = openpyxl.Workbook()
    for cells in (["Rig 3"], ["Operator", "M. Muster"], [], GERMAN, *ROWS):
        book.active.append(cells)
    book.save(tmp_path / "a.xlsx")
    table = read_table(tmp_path / "a.xlsx", CALLED)
    assert table.header_row == 4
    np.testing.assert_allclose(table["force"], [row[3] for row in ROWS])
