"""Whether what was named instead can do all that the truth does: then no recording of this kind tells them apart.

The simulator answers, not the program: the named effects are fitted to the truth's own force, without noise.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import least_squares

from .protocols import PROTOCOLS
from .sizes import ABSENT, ALL_TYPICAL, INFINITE, base_of, beside_refit, clean, hiding, scaled, sensible, shape_keys

STARTS = (0.05, 0.5)


def mimic(protocol: str, hidden: dict[str, dict[str, float]], named: Sequence[str], noise_sd: float) -> float:
    """Rms force (N) by which the best of the named effects, and a refitted baseline, miss the hidden ones' force."""
    base = base_of(hidden)
    target = clean(PROTOCOLS[protocol], hiding(base, hidden))[0]

    def rows(place: np.ndarray) -> np.ndarray:
        given = parameters(named, place)
        if not all(sensible(name, one) for name, one in given.items()):
            return np.full(beside_refit(protocol, base, target * 0, noise_sd).size, 1e3)
        force = clean(PROTOCOLS[protocol], hiding(base, given))[0]
        return beside_refit(protocol, base, target - force, noise_sd)

    found = []
    for start in starts(named):
        best = least_squares(rows, start, x_scale=0.1, diff_step=1e-4, max_nfev=40)
        found.append(float(np.sqrt(np.mean(best.fun**2))))
    return min(found)


def starts(named: Sequence[str]) -> list[np.ndarray]:
    """Small and middling sizes, of either sign where that makes sense; shapes as they are typically."""
    signs = [1.0, -1.0] if all(two_sided(name) for name in named) else [1.0]
    shapes = [0.0 for name in named for _ in shape_keys(name)]
    return [np.array([sign * size] * len(named) + shapes) for size in STARTS for sign in signs]


def two_sided(name: str) -> bool:
    """Whether an effect may be there with the other sign."""
    return INFINITE not in ABSENT.get(name, {}).values() and sensible(name, scaled(name, -0.05, {}))


def parameters(named: Sequence[str], place: np.ndarray) -> dict[str, dict[str, float]]:
    """Sizes first, then logarithms of the shapes' multiples."""
    shapes = iter(place[len(named) :])
    given = {}
    for name, size in zip(named, place, strict=False):
        multiples = {key: float(np.exp(np.clip(next(shapes), -3, 3))) for key in shape_keys(name)}
        own = float(size) if two_sided(name) else max(float(abs(size)), 1e-4)
        given[name] = scaled(name, own, multiples)
    assert set(given) <= set(ALL_TYPICAL)
    return given
