"""A small simulator, written only to try the kit from its page: `python -m tests.hidden.challenge.second_rig FOLDER`.

It shares no line with the other simulator: the pull comes from the volume that a braid of inextensible strands encloses
(Chou and Hannaford 1996, eq 7), friction from the contact surface of Tondu 2012, eq 35. Its instruments err.
"""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

LENGTH, RADIUS, ANGLE = 0.28, 0.009, math.radians(22.0)  # m, m, rad at rest
FRICTION = 0.012  # share of contact surface times pressure
STROKE, RATE = 0.16, 40.0  # largest contraction; readings per second
NOISE = {"pressure": 120.0, "displacement": 1e-5, "force": 0.5}  # Pa, m, N: of one reading
ZERO = {"pressure": 400.0, "displacement": 2e-4, "force": 0.5}  # Pa, m, N: of one run
GAIN = {"pressure": 2e-3, "force": 1e-3}  # of the whole recording
MUSCLE = """name = "second rig"

[muscle]
length      = "280 mm"
radius      = "9.0 +/- 0.1 mm"
braid_angle = "22.0 +/- 0.3 deg"

[[recording]]
file = "loops.csv"
test = "loop"
noise = "0.5 N"

[recording.accuracy]
pressure     = { noise = "120 Pa", zero_per_run = "0.4 kPa", gain = "0.2 %" }
displacement = { noise = "0.01 mm", zero_per_run = "0.2 mm" }
force        = { zero_per_run = "0.5 N", gain = "0.1 %" }
"""


@dataclass(frozen=True)
class Motion:
    """One run: time (s), true pressure (Pa), true shortening (m) and its speed (m/s)."""

    time: np.ndarray
    pressure: np.ndarray
    shortening: np.ndarray
    speed: np.ndarray


Law = Callable[[Motion], np.ndarray]


def pull(motion: Motion) -> np.ndarray:
    """Force of the braided cylinder, N: P (3 l^2 - b^2)/(4 pi n^2)."""
    strand = LENGTH / math.cos(ANGLE)
    turns = LENGTH * math.tan(ANGLE) / (2 * math.pi * RADIUS)
    length = LENGTH - motion.shortening
    return motion.pressure * (3 * length**2 - strand**2) / (4 * math.pi * turns**2)


def friction(motion: Motion) -> np.ndarray:
    """Dry friction of the strands, N: against the motion, by contact surface and pressure."""
    share = 1 - motion.shortening / LENGTH
    surface = 2 * math.pi * RADIUS * LENGTH * math.sin(ANGLE) / (share * np.sqrt(1 - (math.cos(ANGLE) * share) ** 2))
    return -np.sign(motion.speed) * FRICTION * surface * motion.pressure


def spring(motion: Motion) -> np.ndarray:
    """A spring of 600 N/m beside the muscle."""
    return -600.0 * motion.shortening


def drag(motion: Motion) -> np.ndarray:
    """A damper of 500 N s/m beside the muscle."""
    return -500.0 * motion.speed


def teeth(motion: Motion) -> np.ndarray:
    """What no library has: a force of 6 N that comes and goes each 11 mm of the stroke."""
    return 6.0 * np.sin(2 * math.pi * motion.shortening / 0.011)


@dataclass(frozen=True)
class Hidden:
    """What one recording hides: names, whether a library can know them, sizes (SI), and their force."""

    effects: tuple[str, ...] = ()
    in_library: bool = True
    sizes: tuple[tuple[str, float], ...] = ()
    laws: tuple[Law, ...] = ()


CASES = {
    "one": Hidden(),
    "two": Hidden(),
    "three": Hidden(("linear_spring",), sizes=(("linear_spring.K", 600.0),), laws=(spring,)),
    "four": Hidden(("viscous_damping",), sizes=(("viscous_damping.B", 500.0),), laws=(drag,)),
    "five": Hidden(("linear_spring", "viscous_damping"), laws=(spring, drag)),
    "six": Hidden(("teeth",), in_library=False, laws=(teeth,)),
}


def motion(pressure: float, speed: float) -> Motion:
    """Two strokes there and back at one pressure (Pa) and one speed (m/s)."""
    half = STROKE * LENGTH / speed
    time = np.arange(0.0, 4 * half, 1 / RATE)
    phase = (time / half) % 2
    shortening = STROKE * LENGTH * np.minimum(phase, 2 - phase)
    return Motion(time, np.full_like(time, pressure), shortening, np.where(phase < 1, speed, -speed))


def recorded(hidden: Hidden, random: np.random.Generator) -> list[tuple[float, ...]]:
    """Readings of six runs, as rows of the file: run, s, kPa, mm, N."""
    gain = {name: 1 + share * random.standard_normal() for name, share in GAIN.items()}
    rows: list[tuple[float, ...]] = []
    for run, (pressure, speed) in enumerate((p, v) for p in (1e5, 2e5, 3e5) for v in (0.01, 0.03)):
        true = motion(pressure, speed)
        force = pull(true) + friction(true) + sum(law(true) for law in hidden.laws)
        zero = {name: size * random.standard_normal() for name, size in ZERO.items()}
        noise = {name: size * random.standard_normal(len(force)) for name, size in NOISE.items()}
        read = {
            "pressure": (true.pressure * gain["pressure"] + zero["pressure"] + noise["pressure"]) / 1e3,
            "displacement": (true.shortening + zero["displacement"] + noise["displacement"]) * 1e3,
            "force": force * gain["force"] + zero["force"] + noise["force"],
        }
        rows += [(run, *row) for row in np.column_stack([true.time, *read.values()]).tolist()]
    return rows


def make(folder: Path, seed: int) -> None:
    """Write the recordings and truth.json."""
    random = np.random.default_rng(seed)
    for name, hidden in CASES.items():
        place = folder / "recordings" / name
        place.mkdir(parents=True)
        (place / "muscle.toml").write_text(MUSCLE)
        lines = [f"{run:.0f},{s:.4f},{kpa:.3f},{mm:.4f},{n:.3f}" for run, s, kpa, mm, n in recorded(hidden, random)]
        head = "run,time [s],pressure [kPa],displacement [mm],force [N]"
        (place / "loops.csv").write_text("\n".join([head, *lines]) + "\n")
    truth = {
        name: {"effects": list(h.effects), "in_library": h.in_library, "sizes": dict(h.sizes)}
        for name, h in CASES.items()
    }
    (folder / "truth.json").write_text(json.dumps(truth, indent=1) + "\n")


if __name__ == "__main__":
    make(Path(sys.argv[1]), seed=int(sys.argv[2]) if len(sys.argv) > 2 else 1)
