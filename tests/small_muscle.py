"""A small muscle measured by nobody: loops from closed forms, written as a user's folder would be."""

from pathlib import Path

import numpy as np

LENGTH, RADIUS, ANGLE = 0.25, 0.008, np.radians(23.0)
MUSCLE = """name = "{name}"
[muscle]
length = "250 mm"
radius = "8.0 +/- 0.1 mm"
braid_angle = "23 +/- 0.3 deg"
wall_thickness = "0.6 mm"
[[recording]]
file = "loops.csv"
test = "loop"
{extra}
"""


def ideal(contraction, pressure):
    """The ideal law (eq 10), N."""
    a, b = 3 / np.tan(ANGLE) ** 2, 1 / np.sin(ANGLE) ** 2
    return np.pi * RADIUS**2 * pressure * (a * (1 - contraction) ** 2 - b)


def surface(contraction):
    """Contact surface (eq 35), m^2."""
    ratio = np.sqrt(1 - (np.cos(ANGLE) * (1 - contraction)) ** 2) / np.sin(ANGLE)
    return 2 * np.pi * RADIUS * LENGTH / (ratio * (1 - contraction))


def loops(missing=lambda eps, pressure, sign: 0.0, noise=0.3, pressures=(1e5, 2e5, 4e5), repeats=3, points=60, seed=0):
    """Rows (run, time, pressure, displacement, force): Coulomb friction and what is `missing`, repeated loops."""
    scatter, rows = np.random.default_rng(seed), []
    there, back = np.linspace(0, 0.2, points)[1:], np.linspace(0.2, 0, points)[1:]
    course = np.concatenate([[0.0], *[there, back] * repeats])
    for run, pressure in enumerate(pressures):
        sign = np.sign(np.gradient(course))
        force = ideal(course, pressure) - 0.012 * surface(course) * pressure * sign - missing(course, pressure, sign)
        force = force + scatter.normal(0, noise, len(course))
        time = 0.05 * np.arange(len(course))
        rows += [(run, t, pressure, x * LENGTH, f) for t, x, f in zip(time, course, force, strict=True)]
    return rows


def write(folder: Path, rows, name="Small muscle", extra='noise = "0.3 N"') -> Path:
    """The folder of a data set."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "muscle.toml").write_text(MUSCLE.format(name=name, extra=extra), encoding="utf-8")
    lines = [f"{r},{t:.3f},{p / 1e3:.3f},{x * 1e3:.5f},{f:.5f}" for r, t, p, x, f in rows]
    head = "run,time [s],pressure [kPa],displacement [mm],force [N]"
    (folder / "loops.csv").write_text("\n".join([head, *lines]) + "\n", encoding="utf-8")
    return folder
