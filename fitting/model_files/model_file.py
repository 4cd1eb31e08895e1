"""Read model.toml: a set of effects with their values, errors and states, and what they were fitted to."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from fitting import full_names, showing, units
from fitting.errors import InputError, unknown_name
from fitting.library.library import library, with_line
from fitting.library.line import defined_name
from fitting.problem.estimate import ParameterState
from fitting.problem.priors import Prior, stated_priors
from fitting.recordings.hoses import is_of_hose
from fitting.recordings.muscle_file import line_of, read_toml
from fitting.recordings.records import Experiment
from fitting.version import NAME, program_version
from mckibben_jax.effect import Effect, name_of
from mckibben_jax.muscle import Muscle, quantities
from mckibben_jax.parameter import parameters

FORMAT = 1
KEYS = ("format", "program", "name", "muscle", "muscle_of", "effect", "fitted_to")


@dataclass(frozen=True)
class ModelFile:
    """A model as a file tells it: effects with their values, the muscle, and the data that it was fitted to."""

    path: Path
    name: str
    muscle: Muscle | None
    effects: tuple[Effect, ...]
    values: dict[str, float]  # by full name, SI
    states: dict[str, ParameterState]
    data: dict[str, str] = field(default_factory=dict)  # data set -> sha256
    priors: dict[str, Prior] = field(default_factory=dict)  # by full name, for the posterior
    hoses: dict[str, str] = field(default_factory=dict)  # data set by name -> the hose that its muscle is cut from

    def fitted_to(self, experiments: Sequence[Experiment]) -> bool:
        """Whether these are the very data that it was fitted to."""
        return bool(self.data) and {e.sha256 for e in experiments} == set(self.data.values())

    @property
    def sets(self) -> tuple[str, ...]:
        """The data sets that it has values for, by name; the first one's muscle is `muscle`."""
        more = (name.split(full_names.OF, 1)[1] for name in self.values if full_names.OF in name)
        return tuple(dict.fromkeys((self.name, *more)))

    @property
    def own(self) -> tuple[str, ...]:
        """The parameters of effects of which each data set has a value of its own: 'coulomb_friction.f_s'."""
        found = (full_names.common(name) for name in self.values if full_names.OF in name)
        return tuple(name for name in dict.fromkeys(found) if full_names.owner_of(name) != "muscle")

    def called(self, asked: str) -> str:
        """The data set of this name, or in the folder of this name; InputError where there is none."""
        folders = dict(zip(self.data, self.sets, strict=False)) if len(self.data) == len(self.sets) else {}
        if asked not in (*self.sets, *folders):
            raise unknown_name("data set", asked, (*self.sets, *folders), self.path)
        return asked if asked in self.sets else folders[asked]

    def sizes_of(self, dataset: str) -> dict[str, float]:
        """The sizes of one data set's muscle, SI: 'radius' and others."""
        first = dataset == self.name
        names = {
            name: f"muscle.{name}" if first else full_names.of_set(f"muscle.{name}", dataset) for name in quantities()
        }
        return {name: self.values[full] for name, full in names.items() if full in self.values}

    def sizes_of_hose(self, hose: str) -> dict[str, float]:
        """The sizes that muscles of this hose share, by full name, SI; nothing where none of its data sets is of it."""
        members = [dataset for dataset, of_it in self.hoses.items() if of_it == hose]
        sizes = {f"muscle.{name}": value for name, value in self.sizes_of(members[0]).items()} if members else {}
        return {name: value for name, value in sizes.items() if is_of_hose(name)}

    def of_set(self, dataset: str) -> "ModelFile":
        """The same with the muscle and the effects of one of its data sets."""
        sizes = self.sizes_of(dataset)
        effects = tuple(self._effect_of_set(effect, dataset) for effect in self.effects)
        return replace(self, muscle=_muscle(sizes, self.path) if sizes else None, effects=effects)

    def _effect_of_set(self, effect: Effect, dataset: str) -> Effect:
        """An effect with the values of one data set, where data sets have values of their own."""
        plain = {p.name: f"{name_of(effect)}.{p.name}" for p in parameters(type(effect))}
        own = {key: full_names.of_set(name, dataset) for key, name in plain.items()}
        places = {key: own[key] if own[key] in self.values else plain[key] for key in plain}
        return type(effect)(**{key: self.values[name] for key, name in places.items() if name in self.values})


def read_model(path: Path | str, known: dict[str, type[Effect]] | None = None) -> ModelFile:
    """Read a model file, or the one in a folder; `known` are the effects by name: the program's own, unless given."""
    path, known = Path(path), library() if known is None else known
    path = path / "model.toml" if path.is_dir() else path
    if not path.is_file():
        raise InputError("no such model file", path, cure="'mckibben fit' writes one beside the data")
    table, raw = read_toml(path)
    _check_format(table, path, raw)
    for key in table:
        if key not in KEYS:
            raise unknown_name("key", key, KEYS, path, row=line_of(raw, key))
    values: dict[str, float] = {}
    states: dict[str, ParameterState] = {}
    measured = {name: unit for name, (unit, _) in quantities().items()}
    sizes = _read_table(table.get("muscle", {}), measured, path, raw, states, "muscle")
    values |= {f"muscle.{name}": value for name, value in sizes.items()}
    for dataset, more in _subtable(table, "muscle_of", path, raw).items():
        own: dict[str, ParameterState] = {}
        found = _read_table(more, measured, path, raw, own, "muscle")
        values |= {full_names.of_set(f"muscle.{name}", dataset): value for name, value in found.items()}
        states |= {full_names.of_set(name, dataset): state for name, state in own.items()}
    entries = table.get("effect", [])
    if not isinstance(entries, list) or not entries:
        raise InputError("the model has no effect", path, cure='add [[effect]] and below it name = "ideal_cylinder"')
    effects = tuple(_read_effect(entry, known, path, raw, values, states) for entry in entries)
    fitted_to = _subtable(table, "fitted_to", path, raw)
    data, hoses = (_subtable(fitted_to, key, path, raw) for key in ("data", "hoses"))
    return ModelFile(
        path,
        str(table.get("name", path.resolve().parent.name)),
        _muscle(sizes, path) if sizes else None,
        effects,
        values,
        states,
        {name: str(text).removeprefix("sha256:") for name, text in data.items()},
        stated_priors(table, effects, path, raw),
        {name: str(hose) for name, hose in hoses.items()},
    )


def _subtable(table: dict[str, Any], key: str, path: Path, raw: bytes) -> dict[str, Any]:
    """A table inside a table; empty where there is none."""
    found = table.get(key, {})
    if not isinstance(found, dict):
        cure = "take it out, or write it as the program does"
        raise InputError(f"{key} is not a table", path, line_of(raw, key), value=found, cure=cure)
    return found


def _check_format(table: dict[str, Any], path: Path, raw: bytes) -> None:
    found = table.get("format", FORMAT)
    if not isinstance(found, int) or isinstance(found, bool) or found < 1:
        cure = f"write format = {FORMAT}"
        raise InputError("format is not a whole number from 1 on", path, line_of(raw, "format"), value=found, cure=cure)
    if found > FORMAT:
        raise InputError(
            f"the file was written by a newer program (format {found}, program {table.get('program', 'unknown')}); "
            f"this is program {program_version()}, which reads format {FORMAT}",
            path,
            line_of(raw, "format"),
            cure=f"{_newer(table.get('program'))}, or fit again with --baseline",
        )


def _newer(program: Any) -> str:
    """The command that installs the program which wrote a file, as far as the file says which."""
    known = isinstance(program, str) and re.fullmatch(r"\d+(\.\d+){0,3}((a|b|rc|\.dev|\.post)\d+)?", program)
    return f"pip install '{NAME}>={program}'" if known else f"pip install --upgrade {NAME}"


def _read_effect(
    entry: Any,
    known: dict[str, type[Effect]],
    path: Path,
    raw: bytes,
    values: dict[str, float],
    states: dict[str, ParameterState],
) -> Effect:
    name = entry.get("name") if isinstance(entry, dict) else None
    if not isinstance(name, str):
        raise InputError("an [[effect]] has no name", path, cure='write name = "ideal_cylinder"')
    if "define" in entry:
        known = _with_defined(name, entry["define"], known, path, raw)
    if name not in known:
        error = unknown_name("effect", name, known, path)
        error.cure += " An effect of your own needs --effect-file or --define"
        raise error
    declared = {p.name: p for p in parameters(known[name])}
    given = {key: value for key, value in entry.items() if key not in ("name", "define")}
    found = _read_table(given, {k: p.unit for k, p in declared.items()}, path, raw, states, name)
    for key, value in found.items():
        p = declared[full_names.common(key)]
        check_range(f"{name}.{key}", value, p.lower, p.upper, p.unit, path, line_of(raw, key))
        values[f"{name}.{key}"] = value
    return known[name](**{key: value for key, value in found.items() if "@" not in key})


def _with_defined(
    name: str, line: Any, known: dict[str, type[Effect]], path: Path, raw: bytes
) -> dict[str, type[Effect]]:
    """The known effects and the one that an [[effect]] carries its own definition of: read as data, never run."""
    row = line_of(raw, "define")
    if not isinstance(line, str) or defined_name(line) != name:
        cure = f'write define = "{name} = ..." as in --define'
        raise InputError(f"define does not define '{name}'", path, row, value=line, cure=cure)
    return with_line(known, line, path, row)


def check_range(
    name: str, value: float, lower: float, upper: float, unit: str, path: Path | None = None, row: int | None = None
) -> None:
    """Refuse a value outside the range that its effect declares."""
    slack = 1e-9 * (upper - lower)
    if not lower - slack <= value <= upper + slack:
        allowed = f"{showing.show(lower, unit)} to {showing.show(upper, unit)}"
        raise InputError(
            f"{name} lies outside its range", path, row, value=showing.show(value, unit), cure=f"{allowed} is allowed"
        )


def _read_table(
    table: Any, known: dict[str, str], path: Path, raw: bytes, states: dict[str, ParameterState], owner: str
) -> dict[str, float]:
    """Values in SI of a table of `{ value, error, state }` or plain values; their states go into `states`."""
    if not isinstance(table, dict):
        raise InputError(f"{owner} is not a table", path, value=table, cure="write name = { value = ..., state = ... }")
    found = {}
    for key, entry in table.items():
        plain = full_names.common(key)
        if plain not in known:
            raise unknown_name(f"parameter of {owner}:", key, known, path, row=line_of(raw, key))
        entry = entry if isinstance(entry, dict) else {"value": entry}
        state = entry.get("state", ParameterState.FITTED)
        if state not in (*ParameterState,):
            raise unknown_name(f"state of {owner}.{key}:", str(state), ParameterState, path, row=line_of(raw, key))
        try:
            found[key] = units.to_si(entry.get("value"), known[plain], f"{owner}.{key}")
        except InputError as error:
            raise error.located(path, line_of(raw, key)) from None
        states[f"{owner}.{key}"] = ParameterState(state)
    return found


def _muscle(sizes: dict[str, float], path: Path) -> Muscle:
    for key in ("length", "radius", "braid_angle"):
        if key not in sizes:
            raise InputError(f"[muscle] lacks {key}", path, cure="take it from the data set's muscle.toml")
    return Muscle(**sizes)  # type: ignore[arg-type]
