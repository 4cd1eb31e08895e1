"""When a muscle is let go: loggers begin to read before that, and call their first reading time 0.

The equation of motion begins at the time 0 of a release. Where a muscle plainly rests until later, or moves before, the
moment is found in the readings: 0.1 s of rest before a release looked like 20 mm of misfit.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fitting import showing, units
from fitting.errors import concerning
from fitting.recordings.motion_signals import noise_level
from fitting.recordings.records import Run
from fitting.recordings.settings import RELEASES


def stated_let_go(text: str | None) -> float | None:
    """When a muscle is let go as muscle.toml states it, s; None where it does not."""
    if text is None:
        return None
    with concerning("let_go"):
        return float(units.to_si(text, "s", "let_go"))


def from_release(r: Run, stated: float | None = None) -> Run:
    """The run with time 0 where the muscle is let go: as it is `stated` (s), else as the readings show."""
    at = let_go_at(r.time, r.contraction) if stated is None else stated
    return replace(r, time=r.time - at) if at else r


def let_go_at(time: np.ndarray, contraction: np.ndarray) -> float:
    """The moment from which a muscle moves, s; 0 where that is not plainly another than time 0.

    From rest under a constant pull the way goes with the square of time: the time is a smooth function of the root of
    the way, and is carried back to where that is 0. `time` and `contraction` are of one run (readings,).
    """
    seen = np.isfinite(contraction) & np.isfinite(time)
    t, x = time[seen], contraction[seen]
    if len(x) < RELEASES.fewest:
        return 0.0
    way = np.abs(x - np.median(x[: RELEASES.resting]))
    noise, whole = noise_level(t, x), float(np.max(way))
    least, most = max(RELEASES.beyond_noise * noise, RELEASES.least * whole), RELEASES.most * whole
    if not least < most:
        return 0.0
    end = int(np.argmax(way > most))
    resting = np.flatnonzero(way[:end] <= least)
    begun = _carried_back(t, way, int(resting[-1]), end) if len(resting) else float(t[0])
    step = float(np.median(np.diff(t)))
    return begun if abs(begun) > max(RELEASES.apart, RELEASES.readings_apart * step) else 0.0


def _carried_back(time: np.ndarray, way: np.ndarray, resting: int, end: int) -> float:
    """When the way was 0, from the first stretch of the motion: behind the last `resting` reading, before `end`."""
    first = slice(resting + 1, end)
    if end - resting - 1 < 3:
        return 0.5 * float(time[resting] + time[resting + 1])
    degree = 2 if end - resting > RELEASES.fewest else 1
    found = np.polynomial.polynomial.polyfit(np.sqrt(way[first]), time[first], degree)[0]
    return float(np.clip(found, time[0], time[resting + 1]))


def let_go_notes(parts: Sequence[Run], runs: Sequence[Run]) -> list[str]:
    """What is said of runs whose time 0 was moved: `parts` as read, `runs` with time 0 where they are let go."""
    moved = [(part.name, float(part.time[0] - run.time[0])) for part, run in zip(parts, runs, strict=True)]
    moved = [(name, at) for name, at in moved if at]
    if not moved:
        return []
    each = ", ".join(f"{showing.show(at, 's', digits=4)} (run {name})" for name, at in moved[: RELEASES.named])
    more = f" and {len(moved) - RELEASES.named} more" if len(moved) > RELEASES.named else ""
    return [
        f"time 0 is where the muscle begins to move, in the file's time {each}{more}; if it is let go at another "
        'time, write let_go = "0 s" (or when it is) below this [[recording]] in muscle.toml'
    ]
