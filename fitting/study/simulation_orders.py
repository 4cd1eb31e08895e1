"""The options of `simulate` as quantities in SI."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from fitting import units
from fitting.errors import InputError
from fitting.model_files.model_file import read_model
from fitting.recordings.experiment import kind_of
from fitting.recordings.records import FORCE_TESTS
from fitting.study.fitted_data import fitted_data
from fitting.study.simulate import SimulatedData, simulate
from fitting.study.simulated_band import SimulatedBand, write_band
from fitting.study.stored_model import stored_model


def simulate_request(folder: Path, options: dict[str, Any]) -> SimulatedData:
    """Simulate the recordings that the options describe, and write them."""
    test = kind_of(options["test"])
    if options["also"] and test not in FORCE_TESTS:
        cure = f"choose one of {', '.join(FORCE_TESTS)}"
        raise InputError("--also compares forces, and this test imposes the force", value=test, cure=cure)
    for other in options["also"]:  # a file that is not there is told before anything is written
        stored_model(other, options["muscle"], options["effect_file"], options["of"])
    whole, _ = stored_model(options["model"], options["muscle"], options["effect_file"], options["of"])
    noise = None
    if options["noise"]:
        noise = units.to_si(options["noise"], "N" if test in FORCE_TESTS else "m", "--noise")
        check_least("--noise", [noise], options["noise"], 0.0)
    return simulate(whole, folder, test, **_quantities(test, options), noise=noise, seed=options["seed"])


def band_of_request(data: SimulatedData, options: dict[str, Any]) -> SimulatedBand | None:
    """Write the band around a simulated force; None where positions were simulated."""
    if data.test not in FORCE_TESTS:
        return None
    try:
        task, fit, _ = fitted_data(options)
    except InputError as error:
        return SimulatedBand(why=str(InputError(error.problem, error.file)))
    if not options["of"]:
        return write_band(data, fit)
    names = [experiment.name for experiment in task.experiments]
    return write_band(data, fit, names.index(read_model(options["model"], task.library).called(options["of"])))


def _quantities(test: str, options: dict[str, Any]) -> dict[str, Any]:
    """What this kind of test is made of, in SI; what was not typed is left to `simulate`."""
    pressures = units.list_to_si(options["pressure"], "Pa", "--pressure")
    check_least("--pressure", pressures, options["pressure"], -units.ATMOSPHERE)
    chosen: dict[str, Any] = {"pressures": pressures}
    chosen |= {key: _positive(options, key, unit) for key, unit in (("rate", "1/s"), ("duration", "s")) if options[key]}
    if test == "loop":
        return chosen | {
            "turns": units.list_to_si(options["turns"], "1", "--turns"),
            "speed": _positive(options, "speed", "m/s"),
        }
    if test in ("isometric", "static"):
        typed = options["contraction"]
        return chosen | ({"contractions": units.list_to_si(typed, "1", "--contraction")} if typed else {})
    loads = units.list_to_si(options["load"], "N", "--load", units.load_to_si)
    check_least("--load", loads, options["load"], 0.0, itself=False)
    return chosen | {"loads": loads}


def _positive(options: dict[str, Any], key: str, unit: str) -> float:
    value = units.to_si(options[key], unit, f"--{key}")
    check_least(f"--{key}", [value], options[key], 0.0, itself=False)
    return value


def check_least(what: str, values: Sequence[float], typed: Any, least: float, itself: bool = True) -> None:
    """Refuse what no rig can do: values (SI) below the least, or at it unless the least `itself` may be."""
    if min(values) < least or (min(values) == least and not itself):
        bound = "a vacuum" if least else "0"
        problem = f"{what} goes below {bound}" if itself else f"{what} is not above {bound}"
        raise InputError(problem, value=typed, cure="give what a rig can do")
