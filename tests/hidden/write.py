"""A simulated data set as a folder: muscle.toml, CSV files, and the truth in a file of its own."""

from __future__ import annotations

import base64
import json
from dataclasses import asdict
from pathlib import Path

import numpy as np

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


def toml_text(dataset: Dataset, source: dict[str, str] | None, say_noise: bool) -> str:
    """muscle.toml"""
    width = max(len(key) for key in dataset.stated)
    lines = [f'name = "{dataset.name}"', "", "[muscle]"]
    lines += [f'{key:<{width}} = "{value}"' for key, value in dataset.stated.items()]
    for recording in dataset.recordings:
        lines += ["", "[[recording]]", f'file = "{recording.file}"', f'test = "{recording.test}"']
        if say_noise and recording.noise_sd:
            factor, unit = (1.0, "N") if recording.measured == "force" else (1e3, "mm")
            lines.append(f'noise = "{recording.noise_sd * factor:.4g} {unit}"')
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
        "seed": dataset.seed,
    }


def seal(record: dict) -> dict:
    """The record so that nobody reads it by accident."""
    return {"format": 1, "sealed": base64.b64encode(json.dumps(record).encode()).decode()}


def unseal(record: dict) -> dict:
    """What `seal` hid."""
    return json.loads(base64.b64decode(record["sealed"]))


def write(dataset: Dataset, folder, truth_path=None, source=None, say_noise=True, decimals=None) -> Path:
    """Write the folder (and the open truth, as JSON, to `truth_path`). Returns the folder."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "muscle.toml").write_text(toml_text(dataset, source, say_noise))
    for recording in dataset.recordings:
        (folder / recording.file).write_text(csv_text(recording, decimals))
    if truth_path:
        Path(truth_path).write_text(json.dumps(truth_record(dataset), indent=1))
    return folder
