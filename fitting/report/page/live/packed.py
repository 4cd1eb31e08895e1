"""Numbers as text that a page can hold: each as few bytes as it needs, in base64."""

from base64 import b64encode
from typing import Any

import numpy as np

TYPES = ("u1", "u2", "u4")
STEPS = 65535  # of a quantity that is only read off: finer than any instrument resolves


def floats(values: np.ndarray) -> dict[str, Any]:
    """Values as they are, to seven digits."""
    return _packed(values, "f4")


def counts(values: np.ndarray) -> dict[str, Any]:
    """Whole numbers from 0 on, exactly."""
    kind = next(k for k in TYPES if np.max(values, initial=0) <= np.iinfo(k).max)
    return _packed(values, kind)


def read_off(values: np.ndarray) -> dict[str, Any] | None:
    """Values in 65,535 steps from the smallest to the largest; as they are where some are unknown; None of none."""
    known = np.isfinite(values)
    if not known.all():
        return floats(values) if known.any() else None
    if not len(values):
        return None
    low, step = float(values.min()), float(np.ptp(values)) / STEPS or 1.0
    return _packed(np.rint((values - low) / step), "u2") | {"low": low, "step": step}


def _packed(values: np.ndarray, kind: str) -> dict[str, Any]:
    return {"type": kind, "bytes": b64encode(np.asarray(values).astype(f"<{kind}").tobytes()).decode()}
