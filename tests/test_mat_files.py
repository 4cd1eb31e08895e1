"""Recordings that MATLAB saved: vectors, structs, matrices, runs; the same checks as of a CSV, and nothing is run."""

import io
import zlib
from dataclasses import replace
from functools import partial
from pathlib import Path

import h5py
import numpy as np
import pytest
import scipy.io
from folders import folder_of, loop_csv, only_run
from other_files import UNITS, is_read_or_refused, mat, mat73, read_as, refused_as, vectors

from fitting.recordings import mat_elements, mat_hdf5
from fitting.recordings.mat_elements import mat5_variables
from fitting.recordings.mat_file import HDF5
from fitting.recordings.mat_variables import Unread
from fitting.recordings.settings import TABLES
from fitting.recordings.tables import read_heads
from fitting.recordings.template import write_muscle_file

pytestmark = pytest.mark.filterwarnings("error")
VERSIONS = pytest.mark.parametrize("write", [mat, mat73], ids=["version 7", "version 7.3"])


read, refused = partial(read_as, "loops.mat"), partial(refused_as, "loops.mat")


def same_as_csv(folder, found):
    """Whether a recording is number for number that of a CSV with the same readings."""
    (folder / "csv").mkdir()
    _, expected = only_run(folder_of(folder / "csv", loop_csv()))
    (run,) = found.recordings[0].runs
    for name in ("time", "pressure", "contraction", "measured", "weight", "branch"):
        np.testing.assert_array_equal(getattr(run, name), getattr(expected, name))
    assert run.row.tolist() == list(range(1, 203))  # as MATLAB counts
    return True


# --------------------------------------------------------------------------------------------------------- what is read


@VERSIONS
@pytest.mark.parametrize("shape", ["vectors", "a struct", "structs in structs"])
def test_what_matlab_saves_is_read_as_the_same_csv(tmp_path, write, shape):
    given = {name: values[:, None] for name, values in vectors().items()}
    content = {"vectors": given, "a struct": {"data": given}, "structs in structs": {"rig": {"data": given}}}[shape]
    assert same_as_csv(tmp_path, read(tmp_path, write(content)))


@pytest.mark.parametrize("options", [{"format": "4"}, {"do_compression": False}, {"oned_as": "row"}])
def test_every_version_is_read(tmp_path, options):
    assert same_as_csv(tmp_path, read(tmp_path, mat(vectors(), **options)))


@VERSIONS
def test_a_matrix_is_read_by_the_numbers_of_its_columns(tmp_path, write):
    matrix = np.stack([*vectors().values()], axis=1)
    names = ", ".join(f'{name} = "daq column {k}"' for k, name in enumerate(vectors(), 1))
    assert same_as_csv(tmp_path, read(tmp_path, write({"daq": matrix}), f"columns = {{ {names} }}\n{UNITS}"))


def test_a_matrix_with_a_channel_in_each_row_is_read_too(tmp_path):
    (tmp_path / "m.mat").write_bytes(mat({"daq": np.stack([*vectors().values()])}))
    assert read_heads(tmp_path / "m.mat") == [f"daq row {k}" for k in (1, 2, 3, 4)]


@VERSIONS
def test_an_array_of_structs_is_a_series_of_runs(tmp_path, write):
    trials = [vectors() | {"force": vectors()["force"] + k} for k in range(3)]
    trials = [{name: values[:, None] for name, values in trial.items()} for trial in trials]
    given = {"trial": np.array([tuple(t.values()) for t in trials], [(n, object) for n in trials[0]])}
    found = read(tmp_path, write(given if write is mat else {"trial": trials})).recordings[0].runs
    assert [run.name for run in found] == ["1", "2", "3"]
    assert [run.measured[0] for run in found] == [200, 201, 202]


@VERSIONS
def test_branches_may_be_a_cell_array_of_texts(tmp_path, write):
    back = np.diff(vectors()["contraction"], append=0) < 0
    ways = np.where(back, "elongation", "contraction").tolist()
    cells = np.array(ways, object)[:, None] if write is mat else ways
    (run,) = read(tmp_path, write(vectors() | {"branch": cells})).recordings[0].runs
    counts = run.weight > 0  # beside turning points the direction of the muscle decides
    assert run.branch[counts].tolist() == np.where(back, -1, 1)[counts].tolist()


@VERSIONS
def test_one_variable_of_several_may_be_named(tmp_path, write):
    others = {name: values + 1 for name, values in vectors().items()}
    content = write({"monday": vectors(), "tuesday": others})
    said = refused(tmp_path, content)
    assert "2 structs have columns of the same names: 'monday', 'tuesday'" in said
    assert 'add variable = "monday"' in said
    (run,) = read(tmp_path, content, f'variable = "monday"\n{UNITS}').recordings[0].runs
    assert run.measured[0] == 200
    assert "did you mean 'monday'" in refused(tmp_path, content, f'variable = "mondy"\n{UNITS}')


def test_init_writes_a_recording_for_every_struct(tmp_path):
    (tmp_path / "loops.mat").write_bytes(mat({"monday": vectors(), "tuesday": vectors()}))
    text = write_muscle_file(tmp_path).read_text()
    assert text.count("[[recording]]") == 2
    assert 'variable = "tuesday"' in text
    assert 'units = { time = "?", pressure = "?", contraction = "?", force = "?" }' in text


# ------------------------------------------------------------------------------------------------------ what is refused


@VERSIONS
def test_what_does_not_fit_together_is_said(tmp_path, write):
    assert "has 5 values, and 'time' has 202" in refused(tmp_path, write(vectors() | {"force": np.ones(5)}))
    said = refused(tmp_path, write(vectors()), "")
    assert "the column has no unit" in said
    assert "Cure: write in muscle.toml units = { " in said
    bad = vectors() | {"pressure": np.where(np.arange(202) == 7, 900.0, 2.0)}
    assert "row 8, column 'pressure'" in refused(tmp_path, write(bad))


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (np.ones(202) * 1j, "is complex"),
        (np.array([np.ones(3), np.ones(4)], object), "is a cell array"),
        (np.ones((3, 4, 5)), "more than two dimensions"),
        (scipy.sparse.eye(202).tocsc(), "is a sparse matrix"),
        (np.zeros((0, 0)), "unknown column in units: 'force'"),
    ],
)
def test_a_variable_that_is_no_column_says_why(tmp_path, value, words):
    assert words in refused(tmp_path, mat(vectors() | {"force": value}))


def test_runs_whose_fields_differ_in_length_are_refused(tmp_path):
    trials = [(np.ones(4), np.ones(5)), (np.ones(3), np.ones(3))]
    content = mat({"trial": np.array(trials, [("time", object), ("force", object)])})
    assert "fields differ in length" in refused(tmp_path, content)


def test_a_table_of_matlab_is_refused_with_what_to_type(tmp_path):
    out = io.BytesIO()
    with h5py.File(out, "w") as file:
        file["T"] = np.zeros((1, 6), np.uint32)
        file["T"].attrs["MATLAB_class"] = np.bytes_("table")
    assert "s = table2struct(T, 'ToScalar', true)" in refused(tmp_path, out.getvalue())


def test_a_link_to_another_file_is_not_followed(tmp_path):
    with h5py.File(tmp_path / "secret.h5", "w") as file:
        file["force"] = vectors()["force"]
    with h5py.File(tmp_path / "loops.h5", "w") as file:
        for name, values in vectors().items():
            if name != "force":
                file[name] = values
        file["force"] = h5py.ExternalLink("secret.h5", "force")
    assert "is kept in another file" in refused(tmp_path, (tmp_path / "loops.h5").read_bytes())


def test_a_file_that_unpacks_without_end_is_refused(tmp_path, monkeypatch):
    for module in (mat_elements, mat_hdf5):
        monkeypatch.setattr(module, "TABLES", replace(TABLES, unpacked_bytes=1_000_000))
    for write in (mat, mat73):
        content = write(vectors() | {"more": np.zeros(1_000_000)})
        assert len(content) < 50_000
        assert "unpacks to more than" in refused(tmp_path, content)


def test_structs_nested_without_end_are_refused(tmp_path):
    inner = element(14, b"".join((element(6, bytes(8)), element(5, bytes(8)), element(1, b"x"))))
    for _ in range(100_000):
        inner = inner[:4] + (len(inner)).to_bytes(4, "little") + inner
        if len(inner) > 50_000:
            break
    assert "damaged" in refused(tmp_path, mat({})[:128] + element(15, zlib.compress(inner)))


def element(kind, content):
    padded = content + bytes(-len(content) % 8) if kind != 15 else content
    return kind.to_bytes(4, "little") + len(content).to_bytes(4, "little") + padded


@VERSIONS
def test_damaged_files_end_in_one_message(tmp_path, write):
    """Cut off, overwritten, bytes changed: read or refused, never anything else."""
    options = {"do_compression": False} if write is mat else {}
    content, scatter = write({"data": vectors() | {"note": "a"}}, **options), np.random.default_rng(0)
    path = tmp_path / "f.mat"
    for turn in range(150):
        damaged = bytearray(content)
        if turn % 3 == 0:
            damaged = damaged[: int(scatter.integers(len(content)))]
        for _ in range(int(scatter.integers(1, 6))):
            if damaged:
                place = int(scatter.integers(min(len(damaged), 600 if turn % 2 else len(damaged))))
                damaged[place] = int(scatter.integers(256))
        path.write_bytes(bytes(damaged))
        assert is_read_or_refused(path)


# ----------------------------------------------------------------------------------------- beside another reader's word


def test_files_that_matlab_wrote_are_read_as_scipy_reads_them():
    """scipy carries files of many versions of MATLAB, from several machines of either byte order."""
    folder = Path(scipy.io.__file__).parent / "matlab" / "tests" / "data"
    compared = 0
    for path in sorted(folder.glob("test*_[567]*.mat")):
        raw = path.read_bytes()
        if raw[512:520] == HDF5:
            continue
        theirs = {n: v for n, v in scipy.io.loadmat(path, chars_as_strings=True).items() if not n.startswith("__")}
        ours = mat5_variables(raw)
        assert all(is_same(value, theirs[name]) for name, value in ours.items()), path.name
        compared += len(ours)
    if not compared:
        pytest.skip("this scipy came without the files of its own tests")
    assert compared > 60


def is_same(ours, theirs):
    """Whether a value of ours is one of scipy's."""
    if isinstance(ours, Unread):
        return True
    if isinstance(ours, dict):
        return all(is_same(value, theirs[name].ravel()[0]) for name, value in ours.items())
    if isinstance(ours, list):
        found = theirs.ravel()
        if isinstance(ours[0], dict):
            return all(is_same(ours[k][name], found[k][name]) for k in range(len(ours)) for name in ours[k])
        return [str(text.item() if isinstance(text, np.ndarray) else text).strip() for text in found] == ours
    return ours.size == theirs.size == 0 or np.array_equal(ours, theirs)
