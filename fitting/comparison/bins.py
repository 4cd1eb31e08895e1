"""Sorting samples by a quantity: by its levels where it has a few, else by equal steps."""

from dataclasses import dataclass

import numpy as np

from fitting.comparison.settings import BINS
from fitting.showing import shown_in


@dataclass(frozen=True)
class Bins:
    """Which group each sample is in, and where the groups lie (SI). For levels `lower` and `upper` nearly agree."""

    of: np.ndarray  # group of every sample
    lower: np.ndarray
    upper: np.ndarray
    are_levels: bool

    def __len__(self) -> int:
        return len(self.lower)

    @property
    def centre(self) -> np.ndarray:
        """Middle of each group."""
        return 0.5 * (self.lower + self.upper)

    def label(self, group: int, si: str) -> str:
        """'300 kPa' or '0.02 to 0.08'."""
        unit, size = shown_in(si, float(np.max(np.abs(self.upper))))
        tail = f" {unit}" if unit else ""
        lower, upper = self.lower[group] / size, self.upper[group] / size
        if self.are_levels:
            level = self.centre[group]
            return f"{_rounded(level / size if abs(level) > BINS.zero * np.max(np.abs(self.centre)) else 0.0)}{tail}"
        places = max(0, 1 - int(np.floor(np.log10(max(upper - lower, 1e-12)))))
        return f"{lower:z.{places}f} to {upper:z.{places}f}{tail}"


def bins(values: np.ndarray, steps: int = 6) -> Bins:
    """Levels if the values have at most a dozen, else this many equal steps."""
    starts = _levels(values)
    if starts is not None:
        of = np.searchsorted(starts, values, side="right") - 1
        groups = range(len(starts))
        lower = np.array([values[of == k].min() for k in groups])
        upper = np.array([values[of == k].max() for k in groups])
        return Bins(of, lower, upper, True)
    edges = np.linspace(values.min(), values.max(), steps + 1)
    of = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, steps - 1)
    return Bins(of, edges[:-1], edges[1:], False)


def _levels(values: np.ndarray) -> np.ndarray | None:
    """Where each level starts; None if the values are spread."""
    ordered = np.unique(values)
    span = ordered[-1] - ordered[0]
    if span <= 1e-3 * np.max(np.abs(ordered)) or len(ordered) == 1:
        return ordered[:1]
    cuts = np.flatnonzero(np.diff(ordered) > BINS.apart * span) + 1
    parts = np.split(ordered, cuts)
    if len(parts) > BINS.levels or max(part[-1] - part[0] for part in parts) > BINS.wide * span:
        return None
    return np.array([part[0] for part in parts])


def medians(values: np.ndarray, part: np.ndarray) -> np.ndarray:
    """Each sample's value replaced by the median of its part of a recording: of its run, or its loop."""
    names, of = np.unique(part, return_inverse=True)
    return np.array([np.median(values[of == k]) for k in range(len(names))])[of]


def _rounded(value: float) -> str:
    return f"{value:.3g}" if abs(value) < 1000 else f"{value:.0f}"
