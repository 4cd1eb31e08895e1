"""The part of a design file that says what a sweep does: [grid] or [sample], outputs, keep, at, histogram."""

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from fitting import units
from fitting.designs.file import (
    EXAMPLES,
    File,
    Known,
    check_angle,
    check_needs,
    conditions,
    constraints,
    muscle_and_effects,
    objective,
    open_file,
    quantity_named,
    variables,
    whole_number,
)  # fmt: skip
from fitting.designs.settings import LIMITS, SWEEP
from fitting.errors import InputError, unknown_name
from mckibben_jax.design.batch import Batch, Histogram, Space
from mckibben_jax.design.best import Limit
from mckibben_jax.design.merit import CONDITIONS, QUANTITIES, At
from mckibben_jax.muscle import quantities as muscle_quantities

WORDS = ("outputs", "keep", "at", "histogram")  # stand at the top of the file, or under [grid] or [sample]
AXIS = 'braid_angle = { from = "15 deg", to = "40 deg", n = 100 }'
Wanted = tuple[str, At]


@dataclass(frozen=True)
class Order:
    """A sweep as ordered: the designs and quantities, and whether every design is written or only the best are kept."""

    batch: Batch
    everything: bool


def read_sweep(path: Path | str, known: Known | None = None) -> Order:
    """Read a design file as a sweep."""
    file = open_file(path, known)
    said = _said(file)
    space = _space(file)
    muscle, effects = muscle_and_effects(file, space.ranges)
    goal = None if "objective" not in file.table else objective(file)
    limits = constraints(file)
    known_at = _Conditions(file, said.get("at", {}), goal, limits)
    outputs, columns = _outputs(file, said, known_at, goal, limits)
    everything, best, by, largest = _keep(file, said, goal, outputs)
    if by not in [name for name, _ in outputs]:
        outputs, columns = [*outputs, (by, known_at.of(by))], [*columns, column(by)]
    check_needs(file, muscle, effects, [name for name, _ in outputs] + [limit.quantity for limit in limits])
    place = [name for name, _ in outputs].index(by)
    batch = Batch(muscle, effects, space, tuple(outputs), limits, place, largest, best, columns=tuple(columns))
    return _with_histogram(file, said, Order(batch, everything))


def _said(file: File) -> dict[str, Any]:
    """What stands at the top of the file, or (as it does when written below them) in [grid] or [sample]."""
    inside = {**file.optional("grid"), **file.optional("sample")}
    return {word: file.table.get(word, inside.get(word)) for word in WORDS if word in file.table or word in inside}


# Which designs -------------------------------------------------------------------------------------------------------


def _space(file: File) -> Space:
    grid, sample = file.optional("grid"), file.optional("sample")
    if bool(grid) == bool(sample):
        problem = "there are both [grid] and [sample]" if grid else "there is neither [grid] nor [sample]"
        cure = f"write [sample] with n = 100000, or [grid] with {AXIS}"
        raise InputError(problem, file.path, cure=cure)
    return _grid(file, grid) if grid else _sample(file, sample)


def _sample(file: File, table: dict[str, Any]) -> Space:
    file.only(table, ("n", "seed", *WORDS), "key in [sample]:")
    if "n" not in table:
        raise InputError("[sample] does not say how many", file.path, cure="write n = 100000 below [sample]")
    return Space(variables(file), whole_number(file, "n", 1, table), (), whole_number(file, "seed", 0, table, least=0))


def _grid(file: File, table: dict[str, Any]) -> Space:
    known, ranges, counts = muscle_quantities(), {}, []
    for name, axis in table.items():
        if name in WORDS:
            continue
        if name not in known:
            raise unknown_name("variable in [grid]:", name, known, file.path, row=file.line(name))
        ranges[name], count = _axis(file, name, axis, known[name][0])
        counts.append(count)
    if not counts:
        raise InputError("[grid] has no variable", file.path, cure=AXIS)
    if math.prod(counts) > LIMITS.count:
        problem = f"[grid] has {math.prod(counts):.3g} designs, more than {LIMITS.count:.0e}"
        raise InputError(problem, file.path, file.line("[grid]"), cure="take fewer, or write [sample] with n = 1000000")
    return Space(ranges, math.prod(counts), tuple(counts))


def _axis(file: File, name: str, axis: Any, unit: str) -> tuple[tuple[float, float], int]:
    cure = f'write {name} = {{ from = "{units.example(unit)}", to = "...", n = 100 }}'
    if not isinstance(axis, dict) or set(axis) != {"from", "to", "n"}:
        raise InputError(f"{name} in [grid] is not from, to and n", file.path, file.line(name), value=axis, cure=cure)
    low, high = (file.si(axis[end], unit, f"{end} of {name}", file.line(name)) for end in ("from", "to"))
    count = whole_number(file, "n", 100, axis)
    if low < 0 or high < low or (count > 1 and high == low):
        raise InputError(f"{name} in [grid] does not rise", file.path, file.line(name), value=axis, cure=cure)
    check_angle(file, name, high, file.line(name), axis["to"])
    return (low, high), count


# What of them --------------------------------------------------------------------------------------------------------


class _Conditions:
    """At which conditions a quantity is taken whose entry does not say so.

    Those of the objective or of a limit on it, else those given for all, else the first that any of them names.
    """

    def __init__(self, file: File, given: Any, goal: Any, limits: tuple[Limit, ...]):
        self.file = file
        self.own: dict[str, At] = {limit.quantity: limit.at for limit in reversed(limits)}
        if goal is not None:
            self.own[goal[0]] = goal[2]
        self.general: At = {}
        for at in reversed([goal[2] if goal else {}, *(limit.at for limit in limits)]):
            self.general |= at
        self.general |= self._read(given)

    def _read(self, given: Any) -> At:
        line = self.file.line("at")
        if not isinstance(given, dict):
            cure = 'at = { contraction = 0.1, pressure = "5 bar" }'
            raise InputError("at is not a table", self.file.path, line, cure=cure)
        self.file.only(given, tuple(CONDITIONS), "condition", line)
        return {key: self.file.si(value, CONDITIONS[key], key, line) for key, value in given.items()}

    def of(self, quantity: str) -> At:
        """The conditions of a quantity."""
        if quantity in self.own:
            return self.own[quantity]
        at: At = {}
        for group in QUANTITIES[quantity].at:
            named = [key for key in reversed(group) if key in self.general]  # of the full stroke rather than of a place
            if not named:
                cure = f"write at = {{ {EXAMPLES[group[0]]} }} at the top of the file"
                problem = f"{quantity} needs to know at which {' or '.join(group)}"
                raise InputError(problem, self.file.path, self.file.line("outputs"), cure=cure)
            at[named[0]] = self.general[named[0]]
        if "conductance" in QUANTITIES[quantity].may_have and "conductance" in self.general:
            at["conductance"] = self.general["conductance"]
        return at


def _outputs(
    file: File, said: dict[str, Any], known: _Conditions, goal: Any, limits: tuple[Limit, ...]
) -> tuple[list[Wanted], list[str]]:
    listed = said.get("outputs")
    line = file.line("outputs")
    if listed is None:
        every = dict.fromkeys([*([goal[0]] if goal else []), *(limit.quantity for limit in limits)])
        listed = list(every)
    if not isinstance(listed, list) or not listed:
        raise InputError("there are no outputs", file.path, line, cure='write outputs = ["force", "stroke", "work"]')
    found, columns = [], []
    for entry in listed:
        one, name = _output(file, entry, known, line)
        if name in columns:
            name += "_at_" + "_".join(f"{value:g}{CONDITIONS[key].replace('1', '')}" for key, value in one[1].items())
        if name in columns:
            raise InputError(f"the output {name} stands there twice", file.path, line, cure="leave one of them out")
        found.append(one)
        columns.append(name)
    return found, columns


def _output(file: File, entry: Any, known: _Conditions, line: int | None) -> tuple[Wanted, str]:
    if isinstance(entry, dict):
        file.only(entry, ("quantity", "at", "name"), "key of an output:", line)
        quantity = quantity_named(file, entry.get("quantity"), line)
        at = conditions(file, entry["at"], quantity, line) if "at" in entry else known.of(quantity)
        return (quantity, at), str(entry.get("name", column(quantity)))
    quantity = quantity_named(file, entry, line)
    return (quantity, known.of(quantity)), column(quantity)


def column(quantity: str) -> str:
    """Name of a quantity's column, its SI unit behind it."""
    return with_unit(quantity, QUANTITIES[quantity].unit)


def with_unit(name: str, unit: str) -> str:
    """A name with its SI unit."""
    return name if unit == "1" else f"{name}_{unit.replace('/', '_per_').replace('^', '')}"


# What is kept --------------------------------------------------------------------------------------------------------


def _keep(file: File, said: dict[str, Any], goal: Any, outputs: list[Wanted]) -> tuple[bool, int, str, bool]:
    """Whether everything is written; else how many are kept, by which quantity, and whether the largest is best."""
    quantity, largest = (goal[0], goal[1]) if goal else (outputs[0][0], True)
    keep = said.get("keep", {"best": SWEEP.best} if goal else "all")
    line = file.line("keep")
    if keep == "all":
        return True, 0, quantity if quantity in dict(outputs) else outputs[0][0], largest
    if not isinstance(keep, dict) or "best" not in keep:
        cure = 'write keep = "all" or keep = { best = 1000, by = "work" }'
        raise InputError("keep does not say what to keep", file.path, line, value=keep, cure=cure)
    file.only(keep, ("best", "by", "smallest"), "key of keep:", line)
    by = quantity_named(file, keep.get("by", quantity), line)
    if by != quantity or not goal:
        largest = True
    if "smallest" in keep:
        largest = not keep["smallest"]
    return False, whole_number(file, "best", SWEEP.best, keep), by, largest


def _with_histogram(file: File, said: dict[str, Any], order: Order) -> Order:
    """A histogram is of the ranked quantity, 100 bins over what a first look finds, unless the file says otherwise."""
    if order.everything and "histogram" not in said:
        return order
    given, line = said.get("histogram", {}), file.line("histogram")
    if not isinstance(given, dict):
        cure = 'write histogram = { of = "work", bins = 100, from = "0 J", to = "50 J" }'
        raise InputError("histogram is not a table", file.path, line, value=given, cure=cure)
    file.only(given, ("of", "bins", "from", "to"), "key of histogram:", line)
    names = [name for name, _ in order.batch.outputs]
    of = quantity_named(file, given.get("of", names[order.batch.by]), line)
    if of not in names:
        cure = f'add "{of}" to outputs'
        raise InputError(f"the histogram is of {of}, which is no output", file.path, line, cure=cure)
    bins = whole_number(file, "bins", 100, given)
    unit = QUANTITIES[of].unit
    low, high = (
        file.si(given[end], unit, f"{end} of histogram", line) if end in given else None for end in ("from", "to")
    )
    if low is None or high is None:
        told = Histogram(names.index(of), math.nan, math.nan, bins)
        return replace(order, batch=replace(order.batch, histogram=told))
    if not low < high:
        raise InputError("the histogram's range does not rise", file.path, line, value=given, cure="swap from and to")
    return replace(order, batch=replace(order.batch, histogram=Histogram(names.index(of), low, high, bins)))
