"""design.toml: what is wanted of a muscle, in any unit, as a task for `mckibben_jax.design`; its answer in words."""

from pathlib import Path
from typing import Any

import numpy as np

from fitting import units
from fitting.errors import InputError, unknown_name
from fitting.model_file import read_model
from fitting.muscle_file import line_of, read_muscle_table, read_toml
from fitting.own_effects import library, named
from mckibben_jax.design import DESIGN_BASELINE, Design, Limit, Met, Task, design, to_json
from mckibben_jax.effect import Effect, name_of
from mckibben_jax.merit import CONDITIONS, QUANTITIES, built, missing
from mckibben_jax.muscle import Muscle
from mckibben_jax.muscle import quantities as muscle_quantities

__all__ = ["describe", "design", "read_design", "to_json"]

TOP_KEYS = ("name", "muscle", "model", "variables", "objective", "constraint")
OF_A_SWEEP = ("grid", "sample", "outputs", "keep")  # the same file may also say what a sweep does
LATER = ("hysteresis_loss", "efficiency", "response_time")
SAME_AS = {"hardness": "shear_modulus", "turns": "braid_angle", "cord_length": "braid_angle"}


def read_design(path: Path | str, known: dict[str, type[Effect]] | None = None) -> Task:
    """Read a design file. `known` are the effects that there are, by name; the program's own unless given."""
    path = Path(path)
    if not path.is_file():
        raise InputError("no such file", path, cure="write one with [muscle], [variables] and [objective]")
    table, raw = read_toml(path)
    for key in table:
        if key not in TOP_KEYS + OF_A_SWEEP:
            raise unknown_name("key", key, TOP_KEYS, path, row=line_of(raw, key))
    variables = _variables(_table(table, "variables", path), path, raw)
    effects, fitted = _model(table.get("model", {}), path, raw, known or library())
    muscle = _muscle(table.get("muscle", {}), variables, fitted, path, raw)
    quantity, maximise, at = _objective(_table(table, "objective", path), path, raw)
    task = Task(muscle, variables, quantity, at, _constraints(table, path, raw), effects, maximise)
    _check_needs(task, path, raw)
    return task


def _table(table: dict[str, Any], key: str, path: Path) -> dict[str, Any]:
    found = table.get(key)
    if not isinstance(found, dict) or not found:
        examples = {"variables": 'braid_angle = ["12 deg", "40 deg"]', "objective": 'maximise = "force"'}
        raise InputError(f"there is no [{key}]", path, cure=f"add [{key}] and below it {examples[key]}")
    return found


# Muscle and model -----------------------------------------------------------------------------------------------------


def _variables(table: dict[str, Any], path: Path, raw: bytes) -> dict[str, tuple[float, float]]:
    known = muscle_quantities()
    ranges = {}
    for name, ends in table.items():
        row = line_of(_below(raw, "[variables]"), name)
        if name not in known:
            raise unknown_name("variable", name, known, path)
        if not isinstance(ends, list) or len(ends) != 2:
            cure = f'write {name} = ["{units.example(known[name][0])}", "..."]'
            raise InputError(f"the range of {name} is not a pair of values", path, row, value=ends, cure=cure)
        low, high = (_si(end, known[name][0], f"{name} in [variables]", path, row) for end in ends)
        if not 0 <= low < high:
            raise InputError(f"the range of {name} does not rise from a positive value", path, row, value=ends,
                             cure="the smaller value comes first")  # fmt: skip
        if name == "braid_angle" and high >= np.pi / 2:
            raise InputError("braid_angle must stay below 90 deg", path, row, value=ends[1], cure="54.7 deg is enough")
        ranges[name] = (low, high)
    return ranges


def _below(raw: bytes, heading: str) -> bytes:
    """The file with everything above a heading blanked, so that its lines keep their numbers."""
    before, mark, after = raw.partition(heading.encode())
    return b"\n" * before.count(b"\n") + mark + after if mark else raw


def _muscle(
    given: Any, variables: dict[str, tuple[float, float]], fitted: Muscle | None, path: Path, raw: bytes
) -> Muscle:
    """What is written, over what the model file knows; variables at the middle of their range."""
    if not isinstance(given, dict):
        raise InputError("[muscle] is not a table", path, cure='write [muscle] and below it length = "300 mm"')
    known = muscle_quantities()
    stored = {} if fitted is None else {name: getattr(fitted, name) for name in known}
    said = {*given, *variables, *(SAME_AS[key] for key in given if key in SAME_AS)}
    table = {k: units.write(float(v), known[k][0]) for k, v in stored.items() if v is not None and k not in said}
    middle = {k: units.write((low + high) / 2, known[k][0]) for k, (low, high) in variables.items()}
    return read_muscle_table(table | given | middle, path, raw)[0]


def _model(
    given: Any, path: Path, raw: bytes, known: dict[str, type[Effect]]
) -> tuple[tuple[Effect, ...], Muscle | None]:
    """The effects, and the muscle of the model file if there is one."""
    if not isinstance(given, dict):
        raise InputError("[model] is not a table", path, cure='write [model] and below it effects = ["..."]')
    for key in given:
        if key not in ("effects", "file"):
            raise unknown_name("key in [model]:", key, ("effects", "file"), path, row=line_of(raw, key))
    if "file" in given and "effects" in given:
        raise InputError("[model] names effects and a file", path, cure="leave one of them out")
    if "file" in given:
        stored = read_model(path.parent / str(given["file"]), known)
        return stored.effects, stored.muscle
    names = given.get("effects", [name_of(kind) for kind in DESIGN_BASELINE])
    if not isinstance(names, list) or not names or not all(isinstance(name, str) for name in names):
        row = line_of(raw, "effects")
        raise InputError("effects is not a list of names", path, row, value=names, cure='effects = ["ideal_cylinder"]')
    try:
        return tuple(kind() for kind in named(names, known)), None
    except InputError as error:
        raise InputError(error.problem, path, line_of(raw, "effects"), cure=error.cure) from None


# What is wanted -------------------------------------------------------------------------------------------------------


def _objective(table: dict[str, Any], path: Path, raw: bytes) -> tuple[str, bool, dict[str, float]]:
    for key in table:
        if key not in ("maximise", "minimise", "at"):
            raise unknown_name("key in [objective]:", key, ("maximise", "minimise", "at"), path, row=line_of(raw, key))
    goals = [key for key in ("maximise", "minimise") if key in table]
    if len(goals) != 1:
        raise InputError("[objective] has not one goal", path, cure='write maximise = "force" or minimise = "..."')
    quantity = _quantity(table[goals[0]], path, line_of(raw, goals[0]))
    return quantity, goals[0] == "maximise", _at(table.get("at", {}), quantity, path, line_of(raw, goals[0]))


def _quantity(name: Any, path: Path, row: int | None) -> str:
    if name in LATER:
        cure = f"there are: {', '.join(QUANTITIES)}"
        raise InputError(f"{name} cannot be designed for yet", path, row, cure=cure)
    if name not in QUANTITIES:
        raise unknown_name("quantity", str(name), QUANTITIES, path, row=row)
    return str(name)


def _at(given: Any, quantity: str, path: Path, row: int | None) -> dict[str, float]:
    """The conditions at which a quantity is taken, SI."""
    merit = QUANTITIES[quantity]
    allowed = {*merit.may_have, *(name for group in merit.at for name in group)}
    if not isinstance(given, dict):
        raise InputError(f"at of {quantity} is not a table", path, row, cure='write at = { pressure = "5 bar" }')
    for key in given:
        if key not in allowed:
            what = f"is taken at {' and '.join(sorted(allowed))}" if allowed else "needs no at"
            raise InputError(f"{quantity} {what}, not at {key}", path, row, cure=f"leave {key} out")
    for group in merit.at:
        if not set(group) & set(given):
            example = {"contraction": "contraction = 0.1", "pressure": 'pressure = "5 bar"'}[group[0]]
            problem = f"{quantity} needs to know at which {' or '.join(group)}"
            raise InputError(problem, path, row, cure=f"write at = {{ {example} }}")
    at = {key: _si(value, CONDITIONS[key], f"{key} of {quantity}", path, row) for key, value in given.items()}
    if not at.get("contraction", 0.0) < 1:
        raise InputError(f"contraction of {quantity} is not below 1", path, row, value=given["contraction"],
                         cure='write 0.1 or "10 %"')  # fmt: skip
    return at


def _constraints(table: dict[str, Any], path: Path, raw: bytes) -> tuple[Limit, ...]:
    entries = table.get("constraint", [])
    if not isinstance(entries, list):
        raise InputError("constraint is not a list", path, line_of(raw, "[constraint]"), cure="write [[constraint]]")
    rows = [i for i, line in enumerate(raw.decode("utf-8-sig").splitlines(), 1) if line.strip() == "[[constraint]]"]
    rows += [None] * (len(entries) - len(rows))  # type: ignore[list-item]
    return tuple(_constraint(entry, path, row) for entry, row in zip(entries, rows, strict=False))


def _constraint(entry: dict[str, Any], path: Path, row: int | None) -> Limit:
    keys = ("quantity", "at", "min", "max")
    for key in entry:
        if key not in keys:
            raise unknown_name("key in [[constraint]]:", key, keys, path, row=row)
    quantity = _quantity(entry.get("quantity"), path, row)
    unit = QUANTITIES[quantity].unit
    ends = {key: _si(entry[key], unit, f"{key} of {quantity}", path, row) for key in ("min", "max") if key in entry}
    if not ends:
        cure = f'add min = "{units.example(unit)}" or max = "..."'
        raise InputError(f"the constraint on {quantity} has no limit", path, row, cure=cure)
    if "min" in ends and "max" in ends and ends["min"] >= ends["max"]:
        raise InputError(f"min of {quantity} is not below its max", path, row, value=entry["min"], cure="swap them")
    return Limit(quantity, _at(entry.get("at", {}), quantity, path, row), ends.get("min"), ends.get("max"))


def _si(text: Any, unit: str, what: str, path: Path, row: int | None) -> float:
    try:
        return units.to_si(text, unit, what)
    except InputError as error:
        raise InputError(error.problem, path, row, value=error.value, cure=error.cure) from None


def _check_needs(task: Task, path: Path, raw: bytes) -> None:
    """Refuse a task whose quantities or effects need what the muscle does not have."""
    given = built(task.muscle, task.effects)
    for effect in given.effects:
        if lacking := given.missing_needs(effect):
            raise InputError(f"{name_of(effect)} needs {', '.join(lacking)}", path, line_of(raw, "effects"),
                             cure=f"add {lacking[0]} to [muscle], or leave the effect out")  # fmt: skip
    for quantity in (task.objective, *(limit.quantity for limit in task.constraints)):
        if lacking := missing(given, quantity):
            unit = muscle_quantities()[lacking[0]][0]
            cure = f'add {lacking[0]} = "{units.example(unit)}" to [muscle]'
            raise InputError(f"{quantity} needs {', '.join(lacking)}", path, cure=cure)


# In words -------------------------------------------------------------------------------------------------------------


def describe(found: Design) -> str:
    """For people: the design, what it is worth, which limits hold it and what they cost."""
    lines = [_verdict(found), f"{_named(found.objective, found.at)}: {units.show(found.value, found.unit)}"]
    lines += [f"  {m.quantity:22} {units.show(m.value, m.unit):>14}   {_limits(m)}{_price(m, found)}"
              for m in (*found.variables, *found.constraints)]  # fmt: skip
    return "\n".join([*lines, found.starts])


def _verdict(found: Design) -> str:
    if found.outcome == "infeasible":
        fighting = ", ".join(found.fighting)
        return f"no design meets {fighting} together; the nearest one misses a limit by {100 * found.miss:.2g} % of it"
    if found.outcome == "optimal":
        return "optimal: no small change within the constraints is better"
    return f"not converged: {100 * found.stationarity:.2g} % of the objective's slope is left, within the constraints"


def _named(quantity: str, at: dict[str, float]) -> str:
    told = ", ".join(f"{name} {units.show(value, CONDITIONS[name])}" for name, value in at.items())
    return f"{quantity} at {told}" if told else quantity


def _limits(m: Met) -> str:
    ends = [f"{word} {units.show(end, m.unit)}" for word, end in (("min", m.min), ("max", m.max)) if end is not None]
    return ", ".join(ends)


def _price(m: Met, found: Design) -> str:
    if not m.active:
        return ""
    if (m.min is not None and m.value < m.min * (1 - 1e-5)) or (m.max is not None and m.value > m.max * (1 + 1e-5)):
        return "   missed"
    worth = f"; 1 % of it is worth {m.relative:.2g} % of the {found.objective}" if m.multiplier else ""
    return f"   at its limit{worth}"
