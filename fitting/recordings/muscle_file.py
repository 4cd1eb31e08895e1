"""muscle.toml: what was measured of the muscle at rest, with its uncertainties, and which recordings belong to it."""

import math
import re
import tomllib
from pathlib import Path
from typing import Any

import numpy as np

from fitting import full_names, showing, units
from fitting.errors import InputError, unknown_name
from fitting.recordings.settings import TABLES
from fitting.units import Measured
from mckibben_jax.laws.rubber import shear_modulus_of_hardness
from mckibben_jax.muscle import Muscle, quantities

TOP_KEYS = ("name", "hose", "muscle", "accuracy", "recording", "source")
INSTEAD = ("cord_length", "turns", "hardness")  # other ways to say the braid angle and the shear modulus
TOO_MUCH = "a file of this kind has some dozens of lines; is it another file?"
LEAST_ANGLE = math.radians(1.0)  # every braid has more, and every one in radians that is read as degrees has less
REQUIRED = {"length": "300 mm", "radius": "7.0 +/- 0.1 mm", "braid_angle": "20 +/- 0.5 deg"}  # with an example


def read_toml(path: Path) -> tuple[dict[str, Any], bytes]:
    """The table in a TOML file and the file's bytes."""
    raw = _raw(path)
    try:
        return tomllib.loads(raw.decode("utf-8-sig").replace("\r\n", "\n")), raw
    except UnicodeDecodeError:
        raise InputError("the file is not UTF-8 text", path, cure="save it again as UTF-8") from None
    except tomllib.TOMLDecodeError as error:
        row = re.search(r"at line (\d+)", str(error))
        problem = re.sub(r"\s*\(at .*\)", "", str(error))
        twice = "overwrite" in problem or "declare" in problem
        cure = 'every value stands in quotes, with its unit: length = "300 mm"'
        cure = "every name stands once: leave one of the two out" if twice else cure
        raise InputError(f"not valid TOML: {problem}", path, int(row[1]) if row else None, cure=cure) from None
    except (ValueError, RecursionError):  # a number of thousands of digits, or brackets a thousand deep
        raise InputError("not valid TOML: something in it is too long or too deep", path, cure=TOO_MUCH) from None


def _raw(path: Path) -> bytes:
    try:
        if not path.is_file():
            raise OSError
        if path.stat().st_size > TABLES.toml_bytes:
            size = f"{path.stat().st_size / 1e6:.1f} MB"
            raise InputError(f"the file is larger than {TABLES.toml_bytes / 1e6:g} MB", path, value=size, cure=TOO_MUCH)
        return path.read_bytes()
    except (OSError, ValueError):
        raise InputError("no such file", path, cure=f"'mckibben init {path.parent}' writes one to fill in") from None


def line_of(raw: bytes, key: str) -> int | None:
    """Line that sets `key`, as an editor counts; None where no line does, or several."""
    pattern = re.compile(rf"\s*[\"']?{re.escape(key)}[\"']?\s*(=|$)")
    lines = raw.decode("utf-8-sig", "replace").split("\n")
    found = [number for number, line in enumerate(lines, 1) if pattern.match(line)]
    return found[0] if len(found) == 1 else None


def read_muscle_table(table: dict[str, Any], path: Path, raw: bytes) -> tuple[Muscle, dict[str, tuple[float, float]]]:
    """The `[muscle]` table as a muscle and the normal priors (mean, standard deviation, SI) of its uncertain values."""
    known = quantities()
    given: dict[str, Measured] = {}
    for key, value in table.items():
        if key not in known and key not in INSTEAD:
            raise unknown_name("key in [muscle]:", key, (*known, *INSTEAD), path, row=line_of(raw, key))
        try:
            given[key] = measurement(key, value)
        except InputError as error:
            raise error.located(path, line_of(raw, key)) from None
    given = _angle_from_cords(_modulus_from_hardness(given, path, raw), path, line_of(raw, "cord_length"))
    for key, example in REQUIRED.items():
        if key not in given:
            cure = f'add {key} = "{example}", with your value'
            raise InputError(f"[muscle] lacks {key} ({known[key][1]})", path, cure=cure)
    _check_geometry({key: value.value for key, value in given.items()}, path, raw)
    priors = {f"muscle.{key}": (v.value, v.error) for key, v in given.items() if v.error is not None}
    return Muscle(**{key: v.value for key, v in given.items()}), priors  # type: ignore[arg-type]


def measurement(key: str, value: Any) -> Measured:
    """One value of `[muscle]`, SI, with its standard error where one is stated; InputError without a place."""
    if isinstance(value, str) and "?" in value:
        raise InputError(f"{key} is still to be filled in", value=value, cure="write the value you measured")
    if key == "hardness" and isinstance(value, str):
        value = re.sub(r"\s*(IRHD|[Ss]hore\s*A?)\b", "", value)
    unit = {"cord_length": "m", "turns": "1", "hardness": "1"}.get(key) or quantities()[key][0]
    return units.measured(value, unit, key)


def _modulus_from_hardness(given: dict[str, Measured], path: Path, raw: bytes) -> dict[str, Measured]:
    """Shear modulus in place of the hardness, its uncertainty carried over to first order."""
    if "hardness" not in given:
        return given
    if "shear_modulus" in given:
        raise InputError("hardness and shear_modulus say the same twice", path, cure="leave one of them out")
    hardness = given["hardness"]
    if not 30 <= hardness.value <= 75:
        raise InputError(
            "hardness lies outside 30..75 IRHD, where its modulus is known",
            path,
            line_of(raw, "hardness"),
            value=f"{hardness.value:g} IRHD",
            cure="give shear_modulus instead",
        )
    around = hardness.value + np.array([-0.5, 0.0, 0.5])
    softer, modulus, harder = np.asarray(shear_modulus_of_hardness(around)).tolist()
    error = None if hardness.error is None else (harder - softer) * hardness.error
    return {k: v for k, v in given.items() if k != "hardness"} | {"shear_modulus": Measured(modulus, error)}


def _angle_from_cords(given: dict[str, Measured], path: Path, row: int | None) -> dict[str, Measured]:
    """Braid angle in place of cord length and turns: tan(angle) = 2 pi r n / l0, and the cord is the hypotenuse.

    Length and radius are measured anyhow, so the cord length is the check: the angle from it alone, acos(l0/b), would
    magnify its error at small angles. The uncertainties of length, radius and turns are carried to the angle to
    first order.
    """
    if "cord_length" not in given and "turns" not in given:
        return given
    if "braid_angle" in given:
        raise InputError("braid_angle and cord_length with turns say the same twice", path, cure="leave one out")
    for key in ("length", "radius", "cord_length", "turns"):
        if key not in given:
            problem = f"[muscle] lacks {key}: the braid angle follows from length, radius, cord_length and turns"
            raise InputError(problem, path, cure=f"add {key}, or give braid_angle instead of cord_length and turns")
    length, radius, cord, turns = (given[key] for key in ("length", "radius", "cord_length", "turns"))
    around = 2 * math.pi * radius.value * turns.value
    angle = math.atan2(around, length.value)
    expected = math.hypot(around, length.value)
    if abs(cord.value / expected - 1) > 0.05:
        problem = f"cord_length is not what length, radius and turns ask for, {showing.show(expected, 'm')}"
        raise InputError(
            problem, path, row, value=showing.show(cord.value, "m"), cure="measure again, or give braid_angle"
        )
    relative = [v.error / v.value for v in (length, radius, turns) if v.error is not None]
    error = math.sin(angle) * math.cos(angle) * math.hypot(*relative) if relative else None
    return {k: v for k, v in given.items() if k not in INSTEAD} | {"braid_angle": Measured(angle, error)}


def _check_geometry(value: dict[str, float], path: Path, raw: bytes) -> None:
    """Refuse a muscle that cannot be built, with the line to look at."""

    def refuse(key: str, problem: str, cure: str) -> InputError:
        shown = showing.show(value[key], quantities()[key][0])
        error = InputError(f"{key} {problem}", path, line_of(raw, key), value=shown, cure=cure)
        error.key = key
        return error

    may_be_zero = ("wall_outside", "moving_mass", "mooney_c10", "mooney_c01", "strand_poisson")
    for key, number in value.items():
        if number < 0 or (number == 0 and key not in may_be_zero):
            raise refuse(key, "must be positive", "check the sign and the unit")
    if value["braid_angle"] >= math.pi / 2:
        raise refuse("braid_angle", "must be below 90 deg", "it is measured from the long axis of the muscle")
    if value["braid_angle"] < LEAST_ANGLE:
        degrees = math.degrees(value["braid_angle"])
        problem = f"is below {math.degrees(LEAST_ANGLE):.0f} deg, as no braid is"
        raise refuse("braid_angle", problem, f"if it is in radians, write '{degrees:.3g} rad'")
    if value["radius"] >= value["length"]:
        raise refuse("radius", "is not below the length", "check the units; radius, not diameter")
    outside = value.get("wall_outside", 0.0)
    if value.get("wall_thickness", math.inf) <= outside and outside > 0:
        raise refuse("wall_outside", "is not below wall_thickness", "wall_thickness is the whole wall")
    if value.get("wall_thickness", 0.0) >= value["radius"] + outside:
        raise refuse(
            "wall_thickness",
            "leaves no bore: radius + wall_outside - wall_thickness must be positive",
            "check the units; wall_thickness is that of one wall",
        )
    if value.get("strand_poisson", 0.0) > 0.5:
        raise refuse("strand_poisson", "is above 0.5", "Poisson's ratio lies in 0..0.5")


def read_muscle(path: Path | str) -> tuple[Muscle, dict[str, tuple[float, float]], str, dict[str, str]]:
    """Muscle, priors ("muscle.radius" -> mean and standard deviation, SI), name and source of a muscle.toml.

    A folder stands for the muscle.toml in it.
    """
    path = Path(path)
    path = path / "muscle.toml" if path.is_dir() else path
    table, raw = read_toml(path)
    muscle, priors = muscle_of(table, path, raw)
    return muscle, priors, name_of(table, path), source_of(table, path)


def muscle_of(table: dict[str, Any], path: Path, raw: bytes) -> tuple[Muscle, dict[str, tuple[float, float]]]:
    """The muscle of a whole file's table, its keys checked."""
    for key in table:
        if key not in TOP_KEYS:
            raise unknown_name("key", key, TOP_KEYS, path, row=line_of(raw, key))
    if not isinstance(table.get("muscle"), dict):
        raise InputError("there is no [muscle] table", path, cure="add [muscle] with length, radius and braid_angle")
    return read_muscle_table(table["muscle"], path, raw)


def name_of(table: dict[str, Any], path: Path) -> str:
    """The muscle's name, or its folder's, without what would steer a screen."""
    return _printable(str(table.get("name") or path.resolve().parent.name))


def hose_of(table: dict[str, Any], raw: bytes, path: Path) -> str:
    """The name of the hose that the muscle is cut from, without what would steer a screen; empty where none is."""
    hose = table.get("hose", "")
    if not isinstance(hose, str) or full_names.OF in hose or hose.strip() == "?":
        cure = 'write its name in quotes, without "@": hose = "DMSP-10"'
        raise InputError("hose is no name", path, line_of(raw, "hose"), value=hose, cure=cure)
    return _printable(hose.strip())


def _printable(name: str) -> str:
    return "".join(letter if letter.isprintable() else "\N{REPLACEMENT CHARACTER}" for letter in name)


def source_of(table: dict[str, Any], path: Path) -> dict[str, str]:
    """The `[source]` table as text."""
    source = table.get("source", {})
    if not isinstance(source, dict):
        raise InputError("source is not a table", path, cure='write [source] and below it citation = "..."')
    return {key: str(value) for key, value in source.items()}
