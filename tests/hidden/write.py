"""A simulated data set as a folder: muscle.toml, CSV files, and the truth in a file of its own."""

from __future__ import annotations

import base64
import json
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np

from .instruments import Channel
from .physics import Muscle
from .rig import Dataset, Recording

COLUMNS = {
    "run": ("run", 1.0, 0),
    "time": ("time [s]", 1.0, 5),
    "pressure": ("pressure [kPa]", 1e-3, 3),
    "set_pressure": ("set_pressure [kPa]", 1e-3, 3),
    "displacement": ("displacement [mm]", 1e3, 4),
    "load": ("load [N]", 1.0, 4),
    "force": ("force [N]", 1.0, 3),
    "branch": ("branch", None, None),
}
UNITS = {
    "length": (1e3, "mm"),
    "radius": (1e3, "mm"),
    "braid_angle": (180 / np.pi, "deg"),
    "wall_thickness": (1e3, "mm"),
    "wall_outside": (1e3, "mm"),
    "shear_modulus": (1e-6, "MPa"),
    "strand_width": (1e3, "mm"),
    "strand_modulus": (1e-9, "GPa"),
    "strand_poisson": (1.0, ""),
    "moving_mass": (1.0, "kg"),
}
READS = {"pressure": (1.0, "Pa"), "force": (1.0, "N"), "displacement": (1e3, "mm")}
IN_UNITS = ("noise", "resolution", "zero", "zero_per_run")
IN_PERCENT = ("gain", "gain_per_run", "hysteresis")
HOUR = 3600.0


def stated(muscle: Muscle, seed=0, **errors: float) -> dict[str, str]:
    """What the owner writes down: exact, or off by a normal error where `errors` names one (SI units)."""
    random, words = np.random.default_rng([seed, 77]), {}
    for key, value in asdict(muscle).items():
        if value is None or (value == 0 and key in ("wall_outside", "moving_mass")):
            continue
        factor, unit = UNITS[key]
        if key in errors:
            seen = value + errors[key] * random.standard_normal()
            words[key] = f"{seen * factor:.6g} +/- {errors[key] * factor:.4g} {unit}".strip()
        else:
            words[key] = f"{value * factor:.10g} {unit}".strip()
    return words


def cells(key: str, values, decimals=None):
    """One column as text."""
    title, factor, places = COLUMNS[key]
    if factor is None:
        return title, [str(value) for value in values]
    places = places if decimals is None else decimals.get(key, places)
    return title, [f"{value:.{places}f}" for value in np.asarray(values, float) * factor]


def csv_text(recording: Recording, decimals=None) -> str:
    """The recording as CSV."""
    ordered = [key for key in COLUMNS if key in recording.columns]
    columns = [cells(key, recording.columns[key], decimals) for key in ordered]
    lines = [",".join(title for title, _ in columns)]
    lines += [",".join(row) for row in zip(*(values for _, values in columns), strict=True)]
    return "\n".join(lines) + "\n"


def accuracies(channel: Channel, factor: float, unit: str) -> str:
    """What the data sheet of one instrument says: an inline table of all that is not 0."""
    words = {name: f"{getattr(channel, name) * factor:.6g} {unit}" for name in IN_UNITS}
    words |= {name: f"{100 * getattr(channel, name):.6g} %" for name in IN_PERCENT}
    words["drift"] = f"{channel.drift * factor * HOUR:.6g} {unit}/h"
    return ", ".join(f'{name} = "{text}"' for name, text in words.items() if getattr(channel, name))


def accuracy_lines(recording: Recording) -> list[str]:
    """[recording.accuracy]; nothing where every instrument is exact.

    What no data sheet says (jitter, ripple, warming of the muscle's friction) cannot be stated.
    """
    errs = recording.instruments
    position = errs.position
    if recording.test == "isometric":
        position = replace(position, zero_per_run=float(np.hypot(position.zero_per_run, errs.held_length)))
    channels = {"pressure": errs.pressure, "force": errs.force, "displacement": position}
    lines = [f"{name} = {{ {text} }}" for name, one in channels.items() if (text := accuracies(one, *READS[name]))]
    if errs.skew and recording.test != "static":
        lines.append(f'time = {{ skew = "{errs.skew * 1e3:.6g} ms" }}')
    return ["", "[recording.accuracy]", *lines] if lines else []


def toml_text(dataset: Dataset, source: dict[str, str] | None, say_noise: bool, say_accuracy: bool) -> str:
    """muscle.toml"""
    width = max(len(key) for key in dataset.stated)
    lines = [f'name = "{dataset.name}"', "", "[muscle]"]
    lines += [f'{key:<{width}} = "{value}"' for key, value in dataset.stated.items()]
    for recording in dataset.recordings:
        lines += ["", "[[recording]]", f'file = "{recording.file}"', f'test = "{recording.test}"']
        if say_noise and recording.noise_sd:
            factor, unit = (1.0, "N") if recording.measured == "force" else (1e3, "mm")
            lines.append(f'noise = "{recording.noise_sd * factor:.4g} {unit}"')
        lines += accuracy_lines(recording) if say_accuracy else []
    if source:
        lines += ["", "[source]", *(f'{key} = "{value}"' for key, value in source.items())]
    return "\n".join(lines) + "\n"


def truth_record(dataset: Dataset) -> dict:
    """Everything that was hidden, in SI units."""
    return {
        "effects": list(dataset.truth.effects),
        "parameters": {f"{n}.{k}": v for n, given in dataset.truth.effects.items() for k, v in given.items()},
        "muscle": {key: value for key, value in asdict(dataset.truth.muscle).items() if value is not None},
        "noise": asdict(dataset.noise),
        "noise_sd": {recording.file: recording.noise_sd for recording in dataset.recordings},
        "instruments": {recording.file: asdict(recording.instruments) for recording in dataset.recordings},
        "seed": dataset.seed,
    }


def seal(record: dict) -> dict:
    """The record so that nobody reads it by accident."""
    return {"format": 1, "sealed": base64.b64encode(json.dumps(record).encode()).decode()}


def unseal(record: dict) -> dict:
    """What `seal` hid."""
    return json.loads(base64.b64decode(record["sealed"]))


def write(
    dataset: Dataset, folder, truth_path=None, source=None, say_noise=True, decimals=None, say_accuracy=False
) -> Path:
    """Write the folder (and the open truth, as JSON, to `truth_path`). Returns the folder.

    `say_accuracy`: whether the data sheets of the instruments are copied into muscle.toml.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "muscle.toml").write_text(toml_text(dataset, source, say_noise, say_accuracy))
    for recording in dataset.recordings:
        (folder / recording.file).write_text(csv_text(recording, decimals))
    if truth_path:
        Path(truth_path).write_text(json.dumps(truth_record(dataset), indent=1))
    return folder
