"""What a design file asks for besides the best design: tolerances, a chance, a trade-off; and draws of a posterior."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from fitting import showing
from fitting.designs.file import File, Known, check_needs, conditions, open_file, quantity_named, task_of, whole_number
from fitting.designs.stated_units import stated_units
from fitting.errors import InputError, unknown_name
from fitting.model_files.model_file import ModelFile, read_model
from mckibben_jax.design.best import Task, wanted_of
from mckibben_jax.design.merit import RUBBER
from mckibben_jax.design.pareto import Second
from mckibben_jax.effect import Effect, name_of
from mckibben_jax.muscle import Muscle
from mckibben_jax.muscle import quantities as muscle_quantities
from mckibben_jax.parameter import parameters


@dataclass(frozen=True)
class DesignOrder:
    """A task; tolerances by dimension (SI); the chance with which limits are to hold; the other end of a trade-off.

    `models` are the effects of every model that the design is for, by the name of its file; empty where it is for one.
    `notes` say what a reader should know of the models. `units` are those that the design file uses.
    """

    task: Task
    tolerances: dict[str, float]
    chance: float | None
    second: Second | None
    models: dict[str, tuple[Effect, ...]] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    units: tuple[Mapping[str, str], ...] = ()


def read_order(path: Path | str, known: Known | None = None, also: Sequence[str] = ()) -> DesignOrder:
    """Read all that a design file asks for; `also` names model files for which the design has to do as well."""
    file = open_file(path, known)
    order = DesignOrder(task_of(file), _tolerances(file), _chance(file), _second(file), units=stated_units(file.table))
    models = _models(file, order, also) if also else {}
    told = models or {_own_name(file): order.task.effects}
    notes = [note for name, effects in told.items() for note in _replaced(name, effects, order.task.muscle)]
    return replace(order, models=models, notes=(*notes, *(_of_other_data(file, also) if also else ())))


def _own_name(file: File) -> str:
    """What the model of the design file is called."""
    return str(file.table.get("model", {}).get("file") or f"the model of {file.path.name}")


def _own_model(file: File) -> ModelFile | None:
    """The model file that the design file names, if it names one."""
    named = file.table.get("model", {}).get("file")
    return read_model(file.path.parent / str(named), file.known) if named else None


def _models(file: File, order: DesignOrder, also: Sequence[str]) -> dict[str, tuple[Effect, ...]]:
    """The model of the design file, then the others; each has to find what it needs in the muscle."""
    if order.tolerances or order.chance is not None or order.second is not None:
        cure = "leave [tolerance], [uncertainty] and [pareto] out of it"
        raise InputError("a design for several models is made without tolerances and trade-offs", file.path, cure=cure)
    own = _own_model(file)
    models, places = {_own_name(file): order.task.effects}, [own.path.resolve()] if own else []
    for name in also:
        stored = read_model(name, file.known)
        if stored.path.resolve() in places:
            raise InputError("a model is named twice", name, cure="name each model once")
        check_needs(file, order.task.muscle, stored.effects, [quantity for quantity, _ in wanted_of(order.task)])
        places.append(stored.path.resolve())
        models[name] = stored.effects
    return models


def _replaced(name: str, effects: Sequence[Effect], muscle: Muscle) -> list[str]:
    """What the rubber that [muscle] states replaces in a model that knows its own."""
    notes = []
    for effect in effects:
        for p in parameters(effect):
            stated, own = getattr(muscle, RUBBER.get(p.name, ""), None), float(getattr(effect, p.name))
            if "rubber" in effect.gives and stated is not None and own not in (float(stated), p.default):
                size = f"{RUBBER[p.name]} = {showing.show(float(stated), p.unit)} of the muscle"
                notes.append(f"{name}: {size} replaces {name_of(effect)}.{p.name} = {showing.show(own, p.unit)}")
    return notes


def _of_other_data(file: File, also: Sequence[str]) -> list[str]:
    """Which models were fitted to other data than that of the design file."""
    own = _own_model(file)
    if own is None or not (first := set(own.data.values())):
        return []
    stored = [(name, set(read_model(name, file.known).data.values())) for name in also]
    return [
        f"{name} was fitted to other data than {_own_name(file)}" for name, data in stored if data and data != first
    ]


def _tolerances(file: File) -> dict[str, float]:
    known, found = muscle_quantities(), {}
    for name, text in file.optional("tolerance").items():
        if name not in known:
            raise unknown_name("dimension in [tolerance]:", name, known, file.path, row=file.line(name))
        found[name] = file.si(str(text).removeprefix("+/-").strip(), known[name][0], f"tolerance of {name}", None)
        if found[name] <= 0:
            cure = 'write the half width of what comes out, as in radius = "0.1 mm"'
            raise InputError(f"the tolerance of {name} is not positive", file.path, value=text, cure=cure)
    return found


def _chance(file: File) -> float | None:
    table = file.optional("uncertainty")
    file.only(table, ("chance",), "key in [uncertainty]:")
    if "chance" not in table:
        return None
    chance = file.si(table["chance"], "1", "chance", file.line("chance"))
    if not 0.5 <= chance < 1:
        cure = 'write chance = "95 %"'
        raise InputError("chance is not between 50 % and 100 %", file.path, value=table["chance"], cure=cure)
    return chance


def _second(file: File) -> Second | None:
    table = file.optional("pareto")
    if not table:
        return None
    file.only(table, ("second", "at", "points", "goal"), "key in [pareto]:")
    line, goal = file.line("second"), table.get("goal", "maximise")
    quantity = quantity_named(file, table.get("second"), line)
    if goal not in ("maximise", "minimise"):
        cure = 'write goal = "maximise" or "minimise"'
        raise InputError("goal of [pareto] is neither", file.path, file.line("goal"), value=goal, cure=cure)
    points = whole_number(file, "points", 12, table, least=2)
    return Second(quantity, conditions(file, table.get("at", {}), quantity, line), goal == "maximise", points)


# Posterior -----------------------------------------------------------------------------------------------------------


def read_draws(path: Path | str, task: Task) -> dict[str, np.ndarray]:
    """Draws of the effects' parameters from the chains that `mckibben posterior --netcdf` writes.

    Those of a muscle's own dimensions are of the muscle that was measured, and are left out.
    """
    import h5py

    wanted = {f"{name_of(e)}.{p.name}" for e in task.effects for p in parameters(e)}
    try:
        with h5py.File(path) as file:
            group = file["posterior"]
            assert isinstance(group, h5py.Group)
            chains = {name: np.asarray(group[name]).ravel() for name in group if name in wanted}
    except (OSError, KeyError, AssertionError):
        cure = "mckibben posterior DATASET --netcdf FILE writes one"
        raise InputError("the file holds no chains of a posterior", path, cure=cure) from None
    if not chains:
        cure = f"the design's effects have {', '.join(sorted(wanted)) or 'no parameters'}"
        raise InputError("the posterior knows no parameter of the design's effects", path, cure=cure)
    return chains
