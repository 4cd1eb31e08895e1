"""The fitted muscle for other programs: every form that `ENDINGS` names."""

import keyword
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from fitting.errors import InputError
from fitting.exporting.arduino_folder import arduino_files
from fitting.exporting.c_header import c_header
from fitting.exporting.draws import Draws
from fitting.exporting.fmu import write_fmu
from fitting.exporting.laws import NOTHING, Told
from fitting.exporting.mujoco_folder import mujoco_files, write_folder
from fitting.exporting.python_module import python_module
from fitting.exporting.simulink_folder import simulink_files
from fitting.exporting.table import Grid, free_contraction, table, write_table
from fitting.writing import write_text, write_whole
from mckibben_jax.model import Model

ENDINGS = {
    "python": (".py",), "table": (".csv", ".parquet"), "c": (".h",), "mujoco": ("",), "fmu": (".fmu",),
    "simulink": ("",), "arduino": ("",),
}  # fmt: skip
DRAWN = ("python", "c", "mujoco")  # forms that can hold draws of the parameters

FOLDERS = {
    "mujoco": lambda whole, source, _, told: mujoco_files(whole, source, told),
    "simulink": simulink_files,
    "arduino": arduino_files,
}

KEYWORDS_OF_C = frozenset({  # C99, 6.4.1, and those of C++
    "auto", "break", "case", "char", "const", "continue", "default", "do", "double", "else", "enum", "extern", "float",
    "for", "goto", "if", "inline", "int", "long", "register", "restrict", "return", "short", "signed", "sizeof",
    "static", "struct", "switch", "typedef", "union", "unsigned", "void", "volatile", "while", "class", "new", "delete",
    "this", "template", "namespace", "public", "private", "protected", "virtual", "operator", "try", "catch", "throw",
    "bool", "true", "false",
})  # fmt: skip


def export(
    model: Model,
    file: str | Path,
    *,
    contractions: Sequence[float] | None = None,
    pressures: Sequence[float] = (0.0, 5e5),
    points: tuple[int, int] = (51, 11),
    source: str = "a model in Python",
    told: Told = NOTHING,
    form: str | None = None,
) -> Path:
    """Write a model to a new file; its ending says the form unless `form` does, and `source` is said in it.

    `.py` is a module of plain numpy, `.h` a header of C99, `.csv` and `.parquet` a table of its force, `.fmu` an FMU
    (FMI 2.0) compiled for this machine; a name without an ending is a new folder for MuJoCo. The forms "simulink" (an
    S-function) and "arduino" (a sketch) are new folders too.

    `told` is what is known of the model besides: the largest force error to expect, which is written in every form, and
    draws of its parameters, of which numpy, C and MuJoCo can choose one (InputError in the other forms).

    A table goes from the first to the last of `contractions` (from 0 to where the force vanishes, unless given) and of
    `pressures` (Pa), in so many `points` of each. InputError where the file is there.
    """
    file = Path(file)
    form = form or next((form for form, endings in ENDINGS.items() if file.suffix in endings), "table")
    check_place(file, form)
    if told.draws is not None:
        told = replace(told, draws=_usable(told.draws.of(model), form))
    if form == "python":
        write_text(str(file), python_module(model, source, told))
    elif form == "c":
        write_text(str(file), c_header(model, source, file.stem, told))
    elif form == "fmu":
        write_whole(file, lambda new: write_fmu(model, source, new, file.stem, told))
    elif form in FOLDERS:
        write_whole(file, lambda new: write_folder(new, FOLDERS[form](model, source, file.stem, told)))
    else:
        write_table(file, table(model, grid(model, contractions, pressures, points)), source, told.error)
    return file


def _usable(draws: Draws, form: str) -> Draws:
    """Refuse draws where no form can hold them, or where there is nothing in them."""
    if form not in DRAWN:
        cure = f"take --to {', '.join(DRAWN)}"
        raise InputError(f"--to {form} holds no draws of the parameters", cure=cure)
    if not draws.names:
        raise InputError("nothing that was drawn is left in this model", cure="leave --without out, or --draws")
    return draws


def grid(
    model: Model, contractions: Sequence[float] | None, pressures: Sequence[float], points: tuple[int, int]
) -> Grid:
    """The places of a table, evenly spaced; arguments as in `export`."""
    ends = (0.0, free_contraction(model, pressures[-1])) if contractions is None else contractions
    return Grid(np.linspace(ends[0], ends[-1], points[0]), np.linspace(pressures[0], pressures[-1], points[1]))


def check_place(file: Path, form: str) -> None:
    """Refuse a file that is there, that has the wrong ending, or that Python could not import."""
    if file.suffix not in ENDINGS[form]:
        cure = f"name a file that ends in {' or '.join(ENDINGS[form])}" if any(ENDINGS[form]) else "name a new folder"
        raise InputError(f"--to {form} writes no '{file.suffix}' file", file, cure=cure)
    name = file.stem
    if form == "python" and (not name.isidentifier() or keyword.iskeyword(name) or name in sys.stdlib_module_names):
        cure = "use letters, digits and underscores, and no word of Python's own"
        raise InputError("Python cannot import a file of this name", file, cure=cure)
    if form == "python" and name == "numpy":
        raise InputError("a file of this name hides numpy, which it needs", file, cure="name another with --out")
    if form in ("c", "fmu", "simulink", "arduino") and not (
        name.isascii() and name.isidentifier() and name not in KEYWORDS_OF_C
    ):
        cure = "use letters, digits and underscores, and no word of C's own: its functions begin with this name"
        raise InputError("C cannot use the name of this file", file, cure=cure)
    if file.exists():
        raise InputError("the file is there already and is left alone", file, cure="name another with --out")
