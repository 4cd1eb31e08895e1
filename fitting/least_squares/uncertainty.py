"""How well a fit knows its parameters: covariance, which are at a bound, which are strongly correlated."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fitting.instruments.errors import InstrumentErrors
from fitting.problem.residuals import Samples
from fitting.problem.unknowns import Unknowns


@dataclass(frozen=True)
class ErrorSettings:
    """Settings of standard errors. Where no source is named they were chosen."""

    enough_runs: int = 8  # fewer say too little about what runs share
    alone: float = 0.9  # share of the information on a direction: a cluster with more cannot be judged by others
    collinearity: float = 20.0  # index above which parameters are strongly correlated (Brun, Reichert & Kuensch 2001)
    large_part: float = 0.3  # part of a parameter in a weak direction (a unit vector) from which it counts as in it
    at_end: float = 1e-6  # of a range: closer to an end than this is at the end


SETTINGS = ErrorSettings()


def clusters(samples: Samples, slopes: np.ndarray) -> np.ndarray:
    """Number (rows,) of the cluster that each row belongs to, within which errors are correlated.

    A cluster is a run; it is a closed loop where runs are few, or where one run alone decides a parameter. The fit then
    follows that run, so that its errors show in the differences between its loops alone. Where runs are
    many, points of a static curve, each of which is a loop of its own, stay in their run: they err together.
    `slopes` (rows, and those of priors if any; k) are those of the free parameters in standard deviations.
    """
    runs = np.unique(samples.run, return_inverse=True)[1]
    loops = np.unique(np.stack([samples.run, samples.loop]), axis=1, return_inverse=True)[1]
    if runs.max(initial=-1) + 1 < SETTINGS.enough_runs:
        return loops
    root = _root_of_inverse(slopes.T @ slopes)
    data = slopes[: len(runs)] @ root
    decides = np.array([_by_loops(data[runs == run], loops[runs == run]) for run in range(runs.max() + 1)])
    return np.unique(np.where(decides[runs], len(decides) + loops, runs), return_inverse=True)[1]


def _by_loops(data: np.ndarray, loops: np.ndarray) -> bool:
    """Whether a run alone decides something, and has loops of more than one point to judge that by."""
    return len(np.unique(loops)) < len(loops) and np.linalg.norm(data, 2) ** 2 > SETTINGS.alone


def spread_of_values(
    layout: Unknowns, names: Sequence[str], samples: Samples, rows: np.ndarray, slopes: np.ndarray,
    errors: InstrumentErrors | None = None,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Covariances of the named unknowns, as if samples were independent, and robust: see `covariances`.

    `rows` and `slopes` (along the unknowns, SI) are in standard deviations, those of priors below the measurements'.
    """
    count, cluster = len(samples), clusters(samples, slopes)
    parts = slopes[:count], rows[:count], slopes[count:], cluster
    stated = np.array([layout.entry(name).is_confined for name in names], dtype=bool)
    return beside_stated(*parts, stated, errors) if stated.any() else covariances(*parts, errors)


def repeatable_spread(
    layout: Unknowns, names: Sequence[str], samples: Samples, rows: np.ndarray, slopes: np.ndarray
) -> np.ndarray:
    """Robust covariance of the named unknowns for more readings of this muscle on this rig; as `spread_of_values`.

    Instruments then err as they did before. A size that is confined to what was stated stays where it is, however far
    it is from the true one: the other parameters were fitted beside it.
    """
    count, cluster = len(samples), clusters(samples, slopes)
    varies = np.array([not layout.entry(name).is_confined for name in names], dtype=bool)
    _, robust = covariances(slopes[:count][:, varies], rows[:count], slopes[count:][:, varies], cluster)
    whole = np.zeros((len(names), len(names)))
    whole[np.ix_(varies, varies)] = robust
    return whole


@np.errstate(over="ignore", invalid="ignore")  # of what changes readings by 1e-140 the error is infinite or no number
def covariances(
    data: np.ndarray,
    rows: np.ndarray,
    priors: np.ndarray,
    cluster: np.ndarray,
    errors: InstrumentErrors | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Covariance of the free parameters: as if samples were independent, and robust to all errors that are shared.

    The robust one is what leaving out each cluster in turn would give (CR3: Bell & McCaffrey 2002); the plain sandwich
    is too small where clusters are few. What instruments make of a run shows in the differences between runs: no
    parameter's variance is below what independent samples and such `errors` give. What instruments do alike in all runs
    no recording shows: it is added.
    """
    freedom = max(len(rows) - data.shape[1], 1)
    variance = max(np.sum(rows**2) / freedom, 1e-30)  # of rows that fit exactly
    known = priors.T @ priors
    root = _root_of_inverse(data.T @ data / variance + known)  # coordinates in which the first covariance is 1
    scores, shares = _by_cluster(data @ root / np.sqrt(variance), rows / np.sqrt(variance), cluster)
    strength, along = np.linalg.eigh(shares)
    grown = np.einsum("gji,gj->gi", along, scores) / (1 - np.clip(strength, 0.0, SETTINGS.alone))
    left_out = np.einsum("gij,gj->gi", along, grown)
    plain = root @ root.T
    robust = root @ (left_out.T @ left_out + root.T @ known @ root) @ root.T
    least, common = plain, np.zeros_like(plain)
    if errors is not None:
        own, shared = moved_by(errors, data, priors)
        least = plain + np.einsum("pre,qre->pq", own, own)
        common = shared @ shared.T
    lacking = np.sqrt(np.maximum(1 - np.diag(robust) / np.maximum(np.diag(least), 1e-300), 0.0))
    return plain, robust + least * np.outer(lacking, lacking) + common


def misfit_of_all(rows: np.ndarray) -> float:
    """What all readings together are missed by, in standard deviations of one: the root of their sum of squares.

    Readings with this noise say of a size that a change of it is one standard error where it changes them by as much,
    in root mean square, as the model misses them by. A wrong law misses every loop alike: more readings tell no more.
    """
    return float(max(np.linalg.norm(rows), 1e-15))


def beside_stated(
    data: np.ndarray,
    rows: np.ndarray,
    priors: np.ndarray,
    cluster: np.ndarray,
    stated: np.ndarray,
    errors: InstrumentErrors | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """The same where a free fit would deny a size of the muscle; `stated` (k,) tells which parameters are such sizes.

    They are known as by what was stated and by readings that say as little as `misfit_of_all` has it: a radius and an
    angle that the readings tie to each other stay tied, and each of them is hardly better known than it was stated. All
    other parameters have the covariance that they have with these sizes held, and move with them as the optimum does.
    """
    noise, others, moved = misfit_of_all(rows), ~stated, moved_by_sizes(data, priors, stated)
    root = _root_of_inverse(data.T @ data / noise**2 + priors.T @ priors)
    by_sizes = moved @ (root[stated] @ root[stated].T) @ moved.T
    found = []
    for covariance in covariances(data[:, others], rows, priors[:, others], cluster, errors):
        whole = by_sizes.copy()
        whole[np.ix_(others, others)] += covariance
        found.append(whole)
    return found[0], found[1]


def moved_by_sizes(data: np.ndarray, priors: np.ndarray, stated: np.ndarray) -> np.ndarray:
    """How far all parameters move (k, sizes) with each `stated` (k,) size, to first order; slopes as `covariances`."""
    others = ~stated
    root = _root_of_inverse(data[:, others].T @ data[:, others] + priors[:, others].T @ priors[:, others])
    moved = np.zeros((len(stated), int(stated.sum())))
    moved[stated] = np.eye(moved.shape[1])
    moved[others] = -root @ root.T @ (data[:, others].T @ data[:, stated] + priors[:, others].T @ priors[:, stated])
    return moved


def moved_by(errors: InstrumentErrors, data: np.ndarray, priors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """How far the optimum moves by one standard deviation of each error of an instrument, to first order.

    Of errors that each run has for itself (parameters, runs, errors), of those that all runs share (parameters,
    errors). `data` (rows, parameters) and `priors` are slopes in standard deviations.
    """
    root = _root_of_inverse(data.T @ data + priors.T @ priors)
    normal = root @ root.T
    runs = [np.flatnonzero(errors.run == one) for one in np.unique(errors.run)]
    own = np.stack([data[at].T @ errors.per_run[at] for at in runs], axis=1)
    return np.einsum("pq,qre->pre", normal, own), normal @ (data.T @ errors.shared)


def _by_cluster(slopes: np.ndarray, rows: np.ndarray, cluster: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Gradient (clusters, p) and curvature (clusters, p, p) of each cluster."""
    order = np.argsort(cluster, kind="stable")
    parts = np.split(order, np.flatnonzero(np.diff(cluster[order])) + 1)
    gradient = np.stack([slopes[part].T @ rows[part] for part in parts])
    return gradient, np.stack([slopes[part].T @ slopes[part] for part in parts])


def _root_of_inverse(matrix: np.ndarray) -> np.ndarray:
    """R with R R^T the inverse, without directions of which nothing is known."""
    scale = 1 / np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    strength, along = np.linalg.eigh(matrix * np.outer(scale, scale))
    seen = strength > 1e-14 * strength.max(initial=0.0)
    return scale[:, None] * along * np.where(seen, 1 / np.sqrt(np.where(seen, strength, 1.0)), 0.0)


def at_bound(names: Sequence[str], place: np.ndarray) -> tuple[str, ...]:
    """Those of the free names that ended at an end of their range."""
    return tuple(name for name, p in zip(names, place, strict=True) if p < SETTINGS.at_end or p > 1 - SETTINGS.at_end)


def ties(names: Sequence[str], slopes: np.ndarray) -> dict[str, tuple[str, ...]]:
    """Which parameters are strongly correlated, not separately identifiable: collinearity index above 20."""
    if len(names) < 2:
        return {}
    unit = slopes / np.maximum(np.linalg.norm(slopes, axis=0), 1e-300)
    strength, direction = np.linalg.eigh(unit.T @ unit)
    tied: dict[str, set[str]] = {}
    for value, vector in zip(strength, direction.T, strict=True):
        if value < 1 / SETTINGS.collinearity**2:
            group = [name for name, share in zip(names, vector, strict=True) if abs(share) > SETTINGS.large_part]
            for name in group:
                tied.setdefault(name, set()).update(other for other in group if other != name)
    return {name: tuple(sorted(others)) for name, others in tied.items() if others}
