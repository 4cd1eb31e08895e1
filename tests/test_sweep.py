"""Sweeps against numpy and against themselves: in one go and in pieces, on one device and on three."""

import dataclasses
import os
import subprocess
import sys

import numpy as np
import pytest
import zarr
from scipy.stats import qmc
from sweeping import ALL, BEST, GRID, SAMPLE, order, table

from fitting.designs.sweep import sweep
from mckibben_jax.design.batch import Engine, Space


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
    flags = f"{os.environ.get('XLA_FLAGS', '')} --xla_force_host_platform_device_count=3"  # else compiled as here
    environment = os.environ | {"XLA_FLAGS": flags}
    subprocess.run([sys.executable, "-c", DEVICES, *place], check=True, env=environment)
    three = np.load(place[2])
    for name, value in one.tally._asdict().items():
        np.testing.assert_array_equal(value, three[name])


def test_what_is_kept_in_memory_does_not_grow_with_the_sweep(tmp_path):
    """The compiled call for 10^4 and for 10^10 designs needs the same temporary memory."""
    sizes = []
    for count in (10**4, 10**10):
        batch = order(tmp_path).batch
        engine = Engine(dataclasses.replace(batch, space=dataclasses.replace(batch.space, size=count)), 2**13)
        inputs = (engine._numbers(0), np.uint64(1), np.float64(0))
        sizes.append(engine._tally.lower(*inputs).compile().memory_analysis().temp_size_in_bytes)
    assert sizes[0] == sizes[1] < 10 * 2**20


# Samples --------------------------------------------------------------------------------------------------------------


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
