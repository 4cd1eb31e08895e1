"""From what was typed after `export` to a file."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fitting import full_names, showing, units
from fitting.errors import InputError
from fitting.exporting.export import DRAWN, check_place, export, grid
from fitting.exporting.force_error import ForceError, unknown_error
from fitting.exporting.known import error_of, known_of
from fitting.exporting.laws import Told, without
from fitting.exporting.settings import EXPORT
from fitting.exporting.table import free_contraction, guessed_rows, table, write_table
from fitting.least_squares.force_band import ForceBand
from fitting.library.library import library
from fitting.model_files.model_file import read_model
from fitting.problem.estimate import ParameterState
from fitting.recordings.settings import TABLES
from fitting.study.stored_model import stored_model
from mckibben_jax.effect import INSTRUMENT, name_of
from mckibben_jax.model import Model
from mckibben_jax.parameter import parameters

WORDS = {
    "python": "in plain numpy", "c": "in C99", "fmu": "as an FMU, compiled for this machine",
    "mujoco": "for MuJoCo, with two scenes", "simulink": "as an S-function in C", "arduino": "as a sketch for Arduino",
}  # fmt: skip
DEFAULT = {
    "python": "muscle.py",
    "table": "muscle.csv",
    "c": "muscle.h",
    "mujoco": "muscle_mujoco",
    "fmu": "muscle.fmu",
    "simulink": "muscle_simulink",
    "arduino": "muscle_arduino",
}


@dataclass(frozen=True)
class Exported:
    """What was written: the file, the result for machines, what is in the file in words, and the bands of a new run.

    `beware` says which rows of a table are a guess, and which effects are none of the muscle's.
    """

    file: Path
    result: dict[str, Any]
    words: str
    bands: tuple[ForceBand, ...]
    beware: tuple[str, ...] = ()


def export_of(given: dict[str, Any]) -> Exported:
    """Write what was asked for."""
    form, file = given["form"], Path(given["out"] or DEFAULT[given["form"]])
    whole, source = stored_model(given["model"], given["muscle"], given["effect_file"], given["of"])
    check_place(file, form)
    whole = without(whole, given["without"])
    told = _told(given)
    beware = (*_read_only(whole), *_unmeasured(given, whole))
    result = {"file": str(file), "form": form, "effects": list(whole.names), **_result_of(told)}
    use, words = _use(form, file), f"{' + '.join(whole.names)} {WORDS.get(form, '')}".strip()
    if form != "table":
        export(whole, file, source=str(source), told=told, form=form)
        float_too = f", float with -D{file.stem.upper()}_FLOAT" if form == "c" else ""
        drawn = "" if told.draws is None else f", with {len(told.draws.values):,} draws of its parameters"
        return Exported(file, result | {"use": use}, words + float_too + drawn, told.error.bands, beware)
    contractions, pressures = _ends_of_table(whole, given)
    points = _counts(given["points"])
    rows = table(whole, grid(whole, contractions, pressures, points))
    write_table(file, rows, str(source), told.error)
    guessed = guessed_rows(rows, told.error.reach)
    result |= {"use": use, "rows": guessed.rows, "rows_beyond": guessed.beyond, "rows_below_zero": guessed.pushing}
    return Exported(file, result, f"{guessed.rows:,} rows, {words}", told.error.bands, (*beware, *guessed.texts))


def _read_only(whole: Model) -> tuple[str, ...]:
    """That a model holds errors of instruments, which a simulation of the muscle may not want."""
    names = [name for name, effect in zip(whole.names, whole.effects, strict=True) if effect.source == INSTRUMENT]
    left_out = " ".join(f"--without {name}" for name in names)
    told = "The model tells what the instruments read, not what the muscle does alone"
    return (f"{told}: {left_out} leaves out what belongs to them.",) if names else ()


def _unmeasured(given: dict[str, Any], whole: Model) -> tuple[str, ...]:
    """Values of effects that were to be fitted and that the data did not tell: what is written is where they began."""
    stored = read_model(given["model"], library(given["effect_file"]))
    dataset = stored.called(given["of"] or stored.name)
    texts = []
    for effect in whole.effects:
        for its in parameters(effect):
            name, value = f"{name_of(effect)}.{its.name}", float(getattr(effect, its.name))
            state = stored.states.get(full_names.of_set(name, dataset), stored.states.get(name))
            texts += [f"{name} = {showing.show(value, its.unit, digits=3)}"] if state is ParameterState.HELD else []
    if not texts:
        return ()
    these = "this value, which is the starting value" if len(texts) == 1 else "these values, which are starting values"
    return (
        f"The data do not determine {these} of the fit: {', '.join(texts)}. If you know better, write that into the "
        'model file with state = "fixed", or leave the effect out (--without).',
    )


def _use(form: str, file: Path) -> str:
    """The shortest way to use what was written."""
    name = file.stem
    return {
        "python": f"from {name} import step; state, force = step(None, 3e5, 0.0, 1e-3)",
        "c": f'#include "{file.name}"; {name}_state s = {name}_start(3e5, 0); force = {name}_step(&s, 3e5, 0, 1e-3);',
        "fmu": "import it into OpenModelica, Simulink or another tool as FMI 2.0 for co-simulation; in Python: fmpy",
        "mujoco": f"pip install mujoco, then in {file}: python muscle_mujoco.py lift.xml, or joint.xml",
        "simulink": f"in MATLAB, in {file}: mex {name}_block.c; then the block S-Function with the sample time in s",
        "arduino": f"open {file / name}.ino in the Arduino IDE and write the numbers of your sensors",
        "table": "columns pressure [kPa], contraction [1], branch, force [N]; a recording of the kind 'static'",
    }[form]


def _told(given: dict[str, Any]) -> Told:
    """What is known of the model from its data: the force error, and draws where they were asked for."""
    if given["draws"] is None:
        return Told(_of_whole(error_of(given), given["without"]))
    if given["form"] not in DRAWN:
        cure = f"take --to {', '.join(DRAWN)}"
        raise InputError(f"--to {given['form']} holds no draws of the parameters", cure=cure)
    known = known_of(given)
    return Told(_of_whole(known.error(), given["without"]), known.draws(given["draws"], given["seed"], _set_of(given)))


def _set_of(given: dict[str, Any]) -> str | None:
    """The name of the data set whose muscle is meant, where one was asked for."""
    return read_model(given["model"], library(given["effect_file"])).called(given["of"]) if given["of"] else None


def _of_whole(error: ForceError, left_out: Sequence[str]) -> ForceError:
    """What was found of the model with all its effects, which says nothing of one without some of them."""
    if not left_out or not math.isfinite(error.newtons):
        return error
    names = " + ".join(left_out)
    return unknown_error(f"with {names}, left out here, the model errs by {error.newtons:.3g} N at most")


def _result_of(told: Told) -> dict[str, Any]:
    """The same for machines."""
    newtons = told.error.newtons if math.isfinite(told.error.newtons) else None
    found: dict[str, Any] = {"force_error_N": newtons, "force_error": told.error.sentence}
    if told.draws is not None:
        found["draws"] = {
            "parameters": list(told.draws.names),
            "count": len(told.draws.values),
            "from": told.draws.origin,
            "scatter_N": told.error.scatter if math.isfinite(told.error.scatter) else None,
        }
    return found


def _ends_of_table(whole: Model, given: dict[str, Any]) -> tuple[tuple[float, float], tuple[float, float]]:
    """From where to where a table goes: contractions, pressures (Pa)."""
    pressures = _ends(given["pressure"], "Pa", "--pressure")
    top = free_contraction(whole, pressures[1])
    contractions = _ends(given["contraction"], "1", "--contraction") if given["contraction"] else (0.0, top)
    low, high = TABLES.contractions
    if not low <= contractions[0] < contractions[1] <= high:
        problem = f"--contraction leaves {low:g} .. {high:g}, where no braided muscle goes"
        raise InputError(problem, value=given["contraction"], cure="for example --contraction 0,0.25")
    if pressures[0] < -units.ATMOSPHERE:
        raise InputError("--pressure goes below a vacuum", value=given["pressure"], cure="for example '0 bar,5 bar'")
    return contractions, pressures


def _counts(text: str) -> tuple[int, int]:
    parts = text.split(",")
    if len(parts) != 2 or not all(part.strip().isdecimal() and int(part) > 1 for part in parts):
        raise InputError("--points needs two whole numbers above 1", value=text, cure="for example --points 51,11")
    many, few = map(int, parts)
    if many * few > EXPORT.rows:
        raise InputError(f"the table would have {2 * many * few:,} rows", value=text, cure="ask for fewer points")
    return many, few


def _ends(text: str, unit: str, what: str) -> tuple[float, float]:
    ends = units.list_to_si(text, unit, what)
    if len(ends) != 2 or ends[0] >= ends[1]:
        cure = f"for example {what} '{showing.write(0.0, unit)}, {units.example(unit)}'"
        raise InputError(f"{what} needs a lower and an upper end", value=text, cure=cure)
    return ends[0], ends[1]
