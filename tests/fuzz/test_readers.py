"""Damaged files end in a result or a refusal in words, and a changed number is reported or shows."""

import re
from random import Random

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fitting import units
from fitting.errors import InputError
from fitting.recordings.muscle_file import read_muscle
from fitting.recordings.tables import read_table

from .mutations import TOKENS, damaged
from .readers import FOLDER, LOOP_HEAD, MUSCLE, READERS, _loops, _table, refusal

pytestmark = pytest.mark.filterwarnings("error")
few = settings(
    max_examples=60,
    deadline=None,
    derandomize=True,
    database=None,
    suppress_health_check=(HealthCheck.too_slow, HealthCheck.filter_too_much),
)
many = settings(few, max_examples=300)

PLAIN = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
CELLS = st.one_of(
    st.from_regex(PLAIN, fullmatch=True),
    st.floats(-1e6, 1e6).map(repr),
    st.sampled_from([token.decode("utf-8", "ignore") for token in TOKENS if len(token) < 20]),
    st.tuples(st.from_regex(PLAIN, fullmatch=True), st.sampled_from(["_", ",", "'", " ", "d", "x", "−", "%", "f", "L"]),
              st.from_regex(PLAIN, fullmatch=True)).map("".join),
    st.text(st.sampled_from("0123456789.,-+eE_ 'xd"), max_size=8),
)  # fmt: skip


@pytest.mark.parametrize("name", READERS)
def test_good_inputs_are_read(name):
    for good in READERS[name].good:
        assert refusal(READERS[name], good) is None


@pytest.mark.parametrize("name", READERS)
@few
@given(seed=st.integers(0, 2**32))
def test_damaged_inputs_are_read_or_refused_in_words(name, seed):
    reader, random = READERS[name], Random(seed)
    refusal(reader, damaged(random.choice(reader.good), random, reader.tree))


@many
@given(text=CELLS, row=st.integers(0, 39), column=st.integers(0, 3))
def test_a_changed_cell_is_reported_or_shows(text, row, column):
    lines = _table(LOOP_HEAD, _loops()).decode().splitlines()
    cells = lines[1 + row].split(",")
    cells[column] = text
    lines[1 + row] = ",".join(cells)
    _check(lines, ",", text, row, column, float(text) if PLAIN.fullmatch(text.strip()) else None)


@many
@given(text=CELLS, row=st.integers(0, 39), column=st.integers(0, 3))
def test_a_changed_cell_between_semicolons_is_reported_or_shows(text, row, column):
    lines = _table(LOOP_HEAD, _loops(), ";", ",").decode().splitlines()
    cells = lines[1 + row].split(";")
    cells[column] = text
    lines[1 + row] = ";".join(cells)
    point = text.replace(",", ".")
    meant = float(point) if "." not in text and PLAIN.fullmatch(point.strip()) else None
    _check(lines, ";", text, row, column, meant)


def _check(lines, separator, text, row, column, meant):
    """What is read for one cell is what was meant, or missing where nothing was, and its row is its own."""
    path = FOLDER / "cell.csv"
    path.write_bytes("\n".join(lines).encode())
    name = ("time", "pressure", "contraction", "force")[column]
    try:
        table = read_table(path)
    except InputError:
        return
    found = table[name][list(table.row).index(2 + row)] if 2 + row in table.row else np.nan
    factor = {"pressure": 1e5, "contraction": 0.01}.get(name, 1.0)
    if meant is not None and np.isfinite(meant):
        assert found == pytest.approx(meant * factor, rel=1e-12, abs=1e-300)
    else:
        assert np.isnan(found), f"{text!r} was read as {found}"


@many
@given(
    value=CELLS, unit=st.sampled_from(["mm", "m", "cm", " mm ", "mm!", "mm mm", "kPa", "dB", "count", "", "mm/m", "µm"])
)
def test_a_changed_length_is_reported_or_shows(value, unit):
    text = f"{value} {unit}".replace("\\", "").replace('"', "")
    path = FOLDER / "changed.toml"
    path.write_text(MUSCLE.replace('"300 mm"', f'"{text}"'), encoding="utf-8")
    try:
        muscle = read_muscle(path)[0]
    except InputError:
        return
    sizes = {"mm": 1e-3, "m": 1.0, "cm": 1e-2, "µm": 1e-6}
    shown = text.split("+/-")[0].split("±")[0].split("+-")[0].strip()
    number = re.match(PLAIN, shown)
    assert number, f"{text!r} was read as {float(muscle.length)}"
    behind = (shown[number.end() :].strip() or text.rsplit(" ", 1)[-1]).strip()
    assert behind in sizes, f"{text!r} was read as {float(muscle.length)}"
    assert float(muscle.length) == pytest.approx(float(number[0]) * sizes[behind], rel=1e-9)


@pytest.mark.parametrize(
    "unit", ["mm**9**9**9", "mm!", "−mm", "mm\x00", "dB", "degC", "mm" * 100, "Gm^99", "9**9", "(" * 40]
)
def test_units_that_the_library_would_take_or_work_on_for_ever(unit):
    with pytest.raises(InputError) as caught:
        units.factor(unit, "m")
    assert caught.value.cure
