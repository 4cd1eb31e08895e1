"""Writes the simulated data sets that ship with the program, from the sealed records beside them.

    python -m tests.hidden.make_shipped          # from the repository's root

Each record data/sealed/NAME.json holds muscle, effects, protocol, noise and seed; the same record gives the same
files to the last digit. What is in a record stays out of this file on purpose.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

from .simulator import (
    Dataset,
    Muscle,
    Noise,
    Truth,
    isometric,
    isotonic,
    loops,
    quick_release,
    static,
    step,
    unseal,
    write,
)

DATA = Path(__file__).resolve().parents[2] / "data"
TESTS = {
    "loop": loops,
    "isometric": isometric,
    "static": static,
    "isotonic": isotonic,
    "quick release": quick_release,
    "step": step,
}
SOURCE = {
    "citation": "Simulated with the program's tests (tests/hidden); no muscle was measured",
    "licence": "CC0 1.0",
}
# Rows are many and the files should stay small: a hundredth of a newton is far below the noise.
DECIMALS = {"time": 4, "pressure": 2, "displacement": 3, "force": 2, "load": 3}


def rebuilt(record: dict) -> Dataset:
    """The data set that a record describes."""
    effects = {name: {} for name in record["effects"]}
    for full, value in record["parameters"].items():
        name, key = full.split(".")
        effects[name][key] = value
    truth = Truth(Muscle(**record["muscle"]), effects)
    recordings = tuple(
        TESTS[one["test"]](truth, noise=Noise(**one["noise"]), seed=one["seed"], file=one["file"], **one["protocol"])
        for one in record["recordings"]
    )
    return Dataset(record["name"], record["stated"], truth, recordings, seed=record["seed"])


def make(name: str, folder: Path = DATA) -> Path:
    """Write one shipped data set."""
    record = unseal(json.loads((DATA / "sealed" / f"{name}.json").read_text()))
    return write(rebuilt(record), folder / name, source=SOURCE, decimals=DECIMALS)


def main() -> None:
    """Write all of them."""
    for path in sorted((DATA / "sealed").glob("*.json")):
        print(make(path.stem), file=sys.stderr)


if __name__ == "__main__":
    main()
