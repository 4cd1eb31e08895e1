"""Sweeps against numpy and against themselves: in one go, in pieces, interrupted, on two devices, on a cluster."""

import dataclasses
import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pyarrow.parquet as pq
import pytest
import zarr
from scipy.stats import qmc

from fitting.designs.sweep import here, sweep
from fitting.designs.sweep_file import read_sweep
from fitting.errors import InputError
from mckibben_jax.batch import Engine, Space

TOP = """
outputs = ["force", "stroke", "work"]
keep = {keep}
"""
FILE = """
[muscle]
length = "300 mm"
wall_thickness = "1 mm"
shear_modulus = "0.54 MPa"
[model]
effects = ["ideal_cylinder"]
[variables]
braid_angle = ["12 deg", "40 deg"]
radius      = ["4 mm", "12 mm"]
[objective]
maximise = "force"
at = { contraction = 0.1, pressure = "5 bar" }
[[constraint]]
quantity = "stroke"
at = { pressure = "5 bar" }
min = "25 %"
"""
SAMPLE = "[sample]\nn = 5000\n"
GRID = """
[grid]
braid_angle = { from = "12 deg", to = "40 deg", n = 40 }
radius = { from = "4 mm", to = "12 mm", n = 25 }
"""
BEST, ALL = '{ best = 20, by = "work" }', '"all"'


def order(folder, keep=BEST, space=SAMPLE, **changes):
    """A sweep as a file orders it."""
    text = TOP.replace("{keep}", keep) + FILE + space
    for old, new in changes.items():
        text = text.replace(old, new)
    (folder / "design.toml").write_text(text)
    return read_sweep(folder / "design.toml")


def table(found):
    """All that a sweep has written, as columns of numpy."""
    if found.files[0].endswith(".zarr"):
        group = zarr.open_group(found.folder / found.files[0], mode="r")
        return {name: array[:] for name, array in group.arrays()}
    parts = [pq.read_table(found.folder / name) for name in found.files]
    return {name: np.concatenate([part[name].to_numpy() for part in parts]) for name in parts[0].column_names}


def ideal(angle, radius):
    """Force at 10 %, stroke, work of the ideal muscle at 5 bar, in numpy."""
    a, b = 3 / np.tan(angle) ** 2, 1 / np.sin(angle) ** 2
    end = 1 - 1 / (np.sqrt(3) * np.cos(angle))
    area = a * (1 - (1 - end) ** 3) / 3 - b * end
    scale = np.pi * radius**2 * 5e5
    return scale * (a * 0.81 - b), end, 0.3 * scale * area


def test_a_grid_is_written_out_whole_and_in_order(tmp_path):
    rows = table(sweep(order(tmp_path, ALL, GRID), tmp_path / "all", piece=300))
    angle, radius = np.meshgrid(np.radians(np.linspace(12, 40, 40)), np.linspace(4e-3, 12e-3, 25), indexing="ij")
    np.testing.assert_allclose(rows["braid_angle_rad"], angle.ravel(), rtol=1e-14)
    np.testing.assert_allclose(rows["radius_m"], radius.ravel(), rtol=1e-14)
    force, stroke, work = ideal(rows["braid_angle_rad"], rows["radius_m"])
    np.testing.assert_allclose(rows["force_N"], force, rtol=1e-10)
    np.testing.assert_allclose(rows["stroke"], stroke, rtol=1e-10)
    np.testing.assert_allclose(rows["work_J"], work, rtol=1e-10)
    np.testing.assert_array_equal(rows["feasible"], stroke >= 0.25)


HISTOGRAM = 'histogram = { of = "work", bins = 30 }\n'


@pytest.mark.parametrize("keep", [BEST, ALL])
def test_zarr_holds_what_parquet_holds(tmp_path, keep):
    ordered = order(tmp_path, keep, SAMPLE + HISTOGRAM)
    parquet, other = (sweep(ordered, tmp_path / kind, piece=700, kind=kind) for kind in ("parquet", "zarr"))
    mine, theirs = table(parquet), table(other)
    assert mine.keys() == theirs.keys()
    for name, column in mine.items():
        assert column.dtype == theirs[name].dtype
        np.testing.assert_array_equal(column, theirs[name])
    for a, b in zip(parquet.tally, other.tally, strict=True):
        np.testing.assert_array_equal(a, b)


def test_a_piece_is_a_chunk_and_every_array_says_what_it_runs_over(tmp_path):
    found = sweep(order(tmp_path, ALL), tmp_path / "out", piece=700, kind="zarr")
    for _, array in zarr.open_group(found.folder / "designs.zarr", mode="r").arrays():
        assert array.shape == (5000,)
        assert array.chunks == (700,)
        assert array.metadata.dimension_names == ("design",)


def test_the_best_the_histogram_and_the_count_are_those_of_all(tmp_path):
    every = table(sweep(order(tmp_path, ALL), tmp_path / "all", piece=700))
    found = sweep(order(tmp_path), tmp_path / "best", piece=700)
    ranked = np.argsort(np.where(every["feasible"], -every["work_J"], np.inf), kind="stable")[:20]
    np.testing.assert_array_equal(found.tally.numbers, ranked)
    np.testing.assert_allclose(found.rows["work_J"], every["work_J"][ranked], rtol=1e-14)
    assert found.tally.feasible == every["feasible"].sum() == np.sum(every["stroke"] >= 0.25)
    drawn = found.batch.histogram
    counts = np.histogram(every["work_J"], np.linspace(drawn.low, drawn.high, drawn.bins + 1))[0]
    assert np.abs(found.tally.counts[1:-1] - counts).sum() <= 2  # a value at an edge may fall to either side
    assert found.tally.counts.sum() == 5000


def test_pieces_make_no_difference(tmp_path):
    one, many = (sweep(order(tmp_path), tmp_path / str(piece), piece=piece) for piece in (10**6, 128))
    for a, b in zip(one.tally, many.tally, strict=True):
        np.testing.assert_array_equal(a, b)


def test_of_equal_designs_the_first_are_kept_whatever_the_pieces(tmp_path):
    """A strand's length knows no radius: every braid angle of the grid has 25 equals."""
    keep = '{ best = 20, by = "strand_length", smallest = true }'
    one, many = (sweep(order(tmp_path, keep, GRID), tmp_path / str(p), piece=p) for p in (1000, 37))
    np.testing.assert_array_equal(one.tally.numbers, np.arange(20))
    np.testing.assert_array_equal(many.tally.numbers, np.arange(20))


def test_the_smallest_can_be_asked_for(tmp_path):
    found = sweep(order(tmp_path, '{ best = 3, by = "work", smallest = true }'), tmp_path / "out")
    assert np.all(np.diff(found.rows["work_J"]) >= 0)
    whole = table(sweep(order(tmp_path, ALL), tmp_path / "whole"))
    np.testing.assert_array_equal(found.rows["work_J"], np.sort(whole["work_J"][whole["feasible"]])[:3])


# Samples -------------------------------------------------------------------------------------------------------------


def shares(space, count):
    """Places of a sample."""
    import jax

    return np.asarray(jax.vmap(space.place)(np.arange(count, dtype=np.uint64)))


def test_a_sample_in_one_dimension_turns_by_the_golden_ratio():
    places = shares(Space({"x": (0.0, 1.0)}, 100), 100)[:, 0]
    golden = (np.sqrt(5) - 1) / 2
    np.testing.assert_allclose((places - places[0]) % 1, np.arange(100) * golden % 1, atol=1e-12)


def test_a_sample_fills_the_box_more_evenly_than_chance():
    ranges = dict.fromkeys("abc", (0.0, 1.0))
    chance = qmc.discrepancy(np.random.default_rng(0).random((2000, 3)))
    for seed in range(3):
        assert qmc.discrepancy(shares(Space(ranges, 2000, (), seed), 2000)) < chance / 4


def test_numbers_beyond_32_bits_are_designs_too():
    space = Space({"x": (0.0, 1.0)}, 2**40)
    far = float(space.place(np.uint64(2**39 + 5))[0])
    exact = (2**39 + 5) * int((5**0.5 - 1) / 2 * 2**53) % 2**53 / 2**53  # 53 bits of the ratio: good to 2^-14 there
    assert abs((far - float(space.place(np.uint64(0))[0])) % 1 - exact) < 1e-3


# Stopped and gone on with --------------------------------------------------------------------------------------------


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
    monkeypatch.setattr("fitting.designs.sweep_store.SAVE_EVERY", 0.0)
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


@pytest.mark.parametrize(("keep", "kind"), [(BEST, "parquet"), (ALL, "parquet"), (ALL, "zarr")])
def test_two_sweeps_at_once_in_one_folder_find_what_one_finds(tmp_path, keep, kind, monkeypatch):
    monkeypatch.setattr("fitting.designs.sweep_store.SAVE_EVERY", 0.0)

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


RUN = "import sys; from fitting.cli import main; main()"


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


# Several devices, several machines -----------------------------------------------------------------------------------

DEVICES = """
import sys, jax, numpy as np
jax.config.update("jax_enable_x64", True)
from fitting.designs.sweep import sweep
from fitting.designs.sweep_file import read_sweep
assert len(jax.devices()) == 3
found = sweep(read_sweep(sys.argv[1]), sys.argv[2], piece=1234)
np.savez(sys.argv[3], **found.tally._asdict())
"""


def test_several_devices_find_the_same(tmp_path):
    """Three, among which no piece divides evenly."""
    one = sweep(order(tmp_path), tmp_path / "one", piece=1234)
    place = [str(tmp_path / name) for name in ("design.toml", "three", "three.npz")]
    environment = os.environ | {"XLA_FLAGS": "--xla_force_host_platform_device_count=3"}
    subprocess.run([sys.executable, "-c", DEVICES, *place], check=True, env=environment)
    three = np.load(place[2])
    for name, value in one.tally._asdict().items():
        np.testing.assert_array_equal(value, three[name])


@pytest.mark.parametrize("keep", [BEST, ALL])
def test_a_cluster_loses_and_doubles_nothing_when_a_worker_is_killed(tmp_path, keep):
    distributed = pytest.importorskip("distributed")
    from fitting.designs.sweep_scheduler import on

    whole = sweep(order(tmp_path, keep), tmp_path / "whole", piece=250)
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as cluster:
        victims = [worker.pid for worker in cluster.workers.values()]
        on_cluster = on(cluster.scheduler_address)

        def work(*ordered):
            for done, found in enumerate(on_cluster(*ordered)):
                if done == 2:
                    os.kill(victims[0], signal.SIGKILL)
                yield found

        shared = sweep(order(tmp_path, keep), tmp_path / "shared", work=work, piece=250)
    assert shared.computed == 5000
    for a, b in zip(whole.tally, shared.tally, strict=True):
        np.testing.assert_array_equal(a, b)
    for name, column in table(whole).items():
        np.testing.assert_array_equal(column, table(shared)[name])


MODEL = """format = 1
[muscle]
length = "300 mm"
radius = "8 mm"
braid_angle = "25 deg"
[[effect]]
name = "ideal_cylinder"
[[effect]]
name = "spring"
define = "spring = -K*x, K = 500 N/m (0..9000)"
K = "2000 N/m"
"""
ELSEWHERE = """
import sys
from fitting.designs.sweep_scheduler import do_piece
print(do_piece(open(sys.argv[1], "rb").read(), 0, 1000, float("-inf")).scores[0].hex())
"""


def test_an_effect_that_a_line_defines_goes_along(tmp_path):
    """A class that pickle takes apart forgets what its fields are, and the law would be another one."""
    from fitting.cluster import packed

    (tmp_path / "model.toml").write_text(MODEL)
    model, muscle = 'file = "model.toml"', FILE.partition("[model]")[0]
    ordered = order(tmp_path, BEST, SAMPLE, **{'effects = ["ideal_cylinder"]': model, muscle: "\n"})
    (tmp_path / "order").write_bytes(packed(ordered))
    ran = subprocess.run([sys.executable, "-c", ELSEWHERE, str(tmp_path / "order")], capture_output=True, text=True)
    best = Engine(ordered.batch, 1000).tally(0).scores[0]
    assert float.fromhex(ran.stdout.strip()) == best, ran.stderr
    alone = order(tmp_path, BEST, SAMPLE).batch
    assert best < Engine(alone, 1000).tally(0).scores[0]  # the spring takes its share


def test_a_scheduler_that_does_not_answer_is_said(monkeypatch):
    pytest.importorskip("distributed")
    from fitting.designs.sweep_scheduler import on

    with pytest.raises(InputError, match="no Dask scheduler answers"):
        on("tcp://127.0.0.1:9")


# Memory --------------------------------------------------------------------------------------------------------------


def test_what_is_kept_in_memory_does_not_grow_with_the_sweep(tmp_path):
    """The compiled call for 10^4 and for 10^10 designs needs the same temporary memory."""
    sizes = []
    for count in (10**4, 10**10):
        batch = order(tmp_path).batch
        engine = Engine(dataclasses.replace(batch, space=dataclasses.replace(batch.space, size=count)), 2**13)
        inputs = (engine._numbers(0), np.uint64(1), np.float64(0))
        sizes.append(engine._tally.lower(*inputs).compile().memory_analysis().temp_size_in_bytes)
    assert sizes[0] == sizes[1] < 10 * 2**20


# Files ---------------------------------------------------------------------------------------------------------------


def test_words_of_a_sweep_may_stand_below_its_heading(tmp_path):
    text = FILE + '[sample]\nn = 100\noutputs = ["work"]\nkeep = "all"\n'
    (tmp_path / "design.toml").write_text(text)
    found = read_sweep(tmp_path / "design.toml")
    assert found.everything
    assert found.batch.columns == ("work_J",)
    assert found.batch.outputs == (("work", {"pressure": 5e5}),)


def test_one_quantity_at_several_places(tmp_path):
    listed = 'outputs = ["work", { quantity = "force", at = { contraction = 0, pressure = "5 bar" } }, "force"]'
    found = order(tmp_path, **{'outputs = ["force", "stroke", "work"]': listed}).batch
    assert found.columns == ("work_J", "force_N", "force_N_at_0.1_500000Pa")
    assert found.outputs[1][1] == {"contraction": 0.0, "pressure": 5e5}


REFUSED = {
    "neither": (SAMPLE, "", "neither [grid] nor [sample]"),
    "both": (SAMPLE, SAMPLE + GRID, "both [grid] and [sample]"),
    "no count": ("n = 5000", "seed = 1", "how many"),
    "half a design": ("n = 5000", "n = 0.5", "whole number"),
    "unknown output": ('"stroke", "work"]', '"strike"]', "did you mean 'stroke'"),
    "unknown keep": (BEST, '"some"', "what to keep"),
    "unknown by": ('by = "work"', 'by = "wrok"', "did you mean 'work'"),
    "no place": ('"stroke", "work"]', '"hysteresis_loss", "outer_radius"]', None),
    "axis": (SAMPLE, '[grid]\nradius = ["4 mm", "5 mm"]\n', "not from, to and n"),
    "falling axis": (SAMPLE, '[grid]\nradius = { from = "5 mm", to = "4 mm", n = 3 }\n', "does not rise"),
    "histogram": (SAMPLE, SAMPLE + 'histogram = { of = "outer_radius" }\n', "no output"),
    "need": ('"stroke", "work"]', '"burst_pressure"]', "needs breaking_stress"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_a_wrong_file_is_refused_with_a_cure(tmp_path, case):
    old, new, message = REFUSED[case]
    if message is None:  # conditions that the objective gives are taken over
        assert order(tmp_path, **{old: new}).batch.outputs[-2][1] == {"contraction": 0.1}
        return
    with pytest.raises(InputError) as error:
        order(tmp_path, **{old: new})
    assert message in str(error.value)
    assert "Cure:" in str(error.value)
