"""From what was typed after `export` to a file."""

from pathlib import Path
from typing import Any

from fitting import units
from fitting.errors import InputError
from fitting.exporting.export import check_place, export
from fitting.exporting.laws import without
from fitting.exporting.settings import EXPORT
from fitting.exporting.table import BRANCHES, free_contraction
from fitting.recordings.settings import TABLES
from fitting.study.stored_model import stored_model
from mckibben_jax.model import Model

DEFAULT = {
    "python": "muscle.py",
    "table": "muscle.csv",
    "c": "muscle.h",
    "mujoco": "muscle_mujoco",
    "fmu": "muscle.fmu",
}


def export_of(given: dict[str, Any]) -> tuple[Path, dict[str, Any], str]:
    """Write what was asked for: the file, the result for machines, and what is in the file in words."""
    form, file = given["form"], Path(given["out"] or DEFAULT[given["form"]])
    check_place(file, form)
    whole, source = stored_model(given["model"], given["muscle"], given["effect_file"])
    whole = without(whole, given["without"])
    result = {"file": str(file), "form": form, "effects": list(whole.names)}
    if form == "python":
        export(whole, file, source=str(source))
        use = f"from {file.stem} import step; state, force = step(None, 3e5, 0.0, 1e-3)"
        return file, result | {"use": use}, f"{' + '.join(whole.names)} in plain numpy"
    if form == "c":
        export(whole, file, source=str(source))
        name = file.stem
        use = f'#include "{file.name}"; {name}_state s = {name}_start(3e5, 0); force = {name}_step(&s, 3e5, 0, 1e-3);'
        return file, result | {"use": use}, f"{' + '.join(whole.names)} in C99, float with -D{name.upper()}_FLOAT"
    if form == "fmu":
        export(whole, file, source=str(source))
        use = "import it into OpenModelica, Simulink or another tool as FMI 2.0 for co-simulation; in Python: fmpy"
        return file, result | {"use": use}, f"{' + '.join(whole.names)} as an FMU, compiled for this machine"
    if form == "mujoco":
        export(whole, file, source=str(source))
        use = f"pip install mujoco, then in {file}: python muscle_mujoco.py lift.xml, or joint.xml"
        return file, result | {"use": use}, f"{' + '.join(whole.names)} for MuJoCo, with two scenes"
    ends = _ends_of_table(whole, given)
    points = _counts(given["points"])
    export(whole, file, **ends, points=points, source=str(source))
    count = len(BRANCHES) * points[0] * points[1]
    use = "columns pressure [kPa], contraction [1], branch, force [N]; a recording of the kind 'static'"
    return file, result | {"use": use, "rows": count}, f"{count:,} rows, {' + '.join(whole.names)}"


def _ends_of_table(whole: Model, given: dict[str, Any]) -> dict[str, tuple[float, float]]:
    pressures = _ends(given["pressure"], "Pa", "--pressure")
    top = free_contraction(whole, pressures[1])
    contractions = _ends(given["contraction"], "1", "--contraction") if given["contraction"] else (0.0, top)
    low, high = TABLES.contractions
    if not low <= contractions[0] < contractions[1] <= high:
        problem = f"--contraction leaves {low:g} .. {high:g}, where no braided muscle goes"
        raise InputError(problem, value=given["contraction"], cure="for example --contraction 0,0.25")
    if pressures[0] < -units.ATMOSPHERE:
        raise InputError("--pressure goes below a vacuum", value=given["pressure"], cure="for example '0 bar,5 bar'")
    return {"contractions": contractions, "pressures": pressures}


def _counts(text: str) -> tuple[int, int]:
    parts = text.split(",")
    if len(parts) != 2 or not all(part.strip().isdecimal() and int(part) > 1 for part in parts):
        raise InputError("--points needs two whole numbers above 1", value=text, cure="for example --points 51,11")
    many, few = map(int, parts)
    if many * few > EXPORT.rows:
        raise InputError(f"the table would have {2 * many * few:,} rows", value=text, cure="ask for fewer points")
    return many, few


def _ends(text: str, unit: str, what: str) -> tuple[float, float]:
    ends = [units.to_si(part.strip(), unit, what) for part in text.split(",")]
    if len(ends) != 2 or ends[0] >= ends[1]:
        cure = f"for example {what} '{units.write(0.0, unit)}, {units.example(unit)}'"
        raise InputError(f"{what} needs a lower and an upper end", value=text, cure=cure)
    return ends[0], ends[1]
