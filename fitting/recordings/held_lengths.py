"""Stretches of a recording in which a muscle was held at one length: each is a run of an isometric test.

A rig may jump from one length to the next, or move there slowly; what it reads on the way belongs to no run.
"""

import numpy as np

from fitting.recordings.settings import TABLES

STANDS = 0.25  # of what a held length may wander: the middle half of a stretch that stands; of a ramp it is a half
LEAST, MOST_LEVELS = 0.02, 50  # share of the readings at one length; lengths of one recording: chosen
MOSTLY = 0.5  # of the readings, that stand: else the length is not held; chosen
SWEPT = 0.5  # of the range of pressure, that is swept at each length; chosen


def held_stretches(contraction: np.ndarray, pressure: np.ndarray) -> list[np.ndarray]:
    """The positions of each stretch at one length, of contractions and pressures (samples,) in the order of time.

    A new one begins where the length jumps by more than a wandering sensor does. What then wanders too far is cut where
    it moves, if it mostly stands, at two lengths or more, and the pressure is swept at each. A rig that gives way where
    the pressure steps moves with the pressure; it is left as it is, for it holds no length.
    """
    everything = np.arange(len(contraction))
    jumps = np.flatnonzero(np.abs(np.diff(contraction)) > TABLES.held / 2) + 1
    parts = [part for part in np.split(everything, jumps) if len(part) >= TABLES.fewest_samples]
    return [stretch for part in parts or [everything] for stretch in _standing(contraction, pressure, part)]


def wanders(contraction: np.ndarray) -> bool:
    """Whether a length moves by more than a held one may, but for a few readings."""
    return len(contraction) > 0 and bool(np.ptp(np.quantile(contraction, [0.02, 0.98])) > TABLES.held)


def _standing(contraction: np.ndarray, pressure: np.ndarray, part: np.ndarray) -> list[np.ndarray]:
    """The part itself where its length is held, or where nobody held it; else the stretches in which it stands."""
    if not wanders(contraction[part]):
        return [part]
    level = _level_of(contraction[part])
    pieces = np.split(np.arange(len(part)), np.flatnonzero(np.diff(level)) + 1)
    kept = [at for at in pieces if level[at[0]] >= 0 and len(at) >= TABLES.fewest_samples]
    stands = [at for at in kept if _spread(contraction[part][at]) < STANDS * TABLES.held]
    swept = all(_range(pressure[part][at]) >= SWEPT * _range(pressure[part]) for at in stands)
    several = len({int(level[at[0]]) for at in stands}) > 1
    mostly = sum(map(len, stands)) > MOSTLY * len(part)
    return [part[at] for at in stands] if several and swept and mostly else [part]


def _level_of(contraction: np.ndarray) -> np.ndarray:
    """Which of the lengths where most readings lie each reading is at (samples,), or -1: none of them."""
    found, level = np.sort(contraction), np.full(len(contraction), -1)
    for number in range(MOST_LEVELS):
        inside = np.searchsorted(found, found + TABLES.held, "right") - np.arange(len(found))
        if not len(found) or inside.max() < LEAST * len(contraction):
            break
        at = int(np.argmax(inside))
        middle = np.median(found[at : at + inside[at]])
        level[(level < 0) & (np.abs(contraction - middle) <= TABLES.held / 2)] = number
        found = found[np.abs(found - middle) > TABLES.held / 2]
    return level


def _range(values: np.ndarray) -> float:
    known = values[np.isfinite(values)]
    return float(np.ptp(known)) if len(known) else 0.0


def _spread(values: np.ndarray) -> float:
    return float(np.ptp(np.quantile(values, [0.25, 0.75])))
