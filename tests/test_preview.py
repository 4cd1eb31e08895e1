"""What dropped files hold, shown before anybody has said what they are."""

import re

import numpy as np
import pytest

from fitting.errors import InputError
from fitting.workbench.preview import POINTS, column_html, previews, rows_html, sparkline


def written(folder, text):
    path = folder / "odd.csv"
    path.write_text(text, encoding="utf-8")
    return path


def heights(drawing):
    """How high the points of a course stand, from the top."""
    return [float(point.split(",")[1]) for point in re.search(r'points="([^"]*)"', drawing)[1].split()]


def test_first_rows_and_extents_are_those_of_the_file(tmp_path):
    rows = "".join(f"up;{k},5;{100 - k};\n" for k in range(30))
    label, number, other, empty = previews(written(tmp_path, f"way;t;druck;leer\n{rows}"), {})
    assert (label.head, label.extent, set(label.first)) == ("way", "up", {"up"})
    assert (number.extent, other.extent, empty.extent) == ("0.5 to 29.5", "71 to 100", "empty")
    assert number.first[:2] == ("0.5", "1.5")
    assert len(number.first) == 10
    table = rows_html((label, number))
    assert "30 rows" in table
    assert table.count("<tr>") == 11


def test_the_course_of_a_column_is_drawn_and_no_spike_is_lost(tmp_path):
    values = np.linspace(0.0, 1.0, 5000)
    values[3210] = 9.0
    (column,) = previews(written(tmp_path, "x\n" + "\n".join(f"{v:.6f}" for v in values)), {})
    drawn = heights(sparkline(column))
    assert POINTS <= len(drawn) <= 2 * POINTS
    assert drawn[0] == max(drawn)  # the least reading stands lowest
    assert sorted(drawn)[0] < 2
    assert sorted(drawn)[1] > 15  # one reading alone is so high
    assert 'aria-label="Course of x: 0 to 9"' in sparkline(column)


def test_a_reading_that_never_changes_and_one_that_misses_are_drawn(tmp_path):
    (still, gaps) = previews(written(tmp_path, "a,b\n" + "\n".join(f"5,{'' if k % 3 else k}" for k in range(60))), {})
    assert len(set(heights(sparkline(still)))) == 1
    assert (still.extent, gaps.extent) == ("5 to 5", "0 to 57")
    assert len(heights(sparkline(gaps))) == 20


def test_words_have_no_course_and_cannot_write_into_the_page(tmp_path):
    (column,) = previews(written(tmp_path, "<b>x</b>\n" + "<i>one</i>\ntwo\nthree\nfour\nfour\n"), {})
    assert sparkline(column) == ""
    assert column.extent == "<i>one</i>, two, three, ..."
    assert "<b>" not in column_html(column) + rows_html([column])
    assert "<i>" not in column_html(column) + rows_html([column])


def test_what_is_no_table_is_refused(tmp_path):
    with pytest.raises(InputError):
        previews(tmp_path / "missing.csv", {})
