"""Readings that stand alone among their neighbours: disturbances of a wire, and nothing that a muscle does.

Only where signals are slow beside the sampling: in loops, isometric and isotonic tests. In releases and steps
something real may happen between two samples.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.ndimage import median_filter

from fitting.recordings.records import FORCE_TESTS, Run
from fitting.recordings.settings import SPIKES, SpikeSettings

SLOW = ("loop", "isometric", "isotonic")
MOST_LINES = 8  # of a file, that a note names


def without_spikes(runs: Sequence[Run], test: str) -> tuple[list[Run], list[str]]:
    """The runs in which spikes carry no weight, and notes that name the lines of the file where they stand.

    A pressure or a contraction that stands alone is given the median of its neighbours: effects that remember would
    else feel it. What is measured stays as it was read.
    """
    if test not in SLOW:
        return list(runs), []
    found = {name: [spikes(getattr(run, name)) for run in runs] for name in _read(test)}
    cleaned = [_cleaned(run, {name: of[i] for name, of in found.items()}) for i, run in enumerate(runs)]
    notes = [_note(name, runs, of, test) for name, of in found.items() if any(at.any() for at in of)]
    return cleaned, notes


def _read(test: str) -> tuple[str, ...]:
    """The channels that are looked through: a held length is one number, a sweep under a load measures the length."""
    return ("measured", "pressure", "contraction") if test == "loop" else ("measured", "pressure")


def spikes(signal: np.ndarray, settings: SpikeSettings = SPIKES) -> np.ndarray:
    """Samples of a signal that stand alone, a mask (samples,): one or two in a row, far from both sides.

    Far is beyond the noise and beyond what a turning point of the signal makes, two steps from the median of three.
    Where the signal does not come back to where it was, it is a step that overshoots.
    """
    none = np.zeros(len(signal), dtype=bool)
    if len(signal) < settings.fewest or not np.all(np.isfinite(signal)):
        return none
    sides = np.lib.stride_tricks.sliding_window_view(np.pad(signal, 3, mode="reflect"), 7)
    before, after = np.median(sides[:, :3], axis=1), np.median(sides[:, 4:], axis=1)
    usual = median_filter(np.abs(np.diff(signal, append=signal[-1])), settings.near, mode="nearest")
    off = np.abs(signal - (before + after) / 2)
    noise = 1.4826 * float(np.median(off)) + settings.least_share * float(np.max(np.abs(signal)))
    bound = settings.beyond_noise * noise + settings.beyond_steps * usual
    far = (off > bound) & (np.abs(before - after) <= bound)
    far[:3] = far[-3:] = False  # they have neighbours on one side only
    return far if np.count_nonzero(far) <= max(1.0, settings.most * len(signal)) else none


def _cleaned(run: Run, found: dict[str, np.ndarray]) -> Run:
    """The run with its spikes without weight, and signals that laws feel put right."""
    out = replace(run, weight=np.where(np.any(list(found.values()), axis=0), 0.0, run.weight))
    for name in ("pressure", "contraction"):
        if name in found and found[name].any():
            signal = getattr(run, name)
            usual = median_filter(signal, 5, mode="nearest")
            out = replace(out, **{name: np.where(found[name], usual, signal)})
    return out


def _note(name: str, runs: Sequence[Run], found: Sequence[np.ndarray], test: str) -> str:
    """Which readings stand alone, by the lines of the file."""
    lines = np.concatenate([run.row[at] for run, at in zip(runs, found, strict=True)])
    what = ("force" if test in FORCE_TESTS else "position") if name == "measured" else name
    more = f" and {len(lines) - MOST_LINES} more" if len(lines) > MOST_LINES else ""
    where = f"line{'s' * (len(lines) > 1)} {', '.join(map(str, lines[:MOST_LINES]))}{more}"
    many = "reading of {} stands" if len(lines) == 1 else "readings of {} stand"
    return (
        f"{len(lines)} {many.format(what)} alone, far from the readings before and after ({where}): taken for a "
        "disturbance of the wire, without weight"
    )
