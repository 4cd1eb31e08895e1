"""A small sweep, as a file orders it, and what it has written."""

import numpy as np
import pyarrow.parquet as pq
import zarr
from design_texts import BRAID, FORCE, IDEAL, KNOWN, WALL, stroke

from fitting.designs.sweep_file import read_sweep

TOP = """
outputs = ["force", "stroke", "work"]
keep = {keep}
"""
FILE = KNOWN + WALL + IDEAL + BRAID + FORCE + stroke("25 %")
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
