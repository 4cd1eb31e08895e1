"""The folder of a sweep: cut, killed and gone on with, damaged, of another sweep, written to by two at once."""

import json
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
import zarr
from sweeping import ALL, BEST, order, table

from fitting.designs.settings import SweepSettings
from fitting.designs.sweep import here, sweep
from fitting.designs.sweep_files import write_table, writer
from fitting.errors import InputError


class Cut(Exception):
    """The power fails."""


def cut_after(count):
    """Pieces done here, until the power fails."""

    def work(order, numbers, piece, floor):
        for done, found in enumerate(here(order, numbers, piece, floor)):
            if done == count:
                raise Cut
            yield found

    return work


@pytest.mark.parametrize(("keep", "kind"), [(BEST, "parquet"), (ALL, "parquet"), (ALL, "zarr")])
def test_a_sweep_that_was_cut_goes_on(tmp_path, keep, kind, monkeypatch):
    monkeypatch.setattr("fitting.designs.sweep_store.SWEEP", SweepSettings(save_every=0.0))
    whole = sweep(order(tmp_path, keep), tmp_path / "whole", piece=500, kind=kind)
    with pytest.raises(Cut):
        sweep(order(tmp_path, keep), tmp_path / "cut", work=cut_after(4), piece=500, kind=kind)
    (tmp_path / "cut" / ".part-000004.parquet.77").write_bytes(b"half")
    # pieces keep the size that they began with
    rest = sweep(order(tmp_path, keep), tmp_path / "cut", piece=999, kind=kind)
    assert rest.computed == 5000 - 4 * 500
    for a, b in zip(whole.tally, rest.tally, strict=True):
        np.testing.assert_array_equal(a, b)
    for name, column in table(whole).items():
        np.testing.assert_array_equal(column, table(rest)[name])


def test_a_zarr_piece_that_was_cut_between_its_columns_is_done_again(tmp_path):
    whole = sweep(order(tmp_path, ALL), tmp_path / "whole", piece=500, kind="zarr")
    with pytest.raises(Cut):
        sweep(order(tmp_path, ALL), tmp_path / "cut", work=cut_after(4), piece=500, kind="zarr")
    zarr.open_group(tmp_path / "cut" / "designs.zarr", mode="r+")["force_N"][2000:2500] = -1.0
    rest = sweep(order(tmp_path, ALL), tmp_path / "cut", kind="zarr")
    assert rest.computed == 3000
    np.testing.assert_array_equal(table(whole)["force_N"], table(rest)["force_N"])


def test_a_folder_keeps_the_format_that_it_began_with(tmp_path):
    sweep(order(tmp_path, ALL), tmp_path / "out")
    with pytest.raises(InputError, match=r"holds this sweep as parquet.*add --to parquet"):
        sweep(order(tmp_path, ALL), tmp_path / "out", kind="zarr")


def test_a_finished_sweep_is_not_done_again(tmp_path):
    first = sweep(order(tmp_path), tmp_path / "out", piece=500)
    again = sweep(order(tmp_path), tmp_path / "out", piece=500)
    assert again.computed == 0
    np.testing.assert_array_equal(first.tally.numbers, again.tally.numbers)
    assert first.tally.feasible == again.tally.feasible


def test_a_folder_of_another_sweep_is_refused(tmp_path):
    sweep(order(tmp_path), tmp_path / "out")
    with pytest.raises(InputError, match="ordered otherwise"):
        sweep(order(tmp_path, **{'"300 mm"': '"310 mm"'}), tmp_path / "out")


def test_a_piece_that_a_power_cut_left_empty_is_done_again(tmp_path):
    whole = sweep(order(tmp_path, ALL), tmp_path / "out", piece=500)
    (tmp_path / "out" / "part-000003.parquet").write_bytes(b"")
    again = sweep(order(tmp_path, ALL), tmp_path / "out")
    assert again.computed == 500
    for a, b in zip(whole.tally, again.tally, strict=True):
        np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize(
    ("file", "content", "words"),
    [
        ("sweep.json", b"[]", "no file of a sweep, or a damaged one"),
        ("sweep.json", b'{"format": 1}', "no file of a sweep, or a damaged one"),
        ("sweep.json", b'{"format": 2, "program": "9.9", "designs_in_a_piece": 5}', "begun by program 9.9"),
        ("state.npz", b"PK\x03\x04 cut off", "what is known so far is damaged"),
        ("state.npz", b"", "what is known so far is damaged"),
    ],
)
def test_a_damaged_folder_is_refused_with_a_cure(tmp_path, file, content, words):
    sweep(order(tmp_path), tmp_path / "out", piece=5000)
    (tmp_path / "out" / file).write_bytes(content)
    with pytest.raises(InputError, match=words) as caught:
        sweep(order(tmp_path), tmp_path / "out")
    assert caught.value.cure


RUN = "import sys; from fitting.cli.main import main; main()"


@pytest.mark.slow
def test_a_killed_process_loses_nothing(tmp_path):
    """kill -9 in the middle, then the same command."""
    order(tmp_path, ALL, "[sample]\nn = 12000000\n")
    command = [sys.executable, "-c", RUN, "sweep", str(tmp_path / "design.toml"), "--out", str(tmp_path / "out")]
    first = subprocess.Popen([*command, "--quiet"])
    while len(list((tmp_path / "out").glob("part-*.parquet"))) < 3:
        assert first.poll() is None
        time.sleep(0.05)
    first.send_signal(signal.SIGKILL)
    first.wait()
    assert subprocess.run([*command, "--json", str(tmp_path / "r.json"), "--quiet"]).returncode == 0
    told = json.loads((tmp_path / "r.json").read_text())
    assert 0 < told["computed"] <= 9 * 2**20
    count = sum(pq.read_metadata(tmp_path / "out" / name).num_rows for name in told["files"])
    assert count == told["designs"] == 12_000_000


# Two at once ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("keep", "kind"), [(BEST, "parquet"), (ALL, "parquet"), (ALL, "zarr")])
def test_two_sweeps_at_once_in_one_folder_find_what_one_finds(tmp_path, keep, kind, monkeypatch):
    monkeypatch.setattr("fitting.designs.sweep_store.SWEEP", SweepSettings(save_every=0.0))

    def other_begins_midway(*asked):
        for done, found in enumerate(here(*asked)):
            if done == 4:
                sweep(order(tmp_path, keep), tmp_path / "both", piece=500, kind=kind)
            yield found

    whole = sweep(order(tmp_path, keep), tmp_path / "whole", piece=500, kind=kind)
    both = sweep(order(tmp_path, keep), tmp_path / "both", work=other_begins_midway, piece=500, kind=kind)
    for a, b in zip(whole.tally, both.tally, strict=True):
        np.testing.assert_array_equal(a, b)
    for name, column in table(whole).items():
        np.testing.assert_array_equal(column, table(both)[name])


class EndsMeanwhile(dict):
    """Columns of a table during whose writing another program writes its own, begun and ended."""

    def __init__(self, columns, other):
        super().__init__(columns)
        self.other = other

    def items(self):
        other, self.other = self.other, lambda: None
        other()
        return super().items()


def ten(value):
    """A table that says whose it is."""
    return {name: np.full(10, value) for name in ("number", "work_J", "feasible")}


def test_of_two_tables_at_once_one_is_there_whole(tmp_path):
    def other():
        write_table("zarr", tmp_path, "best", ten(2.0))

    write_table("zarr", tmp_path, "best", EndsMeanwhile(ten(1.0), other))
    group = zarr.open_group(tmp_path / "best.zarr", mode="r")
    assert {name: set(array[:]) for name, array in group.arrays()} == {name: {1.0} for name in ten(1.0)}
    assert [path.name for path in tmp_path.iterdir()] == ["best.zarr"]


def test_of_many_tables_at_once_one_is_there_whole(tmp_path):
    def write(value):
        for _ in range(10):
            write_table("zarr", tmp_path, "best", ten(value))

    with ThreadPoolExecutor(3) as workers:
        list(workers.map(write, (1.0, 2.0, 3.0)))
    found = {name: set(array[:]) for name, array in zarr.open_group(tmp_path / "best.zarr", mode="r").arrays()}
    assert len(found) == 3
    assert len(set.union(*found.values())) == 1
    assert [path.name for path in tmp_path.iterdir()] == ["best.zarr"]


def test_two_sweeps_that_begin_at_once_share_one_group(tmp_path, monkeypatch):
    """The other has made the group between this one's look and its own."""
    kinds = {"work_J": float, "feasible": bool}
    writer("zarr", tmp_path, kinds, 100, 10)
    exists, looks = Path.exists, iter([False])
    monkeypatch.setattr(Path, "exists", lambda p: next(looks, True) if p.name == "designs.zarr" else exists(p))
    mine = writer("zarr", tmp_path, kinds, 100, 10)
    monkeypatch.undo()
    mine.write(3, {"work_J": np.arange(10.0), "feasible": np.ones(10, bool)}, {"feasible": 10, "undefined": 0})
    np.testing.assert_array_equal(zarr.open_group(tmp_path / "designs.zarr")["work_J"][30:40], np.arange(10.0))
    assert mine.done() == {3}
