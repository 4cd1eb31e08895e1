"""Declared units as exponents of metre, kilogram and second: what a change of the units' size does to a number."""

import re

import numpy as np

EXPONENTS = {
    "1": (0, 0, 0), "rad": (0, 0, 0), "m": (1, 0, 0), "kg": (0, 1, 0), "s": (0, 0, 1), "N": (1, 1, -2),
    "Pa": (-1, 1, -2), "J": (2, 1, -2),
}  # fmt: skip


def exponents(unit: str) -> np.ndarray:
    """Exponents of m, kg, s of a unit such as "N s/m": factors stand side by side, all after the slash divide."""
    total = np.zeros(3)
    above, _, below = unit.partition("/")
    for part, sign in ((above, 1), (below, -1)):
        for factor in part.split():
            symbol, power = re.fullmatch(r"([A-Za-z]+|1)(?:\^(-?\d+))?", factor).groups()
            total += sign * int(power or 1) * np.array(EXPONENTS[symbol])
    return total


def rescaling(random: np.random.Generator, kept: tuple[str, ...] = ()):
    """Random new sizes of metre, kilogram and second that leave the units `kept` as they are: unit -> factor."""
    logs = random.normal(0, 0.7, 3)
    if kept:
        fixed = np.array([exponents(unit) for unit in kept])
        logs -= np.linalg.pinv(fixed) @ fixed @ logs
    return lambda unit: float(np.exp(exponents(unit) @ logs))
