"""Files dropped into the workbench: described column by column, and none that is no recording."""

import pytest

from fitting.errors import InputError
from fitting.study.request import Request
from fitting.workbench import data as dropping
from fitting.workbench import session as bench

ODD = "t;druck;Load cell (N);pos\n" + "".join(
    f"{0.1 * k:.1f};200;{200 - 3 * abs(30 - k % 60):.1f};{abs(30 - k % 60):.2f}\n" for k in range(240)
)


def test_dropped_files_are_described_column_by_column(tmp_path):
    dropping.keep([("C:\\data\\odd.csv", ODD.encode())], tmp_path)
    assert not dropping.is_described(tmp_path)
    found = dropping.guess(tmp_path)
    assert [(c.head, c.meaning) for c in found.columns["odd.csv"]] == [
        ("t", "time"), ("druck", "pressure"), ("Load cell (N)", "force"), ("pos", "not used"),
    ]  # fmt: skip
    assert [column.extent for column in found.previews["odd.csv"]] == [
        "0 to 23.9",
        "200 to 200",
        "110 to 200",
        "0 to 30",
    ]
    muscle = {"length": "300 mm", "radius": "7.0 +/- 0.1 mm", "braid_angle": "20 deg"}
    filled = {"odd.csv": [("time", "s"), ("pressure", "kPa"), ("force", "N"), ("displacement", "mm")]}
    dropping.describe(found, "Odd", muscle, {"odd.csv": "loop"}, filled)
    run = bench.open_session(Request(data=(str(tmp_path),))).last.task.experiments[0].recordings[0].runs[0]
    assert run.pressure[0] == pytest.approx(2e5)
    assert run.contraction.max() == pytest.approx(0.1)


def test_what_is_not_filled_in_is_named(tmp_path):
    dropping.keep([("odd.csv", ODD.encode())], tmp_path)
    with pytest.raises(InputError, match="length is not filled in"):
        dropping.describe(dropping.guess(tmp_path), "", {}, {"odd.csv": "loop"}, {"odd.csv": []})


@pytest.mark.parametrize(
    ("files", "words"),
    [
        ([("evil.py", b"print()")], "no recording and no muscle.toml"),
        ([("a/x.csv", b""), ("b/x.csv", b"")], "one name"),
        ([("muscle.toml", b"")], "no recording among them"),
    ],
)
def test_other_files_are_not_taken(tmp_path, files, words):
    with pytest.raises(InputError, match=words):
        dropping.keep(files, tmp_path)
    assert not list(tmp_path.glob("*.py"))


def test_a_dropped_name_cannot_leave_the_folder(tmp_path):
    inner = tmp_path / "inner"
    inner.mkdir()
    dropping.keep([("../../outside.csv", ODD.encode())], inner)
    assert [path.name for path in inner.iterdir()] == ["outside.csv"]
    assert not (tmp_path / "outside.csv").exists()


def test_a_message_names_a_dropped_file_as_its_user_does():
    assert dropping.without_place("/tmp/m_1/t_2/loops.csv, row 2: no", "/tmp/m_1") == "loops.csv, row 2: no"
