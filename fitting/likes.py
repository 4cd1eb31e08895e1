"""Explanations that these data cannot tell apart, special cases of each other, and the one that leads."""

from collections.abc import Mapping, Sequence

import numpy as np

from fitting import held_out
from fitting.diagnosis import Leading
from fitting.examine import Examiner
from fitting.universe import Trial, Universe

SAME = 0.05  # of the noise: a set that follows another's prediction this closely contains it
CLEARLY = 2.0  # standard errors


def contains(world: Universe, larger: Trial, smaller: Trial, noise: float) -> bool:
    """Whether one fitted set can predict all that another predicts."""
    followed = world.mimicking(smaller).fit(larger.effects, larger.vector)
    return held_out.rms(followed.rows) < SAME * noise


def simplest(
    world: Universe, adequate: Sequence[frozenset[str]], trials: Mapping[frozenset[str], Trial], noise: float
) -> tuple[list[frozenset[str]], tuple[tuple[str, ...], ...]]:
    """Adequate sets without those that contain a simpler adequate one, and the classes of exact likes."""
    order = sorted(adequate, key=lambda added: (len(trials[added].free), trials[added].cost))
    kept: list[frozenset[str]] = []
    classes: dict[frozenset[str], list[frozenset[str]]] = {}
    for added in order:
        host = next((k for k in kept if contains(world, trials[added], trials[k], noise)), None)
        if host is None:
            kept.append(added)
            classes[added] = [added]
        elif len(trials[added].free) == len(trials[host].free):
            classes[host].append(added)
    alike = [members for members in classes.values() if len(members) > 1]
    named = sorted((member for members in classes.values() for member in members), key=order.index)
    return named, tuple(tuple("+".join(sorted(member)) for member in members) for members in alike)


def leading_of(
    world: Universe, base: Trial, trials: Mapping[frozenset[str], Trial], examiner: Examiner
) -> Leading | None:
    """The single effect that lowers the left-out error by clearly more than any other, or None."""
    singles = [added for added in trials if len(added) == 1]
    rows = {added: examiner.left_out(trials[added]) for added in singles}
    order = sorted(singles, key=lambda added: held_out.rms(rows[added]))
    if not order:
        return None
    best = order[0]
    floor = held_out.rms(base.rows) * 0.1
    contenders = [added for added in order[:6] if not _clearly(rows[added], rows[best], examiner.groups)]
    first = min(contenders, key=lambda added: (len(trials[added].free), order.index(added)))
    noise = max(held_out.rms(trials[best].rows), floor)
    if any(not contains(world, trials[other], trials[first], noise) for other in contenders if other != first):
        return None
    likes = [added for added in contenders if len(trials[added].free) == len(trials[first].free)]
    if not _clearly(examiner.left_out(base), rows[first], examiner.groups):
        return None
    others = [added for added in order if added not in contenders]
    whole, left = np.mean(examiner.left_out(base) ** 2), np.mean(rows[first] ** 2)
    return Leading(
        tuple(sorted(min(added) for added in likes)),
        float(1 - left / whole),
        world.rmse(rows[first]),
        world.rmse(rows[others[0]]) if others else world.rmse(examiner.left_out(base)),
    )


def _clearly(worse: np.ndarray, better: np.ndarray, groups: np.ndarray) -> bool:
    fall, error = held_out.difference(worse, better, groups)
    return fall > CLEARLY * error
