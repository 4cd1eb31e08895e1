"""The answer to a design file: one design or a trade-off, with its words, its picture, and files to go on with."""

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit

from fitting import units
from fitting.designs.order import DesignOrder
from fitting.errors import InputError
from fitting.model_files.model_file import sealed
from fitting.report.design_text import describe, front_in_words, odds_in_words
from fitting.version import program_version
from fitting.writing import write_text, write_whole
from mckibben_jax.design.design import Design, Task, design, to_json
from mckibben_jax.design.merit import built
from mckibben_jax.design.pareto import front
from mckibben_jax.design.scatter import design_cautiously, odds, one_sided, scatter_of
from mckibben_jax.effect import name_of
from mckibben_jax.muscle import quantities as muscle_quantities
from mckibben_jax.parameter import parameters

PICTURES = (".svg", ".pdf", ".png")


@dataclass(frozen=True)
class Answer:
    """What was found. `result` is for machines."""

    order: DesignOrder
    designs: tuple[Design, ...]
    words: str
    result: dict[str, Any]

    @property
    def first(self) -> Design:
        """The design, or the first of a trade-off: the one best by the objective."""
        return next(iter(self.designs))

    @property
    def converged(self) -> bool:
        """Whether every design is an optimum, or there is none."""
        return all(one.outcome != "not converged" for one in self.designs)

    def draw(self, path: str) -> None:
        """Write the picture."""
        from fitting.report.design_figures import stroke_of, to_scale, trade_off

        kind = check_kind(path)
        if len(self.designs) > 1 and self.order.second:
            figure = trade_off(self.designs, self.order.second)
        else:
            pressure, stroke = stroke_of(self.order.task, self.first)
            figure = to_scale(self.first.muscle, max(stroke, 0.0), pressure)
        write_whole(path, lambda new: figure.savefig(new, dpi=150, format=kind.removeprefix(".")))

    def save(self, path: Path) -> None:
        """Write the design as a model file, or those of a trade-off into a folder."""
        if len(self.designs) == 1:
            write_text(str(path), model_text(self.order.task, self.first))
            return
        try:
            path.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            cure = "name a folder that may be made"
            raise InputError(f"no folder can be made: {error.strerror}", path, cure=cure) from None
        for number, one in enumerate(self.designs, 1):
            write_text(str(path / f"design-{number:02d}.toml"), model_text(self.order.task, one))


def check_kind(path: str) -> str:
    """The kind of a picture, by the end of its name; InputError where it cannot be drawn."""
    kind = Path(path).suffix.lower()
    if kind not in PICTURES:
        raise InputError("the picture's kind is not known", path, cure=f"end its name with {', '.join(PICTURES)}")
    return kind


def answer(order: DesignOrder, draws: dict[str, np.ndarray], seed: int = 0) -> Answer:
    """Do what a design file asks for. `draws` are those of a posterior, by parameter."""
    task = order.task
    if order.second is not None:
        designs: tuple[Design, ...] = tuple(front(task, order.second))
        first = next(iter(designs))
        shown = front_in_words(designs, order.second) if len(designs) > 1 else describe(first)
        if len(designs) == 1 and first.outcome != "infeasible":
            shown = f"no trade-off: one design is best in {task.objective} and in {order.second.quantity}\n{shown}"
        return Answer(order, designs, shown, to_json(first) | {"front": [to_json(one) for one in designs]})
    if not order.tolerances and not draws:
        found = design(task)
        return Answer(order, (found,), describe(found), to_json(found))
    scatter = scatter_of(order.tolerances, draws, seed=seed)
    found = design(task) if order.chance is None else design_cautiously(task, scatter, order.chance)
    task = task if order.chance is None else one_sided(task)
    fate = odds(task, found.muscle, scatter)
    told = {"uncertainty": dataclasses.asdict(fate) | {"chance": order.chance, "unit": found.unit}}
    words = [describe(found), odds_in_words(found, fate, order.chance is not None)]
    if order.chance is not None:
        share = f"{100 * order.chance:g} % of the muscles made"
        words.insert(0, f"values of limits are those that {share} keep, if normally spread; the objective is the mean")
    return Answer(order, (found,), "\n".join(words), to_json(found) | told)


def model_text(task: Task, found: Design) -> str:
    """A design as a model file, which `simulate`, `export` and the [model] of another design read."""
    document = tomlkit.document()
    document["format"] = 1
    document["program"] = program_version()
    document["name"] = f"design for {found.objective}"
    known = {name: (getattr(found.muscle, name), unit) for name, (unit, _) in muscle_quantities().items()}
    document["muscle"] = {name: _entry(value, unit) for name, (value, unit) in known.items() if value is not None}
    effects = tomlkit.aot()
    for effect in built(found.muscle, task.effects).effects:
        table = tomlkit.table()
        table["name"] = name_of(effect)
        for p in parameters(effect):
            table[p.name] = _entry(getattr(effect, p.name), p.unit)
        effects.append(table)
    document["effect"] = effects
    return sealed(tomlkit.dumps(document))


def _entry(value: Any, unit: str) -> Any:
    entry = tomlkit.inline_table()
    entry.update({"value": units.write(float(value), unit), "state": "fixed"})
    return entry
