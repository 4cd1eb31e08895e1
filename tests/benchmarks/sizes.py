"""What an installation takes: size, import and start-up of the program and of everything it depends on, as Markdown.

Run with `python -m tests.benchmarks.sizes` where the program is installed. Dependencies are those of `pyproject.toml`;
their sizes are those of the files that each distribution lists, compiled bytecode left out. What leaves with a
dependency is what nothing else in the core needs. Imports and commands are timed in processes of their own: processor
time, children counted, and on the wall, the least of some rounds. `--rounds 1` is quick, `--no-times` quicker.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
import tomllib
from collections.abc import Iterable
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

import numpy as np
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
CALLED = {"scikit-learn": "sklearn"}  # installed by one name, imported by another
MB = 1e6
LARGE = 5.0  # MB, from which what nobody asked for directly is listed too
SAMPLES = 10_000
GOAL_HELP, GOAL_TIMES, GOAL_MORE = 0.3, 2.5, 3.0  # s; times `import jax`, and s beyond that


# Sizes ---------------------------------------------------------------------------------------------------------------


def asked_for(texts: Iterable[str], extras: Iterable[str] = ()) -> set[str]:
    """Distributions that requirements name, as far as they hold here and with these extras."""
    asked, cases = map(Requirement, texts), [{"extra": extra} for extra in ("", *extras)]
    return {canonicalize_name(r.name) for r in asked if r.marker is None or any(map(r.marker.evaluate, cases))}


def brought(names: Iterable[str]) -> set[str]:
    """These distributions, and all that they need in turn; what is not installed is left out."""
    found, waiting = set(), list(names)
    while waiting:
        name = waiting.pop()
        if name not in found:
            try:
                waiting += asked_for(distribution(name).requires or [])
            except PackageNotFoundError:
                continue
            found.add(name)
    return found


def size(name: str) -> int:
    """Bytes of the files of a distribution."""
    files = distribution(name).files or []
    there = (Path(str(file.locate())) for file in files if file.suffix != ".pyc")
    return sum(path.stat().st_size for path in there if path.is_file())


def total(names: Iterable[str]) -> float:
    """Megabytes of several distributions."""
    return sum(map(size, names)) / MB


def own_size() -> float:
    """Megabytes of the program itself, which may be installed as a link to its sources."""
    folders = [ROOT / name for name in ("mckibben_jax", "fitting", "data")]
    files = [path for folder in folders for path in folder.rglob("*") if path.suffix != ".pyc" and path.is_file()]
    return sum(path.stat().st_size for path in files) / MB


# Times ---------------------------------------------------------------------------------------------------------------


def spent(*command: str, rounds: int) -> tuple[float, float]:
    """Least processor and wall time of a command, s."""
    found = []
    for _ in range(rounds):
        before, begun = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
        subprocess.run(command, capture_output=True, check=True)
        wall, after = time.perf_counter() - begun, resource.getrusage(resource.RUSAGE_CHILDREN)
        found.append((after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, wall))
    return min(cpu for cpu, _ in found), min(wall for _, wall in found)


def imported(name: str, rounds: int, bare: float) -> float:
    """Processor seconds to import a distribution's package, the interpreter's own start taken off."""
    module = CALLED.get(name, name.replace("-", "_"))
    return max(spent(sys.executable, "-c", f"import {module}", rounds=rounds)[0] - bare, 0.0)


def dependencies_table(rounds: int, with_times: bool) -> list[str]:
    """One line for each direct dependency of the core, the largest first."""
    direct = sorted(asked_for(PROJECT["dependencies"]))
    every = brought(direct)
    alone = {name: every - brought(set(direct) - {name}) for name in direct}
    lines = ["| dependency | version | its files | what leaves with it | import (processor) |", "|---|---|---|---|---|"]
    bare = spent(sys.executable, "-c", "pass", rounds=rounds)[0] if with_times else 0.0
    for name in sorted(direct, key=lambda n: -total(alone[n] | {n})):
        others = sorted(alone[name] - {name}, key=lambda n: -size(n))
        gone = f"{total(alone[name]):.1f} MB" + (f" (with {', '.join(others)})" if others else "")
        gone = gone if alone[name] else "nothing: others need it"
        took = f"{imported(name, rounds, bare):.2f} s" if with_times else ""
        lines.append(f"| {name} | {distribution(name).version} | {size(name) / MB:.1f} MB | {gone} | {took} |")
    indirect = sorted((name for name in every - set(direct) if size(name) > LARGE * MB), key=lambda n: -size(n))
    for name in indirect:
        lines.append(f"| ({name}, brought by others) | {distribution(name).version} | {size(name) / MB:.1f} MB | | |")
    whole = f"{len(every)} distributions"
    lines.append(f"| **core install** | {whole} | {total(every):.0f} MB | and {own_size():.1f} MB of our own | |")
    return lines


def extras_table() -> list[str]:
    """What each extra adds to the core, as far as it is installed here."""
    core, lines = brought(asked_for(PROJECT["dependencies"])), ["| extra | adds | |", "|---|---|---|"]
    for extra, texts in PROJECT["optional-dependencies"].items():
        asked = asked_for(texts)
        more = brought(asked) - core
        absent = sorted(name for name in asked - more - core)
        words = f"not installed here: {', '.join(absent)}" if absent else ""
        adds = f"{total(more):.0f} MB in {len(more)} distributions" if more else ""
        lines.append(f"| {extra} | {adds} | {words} |")
    return lines


# Start-up ------------------------------------------------------------------------------------------------------------


def ten_thousand(folder: Path) -> Path:
    """A data set of ten runs of 1,000 samples, with the baseline's physics and white noise."""
    from tests.hidden.simulator import Muscle, Noise, Truth, dataset, loops, with_baseline, write

    truth, noise = Truth(Muscle(), with_baseline()), Noise(sd=0.6)
    return write(dataset(truth, [loops(truth, samples=SAMPLES // 10, noise=noise, seed=5)], noise=noise), folder)


def startup_table(rounds: int) -> list[str]:
    """Help, and `compare` on 10,000 samples on its first run and later ones."""
    program = [sys.executable, "-m", "fitting.cli"]
    with tempfile.TemporaryDirectory() as folder:
        os.environ["MCKIBBEN_CACHE"] = str(Path(folder) / "store")
        data = str(ten_thousand(Path(folder) / "data"))
        times = {
            "`python -c pass`": spent(sys.executable, "-c", "pass", rounds=rounds),
            "`mckibben --help`": spent(*program, "--help", rounds=rounds),
            '`python -c "import jax"`': spent(sys.executable, "-c", "import jax", rounds=rounds),
            "`mckibben compare`, 10,000 samples, first run": spent(*program, "compare", data, rounds=1),
            "the same, second run": spent(*program, "compare", data, rounds=rounds),
        }
    lines = ["| command | processor time | on the wall | goal |", "|---|---|---|---|"]
    goals = dict.fromkeys(times, (np.nan, np.nan))
    goals["`mckibben --help`"] = (GOAL_HELP, GOAL_HELP)
    cpu, wall = times['`python -c "import jax"`']
    goals["the same, second run"] = (GOAL_TIMES * cpu + GOAL_MORE, GOAL_TIMES * wall + GOAL_MORE)
    for name, took in times.items():
        goal = "" if np.isnan(goals[name][0]) else f"{goals[name][0]:.2f} s; {goals[name][1]:.2f} s on the wall"
        lines.append(f"| {name} | {took[0]:.2f} s | {took[1]:.2f} s | {goal} |")
    return lines


def main() -> None:
    """Print the tables."""
    asked = argparse.ArgumentParser(prog="python -m tests.benchmarks.sizes", description=(__doc__ or "").split("\n")[0])
    asked.add_argument("--rounds", type=int, default=3, help="of each timing, the least is told (3)")
    asked.add_argument("--no-times", action="store_true", help="sizes alone")
    given = asked.parse_args()
    tables = [dependencies_table(given.rounds, not given.no_times), extras_table()]
    tables += [] if given.no_times else [startup_table(given.rounds)]
    print("\n\n".join("\n".join(lines) for lines in tables))


if __name__ == "__main__":
    main()
