"""A data-set folder as an `Experiment`: muscle.toml and its recordings, in SI units, every reading checked."""

import hashlib
import shlex
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from fitting import showing, units
from fitting.errors import InputError, concerning, unknown_name
from fitting.recordings.absolute import absolute_notes, is_presumed
from fitting.recordings.accuracy import Accuracy
from fitting.recordings.accuracy_table import ACCURATE, accuracy_of
from fitting.recordings.again import runs_of
from fitting.recordings.channel_errors import found_errors
from fitting.recordings.common_accuracy import common_accuracy, common_accuracy_of, with_common
from fitting.recordings.constants import with_constants
from fitting.recordings.gaps import gap_notes, levels_note
from fitting.recordings.heads import COLUMNS, POSITIONS
from fitting.recordings.kinds import INSIDE, recordings_in
from fitting.recordings.let_go import from_release, let_go_notes, stated_let_go
from fitting.recordings.limits import TURNED_BY, slack_notes, with_limits
from fitting.recordings.muscle_file import hose_of, muscle_of, name_of, read_muscle, read_toml, source_of
from fitting.recordings.noise import noise_of_inputs, one_load_cell
from fitting.recordings.plausible import check_plausible, without_copies
from fitting.recordings.position import AT_REST
from fitting.recordings.readings import read_runs, with_hung_load
from fitting.recordings.records import FORCE_TESTS, TESTS, Experiment, Recording, Run
from fitting.recordings.tables import Table, read_table
from fitting.recordings.toml_rows import row_in_recording
from mckibben_jax.muscle import Muscle

__all__ = ["read_experiment", "read_muscle", "read_recording", "read_single"]

MOST_NAMED = 8  # data sets in a message
OWN_UNITS = ("set_pressure", "pressure", "length", "displacement", "force")  # columns that say what units people use
SIGNS = {"force_sign": "pulling as negative", "position_sign": "lengthening as positive"}  # why each may be -1
OPTIONS = (
    "file",
    "test",
    "noise",
    "columns",
    "units",
    "constant",
    "valid",
    "pressure",
    "ambient",
    "let_go",
    *SIGNS,
    AT_REST,
    "accuracy",
    *INSIDE,
)


def read_experiment(folder: Path | str) -> Experiment:
    """Read a data set: a folder with muscle.toml and the recordings it names."""
    folder = Path(folder)
    if folder.name == "muscle.toml":
        folder = folder.parent
    if folder.is_file():
        raise InputError(
            "this is a file, not a folder", folder, cure="for one file give --muscle muscle.toml --test loop"
        )
    if not folder.is_dir():
        raise InputError("no such folder", folder, cure="a data set is a folder with muscle.toml and recordings")
    path = folder / "muscle.toml"
    if not path.exists():
        _check_inside(folder)
    table, raw = read_toml(path)
    muscle, priors = muscle_of(table, path, raw)
    entries = table.get("recording", [])
    if not isinstance(entries, list) or not entries or not all(isinstance(entry, dict) for entry in entries):
        cure = 'add [[recording]] and below it file = "loops.csv" and test = "loop"'
        raise InputError("no recording is named", path, cure=cure)
    digest, common = hashlib.sha256(raw), common_accuracy(table, path, raw)
    recordings = []
    for number, entry in enumerate(entries):
        try:
            recording, content = _recording_of(entry, common, folder, muscle)
        except InputError as error:
            if error.file is not None:
                raise
            raise error.located(path, row_in_recording(raw, number, error.key)) from None  # an option is wrong
        recordings.append(recording)
        digest.update(content)
    read = Experiment(
        name_of(table, path),
        folder,
        muscle,
        one_load_cell(recordings),
        priors,
        digest.hexdigest(),
        source_of(table, path),
        units.unit_of(str(table["muscle"]["length"])),
        hose=hose_of(table, raw, path),
    )
    return with_limits(without_copies(read))


def _check_inside(folder: Path) -> None:
    """Refuse a folder that is no data set but holds some, naming them."""
    if recordings_in(folder):
        return  # then its muscle.toml is what is missing
    inside = sorted(path.parent for path in folder.glob("*/muscle.toml"))
    bare = sorted(path for path in folder.iterdir() if path.is_dir() and path not in inside and recordings_in(path))
    if inside:
        named = " ".join(shlex.quote(str(path)) for path in inside[:MOST_NAMED])
        more = f" (and {len(inside) - MOST_NAMED} more)" if len(inside) > MOST_NAMED else ""
        cure = f"name one of them, or several that share the parameters of effects: {named}{more}"
        raise InputError(f"this folder is no data set, but {len(inside)} of its folders are", folder, cure=cure)
    if bare:
        cure = f"begin with 'mckibben init {shlex.quote(str(bare[0]))}', then name that folder"
        raise InputError(f"this folder is no data set; {len(bare)} of its folders hold recordings", folder, cure=cure)


def read_recording(path: Path | str, test: str, muscle: Muscle, options: Mapping[str, Any] | None = None) -> Recording:
    """Read one file as a recording of this kind of test; `options` are the keys a `[[recording]]` may have."""
    return _read(Path(path), test, muscle, dict(options or {}), {}, Path(path).name)[0]


def read_single(
    path: Path | str, muscle_file: Path | str, test: str, options: Mapping[str, Any] | None = None
) -> Experiment:
    """A data set of one file, with the muscle of a muscle.toml that may stand elsewhere."""
    path = Path(path)
    muscle, priors, name, source = read_muscle(muscle_file)
    described = Path(muscle_file) / "muscle.toml" if Path(muscle_file).is_dir() else Path(muscle_file)
    common = common_accuracy_of(described)
    recording, content = _read(path, test, muscle, dict(options or {}), common, path.name)
    digest, hose = (
        hashlib.sha256(described.read_bytes() + content).hexdigest(),
        hose_of(*read_toml(described), described),
    )
    read = Experiment(name, path.parent, muscle, (recording,), priors, digest, source, hose=hose)
    return with_limits(without_copies(read))


def _recording_of(
    entry: dict[str, Any], common: Mapping[str, Any], folder: Path, muscle: Muscle
) -> tuple[Recording, bytes]:
    """One `[[recording]]` of a muscle.toml with its [accuracy]."""
    for key in ("file", "test"):
        if not isinstance(entry.get(key), str):
            cure = f'add {key} = "{"loops.csv" if key == "file" else "loop"}"'
            raise InputError(f"a [[recording]] lacks {key}", value=entry.get(key), cure=cure)
    return _read(folder / entry["file"], entry["test"], muscle, entry, common, entry["file"])


def _read(
    path: Path, test: str, muscle: Muscle, options: dict[str, Any], common: Mapping[str, Any], name: str
) -> tuple[Recording, bytes]:
    """One recording; `common` holds the accuracies of all recordings of its muscle.toml."""
    with concerning("test"):
        test = kind_of(test)
    _check_options(options)
    stated = with_common(options, test, common)
    accuracy = accuracy_of(stated, test, float(muscle.length), _noise(options.get("noise"), test))
    inside = {key: options[key] for key in INSIDE if key in options}
    table = read_table(path, options.get("columns"), options.get("units"), inside)
    table = with_hung_load(with_constants(table, options.get("constant", {}), test), test)
    with showing.spoken(showing.own_units([_stated(table)])):  # what is wrong is said as the owner of the data would
        runs, notes, found = _checked_runs(table, test, muscle, options, accuracy)
    position = next(column for column in POSITIONS if column in table)
    noise = (accuracy.force if test in FORCE_TESTS else accuracy.position).noise
    part = "".join(f", {option} {value}" for option, value in inside.items())
    read = Recording(
        name + part, test, runs, noise, notes, position, _stated(table), accuracy=accuracy, found=found,
        ambient_is_presumed=is_presumed(options), part=part,
    )  # fmt: skip
    if test == "static":
        read = replace(read, noise_of_inputs=noise_of_inputs(runs, accuracy, muscle))
    return read, table.raw


def _noise(stated: Any, test: str) -> float | None:
    """The stated standard deviation of one reading, N or m; None where there is none."""
    if stated is None:
        return None
    with concerning("noise"):
        noise = units.to_si(stated, "N" if test in FORCE_TESTS else "m", "noise")
        if noise <= 0:
            raise InputError("noise is not positive", value=stated, cure="leave it out if it is unknown")
    return noise


def _checked_runs(
    table: Table, test: str, muscle: Muscle, options: dict[str, Any], stated: Accuracy
) -> tuple[tuple[Run, ...], tuple[str, ...], Accuracy]:
    """The runs of a table, every reading checked; notes on what was set aside; and what the readings err by."""
    counts: Counter[str] = Counter()
    parts = read_runs(table, test, muscle, options, counts)
    begun, moment = list[str](), stated_let_go(options.get("let_go"), test)
    if test == "quick release":
        let_go = [from_release(part, moment) for part in parts]
        begun, parts = let_go_notes(parts, let_go), let_go
    odd = [*absolute_notes(table, options), *check_plausible(parts, table, test, muscle, options)]
    parts, runs, alone = runs_of(parts, test, muscle, stated)
    for run in runs:
        counts.update(run.without_weight)
    if not any(run.weight.any() for run in runs):
        why = "; ".join(_weightless(counts, table))
        raise InputError(
            f"no sample is left that carries weight: {why}", table.file, cure="widen `valid`, or record more"
        )
    told = (*_notes(counts, table, test, runs), *_smoothed(parts, runs, test))
    cut = [levels_note(parts)] if test == "loop" and len(parts) > 1 and "run" not in table else []
    notes = (*cut, *begun, *told, *odd, *alone, *gap_notes(parts, test), *slack_notes(runs, test))
    return runs, notes, found_errors(parts, test, float(muscle.length))


def _smoothed(parts: Sequence[Run], runs: tuple[Run, ...], test: str) -> list[str]:
    """Notes on channels whose readings err so much that the signal behind them was estimated."""
    notes = []
    for name, unit in (("pressure", "Pa"), ("contraction", "1")) if test == "loop" else (("pressure", "Pa"),):
        off = np.concatenate([getattr(run, name) - getattr(part, name) for run, part in zip(runs, parts, strict=True)])
        if np.count_nonzero(off) > len(off) / 2:  # a few readings change where jitter would turn a branch
            size = showing.show(float(np.sqrt(np.mean(off**2))), unit, digits=2)
            notes.append(f"{name} estimated by a Kalman smoother: one reading errs by {size}")
    return notes


def _stated(table: Table) -> dict[str, str]:
    """SI unit -> the unit of the column that is measured in it; a load hung on as a mass is no force."""
    stated = {str(COLUMNS[name]): unit for name, unit in table.units.items() if name in OWN_UNITS}
    load = table.units.get("load")
    return {"N": load} | stated if load and units.dimension(load) == units.dimension("N") else stated


def kind_of(test: str) -> str:
    """The kind of test that a name means: 'Quick_release' -> 'quick release'."""
    plain = str(test).strip().lower().replace("_", " ").replace("-", " ")
    if plain not in TESTS:
        raise unknown_name("test", str(test), TESTS)
    return plain


def _check_options(options: dict[str, Any]) -> None:
    for key, value in options.items():
        with concerning(key):
            if isinstance(value, dict) and key in ACCURATE:
                cure = "write a line [recording.accuracy] above it"
                raise InputError(f"{key}: how far a channel may err belongs below [recording.accuracy]", cure=cure)
            if key not in OPTIONS:
                raise unknown_name("key in [[recording]]:", key, OPTIONS)
            if check := CHECKS.get(key):
                check(key, value)


def _check_table(key: str, value: Any) -> None:
    if not isinstance(value, dict):
        raise InputError(f"{key} is not a table", value=value, cure=f"write {key} = {{ force = ... }}")


def _check_texts(key: str, value: Any) -> None:
    _check_table(key, value)
    for name, text in value.items():
        if not isinstance(text, str):
            raise InputError(f"{key}: {name} is not text", value=text, cure=f'write {key} = {{ {name} = "..." }}')


def _check_text(key: str, value: Any) -> None:
    if not isinstance(value, str):
        raise InputError(f"{key} is not text", value=value, cure=f'write {key} = "its name"')


def _check_pressure(key: str, value: Any) -> None:
    if value not in ("gauge", "absolute"):
        raise InputError("pressure is neither gauge nor absolute", value=value, cure=f'write {key} = "gauge"')


def _check_sign(key: str, value: Any) -> None:
    if isinstance(value, bool) or value not in (1, -1):
        cure = f"write {key} = -1 where the rig counts {SIGNS[key]}"
        raise InputError(f"{key} is neither 1 nor -1", value=value, cure=cure)


CHECKS: dict[str, Callable[[str, Any], None]] = {
    "columns": _check_texts, "units": _check_texts, "constant": _check_texts,
    "valid": _check_table, "pressure": _check_pressure,
    **dict.fromkeys(SIGNS, _check_sign), **dict.fromkeys(INSIDE, _check_text),
}  # fmt: skip


# -------------------------------------------------------------------------------------------------------------- notes


def _weightless(counts: Counter[str], table: Table) -> list[str]:
    total = len(table.row)
    return [f"{count} of {total} samples carry no weight: {reason}" for reason, count in counts.items() if count]


def _notes(counts: Counter[str], table: Table, test: str, runs: tuple[Run, ...]) -> tuple[str, ...]:
    """What was set aside and why, with counts."""
    notes = _weightless(counts, table)
    if table.unused:
        notes.append(f"not used: {', '.join(table.unused)}")
    if test == "static" and "branch" not in table:
        notes.append("direction not stated: friction taken as 0")
    if test in TURNED_BY:
        branches = sum(int(run.half[-1]) + 1 for run in runs)
        how = "the branch column" if "branch" in table else f"the turning points of the {TURNED_BY[test]}"
        notes.append(f"{branches} branches in {showing.counted(len(runs), 'run')}, told by {how}")
    if test in ("loop", "isotonic"):
        notes.append("speed derived from the position by local parabolas that stop at turning points")
    return tuple(notes)
