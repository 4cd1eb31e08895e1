"""The fitted muscle for other programs: a module of plain numpy, or a table of its force."""

import keyword
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from fitting.errors import InputError
from fitting.exporting.files import Grid, free_contraction, python_module, table, write_table
from fitting.writing import write_text
from mckibben_jax.model import Model

ENDINGS = {"python": (".py",), "table": (".csv", ".parquet")}


def export(
    model: Model,
    file: str | Path,
    *,
    contractions: Sequence[float] | None = None,
    pressures: Sequence[float] = (0.0, 5e5),
    points: tuple[int, int] = (51, 11),
    source: str = "a model in Python",
) -> Path:
    """Write a model to a new file: `.py` is a module of plain numpy, `.csv` and `.parquet` a table of its force.

    A table goes from the first to the last of `contractions` (from 0 to where the force vanishes, unless given) and of
    `pressures` (Pa), in so many `points` of each. `source` is said in the file. InputError where the file is there.
    """
    file = Path(file)
    form = "python" if file.suffix in ENDINGS["python"] else "table"
    check_place(file, form)
    if form == "python":
        write_text(str(file), python_module(model, source))
    else:
        write_table(file, table(model, grid(model, contractions, pressures, points)), source)
    return file


def grid(
    model: Model, contractions: Sequence[float] | None, pressures: Sequence[float], points: tuple[int, int]
) -> Grid:
    """The places of a table, evenly spaced; arguments as in `export`."""
    ends = (0.0, free_contraction(model, pressures[-1])) if contractions is None else contractions
    return Grid(np.linspace(ends[0], ends[-1], points[0]), np.linspace(pressures[0], pressures[-1], points[1]))


def check_place(file: Path, form: str) -> None:
    """Refuse a file that is there, that has the wrong ending, or that Python could not import."""
    if file.suffix not in ENDINGS[form]:
        cure = f"name a file that ends in {' or '.join(ENDINGS[form])}"
        raise InputError(f"--to {form} writes no '{file.suffix}' file", file, cure=cure)
    name = file.stem
    if form == "python" and (not name.isidentifier() or keyword.iskeyword(name) or name in sys.stdlib_module_names):
        cure = "use letters, digits and underscores, and no word of Python's own"
        raise InputError("Python cannot import a file of this name", file, cure=cure)
    if form == "python" and name == "numpy":
        raise InputError("a file of this name hides numpy, which it needs", file, cure="name another with --out")
    if file.exists():
        raise InputError("the file is there already and is left alone", file, cure="name another with --out")
