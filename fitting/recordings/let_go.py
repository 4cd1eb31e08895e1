"""When a muscle is let go: loggers begin to read before that, and call their first reading time 0.

The equation of motion begins at the time 0 of a release. Where a muscle plainly rests until later, or moves before, the
moment is found in the readings: 0.1 s of rest before a release looked like 20 mm of misfit.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fitting import showing, units
from fitting.errors import InputError, concerning
from fitting.recordings.motion_signals import noise_level
from fitting.recordings.records import Run
from fitting.recordings.settings import RELEASES


def stated_let_go(text: str | None, test: str) -> float | None:
    """When a muscle is let go as muscle.toml states it, s; None where it does not."""
    if text is None:
        return None
    with concerning("let_go"):
        if test != "quick release":
            cure = "leave let_go out"
            raise InputError(f"a muscle is let go in a quick release, and this is a '{test}'", value=text, cure=cure)
        return float(units.to_si(text, "s", "let_go"))


def from_release(r: Run, stated: float | None = None) -> Run:
    """The run with time 0 where the muscle is let go: as it is `stated` (s), else as the readings show."""
    at = let_go_at(r.time[r.usable], r.contraction[r.usable]) if stated is None else stated
    return replace(r, time=r.time - at) if at else r


def let_go_at(time: np.ndarray, contraction: np.ndarray) -> float:
    """The moment from which a muscle moves, s; 0 where that is not plainly another than time 0.

    From rest under a constant pull the way goes with the square of time: the time is a smooth function of the root of
    the way, and is carried back to where that is 0. `time` and `contraction` are of one run (readings,), without gaps.
    Nothing is found where the muscle was not seen at rest, where it drifts before, or where the position is so noisy
    that the beginning of the motion cannot be seen.
    """
    if len(contraction) < RELEASES.fewest:
        return 0.0
    way = np.abs(contraction - np.median(contraction[: RELEASES.resting]))
    whole = float(np.quantile(way, RELEASES.whole))
    least = max(RELEASES.beyond_noise * noise_level(time, contraction), RELEASES.least * whole)
    most = RELEASES.most * whole
    moving = way > most
    moving = moving[:-2] & moving[1:-1] & moving[2:]  # one reading alone is a fault of the sensor
    if RELEASES.clear * least > most or not moving.any():
        return 0.0
    end = int(np.argmax(moving))
    resting = np.flatnonzero(way[:end] <= least)
    begun = _carried_back(time, way, int(resting[-1]), end) if len(resting) else 0.0
    step = float(np.median(np.diff(time)))
    return begun if abs(begun) > max(RELEASES.apart, RELEASES.readings_apart * step) else 0.0


def _carried_back(time: np.ndarray, way: np.ndarray, resting: int, end: int) -> float:
    """When the way was 0, from the first stretch of the motion: behind the last `resting` reading, before `end`.

    0 where the stretch is no such motion, for readings lie off it by more than half a sampling interval; and where they
    would lie hardly further off if it had begun at 0.
    """
    first = slice(resting + 1, end)
    if end - resting - 1 < 3:
        return 0.5 * float(time[resting] + time[resting + 1])
    root = np.sqrt(way[first])
    powers = np.stack([np.ones_like(root), root, root**2][: 3 if end - resting > RELEASES.fewest else 2], axis=1)
    begun, off = _fitted(powers, time[first])
    if off > RELEASES.off * float(np.median(np.diff(time[resting : end + 1]))) + RELEASES.jitter:
        return 0.0
    if _fitted(powers[:, 1:], time[first])[1] < RELEASES.worse * off:
        return 0.0
    return float(np.clip(begun, time[0], time[resting + 1]))


def _fitted(powers: np.ndarray, time: np.ndarray) -> tuple[float, float]:
    """The first coefficient of a least-squares fit of times, and how far they lie off it in root mean square, s."""
    coefficients = np.linalg.lstsq(powers, time, rcond=None)[0]
    return float(coefficients[0]), float(np.sqrt(np.mean((time - powers @ coefficients) ** 2)))


def let_go_notes(parts: Sequence[Run], runs: Sequence[Run]) -> list[str]:
    """What is said of runs whose time 0 was moved: `parts` as read, `runs` with time 0 where they are let go."""
    moved = [(part.name, float(part.time[0] - run.time[0])) for part, run in zip(parts, runs, strict=True)]
    moved = [(name, at) for name, at in moved if at]
    if not moved:
        return []
    each = ", ".join(f"{showing.show(at, 's', digits=4)} (run {name})" for name, at in moved[: RELEASES.named])
    more = f" and in {len(moved) - RELEASES.named} more runs" if len(moved) > RELEASES.named else ""
    return [
        f"the muscle begins to move at {each}{more} of the file's time, and that is time 0 from here on; if it was let "
        'go at another moment, state that below this [[recording]] in muscle.toml: let_go = "0 s"'
    ]
