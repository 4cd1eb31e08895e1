"""design.toml: what is wanted of a muscle, in any unit, as a task for `mckibben_jax.design.best`."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path
from typing import Any

import numpy as np

from fitting import showing, units
from fitting.designs.settings import LIMITS
from fitting.errors import InputError, unknown_name
from fitting.library.library import effects_named, library
from fitting.model_files.model_file import read_model
from fitting.recordings.muscle_file import line_of, read_muscle_table, read_toml
from fitting.recordings.settings import TABLES
from mckibben_jax.design.best import DESIGN_BASELINE, Limit, Task
from mckibben_jax.design.merit import CONDITIONS, QUANTITIES, built, missing
from mckibben_jax.effect import Effect, name_of
from mckibben_jax.muscle import Muscle
from mckibben_jax.muscle import quantities as muscle_quantities

TOP_KEYS = ("name", "muscle", "model", "variables", "objective", "constraint", "starts", "seed")
OF_A_DESIGN = ("tolerance", "uncertainty", "pareto")
OF_A_SWEEP = ("grid", "sample", "outputs", "keep", "at", "histogram")  # the same file may also say what a sweep does
STRENGTHS = {"breaking_stress": "28 MPa", "strand_modulus": "3 GPa"}  # examples; 0.54 MPa is no strength
EXAMPLES = {"contraction": "contraction = 0.1", "pressure": 'pressure = "5 bar"'}
SAME_AS = {"hardness": "shear_modulus", "turns": "braid_angle", "cord_length": "braid_angle"}

Known = dict[str, type[Effect]]


@dataclass(frozen=True)
class File:
    """A TOML file as read, with what messages need; `known` are the effects that there are, by name."""

    path: Path
    table: dict[str, Any]
    raw: bytes
    known: Known

    def section(self, key: str, example: str) -> dict[str, Any]:
        """A table that must be there and not be empty."""
        found = self.table.get(key)
        if not isinstance(found, dict) or not found:
            raise InputError(f"there is no [{key}]", self.path, cure=f"add [{key}] and below it {example}")
        return found

    def optional(self, key: str) -> dict[str, Any]:
        """A table that may be missing; then it is empty."""
        found = self.table.get(key, {})
        if not isinstance(found, dict):
            raise InputError(f"{key} is not a table", self.path, self.line(key), value=found, cure=f"write [{key}]")
        return found

    def line(self, key: str, below: str = "") -> int | None:
        """The line on which a key stands, the first one below a heading if one is given."""
        start = max(self.raw.find(below.encode()), 0)
        return line_of(b"\n" * self.raw.count(b"\n", 0, start) + self.raw[start:], key)

    def only(self, table: dict[str, Any], keys: Sequence[str], what: str, row: int | None = None) -> None:
        """Refuse a key that means nothing here, and name the nearest that does."""
        for key in table:
            if key not in keys:
                raise unknown_name(what, key, keys, self.path, row=row or self.line(key))

    def si(self, text: Any, unit: str, what: str, row: int | None) -> float:
        """A value with a unit in SI; a message that names the file."""
        try:
            return units.to_si(text, unit, what)
        except InputError as error:
            raise error.located(self.path, row) from None


def open_file(path: Path | str, known: Known | None = None) -> File:
    """Read a design file without understanding it."""
    path = Path(path)
    if not path.is_file():
        raise InputError("no such file", path, cure="write one with [muscle], [variables] and [objective]")
    file = File(path, *read_toml(path), known or library())
    file.only(file.table, TOP_KEYS + OF_A_DESIGN + OF_A_SWEEP, "key")
    return file


def read_design(path: Path | str, known: Known | None = None) -> Task:
    """Read what a design file wants; `known` are the effects that there are, the program's own unless given."""
    return task_of(open_file(path, known))


def task_of(file: File) -> Task:
    """The task that a design file sets."""
    ranges = variables(file)
    muscle, effects = muscle_and_effects(file, ranges)
    quantity, largest, at = objective(file)
    starts, seed = whole_number(file, "starts", 16), whole_number(file, "seed", 0, least=0)
    task = Task(muscle, ranges, quantity, at, constraints(file), effects, largest, starts, seed)
    check_needs(file, muscle, effects, [task.objective, *(limit.quantity for limit in task.constraints)])
    return task


def muscle_and_effects(file: File, ranges: dict[str, tuple[float, float]]) -> tuple[Muscle, tuple[Effect, ...]]:
    """The muscle, its variables at the middle of their ranges, and the effects of its model."""
    effects, fitted = _model(file)
    return _muscle(file, ranges, fitted), effects


def whole_number(file: File, key: str, default: int, table: dict[str, Any] | None = None, least: int = 1) -> int:
    """A count, or its default."""
    found = (file.table if table is None else table).get(key, default)
    most = getattr(LIMITS, key, LIMITS.count)
    if isinstance(found, bool) or not isinstance(found, int) or not least <= found <= most:
        problem = f"{key} is not a whole number from {least} to {most:.6g}"
        cure = f"write {key} = {max(default, least)}"
        raise InputError(problem, file.path, file.line(key), value=found, cure=cure)
    return found


# Muscle and model -----------------------------------------------------------------------------------------------------


def variables(file: File) -> dict[str, tuple[float, float]]:
    """The range of each variable, SI."""
    known, path = muscle_quantities(), file.path
    ranges = {}
    for name, ends in file.section("variables", 'braid_angle = ["12 deg", "40 deg"]').items():
        row = file.line(name, below="[variables]")
        if name not in known:
            raise unknown_name("variable", name, known, path)
        if not isinstance(ends, list) or len(ends) != 2:
            cure = f'write {name} = ["{units.example(known[name][0])}", "..."]'
            raise InputError(f"the range of {name} is not a pair of values", path, row, value=ends, cure=cure)
        low, high = (file.si(end, known[name][0], f"{name} in [variables]", row) for end in ends)
        if not 0 <= low < high:
            raise InputError(f"the range of {name} does not rise from a positive value", path, row, value=ends,
                             cure="the smaller value comes first")  # fmt: skip
        check_angle(file, name, high, row, ends[1])
        ranges[name] = (low, high)
    return ranges


def check_angle(file: File, name: str, high: float, row: int | None, typed: Any) -> None:
    """Refuse a braid angle at which strands are rings."""
    if name == "braid_angle" and high >= np.pi / 2:
        raise InputError("braid_angle must stay below 90 deg", file.path, row, value=typed, cure="54.7 deg is enough")


def _muscle(file: File, ranges: dict[str, tuple[float, float]], fitted: Muscle | None) -> Muscle:
    """What is written, over what the model file knows; variables at the middle of their range."""
    given = file.table.get("muscle", {})
    if not isinstance(given, dict):
        raise InputError("[muscle] is not a table", file.path, cure='write [muscle] and below it length = "300 mm"')
    known = muscle_quantities()
    stored = {} if fitted is None else {name: getattr(fitted, name) for name in known}
    said = {*given, *ranges, *(SAME_AS[key] for key in given if key in SAME_AS)}
    table = {k: showing.write(float(v), known[k][0]) for k, v in stored.items() if v is not None and k not in said}
    middle = {k: showing.write((low + high) / 2, known[k][0]) for k, (low, high) in ranges.items()}
    return read_muscle_table(table | given | middle, file.path, file.raw)[0]


def _model(file: File) -> tuple[tuple[Effect, ...], Muscle | None]:
    """The effects, and the muscle of the model file if there is one."""
    given, path = file.table.get("model", {}), file.path
    if not isinstance(given, dict):
        raise InputError("[model] is not a table", path, cure='write [model] and below it effects = ["..."]')
    file.only(given, ("effects", "file"), "key in [model]:")
    if "file" in given and "effects" in given:
        raise InputError("[model] names effects and a file", path, cure="leave one of them out")
    if "file" in given:
        stored = read_model(path.parent / str(given["file"]), file.known)
        return stored.effects, stored.muscle
    names = given.get("effects", [name_of(kind) for kind in DESIGN_BASELINE])
    if not isinstance(names, list) or not names or not all(isinstance(name, str) for name in names):
        cure = 'effects = ["ideal_cylinder"]'
        raise InputError("effects is not a list of names", path, file.line("effects"), value=names, cure=cure)
    try:
        return tuple(kind() for kind in effects_named(names, file.known)), None
    except InputError as error:
        raise error.located(path, file.line("effects")) from None


# What is wanted -------------------------------------------------------------------------------------------------------


def objective(file: File) -> tuple[str, bool, dict[str, float]]:
    """The quantity, whether the most of it is wanted, and its conditions."""
    table = file.section("objective", 'maximise = "force"')
    file.only(table, ("maximise", "minimise", "at"), "key in [objective]:")
    goals = [key for key in ("maximise", "minimise") if key in table]
    if len(goals) != 1:
        raise InputError("[objective] has not one goal", file.path, cure='write maximise = "force" or minimise = "..."')
    row = file.line(goals[0])
    quantity = quantity_named(file, table[goals[0]], row)
    return quantity, goals[0] == "maximise", conditions(file, table.get("at", {}), quantity, row)


def quantity_named(file: File, name: Any, row: int | None) -> str:
    """A quantity by its name; InputError with the nearest if there is none."""
    if not isinstance(name, str):
        cure = f"write one of {', '.join(QUANTITIES)}"
        raise InputError("a quantity is not named", file.path, row, value=name, cure=cure)
    if name not in QUANTITIES:
        raise unknown_name("quantity", name, QUANTITIES, file.path, row=row)
    return name


def conditions(file: File, given: Any, quantity: str, row: int | None) -> dict[str, float]:
    """The conditions at which a quantity is taken, SI."""
    merit, path = QUANTITIES[quantity], file.path
    allowed = {*merit.may_have, *(name for group in merit.at for name in group)}
    if not isinstance(given, dict):
        raise InputError(f"at of {quantity} is not a table", path, row, cure='write at = { pressure = "5 bar" }')
    for key in given:
        if key not in allowed:
            what = f"is taken at {' and '.join(sorted(allowed))}" if allowed else "needs no at"
            raise InputError(f"{quantity} {what}, not at {key}", path, row, cure=f"leave {key} out")
    for group in merit.at:
        if not set(group) & set(given):
            example = EXAMPLES[group[0]]
            problem = f"{quantity} needs to know at which {' or '.join(group)}"
            raise InputError(problem, path, row, cure=f"write at = {{ {example} }}")
    at = {key: file.si(value, CONDITIONS[key], f"{key} of {quantity}", row) for key, value in given.items()}
    low, high = TABLES.contractions
    if not low <= at.get("contraction", 0.0) <= high:
        problem = f"contraction of {quantity} is outside {low:g} .. {high:g}, where no braided muscle goes"
        raise InputError(problem, path, row, value=given["contraction"], cure='write 0.1 or "10 %"')
    if at.get("pressure", 0.0) < -units.ATMOSPHERE:
        raise InputError(f"pressure of {quantity} is below vacuum", path, row, value=given["pressure"],
                         cure='write the pressure above the air around, for example "5 bar"')  # fmt: skip
    return at


def constraints(file: File) -> tuple[Limit, ...]:
    """The limits, SI."""
    entries = file.table.get("constraint", [])
    if not isinstance(entries, list):
        row = file.line("[constraint]")
        raise InputError("constraint is not a list", file.path, row, cure="write [[constraint]]")
    text = file.raw.decode("utf-8-sig").splitlines()
    rows = [number for number, line in enumerate(text, 1) if line.strip() == "[[constraint]]"]
    return tuple(_constraint(file, entry, row) for entry, row in zip_longest(entries, rows[: len(entries)]))


def _constraint(file: File, entry: Any, row: int | None) -> Limit:
    path = file.path
    if not isinstance(entry, dict):
        raise InputError("a constraint is not a table", path, row, value=entry, cure="write [[constraint]]")
    file.only(entry, ("quantity", "at", "min", "max"), "key in [[constraint]]:", row)
    quantity = quantity_named(file, entry.get("quantity"), row)
    unit = QUANTITIES[quantity].unit
    ends = {key: file.si(entry[key], unit, f"{key} of {quantity}", row) for key in ("min", "max") if key in entry}
    if not ends:
        cure = f'add min = "{units.example(unit)}" or max = "..."'
        raise InputError(f"the constraint on {quantity} has no limit", path, row, cure=cure)
    if "min" in ends and "max" in ends and ends["min"] >= ends["max"]:
        raise InputError(f"min of {quantity} is not below its max", path, row, value=entry["min"], cure="swap them")
    return Limit(quantity, conditions(file, entry.get("at", {}), quantity, row), ends.get("min"), ends.get("max"))


def check_needs(file: File, muscle: Muscle, effects: tuple[Effect, ...], quantities: Iterable[str]) -> None:
    """Refuse quantities and effects that need what the muscle does not have."""
    given = built(muscle, effects)
    for effect in given.effects:
        if lacking := given.missing_needs(effect):
            raise InputError(f"{name_of(effect)} needs {', '.join(lacking)}", file.path, file.line("effects"),
                             cure=f"add {lacking[0]} to [muscle], or leave the effect out")  # fmt: skip
    for quantity in quantities:
        if lacking := missing(given, quantity):
            unit = muscle_quantities()[lacking[0]][0]
            like = STRENGTHS.get(lacking[0], units.example(unit))
            cure = f'add your {lacking[0]} to [muscle], as in {lacking[0]} = "{like}"'
            raise InputError(f"{quantity} needs {', '.join(lacking)}", file.path, cure=cure)
