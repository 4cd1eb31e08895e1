"""Everything wrong in a folder is refused: one message with file, row, column, value and a cure, never a traceback."""

import sqlite3
from contextlib import closing

import numpy as np
import pytest
from folders import MUSCLE, folder_of, loop_columns, loop_csv, muscle_with, recording, release_columns, table

from fitting.errors import InputError
from fitting.library.library import library
from fitting.model_files.model_file import read_model
from fitting.posterior.store import Store
from fitting.recordings.experiment import read_experiment, read_muscle
from fitting.recordings.muscle_file import name_of, read_toml

pytestmark = pytest.mark.filterwarnings("error")


# ------------------------------------------------------------------------------------------------------- bad tables


def changed(old, new):
    return lambda: loop_csv().replace(old, new, 1)


def cell(line, column, text):
    def change():
        lines = [row.split(",") for row in loop_csv().splitlines()]
        lines[line - 1][column] = text
        return "\n".join(",".join(row) for row in lines)

    return change


def cells(lines, column, text):
    """The same in several lines."""

    def change():
        rows = [row.split(",") for row in loop_csv().splitlines()]
        for line in lines:
            rows[line - 1][column] = text
        return "\n".join(",".join(row) for row in rows)

    return change


BAD_TABLES = {
    "misspelt column": (changed("force [N]", "forse [N]"), "", ("needs a column force", "'forse [N]'", "mean 'force'")),
    "misspelt optional column": (lambda: table({"Runs": 1} | loop_columns()), "", ("'Runs'", "mean 'run'")),
    "foreign column name": (
        changed("force [N]", "sensor 3 [N]"),
        "",
        ("needs a column force", "sensor 3", "columns = {"),
    ),
    "no position": (changed("contraction [%]", "gap [%]"), "", ("contraction, length or displacement", "columns =")),
    "two positions": (
        lambda: table(loop_columns() | {"length [mm]": 300}),
        "",
        ("contraction and length say the same",),
    ),
    "twice the same": (
        lambda: loop_csv().replace("pressure [bar]", "force [kN]"),
        "",
        ("two columns are called force",),
    ),
    "no unit": (
        changed("force [N]", "force"),
        "",
        ("row 1", "'force'", "has no unit", "'force [N]'", 'units = { force = "N" }'),
    ),
    "wrong dimension": (
        changed("force [N]", "force [mm]"),
        "",
        ("row 1", "'force [mm]'", "cannot be the unit of a force"),
    ),
    "mass for force": (changed("force [N]", "force [kg]"), "", ("cannot be the unit of a force", "write kgf for")),
    "no such unit": (changed("[bar]", "[Bahr]"), "", ("'Bahr' is not a unit",)),
    "case of unit": (changed("[bar]", "[MPA]"), "", ("did you mean 'MPa'?",)),
    "text": (
        cell(17, 3, "OVLD"),
        "",
        ("data.csv, row 17, column 'force [N]'", "not a number", "'OVLD'", "leave the cell"),
    ),
    "decimal comma": (cell(17, 3, '"17,5"'), "", ("row 17", "'17,5'", "decimal point")),
    "decimal commas": (lambda: loop_csv().replace(".", ","), "", ("cells, the header 4", "semicolons")),
    "open quote": (cell(17, 3, '"17'), "", ("row 17", "quotation mark", "close or delete")),
    "short row": (
        changed("0.3,2.0,", "0.3,"),
        "",
        ("row 5", "the row has 3 cells, the header 4", "complete or delete the row, or begin it with '#'"),
    ),
    "short rows": (
        lambda: loop_csv().replace("0.3,2.0,", "0.3,", 1).replace("0.4,2.0,", "0.4,", 1),
        "",
        ("row 5", "complete or delete rows 5, 6, which are like it", "begin them with '#'"),
    ),
    "long row": (changed("0.3,2.0,", "0.3,2.0,7,"), "", ("row 5", "5 cells")),
    "time goes back": (
        cell(17, 0, "0.05"),
        "",
        ("row 17", "time goes back", "0.05 s after 1.4 s", "add a column 'run'"),
    ),
    "time goes back in a run": (
        lambda: table({"run": 1} | loop_columns() | {"time [s]": [*np.arange(200), 5, 6]}),
        "",
        ("row 202", "its own number in the column 'run'"),
    ),
    "same time twice": (
        cell(17, 0, "1.4"),
        "",
        ("row 17", "two samples have the same time", "more digits, or delete row 17"),
    ),
    "empty": (lambda: "", "", ("the file is empty", "begin with a header")),
    "comments only": (lambda: "# nothing\n\n", "", ("the file is empty",)),
    "header only": (lambda: "time [s],pressure [bar]\n", "", ("row 1", "no row of readings")),
    "too few rows": (lambda: "\n".join(loop_csv().splitlines()[:4]), "", ("only 3 samples, 5 are needed",)),
    "no reading at all": (lambda: loop_csv(force=np.nan), "", ("'force [N]'", "holds no reading")),
    "contraction in per cent": (
        changed("contraction [%]", "contraction [1]"),
        "",
        ("outside -0.2 .. 0.6", "[1] or [%]"),
    ),
    "length of another muscle": (
        lambda: loop_csv().replace("contraction [%]", "length [mm]"),
        "",
        ("contraction outside", "length in muscle.toml"),
    ),
    "displacement that lengthens": (
        lambda: table({k.replace("contraction [%]", "displacement [mm]"): -5 * v for k, v in loop_columns().items()}),
        "",
        ("contraction outside", "positive is shorter"),
    ),
    "bar for kPa": (lambda: loop_csv(pressure=200), "", ("row 2", "'pressure [bar]'", "above 50 bar", "'200 bar'")),
    "Pa for kPa": (
        lambda: loop_csv(pressure=0.003),
        "",
        ("never reaches 0.01 bar", "0.003 bar", 'valid = { pressure = ["-0.01 bar", "0.01 bar"]'),
    ),
    "gauge for absolute": (lambda: loop_csv(pressure=-1.5), "", ("pressure below vacuum", "gauge or absolute")),
    "blanks separate": (lambda: loop_csv().replace(",", " "), "", ("not separated by commas",)),
    "a spreadsheet": (lambda: b"PK\x03\x04 and so on", "", ("spreadsheet", "save the sheet as CSV")),
    "packed": (lambda: b"\x1f\x8b\x08", "", ("packed file", "unpack")),
    "UTF-16 that breaks off": (lambda: loop_csv().encode("utf-16")[:-1], "", ("UTF-16", "breaks off")),
    "UTF-32": (lambda: loop_csv().encode("utf-32"), "", ("not a text file",)),
    "steering the screen": (changed("force", "f\x1b[31morce"), "", ("row 1", "cannot be printed", "x1b")),
    "no header": (lambda: loop_csv().split("\n", 1)[1], "", ("no header", "begins with numbers")),
    "a mistake below lines before the header": (
        lambda: "Logger 3\nDate,1 May\n" + loop_csv().replace("0.3,2.0,", "0.3,"),
        "",
        ("row 7", "the row has 3 cells, the header 4"),
    ),
    "no units below the header": (
        lambda: loop_csv().replace("\n", "\nin Sekunden,bar,%,N\n", 1),
        "",
        ("row 2", "'time [s]'", "holds the units", "write them in the header"),
    ),
    "other units below the header": (
        lambda: loop_csv().replace("\n", "\ns,kPa,%,N\n", 1),
        "",
        ("row 2", "'time [s]'", "holds the units", "write them in the header"),
    ),
    "time of day": (cell(17, 0, "12:30:05.1"), "", ("row 17", "'12:30:05.1'", "in seconds")),
    "unit in a cell": (cell(17, 3, "17 N"), "", ("row 17", "'17 N'", "in the header: [N]")),
    "too large": (cell(17, 3, "1e200"), "", ("row 17", "'force [N]'", "too large", "'1e+200'")),
    "points among decimal commas": (
        lambda: loop_csv().replace(",", ";").replace(".", ",").replace(";200,0\n", ";1.200\n", 1),
        "",
        ("row 2", "'force [N]'", "'1.200'", "decimal comma"),
    ),
    "commas among decimal points": (
        lambda: loop_csv().replace(",", ";").replace(";200.0\n", ";200,0\n", 1),
        "",
        ("row 2", "'force [N]'", "'200,0'", "decimal points throughout"),
    ),
    "absolute by its unit": (
        changed("[bar]", "[bara]"),
        "",
        ("row 1", "'pressure [bara]'", "says that its pressures are absolute", 'write pressure = "absolute"'),
    ),
    "decibels": (changed("[N]", "[dB]"), "", ("row 1", "no multiple of 'dB'")),
    "counts": (changed("[%]", "[counts]"), "", ("'counts' cannot be the unit of a plain number",)),
    "a unit that takes for ever": (changed("[N]", "[mm**9**9**9]"), "", ("row 1", "is not a unit")),
    "columns: one name twice": (
        lambda: loop_csv().replace("pressure [bar]", "F [N]").replace("force [N]", "F [N]"),
        'columns = { force = "F" }',
        ("2 columns are called 'F'",),
    ),
    "columns: a name over two lines": (
        loop_csv,
        'columns = { force = "a\\nb" }',
        ("unknown column for force", "a\\nb", "known: time [s]"),
    ),
    "texts in two rows": (cells([17, 40], 3, "OVLD"), "", ("row 17", "not a number (rows 17 and 40)")),
    "texts in many rows": (
        cells(range(17, 97), 3, "OVLD"),
        "",
        ("row 17", "not a number (80 rows, the first are 17, 18, 19)"),
    ),
    "too large in three rows": (cells([9, 17, 40], 3, "1e200"), "", ("row 9", "too large (rows 9, 17 and 40)")),
    "spikes in two rows": (cells([17, 40], 3, "90000"), "", ("what the ideal muscle", "(rows 17 and 40)")),
    "a long cell": (cell(17, 3, "x" * 9000), "", ("row 17", "not a number", "xxx ...")),
    "not text": (lambda: b"time\x00\x01\n1\n", "", ("not a text file",)),
    "unknown branch": (
        lambda: table(loop_columns() | {"branch": "inflat"}),
        "",
        ("row 2", "'branch'", "'inflat'", "mean 'inflate'?"),
    ),
    "up, but of what": (
        lambda: table(loop_columns() | {"branch": "up"}),
        "",
        ("row 2", "'branch'", "'up'", "write 'contraction' where the muscle became shorter"),
    ),
    **{
        f"a branch called {word}": (
            lambda word=word: table(loop_columns() | {"branch": word}),
            "",
            ("row 2", f"'{word}'", "Cure: write 'contraction' where"),
        )
        for word in ("loading", "unloading", "extending", "falling", "traction", "venting", "rising")
    },
    "empty branch": (lambda: table(loop_columns() | {"branch": ["inflate"] * 201 + [""]}), "", ("row 203", "empty")),
    "nothing left": (loop_csv, 'valid = { force = ["900 N", "5 kN"] }', ("no sample is left", "202 of 202", "widen")),
    "columns: unknown name": (loop_csv, 'columns = { forc = "F" }', ("'forc'", "did you mean 'force'?")),
    "columns: unknown column": (loop_csv, 'columns = { force = "forces" }', ("'forces'", "mean 'force [N]'")),
    "columns: a number": (loop_csv, "columns = { force = 3 }", ("muscle.toml", "columns: force is not text")),
    "units: not there": (loop_csv, 'units = { load = "kg" }', ("column in units: 'load'",)),
    "units: nonsense": (loop_csv, 'units = { force = "Nn" }', ("'Nn' is not a unit",)),
    "valid: not there": (loop_csv, 'valid = { lenght = ["1 mm", "2 mm"] }', ("column in valid: 'lenght'",)),
    "valid: no pair": (loop_csv, 'valid = { force = "5 N" }', ("not a pair", '["5 N", "5000 N"]')),
    "valid: no unit": (loop_csv, 'valid = { force = ["5", "6"] }', ("valid: force has no unit",)),
    "valid: its row": (
        loop_csv,
        'pressure = "gauge"\nvalid = { pressure = ["5", "6"] }',
        ("muscle.toml, row 11", "valid: pressure has no unit"),
    ),
    "valid: reversed": (loop_csv, 'valid = { force = ["9 N", "6 N"] }', ("holds nothing", "lower limit first")),
    "valid: a list": (loop_csv, "valid = 3", ("valid is not a table",)),
    "pressure option": (loop_csv, 'pressure = "abs"', ("neither gauge nor absolute", "'abs'")),
    "force sign": (loop_csv, 'force_sign = "-"', ("neither 1 nor -1",)),
    "position sign": (loop_csv, "position_sign = 2", ("position_sign is neither 1 nor -1", "lengthening as positive")),
    "at rest: no unit": (
        lambda: loop_csv().replace("contraction [%]", "displacement [mm]"),
        "position_at_rest = 3",
        ("muscle.toml, row 10", "position_at_rest has no unit"),
    ),
    "at rest: no length": (
        lambda: loop_csv().replace("contraction [%]", "displacement [mm]"),
        'position_at_rest = "3 N"',
        ("muscle.toml, row 10", "'N' cannot be the unit of a length"),
    ),
    "at rest: of a length": (
        lambda: loop_csv().replace("contraction [%]", "length [mm]"),
        'position_at_rest = "3 mm"',
        ("position_at_rest belongs to a displacement or a contraction", "leave position_at_rest out"),
    ),
    "noise unit": (loop_csv, 'noise = "0.5 mm"', ("noise: 'mm' cannot be the unit of a force",)),
    "noise zero": (loop_csv, 'noise = "0 N"', ("muscle.toml, row 10", "noise is not positive")),
    "unknown option": (loop_csv, 'noize = "1 N"', ("'noize'", "did you mean 'noise'?")),
}


@pytest.mark.parametrize("case", BAD_TABLES)
def test_bad_tables_are_refused_with_place_and_cure(tmp_path, case):
    csv, more, said = BAD_TABLES[case]
    with pytest.raises(InputError) as caught:
        read_experiment(folder_of(tmp_path, csv(), more=more))
    message = str(caught.value)
    assert all(part in message for part in said), message
    assert caught.value.cure
    assert caught.value.file
    assert "\n" not in message


@pytest.mark.parametrize(
    ("test", "columns", "said"),
    [
        ("quick release", loop_columns, ("needs a column load", "load [kg]")),
        ("isometric", loop_columns, ("the length is not held", 'test = "loop"')),
        ("loops", loop_columns, ("unknown test 'loops'", "did you mean 'loop'?")),
        ("dance", loop_columns, ("unknown test 'dance'", "known: loop, isometric")),
        (
            "step",
            lambda: {k: v for k, v in release_columns().items() if "press" not in k},
            ("needs a column pressure",),
        ),
    ],
)
def test_a_recording_of_the_wrong_kind(tmp_path, test, columns, said):
    with pytest.raises(InputError) as caught:
        read_experiment(folder_of(tmp_path, table(columns()), test=test))
    assert all(part in str(caught.value) for part in said), str(caught.value)


BAD_MUSCLES = {
    "brackets a thousand deep": ("a = " + "[" * 5000, ("not valid TOML", "too deep")),
    "a number of thousands of digits": ("a = " + "9" * 5000, ("not valid TOML", "too long")),
    "another file altogether": ("# " + "x" * 2_000_000, ("larger than 1 MB", "2.0 MB")),
    "lists in lists": (muscle_with(length="[" * 200 + "]" * 200), ("row 2", "not a value", "[[[ ...")),
    "beyond all numbers": (muscle_with(length='"1e300 Gm"'), ("row 2", "is not finite")),
    "a screen that is steered": (muscle_with(length='"3 \\u001b[2Jmm"'), ("row 2", "x1b[2Jmm")),
    "not TOML": ("[muscle\n", ("row 1", "not valid TOML")),
    "bare unit": ("[muscle]\nlength = 300 mm\n", ("row 2", "not valid TOML", 'length = "300 mm"')),
    "no muscle": ('name = "x"\n', ("no [muscle] table",)),
    "unknown table": (MUSCLE + "[sauce]\n", ("unknown key 'sauce'", "did you mean 'source'?")),
    "unknown key": (muscle_with(radios='"7 mm"'), ("row 5", "'radios'", "did you mean 'radius'?")),
    "missing": (muscle_with(radius=None), ("lacks radius", "where the braid lies", "add radius")),
    "no unit": (muscle_with(length='"300"'), ("row 2", "length has no unit", 'as in "300 mm"')),
    "a number": (muscle_with(length="300"), ("row 2", "length has no unit", "'300'")),
    "a boolean": (muscle_with(length="true"), ("row 2", "not a value with a unit", "'True'")),
    "a list": (muscle_with(length='["300 mm"]'), ("row 2", "not a value with a unit")),
    "wrong unit": (muscle_with(braid_angle='"20 mm"'), ("row 4", "'mm' cannot be the unit of an angle")),
    "question mark": (muscle_with(radius='"? mm"'), ("row 3", "still to be filled in")),
    "negative": (muscle_with(radius='"-7 mm"'), ("row 3", "radius must be positive", "-7 mm")),
    "radians": (muscle_with(braid_angle='"0.387 deg"'), ("below 1 deg", "0.387 deg", "write '0.387 rad'")),
    "steep": (muscle_with(braid_angle='"95 deg"'), ("below 90 deg", "long axis")),
    "thick": (muscle_with(radius='"700 mm"'), ("radius is not below the length", "not diameter")),
    "no bore": (muscle_with(wall_thickness='"9 mm"'), ("leaves no bore", "9 mm")),
    "outside": (muscle_with(wall_thickness='"1 mm"', wall_outside='"2 mm"'), ("is not below wall_thickness",)),
    "poisson": (muscle_with(strand_poisson="0.7"), ("above 0.5",)),
    "twice the modulus": (muscle_with(hardness='"45"', shear_modulus='"1 MPa"'), ("say the same twice",)),
    "hardness": (muscle_with(hardness='"145 IRHD"'), ("row 5", "outside 30..75 IRHD")),
    "twice the angle": (muscle_with(turns="1.5"), ("say the same twice",)),
    "no cord": (muscle_with(braid_angle=None, turns="1.5"), ("lacks cord_length",)),
    "cord": (muscle_with(braid_angle=None, turns="1.5", cord_length='"500 mm"'), ("row 5", "cord_length", "307.2 mm")),
    "source": ('source = 3\n' + muscle_with(), ("source is not a table",)),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD_MUSCLES)
def test_bad_muscles_are_refused_with_place_and_cure(tmp_path, case):
    toml, said = BAD_MUSCLES[case]
    with pytest.raises(InputError) as caught:
        read_muscle(folder_of(tmp_path, toml=toml))
    message = str(caught.value)
    assert all(part in message for part in said), message
    assert caught.value.cure
    assert "muscle.toml" in message


@pytest.mark.parametrize(
    ("toml", "said"),
    [
        (MUSCLE, ("no recording is named", "[[recording]]")),
        (MUSCLE + '[recording]\nfile = "a.csv"\n', ("no recording is named",)),
        (MUSCLE + '[[recording]]\ntest = "loop"\n', ("lacks file", 'file = "loops.csv"')),
        (MUSCLE + '[[recording]]\nfile = "a.csv"\n', ("lacks test", 'test = "loop"')),
        (recording(file="gone.csv"), ("gone.csv", "no such file", "muscle.toml")),
    ],
)
def test_bad_lists_of_recordings(tmp_path, toml, said):
    with pytest.raises(InputError) as caught:
        read_experiment(folder_of(tmp_path, toml=toml))
    assert all(part in str(caught.value) for part in said), str(caught.value)


def test_no_folder_and_no_muscle_file(tmp_path):
    with pytest.raises(InputError, match="no such folder"):
        read_experiment(tmp_path / "gone")
    with pytest.raises(InputError, match="mckibben init"):
        read_experiment(tmp_path)


def test_a_value_too_deep_to_be_printed_is_still_told():
    deep = []
    for _ in range(100_000):
        deep = [deep]
    error = InputError("not a value", "muscle.toml", 2, value=deep, cure="write one")
    assert "lists in lists" in str(error)
    assert "lists in lists" in error.as_dict()["value"]


def test_nothing_of_a_users_steers_the_screen_or_fills_it():
    error = InputError("unknown \x1b[2J" + "x" * 9999, "a\x07b.csv", 2, "\x9b1m", "y\n" * 9999, "z" * 9999)
    assert str(error).isprintable()
    assert len(str(error)) < 2000


@pytest.mark.parametrize("seed", range(200))
def test_damaged_files_never_end_in_a_traceback(tmp_path, seed):
    rng = np.random.default_rng(seed)
    text = bytearray(loop_csv().encode() if seed % 2 else recording().encode())
    for _ in range(rng.integers(1, 6)):
        at, kind = rng.integers(len(text)), rng.integers(3)
        text[at : at + 1 + 20 * (kind == 2)] = b"" if kind else bytes([rng.choice(list(b'\n,;"[]=#-.e09 \xff\x00x'))])
    folder = folder_of(tmp_path, bytes(text) if seed % 2 else loop_csv())
    if not seed % 2:
        (folder / "muscle.toml").write_bytes(bytes(text))
    refused = None
    try:
        read_experiment(folder)
    except InputError as error:
        refused = error
    assert refused is None or (refused.cure and refused.file)


# ---------------------------------------------------------------------------------------------------- versions of files

PROGRAM = 'program = "9.1.2"\n'
EFFECT = '[[effect]]\nname = "ideal_cylinder"\n'


@pytest.mark.parametrize(
    ("head", "said"),
    [
        (
            "format = 2\n" + PROGRAM,
            ("row 1", "newer program (format 2, program 9.1.2)", "install 'mckibben-jax>=9.1.2'"),
        ),
        ("format = 2\n", ("row 1", "newer program", "pip install --upgrade mckibben-jax")),
        ('format = 2\nprogram = "1; rm -rf"\n', ("row 1", "newer program", "pip install --upgrade mckibben-jax")),
        ("format = 2\n[new]\nkey = 1\n", ("row 1", "newer program")),
        ("format = 0\n", ("row 1", "not a whole number from 1 on")),
        ('format = "1"\n', ("row 1", "not a whole number from 1 on")),
        ("fitted_to = 3\n", ("row 1", "fitted_to is not a table")),
        ("muscle_of = 3\n", ("row 1", "muscle_of is not a table")),
    ],
)
def test_a_model_file_of_another_version_is_refused_with_the_one_to_install(tmp_path, head, said):
    path = tmp_path / "model.toml"
    path.write_text(head + EFFECT)
    with pytest.raises(InputError) as caught:
        read_model(path, library())
    assert all(part in str(caught.value) for part in said), str(caught.value)


def test_model_files_of_this_and_of_no_stated_version_are_read(tmp_path):
    path = tmp_path / "model.toml"
    for head in ("format = 1\n", ""):
        path.write_text(head + EFFECT)
        assert len(read_model(path, library()).effects) == 1


def test_chains_of_a_newer_version_are_refused_and_older_ones_read(tmp_path):
    store = Store(tmp_path / "run.chains", "run")
    store.begin({"centre": np.arange(3.0)})
    for version, readable in ((0, True), (1, True), (2, False)):
        with closing(sqlite3.connect(store.path)) as file:
            file.execute(f"PRAGMA user_version = {version}")
        if readable:
            assert (store.frame() or {})["centre"].tolist() == [0, 1, 2]
            continue
        with pytest.raises(InputError, match=r"format 2.*pip install --upgrade mckibben-jax"):
            store.frame()


def test_damaged_chains_are_refused(tmp_path):
    store = Store(tmp_path / "run.chains", "run")
    store.begin({"centre": np.arange(300.0)})
    raw = store.path.read_bytes()
    at = raw.index(np.arange(300.0).tobytes()[800:880])
    store.path.write_bytes(raw[:at] + b"\x01" + raw[at + 1 :])
    with pytest.raises(InputError, match="the chains in this file are damaged"):
        store.frame()


def test_a_name_cannot_steer_the_screen(tmp_path):
    assert name_of({"name": "a\x1b[31mred\u202eb \u00fc"}, tmp_path / "muscle.toml") == "a\ufffd[31mred\ufffdb \u00fc"


@pytest.mark.parametrize(
    ("text", "cure"),
    [("length = 1\nlength = 2", "stands once"), ("[muscle]\n[muscle]", "stands once"), ("length = 3 mm", "in quotes")],
)
def test_the_cure_is_that_of_the_fault(tmp_path, text, cure):
    (tmp_path / "muscle.toml").write_text(text)
    with pytest.raises(InputError) as error:
        read_toml(tmp_path / "muscle.toml")
    assert cure in error.value.cure
