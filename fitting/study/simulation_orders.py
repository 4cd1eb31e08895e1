"""From what was typed after `simulate` to its quantities in SI."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from fitting import units
from fitting.errors import InputError
from fitting.recordings.experiment import kind_of
from fitting.recordings.records import FORCE_TESTS
from fitting.study.simulate import SimulatedData, simulate
from fitting.study.stored_model import stored_model


def simulated(folder: Path, given: dict[str, Any]) -> SimulatedData:
    """Simulate what was asked for and write it."""
    test = kind_of(given["test"])
    whole, _ = stored_model(given)
    noise = None
    if given["noise"]:
        noise = units.to_si(given["noise"], "N" if test in FORCE_TESTS else "m", "--noise")
        check("--noise", [noise], given["noise"], 0.0)
    return simulate(whole, folder, test, **_quantities(test, given), noise=noise, seed=given["seed"])


def _quantities(test: str, given: dict[str, Any]) -> dict[str, Any]:
    """What this kind of test is made of, in SI; what was not typed is left to `simulate`."""
    pressures = _list(given["pressure"], "Pa", "--pressure")
    check("--pressure", pressures, given["pressure"], -units.ATMOSPHERE)
    chosen: dict[str, Any] = {"pressures": pressures}
    chosen |= {key: _positive(given, key, unit) for key, unit in (("rate", "1/s"), ("duration", "s")) if given[key]}
    if test == "loop":
        return chosen | {"turns": _list(given["turns"], "1", "--turns"), "speed": _positive(given, "speed", "m/s")}
    if test in ("isometric", "static"):
        typed = given["contraction"]
        return chosen | ({"contractions": _list(typed, "1", "--contraction")} if typed else {})
    loads = _list(given["load"], "N", "--load", units.load_to_si)
    check("--load", loads, given["load"], 0.0, itself=False)
    return chosen | {"loads": loads}


def _positive(given: dict[str, Any], key: str, unit: str) -> float:
    value = units.to_si(given[key], unit, f"--{key}")
    check(f"--{key}", [value], given[key], 0.0, itself=False)
    return value


def check(what: str, values: Sequence[float], typed: Any, least: float, itself: bool = True) -> None:
    """Refuse what no rig can do: values (SI) below the least, or at it unless the least `itself` may be."""
    if min(values) < least or (min(values) == least and not itself):
        bound = "a vacuum" if least else "0"
        problem = f"{what} goes below {bound}" if itself else f"{what} is not above {bound}"
        raise InputError(problem, value=typed, cure="give what a rig can do")


def _list(text: str, unit: str, what: str, read: Callable[..., float] = units.to_si) -> list[float]:
    """Values separated by commas; a unit at the end stands for all that have none."""
    parts = [part.strip() for part in text.split(",") if part.strip()]
    if not parts:
        raise InputError(f"{what} is empty", cure=f"write for example {units.example(unit)}")
    last = units.split_value(parts[-1], what)[1]
    whole = [part if units.split_value(part, what)[1] else f"{part} {last}".strip() for part in parts]
    return [read(part, unit, what) for part in whole]
