"""What loggers and spreadsheets write: encodings, line ends, separators, decimal commas, comments."""

import os
import re

import pytest
from folders import folder_of, loop_columns, loop_csv, only_run, recording

from fitting.errors import InputError
from fitting.recordings.experiment import read_experiment
from fitting.recordings.settings import TABLES
from fitting.recordings.tables import read_table
from fitting.recordings.units_row import with_units

pytestmark = pytest.mark.filterwarnings("error")


@pytest.mark.parametrize(
    "change",
    [
        lambda text: ("\ufeff" + text).encode(),
        lambda text: text.encode("utf-16"),
        lambda text: text.replace("\n", "\r\n").encode(),
        lambda text: text.replace("\n", "\r").encode(),
        lambda text: text.replace(",", ";").encode(),
        lambda text: text.replace(",", "\t").encode(),
        lambda text: text.replace(",", ";").replace(".", ",").encode(),
        lambda text: text.replace(",", "\t").replace(".", ",").encode(),
        lambda text: text.replace(",", ", ").encode(),
        lambda text: text.replace("\n", ",\n").encode(),
        lambda text: text.rstrip("\n").encode(),
        lambda text: text.encode("utf-16-le"),
        lambda text: text.encode("utf-16-be"),
        lambda text: ("sep=;\n" + text.replace(",", ";")).encode(),
        lambda text: (text + "\x1a").encode(),
        lambda text: text.replace("time", "# \u00b0C \u2028\ntime").encode(),
        lambda text: text.replace("time", "# 20 \u00b0C\ntime").encode("latin-1"),
    ],
    ids=["BOM", "UTF-16", "CRLF", "CR", "semicolons", "tabs", "decimal commas", "tabs, decimal commas", "spaces",
         "trailing commas", "no last newline", "UTF-16 LE without mark", "UTF-16 BE without mark", "sep=", "Ctrl-Z",
         "odd line ends in a comment", "Latin-1"],
)  # fmt: skip
def test_what_loggers_and_spreadsheets_write_is_read(tmp_path, change):
    _, run = only_run(folder_of(tmp_path, change(loop_csv())))
    assert run.measured == pytest.approx(loop_columns()["force [N]"])
    assert run.row[-1] - run.row[0] == 201


@pytest.mark.parametrize(
    "units", ["s,bar,%,N", "(s),(bar),(%),(N)", '"[s]","[bar]","[%]","[N]"', " s , bar , % , N ,,"]
)
def test_a_row_of_units_below_the_header_belongs_to_it(tmp_path, units):
    """Universal testing machines write them so, and some loggers."""
    header, body = loop_csv().split("\n", 1)
    bare = re.sub(r" \[[^\]]*\]", "", header)
    (tmp_path / "units.csv").write_text(f"{bare}\n{units}\n{body}")
    (tmp_path / "plain.csv").write_text(loop_csv())
    found, expected = (read_table(tmp_path / name) for name in ("units.csv", "plain.csv"))
    assert found.units == expected.units
    assert list(found.row) == [row + 1 for row in expected.row]
    for name in expected.columns:
        assert list(found[name]) == list(expected[name])


def test_the_form_of_a_clock_below_the_header_is_no_unit():
    heads, below = ["Zeit", "Solldruck", "Kraft", "Phase"], ["[hh:mm:ss]", "[bar]", "[kgf]", "-"]
    assert with_units(heads, below) == ["Zeit", "Solldruck [bar]", "Kraft [kgf]", "Phase [-]"]
    assert with_units(heads, ["[hh:mm:ss]", "[bar]", "[kgf]"]) == ["Zeit", "Solldruck [bar]", "Kraft [kgf]", "Phase"]


def test_a_unit_of_a_column_that_nobody_uses_is_no_obstacle():
    heads = ["time", "pressure", "strain", "force", "room"]
    named = ["time [s]", "pressure [bar]", "strain [1]", "force [N]", "room"]
    assert with_units(heads, ["s", "bar", "1", "N", "\u00b0C"]) == named
    assert with_units(heads, ["s", "bar", "1", "N", "n/a"]) == named


@pytest.mark.parametrize(
    "below",
    [
        ["0.1", "bar", "N"],
        ["", "", ""],
        ["A", "", ""],
        ["N/A", "N/A", "N/A"],
        ["s", "bar", "rising slowly"],
        ["s", "bar", "N", "m"],
        ["s", "bar", "kN"],
    ],
    ids=["a reading", "nothing", "a label", "nothing read", "a remark", "too many", "another one than the head's"],
)
def test_other_rows_below_the_header_are_no_units(below):
    assert with_units(["time", "pressure", "force [N]"], below) is None


def test_comments_and_blank_lines_do_not_shift_the_rows(tmp_path):
    lines = loop_csv().splitlines()
    lines[50] = lines[50].replace(",2.0,", ",two,")
    text = "\n".join(["# made by hand", "", lines[0], "# begins", *lines[1:]])
    with pytest.raises(InputError) as caught:
        read_experiment(folder_of(tmp_path, text))
    assert caught.value.row == text.splitlines().index(next(line for line in text.splitlines() if "two" in line)) + 1


def test_a_file_beyond_the_limit_is_refused_before_it_is_read(tmp_path):
    with (tmp_path / "data.csv").open("wb") as file:
        file.truncate(5 * TABLES.csv_bytes)  # a hole: takes no room on the disk
    with pytest.raises(InputError, match=r"larger than 100 MB.*500 MB.*keep every 5th row"):
        read_table(tmp_path / "data.csv")


@pytest.mark.parametrize("name", ["/dev/zero", "/dev/stdin", ".", "a\\u0000b", "../gone.csv"])
def test_what_is_no_file_is_not_waited_for(tmp_path, name):
    with pytest.raises(InputError, match="no such file"):
        read_experiment(folder_of(tmp_path, loop_csv(), toml=recording(file=name)))


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes on this system")
def test_a_pipe_is_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "pipe.csv")
    with pytest.raises(InputError, match="no such file"):
        read_experiment(folder_of(tmp_path, toml=recording(file="pipe.csv")))
