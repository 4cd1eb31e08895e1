"""The answer to a design file: one design or a trade-off, how sure it is, and files to go on with."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fitting.designs.order import DesignOrder
from fitting.errors import InputError
from fitting.model_files.writer import file_text
from fitting.problem.estimate import Estimate, ParameterState
from fitting.writing import write_text
from mckibben_jax.design.best import Design, Task, design
from mckibben_jax.design.merit import built
from mckibben_jax.design.pareto import front
from mckibben_jax.design.scatter import Odds, design_cautiously, odds, one_sided, scatter_of
from mckibben_jax.design.several import OneSays, design_for_all
from mckibben_jax.muscle import quantities as muscle_quantities
from mckibben_jax.parameter import parameters


@dataclass(frozen=True)
class Answer:
    """What was found; `odds` where tolerances or draws were given, `said` what each of several models says of it."""

    order: DesignOrder
    designs: tuple[Design, ...]
    odds: Odds | None = None
    said: tuple[OneSays, ...] = ()

    @property
    def first(self) -> Design:
        """The design, or the first of a trade-off: the one best by the objective."""
        return next(iter(self.designs))

    @property
    def converged(self) -> bool:
        """Whether every design is an optimum, or there is none."""
        return all(one.outcome != "not converged" for one in self.designs)

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


def answer(order: DesignOrder, draws: dict[str, np.ndarray], seed: int = 0) -> Answer:
    """Do what a design file asks for. `draws` are those of a posterior, by parameter."""
    task = order.task
    if order.second is not None:
        return Answer(order, tuple(front(task, order.second)))
    if order.models:
        found, said = design_for_all(task, list(order.models.values()))
        return Answer(order, (found,), said=said)
    if not order.tolerances and not draws:
        return Answer(order, (design(task),))
    scatter = scatter_of(order.tolerances, draws, seed=seed)
    found = design(task) if order.chance is None else design_cautiously(task, scatter, order.chance)
    task = task if order.chance is None else one_sided(task)
    return Answer(order, (found,), odds(task, found.muscle, scatter))


def model_text(task: Task, found: Design) -> str:
    """A design as a model file, which `simulate`, `export` and the [model] of another design read."""
    fixed = lambda value, unit: (Estimate(float(value), float("nan"), unit), ParameterState.FIXED)  # noqa: E731
    sizes = {name: (getattr(found.muscle, name), unit) for name, (unit, _) in muscle_quantities().items()}
    effects = [
        (effect, {p.name: fixed(getattr(effect, p.name), p.unit) for p in parameters(effect)})
        for effect in built(found.muscle, task.effects).effects
    ]
    muscle = {name: fixed(value, unit) for name, (value, unit) in sizes.items() if value is not None}
    return file_text(f"design for {found.objective}", muscle, effects)
