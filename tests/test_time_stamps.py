"""Time as dates and clocks write it: read as the seconds that a file with seconds has, or refused with a cure."""

import datetime

import numpy as np
import pandas as pd
import pytest
from folders import folder_of, loop_columns, only_run, release_columns, table
from other_files import full_columns, read_as, workbook

from fitting.errors import InputError
from fitting.recordings.experiment import read_experiment
from fitting.recordings.template import muscle_file
from fitting.recordings.time_stamps import seconds_of

pytestmark = pytest.mark.filterwarnings("error")

BEGAN = datetime.datetime(2026, 11, 20, 23, 59, 58, tzinfo=datetime.UTC)  # over midnight


def stamped(written, separator=",", columns=None):
    """The loop with stamps for its seconds, whole milliseconds; `written` makes one of a moment."""
    columns = dict(columns or full_columns())
    seconds = np.round(columns.pop("time [s]"), 3)
    texts = [written(BEGAN + datetime.timedelta(seconds=float(at))) for at in seconds]
    rows = zip(texts, *(np.broadcast_to(each, len(texts)) for each in columns.values()), strict=True)
    lines = [separator.join(["Zeitstempel", *columns]), *(separator.join(map(str, row)) for row in rows)]
    return "\n".join(lines) + "\n", seconds


def milliseconds(moment, mark="."):
    return f"{mark}{moment.microsecond // 1000:03d}"


CALLED = 'columns = { time = "Zeitstempel" }'


@pytest.mark.parametrize(
    "written",
    [
        lambda at: at.strftime("%Y-%m-%dT%H:%M:%S") + milliseconds(at) + "Z",
        lambda at: at.strftime("%Y-%m-%d %H:%M:%S") + milliseconds(at),
        lambda at: at.astimezone(datetime.timezone(datetime.timedelta(hours=2))).isoformat(),
        lambda at: at.strftime("%Y/%m/%d  %H:%M:%S") + milliseconds(at),
        lambda at: f"{at.day}.{at.month}.{at.year} {at:%H:%M:%S}" + milliseconds(at),
    ],
    ids=["ISO 8601", "ISO 8601 with a space", "with a zone", "slashes", "day first"],
)
def test_dates_are_seconds_since_1970(tmp_path, written):
    text, seconds = stamped(written)
    _, run = only_run(folder_of(tmp_path, text, more=CALLED))
    np.testing.assert_allclose(run.time - BEGAN.timestamp(), seconds, atol=1e-6)


def test_dates_with_decimal_commas_are_read(tmp_path):
    """As a German spreadsheet saves it: semicolons, and a comma before the milliseconds too."""
    text, seconds = stamped(lambda at: at.strftime("%d.%m.%Y %H:%M:%S") + milliseconds(at), ";")
    head, *rows = text.splitlines()
    cells = (row.split(";") for row in rows)
    rows = [";".join([day[:10] + day[10:].replace(".", ","), *(c.replace(".", ",") for c in rest)])
            for day, *rest in cells]  # fmt: skip
    _, run = only_run(folder_of(tmp_path, "\n".join([head, *rows]) + "\n", more=CALLED))
    np.testing.assert_allclose(run.time - BEGAN.timestamp(), seconds, atol=1e-6)


def test_a_clock_is_seconds_since_midnight():
    cells = pd.Series(["09:59:59,5", "10:00:00", None, "100:00:01.25"])
    np.testing.assert_allclose(seconds_of(cells), [35999.5, 36000.0, np.nan, 360001.25])


def test_a_clock_may_pass_midnight(tmp_path):
    text, seconds = stamped(lambda at: at.strftime("%H:%M:%S") + milliseconds(at))
    _, run = only_run(folder_of(tmp_path, text, more=CALLED))
    np.testing.assert_allclose(run.time - (24 * 3600 - 2), seconds, atol=1e-6)


def test_a_clock_that_goes_back_by_an_hour_is_refused(tmp_path):
    """As clocks do at the end of summer: which hour a reading belongs to is not known."""
    back = lambda at: at - datetime.timedelta(hours=10 + (at.second == 5))  # noqa: E731
    text, _ = stamped(lambda at: back(at).strftime("%H:%M:%S") + milliseconds(at))
    with pytest.raises(InputError, match="time goes back"):
        read_experiment(folder_of(tmp_path, text, more=CALLED))


def test_moments_of_a_sheet_are_read(tmp_path):
    columns = full_columns()
    seconds = np.round(columns.pop("time [s]"), 3)
    moments = [BEGAN.replace(tzinfo=None) + datetime.timedelta(seconds=float(at)) for at in seconds]
    rows = [
        ["Zeitstempel", *columns],
        *map(list, zip(moments, *(map(float, c) for c in columns.values()), strict=True)),
    ]
    (run,) = read_as("loops.xlsx", tmp_path, workbook({"loops": rows}), CALLED).recordings[0].runs
    np.testing.assert_allclose(run.time - BEGAN.timestamp(), seconds, atol=1e-3)  # a sheet keeps days


@pytest.mark.parametrize(
    ("stamp", "said"),
    [
        ("11/12/2026 10:15:03", "not a number"),  # which of the two is the month?
        ("10:15", "not a number"),  # minutes or hours?
        ("2026-11-20 10:15:03", "goes back"),
    ],
)
def test_stamps_that_cannot_be_read_are_refused_with_a_cure(tmp_path, stamp, said):
    text, _ = stamped(lambda at: stamp if at == BEGAN else at.strftime("%Y-%m-%d %H:%M:%S") + milliseconds(at))
    later = text.replace(stamp, "2026-11-21 10:15:03") if said == "goes back" else text
    with pytest.raises(InputError, match=said) as caught:
        read_experiment(folder_of(tmp_path, later, more=CALLED))
    assert caught.value.row in (2, 3)
    if said == "not a number":
        assert "write stamps as 2026-11-20 10:15:03.010" in caught.value.cure


@pytest.mark.parametrize("wrong", ["2026-02-30 10:15:00", "30.12.2026 10:15:00", "soon", "12.5"])
def test_one_bad_stamp_is_named_with_its_row(tmp_path, wrong):
    lines = stamped(lambda at: at.strftime("%Y-%m-%d %H:%M:%S") + milliseconds(at))[0].splitlines()
    lines[50] = ",".join([wrong, *lines[50].split(",")[1:]])
    with pytest.raises(InputError, match="not a moment such as 2026-11-20 23:59:58") as caught:
        read_experiment(folder_of(tmp_path, "\n".join(lines) + "\n", more=CALLED))
    assert (caught.value.row, caught.value.value) == (51, wrong)


def test_a_quick_release_needs_the_moment_of_its_release(tmp_path):
    text, _ = stamped(lambda at: at.isoformat(), columns=release_columns())
    with pytest.raises(InputError, match="when the muscle is let go"):
        read_experiment(folder_of(tmp_path, text, more=CALLED, test="quick release"))


def test_init_asks_for_no_unit_of_stamps(tmp_path):
    text, _ = stamped(lambda at: at.isoformat())
    (tmp_path / "loops.csv").write_text(text)
    asked = muscle_file(tmp_path)
    assert 'columns = { time = "Zeitstempel" }' in asked
    assert "units" not in asked
    (tmp_path / "loops.csv").write_text(table(loop_columns()).replace("time [s]", "Zeitstempel"))
    assert 'units = { time = "?" }' in muscle_file(tmp_path)
