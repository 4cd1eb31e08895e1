"""From what was typed to what is to be done: data sets, effects with their values, and what may vary."""

import dataclasses
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jax.numpy as jnp

from fitting import full_names, units
from fitting.errors import InputError, unknown_name
from fitting.least_squares.evaluate import evaluate
from fitting.least_squares.fit import fit
from fitting.least_squares.record import Fit
from fitting.library.library import effects_named, library
from fitting.model_files.model_file import ModelFile, check_range, read_model
from fitting.problem.estimate import ParameterState
from fitting.problem.priors import Prior
from fitting.problem.unknowns import Unknowns, unknowns
from fitting.problem.varying import AS_DECLARED, Varying
from fitting.recordings.experiment import read_experiment, read_single
from fitting.recordings.hoses import with_hose_sizes
from fitting.recordings.records import TESTS, Experiment
from fitting.study.allowed import check_allowed
from fitting.study.baseline import BASELINE
from fitting.study.confined import confined, fixed_sizes, held_sizes
from fitting.study.request import MODEL_FILE, Request
from mckibben_jax.effect import Effect, name_of
from mckibben_jax.model import model, with_effects
from mckibben_jax.muscle import quantities

NO_MODEL = "the baseline: there is no model.toml beside the data"  # where a model comes from that nobody named


@dataclass(frozen=True)
class Task:
    """Data sets and a model with starting values; `known` are values that were fitted before, by full name."""

    experiments: tuple[Experiment, ...]
    effects: tuple[Effect, ...]
    known: dict[str, float]
    varying: Varying
    origin: str  # where the model comes from, in words
    library: dict[str, type[Effect]]
    starts: int
    seed: int
    shooting: int = 0  # stretches of a motion, in search of where to begin
    priors: dict[str, Prior] = dataclasses.field(default_factory=dict)  # as model.toml states them
    held: tuple[str, ...] = ()  # stated sizes that model.toml holds at their limit: all of them are confined
    kept: tuple[str, ...] = ()  # stated sizes that model.toml holds at a value of somebody's choice: they do not vary
    is_of_others: bool = False  # whether model.toml was fitted to other data

    @property
    def names(self) -> tuple[str, ...]:
        """The effects' names."""
        return tuple(name_of(effect) for effect in self.effects)

    @property
    def layout(self) -> Unknowns:
        """Everything that may vary."""
        return unknowns(self.experiments, self.effects, self.varying.own)

    @property
    def asked(self) -> dict[str, Any]:
        """What was asked of the parameters and of chance: arguments of every function that users call to fit."""
        return {**self.varying.keywords, "seed": self.seed}

    @property
    def knows_hose(self) -> bool:
        """Whether a model of other data says what the sizes of the hose are."""
        return self.is_of_others and any(full_names.owner_of(name) == "muscle" for name in self.known)

    @property
    def free_names(self) -> tuple[str, ...]:
        """The names of all that varies in a fit."""
        return self.varying.names(self.layout)

    def with_effects(self, effects: Sequence[Effect]) -> "Task":
        """The same with another set of effects."""
        return dataclasses.replace(self, effects=tuple(effects))


def task_of(request: Request) -> Task:
    """Read the data and the model, and check every name before anything is computed."""
    known = library(request.effect_file, request.define)
    experiments = with_hose_sizes(_distinct(read_data(request)))
    stored, effects, origin = _model(request, experiments, known)
    held = held_sizes(stored, experiments, request.free)
    kept = tuple(name for name in fixed_sizes(stored, experiments) if full_names.common(name) not in request.free)
    experiments = confined(experiments) if held else experiments
    task = Task(
        experiments=experiments,
        effects=effects,
        known=_known(stored, experiments),
        varying=Varying((*request.fix, *_fixed(stored, request), *kept), request.free, request.own),
        origin=origin,
        library={**known, **{name_of(effect): type(effect) for effect in effects}},
        starts=max(request.starts, 1),
        seed=request.seed,
        shooting=request.shooting,
        priors=stored.priors if stored else {},
        held=held,
        kept=kept,
        is_of_others=stored is not None and not stored.fitted_to(experiments),
    )
    if stored is not None and not task.is_of_others:
        check_allowed(task.layout, task.known, stored.path)
    task = _with_settings(task, request.settings)
    _check(task, request)
    return task


def cited_task(request: Request) -> Task:
    """A task that may do without data: then the model file that is named, or the effects, or the baseline."""
    if request.data:
        return task_of(request)
    known = library(request.effect_file, request.define)
    if request.model:
        effects = read_model(request.model, known).effects
    else:
        effects = tuple(kind() for kind in (effects_named(request.effects, known) or BASELINE))
    return Task((), effects, {}, AS_DECLARED, "as asked", known, 1, request.seed)


def fit_task(task: Task) -> Fit:
    """The task's model fitted to its data."""
    if not task.free_names:
        return evaluate(task.experiments, task.effects, task.known, (), task.varying.own)
    return fit(
        task.experiments, task.effects, start=task.known, starts=task.starts, shooting=task.shooting, **task.asked
    )


# --------------------------------------------------------------------------------------------------------------- data


def read_data(request: Request) -> tuple[Experiment, ...]:
    """The data sets: folders, or a single CSV with its muscle and kind of test."""
    return tuple(_read(Path(path), request) for path in request.data)


def _read(path: Path, request: Request) -> Experiment:
    if path.is_dir() or path.name == "muscle.toml":
        return read_experiment(path)
    if not path.exists():
        again = " (--set takes one value: write it again before each)" if "=" in str(path) else ""
        raise InputError("no such file or folder", path, cure=f"name a folder with muscle.toml, or a CSV file{again}")
    muscle_file = Path(request.muscle) if request.muscle else path.parent / "muscle.toml"
    if not muscle_file.exists():
        raise InputError("a single file needs its muscle", path, cure=f"add --muscle muscle.toml ({muscle_file})")
    if not request.test:
        cure = f"add --test with one of {', '.join(TESTS)}"
        raise InputError("a single file needs its kind of test", path, cure=cure)
    return read_single(path, muscle_file, request.test)


def _distinct(experiments: tuple[Experiment, ...]) -> tuple[Experiment, ...]:
    """Parameters of a data set go by its name, so that two of one name would share them."""
    names = [e.name for e in experiments]
    if len(set(names)) < len(names):
        experiments = tuple(dataclasses.replace(e, name=e.folder.resolve().name) for e in experiments)
    if len({e.name for e in experiments}) < len(experiments):
        raise InputError("a data set is given twice", value=experiments[0].name, cure="name each once")
    return experiments


# -------------------------------------------------------------------------------------------------------------- model


def _model(
    request: Request, experiments: Sequence[Experiment], known: dict[str, type[Effect]]
) -> tuple[ModelFile | None, tuple[Effect, ...], str]:
    """The model file if one counts, the effects, and where they come from in words."""
    if request.model and (request.effects or request.baseline):
        raise InputError("--model beside --effects or --baseline", cure="name the model in one way only")
    chosen = [kind() for kind in effects_named(request.effects, known)]
    if request.baseline:
        return None, with_effects([kind() for kind in BASELINE], chosen), "the baseline, as asked"
    if chosen:
        return None, tuple(chosen), "as asked"
    beside = experiments[0].folder / MODEL_FILE
    if request.model or beside.is_file():
        stored = read_model(request.model or beside, known)
        unused = [e.name for e in experiments[1:] if not request.model and (e.folder / MODEL_FILE).is_file()]
        beside_it = f"; the model files of {', '.join(unused)} are not used" if unused else ""
        sized = any(name.startswith("muscle.") for name in stored.values)
        not_used = _sizes_not_used(stored, experiments) if sized and not stored.fitted_to(experiments) else ""
        return stored, stored.effects, f"from {stored.path}{beside_it}{not_used}"
    return None, tuple(kind() for kind in BASELINE), NO_MODEL


def _known(stored: ModelFile | None, experiments: Sequence[Experiment]) -> dict[str, float]:
    """Fitted values; a muscle has those of its own data, and those of the hose that it is cut from."""
    if stored is None:
        return {}
    same = stored.fitted_to(experiments)
    values = {name: value for name, value in stored.values.items() if same or not name.startswith("muscle.")}
    if len(experiments) > 1:  # the first data set's are written without its name
        first = experiments[0].name
        values |= {full_names.of_set(name, first): value for name, value in values.items() if "@" not in name}
    return _known_of_hoses(stored, experiments) | values  # what is known of a muscle itself counts first


def _sizes_not_used(stored: ModelFile, experiments: Sequence[Experiment]) -> str:
    """What a model of other data says of the muscle, and whether it counts."""
    hoses = [each.hose for each in experiments if stored.sizes_of_hose(each.hose)]
    if not hoses:
        return "; its sizes of the muscle are not used, those of muscle.toml are"
    told = ", ".join(dict.fromkeys(hoses))
    return f"; its sizes of the hose {told} are used, other sizes are those of muscle.toml"


def _known_of_hoses(stored: ModelFile, experiments: Sequence[Experiment]) -> dict[str, float]:
    """The sizes of each hose by every name that they may have: all data sets', those of the hose, or of a data set."""
    values = dict[str, float]()
    for each in experiments:
        for name, value in (stored.sizes_of_hose(each.hose) if each.hose else {}).items():
            values |= dict.fromkeys(
                (name, *(full_names.of_set(name, owner) for owner in (each.hose, each.name))), value
            )
    return values


def _fixed(stored: ModelFile | None, request: Request) -> tuple[str, ...]:
    """What the model file holds fixed, the geometry apart: that is a matter of muscle.toml, but for `fixed_sizes`."""
    if stored is None:
        return ()
    fixed = (name for name, state in stored.states.items() if state is ParameterState.FIXED)
    return tuple(name for name in fixed if not name.startswith("muscle.") and name not in request.free)


# ------------------------------------------------------------------------------------------------- settings and names


def _with_settings(task: Task, settings: Sequence[str]) -> Task:
    for setting in settings:
        name, sign, text = setting.partition("=")
        if not sign:
            raise InputError("--set needs NAME=VALUE", value=setting, cure="for example --set muscle.radius='7.1 mm'")
        task = _with_setting(task, name.strip(), text.strip())
    return task


def _with_setting(task: Task, name: str, text: str) -> Task:
    """One value changed, and held there unless `--free` names it."""
    entries = {entry.name: entry for entry in task.layout.entries}
    chosen = [full for full in entries if name in (full, full_names.common(full))]
    if not chosen:
        raise unknown_name("parameter", name, _plain(entries))
    unit = entries[chosen[0]].unit
    value = units.to_si(text, unit, name)
    if not name.startswith("muscle."):
        check_range(name, value, entries[chosen[0]].lower, entries[chosen[0]].upper, unit)
    experiments = tuple(_resized(e, name, value) for e in task.experiments)
    known = {**task.known, **dict.fromkeys(chosen, value)}
    varying = task.varying if name in task.varying.free else task.varying.fixing(name)
    effects = tuple(_reset(effect, name, value) for effect in task.effects)
    return dataclasses.replace(task, experiments=experiments, known=known, varying=varying, effects=effects)


def _reset(effect: Effect, name: str, value: float) -> Effect:
    owner, _, key = name.partition(".")
    return dataclasses.replace(effect, **{key: jnp.asarray(value)}) if owner == name_of(effect) else effect


def _resized(experiment: Experiment, name: str, value: float) -> Experiment:
    plain, _, dataset = name.partition("@")
    owner, _, key = plain.partition(".")
    if owner != "muscle" or dataset not in ("", experiment.name):
        return experiment
    muscle = dataclasses.replace(experiment.muscle, **{key: value})
    priors = {name: prior for name, prior in experiment.priors.items() if name != plain}
    return dataclasses.replace(experiment, muscle=muscle, priors=priors)


def _plain(names: Iterable[str]) -> list[str]:
    """Full names as people type them, and every quantity of a muscle."""
    return sorted({full_names.common(name) for name in names} | {f"muscle.{name}" for name in quantities()})


def _check(task: Task, request: Request) -> None:
    names = {name for full in task.layout.names for name in (full, full_names.common(full))}
    for option, given in (("--fix", request.fix), ("--free", request.free), ("--own", request.own)):
        for name in given:
            if name not in names:
                raise unknown_name(f"parameter in {option}:", name, sorted(names))
    both = set(request.fix) & set(request.free)
    if both:
        raise InputError(f"{min(both)} is both in --fix and --free", cure="name it in one of them")
    if not any(effect.stage == "stored" for effect in task.effects):
        cure = f"add {name_of(BASELINE[0])}"
        raise InputError("no effect of the model pulls", value=", ".join(task.names), cure=cure)
    check_needs(task)


def check_needs(task: Task) -> None:
    """Refuse a model with an effect that lacks what it needs, naming the line to add."""
    for experiment in task.experiments:
        whole = model(experiment.muscle, *task.effects)
        for effect in task.effects:
            for need in whole.missing_needs(effect):
                measured = need in quantities()
                cure = _need_text(need, task.library)
                where = experiment.folder / "muscle.toml" if measured else None
                raise InputError(f"{name_of(effect)} needs {need.replace('_', ' ')}", where, cure=cure)


def _need_text(need: str, known: dict[str, type[Effect]]) -> str:
    if need in quantities():
        unit, meaning = quantities()[need]
        return f'write {need} = "{units.example(unit)}", with your value, into [muscle] ({meaning})'
    givers = [name for name, kind in known.items() if need in kind.gives and not kind.rival]
    return f"add one of {', '.join(givers)} to the model"
