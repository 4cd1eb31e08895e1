"""A fitted muscle as a table of its force: over contraction and pressure, on both branches."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fitting.errors import InputError
from fitting.exporting.force_error import ForceError
from fitting.exporting.reach import Reach
from fitting.exporting.settings import EXPORT
from fitting.version import program_version
from fitting.writing import write_text, write_whole
from mckibben_jax.model import Model
from mckibben_jax.motion.stepping import slow_force

BRANCHES = {"contraction": 1.0, "elongation": -1.0}


@dataclass(frozen=True)
class Grid:
    """Where a table says the force: contractions, pressures (Pa)."""

    contractions: np.ndarray
    pressures: np.ndarray


def free_contraction(whole: Model, pressure: float) -> float:
    """Contraction at which the force of a muscle at rest vanishes at this pressure; at most one half."""
    contraction = np.linspace(0.0, 0.5, 501)
    force = forces(whole, contraction, np.full_like(contraction, pressure), np.zeros_like(contraction))
    slack = np.flatnonzero(~(force > 0))
    return float(contraction[slack[0]]) if len(slack) else 0.5


def forces(whole: Model, contraction: np.ndarray, pressure: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """Force of slow motion at many places, N."""
    given = (jnp.asarray(a, float) for a in (contraction, pressure, direction, np.zeros_like(contraction)))
    return np.asarray(_forces(whole, *given))


@eqx.filter_jit
def _forces(whole: Model, *at: jax.Array) -> jax.Array:
    return jax.vmap(lambda *one: slow_force(whole, *one))(*at)


def table(whole: Model, grid: Grid) -> dict[str, np.ndarray]:
    """Force over contraction and pressure on both branches; column heads as in a recording of points."""
    axes = np.meshgrid(grid.pressures, list(BRANCHES), grid.contractions, indexing="ij")
    pressure, branch, contraction = (axis.ravel() for axis in axes)
    direction = np.array([BRANCHES[str(name)] for name in branch])
    found = forces(whole, contraction, pressure, direction)
    return {"pressure [kPa]": pressure / 1e3, "contraction [1]": contraction, "branch": branch, "force [N]": found}


@dataclass(frozen=True)
class Guessed:
    """How many rows a table has, how many lie beyond the readings (None: unknown), in how many the muscle pushes."""

    rows: int
    beyond: int | None
    pushing: int

    @property
    def texts(self) -> tuple[str, ...]:
        """One sentence for each kind of row that nobody should trust."""
        found = []
        if self.beyond:
            found.append(
                f"{self.beyond:,} of {self.rows:,} rows lie beyond the pressures and contractions that were measured: "
                "the force error does not hold there (--pressure and --contraction say where a table goes)."
            )
        if self.pushing:
            found.append(
                f"The force is negative in {self.pushing:,} of {self.rows:,} rows: the model pushes, where a real "
                "muscle hangs slack or buckles. Take 0 N there, unless your rig was measured to push."
            )
        return tuple(found)


def guessed_rows(columns: dict[str, np.ndarray], reach: Reach | None) -> Guessed:
    """Count the rows of a table, and those of which nothing is known."""
    force, pressure = columns["force [N]"], 1e3 * columns["pressure [kPa]"]
    beyond = None if reach is None else int(np.sum(~reach.holds(pressure, columns["contraction [1]"])))
    return Guessed(len(force), beyond, int(np.sum(force < -EXPORT.pushes)))


def write_table(path: Path, columns: dict[str, np.ndarray], source: str, error: ForceError) -> None:
    """Write a table as CSV or, by the file's ending, as Parquet; the force error to expect stands beside it."""
    import pandas as pd

    frame = pd.DataFrame(columns)
    sentence = " ".join([error.sentence, *guessed_rows(columns, error.reach).texts])
    if path.suffix == ".parquet":
        frame.attrs = {"force_error_N": error.newtons, "force_error": sentence}
        _write_parquet(frame, path)
        return
    head = f"# Force of slow motion on both branches. Written by mckibben {program_version()} from {source}. "
    head += f"force_error_N = {error.newtons:.6g}. {sentence}\n"
    write_text(path, head + frame.to_csv(index=False, float_format="%.10g", lineterminator="\n"))


def _write_parquet(frame: Any, path: Path) -> None:
    try:
        write_whole(path, lambda new: frame.to_parquet(new, index=False))
    except ImportError:
        cure = "pip install pyarrow, or name a file that ends in .csv"
        raise InputError("Parquet needs pyarrow", path, cure=cure) from None
