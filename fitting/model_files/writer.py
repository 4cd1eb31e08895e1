"""Write model.toml: the only place that makes one, from a fit or from a design.

The first line holds a digest of the rest, by which a file that somebody has edited is known and left alone.
"""

import hashlib
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import tomlkit
from tomlkit.items import InlineTable, Table

from fitting import showing
from fitting.least_squares.record import Fit
from fitting.library.line import Defined
from fitting.model_files.model_file import FORMAT
from fitting.problem.estimate import Estimate, ParameterState
from fitting.recordings.records import Experiment
from fitting.version import program_version
from fitting.writing import text_replaced
from mckibben_jax.effect import Effect, name_of

SEAL = "# Written by mckibben. Edit freely: it is then left alone. sha256 of what follows: "
Entries = Mapping[str, tuple[Estimate, ParameterState]]  # by the parameter's name within its table


def write_model(path: Path | str, fit: Fit, experiments: Sequence[Experiment]) -> str | None:
    """Write a fitted model; a file that was edited, or a place that cannot be written to, is left alone.

    Returned is why nothing was written, in words, or None.
    """
    path = Path(path)
    if path.is_dir():
        return f"{path} is a folder"
    if path.exists() and is_edited(path):
        return f"{path} was written or edited by hand and is left alone"
    try:
        text_replaced(path, model_text(fit, experiments))
    except OSError as error:
        return f"{path} cannot be written: {error.strerror}"
    return None


def model_text(fit: Fit, experiments: Sequence[Experiment]) -> str:
    """A fitted model as the text of its file."""
    muscles = {experiment.name: _muscle_of(fit, number) for number, experiment in enumerate(experiments)}
    effects = [(effect, _effect_of(fit, name_of(effect))) for effect in fit.layout.templates[0].effects]
    first, *others = muscles
    data = {folder_name(e): f"sha256:{e.sha256}" for e in experiments}
    fitted_to = {"data": data, "hoses": {e.name: e.hose for e in experiments if e.hose}}
    return file_text(first, muscles[first], effects, {name: muscles[name] for name in others}, fitted_to)


def folder_name(experiment: Experiment) -> str:
    """By which the data are called in files: their folder's name."""
    return experiment.folder.resolve().name


def _muscle_of(fit: Fit, number: int) -> Entries:
    """The sizes of one data set's muscle: its own, or those that it shares with others."""
    found = {}
    for common, full in fit.layout.names_of(number).items():
        owner, name = common.split(".", 1)
        if owner == "muscle":
            # at the end of what was stated only its range keeps the fit from denying it; later commands keep to that
            kept = full in fit.at_bound and fit.layout.entry(full).prior is not None
            found[name] = fit.estimate(full), ParameterState.FIXED if kept else fit.state(full)
    return found


def _effect_of(fit: Fit, effect: str) -> Entries:
    return {full.split(".", 1)[1]: (fit.estimate(full), fit.state(full)) for full in fit.layout.of_effect(effect)}


def file_text(
    name: str,
    muscle: Entries,
    effects: Iterable[tuple[Effect, Entries]],
    muscle_of: Mapping[str, Entries] | None = None,
    fitted_to: Mapping[str, Mapping[str, str]] | None = None,
) -> str:
    """A model as the text of its file. `muscle_of` are the muscles of further data sets.

    `fitted_to` are the digests of the "data" by their folders, and the "hoses" that muscles are cut from by data set.
    """
    document = tomlkit.document()
    document["format"] = FORMAT
    document["program"] = program_version()
    document["name"] = name
    document["muscle"] = _table(muscle)
    if muscle_of:
        document["muscle_of"] = {dataset: _table(entries) for dataset, entries in muscle_of.items()}
    tables = tomlkit.aot()
    for effect, entries in effects:
        tables.append(_effect_table(effect, entries))
    document["effect"] = tables
    if fitted_to:
        document["fitted_to"] = {key: _inline(entries) for key, entries in fitted_to.items() if entries}
    return _sealed(tomlkit.dumps(document))


def _effect_table(effect: Effect, entries: Entries) -> Table:
    table = tomlkit.table()
    table["name"] = name_of(effect)
    if isinstance(effect, Defined):
        table["define"] = effect.line
    table.update(_table(entries))
    return table


def _table(entries: Entries) -> Table:
    table = tomlkit.table()
    for name, (estimate, state) in entries.items():
        entry = {"value": showing.write(estimate.value, estimate.unit)}
        if state is ParameterState.FITTED:
            entry["error"] = showing.show(estimate.error, estimate.unit, digits=2)
        table[name] = _inline(entry | {"state": str(state)})
    return table


def _inline(entries: Mapping[str, str]) -> InlineTable:
    table = tomlkit.inline_table()
    table.update(entries)
    return table


def _sealed(body: str) -> str:
    """The text of a model file with the line by which it is known that nobody has edited it."""
    return SEAL + _digest(body) + "\n" + body


def is_edited(path: Path) -> bool:
    """Whether a model file is not as the program wrote it."""
    try:
        first, _, body = path.read_text(encoding="utf-8").partition("\n")
    except (OSError, UnicodeDecodeError):
        return True
    return not first.startswith(SEAL) or first.removeprefix(SEAL).strip() != _digest(body)


def _digest(body: str) -> str:
    return hashlib.sha256(re.sub(r"\s+", " ", body).strip().encode()).hexdigest()[:16]
