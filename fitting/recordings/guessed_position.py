"""How a rig counts the position of its muscle, as its readings betray it: which way, and from where."""

import numpy as np

from fitting.recordings.tables import Table

SIGNED = ("displacement", "contraction")  # positions that have a sign
ABOVE_REST = 0.1  # of a stroke below 0, that a muscle may read above 0: noise, and a zero that is not quite at rest
FOLLOWS, HELD_PRESSURE = 0.8, 0.2  # correlation with a position, share of the pressure it may change by
ELSEWHERE = (
    1.0  # strokes from rest, beyond which 0 lies elsewhere: few benches begin where a muscle has shortened so far
)


def is_turned(table: Table, position: str) -> bool:
    """Whether lengthening is positive in a loop: the position moves as no muscle would, or lies below 0.

    The force of a muscle falls as it shortens at a held pressure; where the pressure is swept, it shortens as that
    rises, whatever it pulls at. If neither tells: no muscle is longer than at rest all the time.
    """
    if not {position, "force", "pressure"} <= {*table.columns}:
        return False
    signals = np.stack([table[name] for name in (position, "force", "pressure")])
    place, force, pressure = signals[:, np.isfinite(signals).all(axis=0)]
    if not len(place) or not np.ptp(place) > 0 or not np.ptp(force) > 0 or np.median(force) <= 0:
        return False
    is_swept = np.ptp(np.quantile(pressure, [0.01, 0.99])) > HELD_PRESSURE * np.max(np.abs(pressure))
    follows = float(np.corrcoef(place, -pressure if is_swept else force)[0, 1])
    if abs(follows) > FOLLOWS:
        return follows > 0
    return bool(np.max(place) < ABOVE_REST * -np.min(place))


def is_elsewhere(table: Table, position: str, turned: bool) -> bool:
    """Whether the sensor's 0 is not where the muscle is at rest: it reads more there than the muscle ever moves."""
    if position != "displacement" or position not in table:  # a contraction is counted from rest
        return False
    place = table[position][np.isfinite(table[position])]
    if not len(place):
        return False
    at_rest = np.max(place) if turned else np.min(place)
    return bool(abs(at_rest) > ELSEWHERE * np.ptp(place) > 0)
