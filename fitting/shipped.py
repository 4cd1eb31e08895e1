"""The data sets that come with the program, and what was sealed about the simulated ones."""

import base64
import json
from importlib import resources
from pathlib import Path
from typing import Any

from fitting.errors import InputError, unknown_name


def shipped_folder() -> Path:
    """Where the shipped data sets lie: inside the installed package, else beside its source."""
    installed = Path(str(resources.files("fitting"))) / "_data"
    beside = Path(__file__).resolve().parents[1] / "data"
    for place in (installed, beside):
        if place.is_dir():
            return place
    raise InputError("the data shipped with the program are not there", beside, cure="install the program again")


def example_names() -> tuple[str, ...]:
    """Names of the shipped data sets."""
    return tuple(sorted(path.parent.name for path in shipped_folder().glob("*/muscle.toml")))


def example_data(name: str) -> Path:
    """The folder of a shipped data set."""
    if name not in example_names():
        raise unknown_name("shipped data set", name, example_names())
    return shipped_folder() / name


def sealed_truth(name: str) -> dict[str, Any]:
    """What was really put into a simulated data set; empty for measured ones."""
    path = shipped_folder() / "sealed" / f"{name}.json"
    if not path.is_file():
        return {}
    return json.loads(base64.b64decode(json.loads(path.read_text(encoding="utf-8"))["sealed"]))
