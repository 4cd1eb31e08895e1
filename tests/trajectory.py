"""The trajectory on which every form of an exported muscle is compared with the module of plain numpy."""

import numpy as np

STEP = 2e-3  # s


def trajectory(length: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time (s), pressure (Pa) and displacement (m) of 1.2 s: reversals, standing still, ramps and steps of pressure."""
    time = np.arange(600) * STEP
    turns = np.array([0.0, 0.2, 0.2, 0.08, 0.15, 0.04, 0.04, 0.22, 0.0])
    at = np.array([0.0, 0.2, 0.3, 0.45, 0.6, 0.75, 0.85, 1.05, 1.2])
    contraction = np.interp(time, at, turns) + 0.003 * np.sin(40 * time) * (time > 0.45) * (time < 0.75)
    pressure = np.interp(time, [0, 0.4, 0.7, 1.2], [2e5, 3e5, 3e5, 1e5])
    pressure = np.where(time > 0.25, pressure + 1.5e5, pressure)  # a step while it stands, and one while it moves
    return time, np.where(time > 0.95, pressure - 1e5, pressure), contraction * length
