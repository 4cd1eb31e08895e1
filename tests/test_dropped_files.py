"""Files dropped into the workbench: described column by column, and none that is no recording."""

import tomllib

import pytest

from fitting.errors import InputError
from fitting.recordings.experiment import read_experiment
from fitting.study.request import Request
from fitting.workbench import data as dropping
from fitting.workbench import form as forms
from fitting.workbench import form_text
from fitting.workbench import session as bench

ODD = "t;druck;Load cell (N);pos\n" + "".join(
    f"{0.1 * k:.1f};200;{200 - 3 * abs(30 - k % 60):.1f};{abs(30 - k % 60):.2f}\n" for k in range(240)
)

MUSCLE = {
    "length": forms.Size("300", "", "mm"),
    "radius": forms.Size("7.0", "0.1", "mm"),
    "braid_angle": forms.Size("20", "", "deg"),
    "wall_thickness": forms.Size("", "", "mm"),  # as the form has it where nothing is filled in
}
COLUMNS = [("time", "s"), ("pressure", "kPa"), ("force", "N"), ("displacement", "mm")]


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
    muscle = MUSCLE
    filled = forms.Filled(muscle, {"odd.csv": "loop"}, {"odd.csv": COLUMNS})
    assert forms.wrong_fields(found, filled) == {}
    forms.describe(found, "Odd", filled)
    run = bench.open_session(Request(data=(str(tmp_path),))).last.task.experiments[0].recordings[0].runs[0]
    assert run.pressure[0] == pytest.approx(2e5)
    assert run.contraction.max() == pytest.approx(0.1)


def test_what_init_guesses_beside_the_columns_is_written_too(tmp_path):
    """A gauge that calls itself absolute was read as one that does not."""
    dropping.keep([("odd.csv", ODD.replace("druck", "druck abs").encode())], tmp_path)
    found = dropping.guess(tmp_path)
    forms.describe(found, "Odd", forms.Filled(MUSCLE, {"odd.csv": "loop"}, {"odd.csv": COLUMNS}))
    (entry,) = tomllib.loads((tmp_path / "muscle.toml").read_text())["recording"]
    assert entry["pressure"] == "absolute"
    assert found.tests == {"odd.csv": "loop"}  # the position is a column that nobody knows


LASER = ODD.replace("pos", "laser displacement (mm)").replace("t;druck", "time (s);druck (kPa)")
LASER = (
    LASER.splitlines()[0]
    + "\n"
    + "".join(
        f"{line.rsplit(';', 1)[0]};{75.5 - float(line.rsplit(';', 1)[1]):.2f}\n" for line in LASER.splitlines()[1:]
    )
)


@pytest.mark.parametrize(("said", "wrong"), [("75.5 mm", ""), ("7.55 cm", ""), ("75.5", "has no unit"), ("", "number")])
def test_a_sensor_with_a_zero_of_its_own_is_asked_for_once(tmp_path, said, wrong):
    dropping.keep([("a.csv", LASER.encode()), ("b.csv", LASER.replace("200.0", "201.0").encode())], tmp_path)
    found = dropping.guess(tmp_path)
    assert sorted(found.elsewhere) == ["a.csv", "b.csv"]
    of_each = lambda value: {"a.csv": value, "b.csv": value}  # noqa: E731
    form = forms.Filled(MUSCLE, of_each("loop"), of_each(COLUMNS), said)
    problems = forms.wrong_fields(found, form)
    assert set(problems) == ({forms.AT_REST} if wrong else set())
    assert wrong in problems.get(forms.AT_REST, "")
    if wrong:
        return
    forms.describe(found, "Odd", form)
    (run,) = read_experiment(tmp_path).recordings[0].runs
    assert (run.contraction.min(), run.contraction.max()) == pytest.approx((0.0, 0.1))
    as_length = [*COLUMNS[:3], ("length", "mm")]
    forms.describe(found, "Odd", forms.Filled(MUSCLE, of_each("loop"), of_each(as_length), said))
    assert not {"position_sign", "position_at_rest"} & {
        *tomllib.loads((tmp_path / "muscle.toml").read_text())["recording"][0]
    }


@pytest.fixture
def odd(tmp_path):
    """A dropped file that lacks a muscle.toml."""
    dropping.keep([("odd.csv", ODD.encode())], tmp_path)
    return dropping.guess(tmp_path)


def filled(muscle=None, columns=(), test="loop"):
    """The form as it should be, but for some fields."""
    new = dict(columns)
    sizes = {name: forms.Size(*three) for name, three in (muscle or {}).items()}
    return forms.Filled(
        MUSCLE | sizes, {"odd.csv": test}, {"odd.csv": [new.get(k, one) for k, one in enumerate(COLUMNS)]}
    )


@pytest.mark.parametrize(
    ("muscle", "columns", "wrong"),
    [
        ({"length": (" ", "", "mm")}, {}, {"length": "the value of length is not filled in"}),
        (
            {"radius": ("7", "", "kg"), "wall_thickness": ("thin", "", "mm")},
            {},
            {"radius": "kg", "wall_thickness": "thin"},
        ),
        ({"radius": ("7.0 mm", "0.1", "mm")}, {}, {"radius": "the value of radius is not a number"}),
        ({"radius": ("7,0", "0.1", "mm")}, {}, {"radius": "decimal point"}),
        ({"radius": ("7.0", "0.1 mm", "mm")}, {}, {"radius": "the error of radius is not a number"}),
        ({"radius": ("nan", "", "mm")}, {}, {"radius": ""}),
        ({"radius": ("7.0", "7.0", "mm")}, {}, {"radius": "the error of radius is as large as its value"}),
        ({"braid_angle": ("20", "", "mm")}, {}, {"braid_angle": "'mm' cannot be the unit of an angle"}),
        ({"radius": ("7.0", "", "")}, {}, {"radius": "unit"}),
        ({"wall_thickness": ("", "0.1", "mm")}, {}, {"wall_thickness": "the value of wall thickness is not filled in"}),
        ({}, {1: ("pressure", "")}, {"odd.csv/1": "unit of the pressure is not filled in. Cure: write"}),
        ({}, {1: ("pressure", "furlong")}, {"odd.csv/1": "furlong"}),
        ({}, {3: ("force", "N")}, {"odd.csv/3": "'Load cell (N)' is the force already"}),
        ({}, {3: ("not used", "furlong")}, {}),
        ({}, {2: ("force", "")}, {}),  # its unit stands in the header
        (
            {"length": ("",), "braid_angle": ("",)},
            {0: ("time", "m")},
            {"length": "", "braid_angle": "", "odd.csv/0": ""},
        ),
    ],
)
def test_what_is_wrong_is_told_field_by_field_and_all_at_once(odd, muscle, columns, wrong):
    found = forms.wrong_fields(odd, filled(muscle, columns))
    assert found.keys() == wrong.keys()
    assert [words for field, words in wrong.items() if words not in found[field]] == []
    assert not any("odd.csv" in said or "muscle.toml" in said for said in found.values())


@pytest.mark.parametrize(
    ("given", "field", "words"),
    [
        (filled({"radius": ("7", "", "m")}), "radius", "radius is not below the length"),
        (filled(columns={3: ("not used", "")}), "odd.csv", "length or displacement"),
        (filled(columns={1: ("force", "N"), 2: ("pressure", "MPa")}), "odd.csv/2", "pressure"),
    ],
)
def test_what_only_reading_finds_wrong_is_told_at_its_field(odd, given, field, words):
    assert forms.wrong_fields(odd, given) == {}
    with pytest.raises(InputError) as caught:
        read_experiment(forms.describe(odd, "", given))
    told = forms.field_of(odd, caught.value)
    assert list(told) == [field]
    assert words in told[field]
    assert not told[field].startswith(("odd.csv", str(odd.folder)))


def test_a_size_is_written_with_its_error_and_its_unit(odd):
    written = forms.describe(odd, "", filled({"wall_thickness": ("1.0", " 0.1 ", "mm")})) / "muscle.toml"
    assert tomllib.loads(written.read_text(encoding="utf-8"))["muscle"] == {
        "length": "300 mm", "radius": "7.0 +/- 0.1 mm", "braid_angle": "20 deg", "wall_thickness": "1.0 +/- 0.1 mm",
    }  # fmt: skip


def test_the_muscle_is_drawn_as_soon_as_it_can_be():
    assert "as soon as its sizes are filled in" in form_text.sketch({"length": forms.Size("300", "", "mm")})
    assert "300 mm long, radius 7 mm" in form_text.sketch(MUSCLE)


@pytest.mark.parametrize(
    ("size", "why"),
    [
        (("7", "", "m"), "radius is not below the length"),
        (("7,0", "", "mm"), "not a number"),
        (("7 <b>", "", "mm"), "7 &lt;b&gt;"),
    ],
)
def test_why_a_muscle_that_is_filled_in_cannot_be_drawn_is_said(size, why):
    told = form_text.sketch(MUSCLE | {"radius": forms.Size(*size)})
    assert "svg" not in told
    assert why in told


def test_a_problem_of_no_field_is_left_to_others(odd):
    assert forms.field_of(odd, InputError("the disk is full")) == {}
    assert forms.field_of(odd, InputError("no such key", odd.folder / "muscle.toml")) == {}


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
