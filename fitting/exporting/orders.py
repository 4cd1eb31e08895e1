"""From what was typed after `export` to a file."""

import keyword
import sys
from pathlib import Path
from typing import Any

import numpy as np

from fitting import units
from fitting.errors import InputError
from fitting.exporting.files import Grid, free_contraction, python_module, table, without, write_table
from fitting.recordings.readings import CONTRACTIONS
from fitting.study.stored_model import stored_model
from fitting.writing import write_text
from mckibben_jax.model import Model

DEFAULT = {"python": "muscle.py", "table": "muscle.csv"}
MOST_ROWS = 1_000_000
ENDINGS = {"python": (".py",), "table": (".csv", ".parquet")}


def exported(given: dict[str, Any]) -> tuple[Path, dict[str, Any], str]:
    """Write what was asked for: the file, the result for machines, and what is in the file in words."""
    form, file = given["form"], Path(given["out"] or DEFAULT[given["form"]])
    _check_place(file, form)
    whole, source = stored_model(given)
    whole = without(whole, given["without"])
    result = {"file": str(file), "form": form, "effects": list(whole.names)}
    if form == "python":
        write_text(str(file), python_module(whole, str(source)))
        use = f"from {file.stem} import step; state, force = step(None, 3e5, 0.0, 1e-3)"
        return file, result | {"use": use}, f"{' + '.join(whole.names)} in plain numpy"
    columns = table(whole, _grid(whole, given))
    write_table(file, columns, str(source))
    count = len(columns["branch"])
    use = "columns pressure [kPa], contraction [1], branch, force [N]; a recording of the kind 'static'"
    return file, result | {"use": use, "rows": count}, f"{count:,} rows, {' + '.join(whole.names)}"


def _check_place(file: Path, form: str) -> None:
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


def _grid(whole: Model, given: dict[str, Any]) -> Grid:
    pressures = _ends(given["pressure"], "Pa", "--pressure")
    top = free_contraction(whole, pressures[1])
    contractions = _ends(given["contraction"], "1", "--contraction") if given["contraction"] else (0.0, top)
    low, high = CONTRACTIONS
    if not low <= contractions[0] < contractions[1] <= high:
        problem = f"--contraction leaves {low:g} .. {high:g}, where no braided muscle goes"
        raise InputError(problem, value=given["contraction"], cure="for example --contraction 0,0.25")
    if pressures[0] < -units.ATMOSPHERE:
        raise InputError("--pressure goes below a vacuum", value=given["pressure"], cure="for example '0 bar,5 bar'")
    many, few = _counts(given["points"])
    return Grid(np.linspace(*contractions, many), np.linspace(*pressures, few))


def _counts(text: str) -> tuple[int, int]:
    parts = text.split(",")
    if len(parts) != 2 or not all(part.strip().isdecimal() and int(part) > 1 for part in parts):
        raise InputError("--points needs two whole numbers above 1", value=text, cure="for example --points 51,11")
    many, few = map(int, parts)
    if many * few > MOST_ROWS:
        raise InputError(f"the table would have {2 * many * few:,} rows", value=text, cure="ask for fewer points")
    return many, few


def _ends(text: str, unit: str, what: str) -> tuple[float, float]:
    ends = [units.to_si(part.strip(), unit, what) for part in text.split(",")]
    if len(ends) != 2 or ends[0] >= ends[1]:
        cure = f"for example {what} '{units.write(0.0, unit)}, {units.example(unit)}'"
        raise InputError(f"{what} needs a lower and an upper end", value=text, cure=cure)
    return ends[0], ends[1]
