"""The answers that today's habits give to the same cases: information criteria and sparse regression.

Each sees the same candidates. Forward selection refits every set jointly with hidden shapes free, by the program's own
fits, and starts from those that the diagnosis has made; sparse regression chooses among linear signatures at several
shapes, beside slopes of the baseline's parameters that cost nothing, and what it chooses is refitted and pruned by BIC.
Identification of sparse dynamics (SINDy, Brunton et al. 2016) knows no effects: it chooses among products of powers.
Whatever is left is the answer: none of these can say "one of" or "not in the library".
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from .learned import learned

MOST = 3  # effects that forward selection may add
REFITTED = 8  # of the next sets, those that a linear look promises the most of
FOLDS = 5
NAMES = {
    "bic": "forward selection, BIC of independent samples",
    "ar1": "forward selection, BIC of AR(1) errors",
    "told": "forward selection, BIC, told of noise and instruments as the program is",
    "lasso": "sparse regression, lasso path by BIC",
    "omp": "sparse regression, matching pursuit by loops left out",
    "sindy": "thresholded least squares on products of powers (SINDy), by BIC",
    "learned": "a learned function of the state, told of noise and instruments as the program is",
}


def answers(search: Any) -> dict[str, list[str]]:
    """What each rival names; an empty list says that nothing is missing."""
    return {
        "bic": forward(search, independent),
        "ar1": forward(search, autoregressive),
        "told": forward(search, told(search)),
        "lasso": sparse(search, lasso),
        "omp": sparse(search, pursuit),
        "sindy": terms(search),
        "learned": learned(search),
    }


# ------------------------------------------------------------------------------------------------- forward selection


def independent(fit: Any, samples: Any) -> float:
    """n log(rss/n) + k log n."""
    count = len(fit.rows)
    return criterion(float(np.sum(fit.rows**2)), 0.0, fit, count, len(fit.free))


def autoregressive(fit: Any, samples: Any) -> float:
    """The same of the innovations of an AR(1) process, its memory estimated and the fit moved to its optimum."""
    rows, slopes = fit.rows, np.asarray(fit.slopes)
    fresh = np.ones(len(rows), bool)
    fresh[1:] = (np.diff(samples.run) != 0) | (np.diff(samples.half) != 0)
    residual, phi = rows, 0.0
    for _ in range(3):
        before = residual[:-1][~fresh[1:]]
        phi = float(np.clip(before @ residual[1:][~fresh[1:]] / max(before @ before, 1e-300), 0.0, 0.999))
        step = np.linalg.lstsq(innovations(slopes, fresh, phi), -innovations(rows, fresh, phi), rcond=1e-10)[0]
        residual = rows + slopes @ step
    left = float(np.sum(innovations(residual, fresh, phi) ** 2))
    return criterion(left, -float(fresh.sum()) * np.log(1 - phi**2), fit, len(rows), len(fit.free) + 1)


def told(search: Any) -> Callable[[Any, Any], float]:
    """BIC of rows free of what the program takes for noise and for errors of instruments, each fit at its optimum.

    The program compares sets by it that its tests let stand; as a method of its own no rival uses it today, and it
    shows what the tests add.
    """
    from fitting.diagnosis.schwarz import criterion, free_of_noise

    free = free_of_noise(search.examiner.ground(search.base))
    return lambda fit, _: criterion(fit, free)


def innovations(values: np.ndarray, fresh: np.ndarray, phi: float) -> np.ndarray:
    """What a sample brings that the one before did not foretell; a branch's first is scaled to the same variance."""
    out = values * np.sqrt(1 - phi**2)
    out[1:][~fresh[1:]] = values[1:][~fresh[1:]] - phi * values[:-1][~fresh[1:]]
    return out


def criterion(left: float, determinant: float, fit: Any, count: int, free: int) -> float:
    """Schwarz's, with the variance profiled out; stated geometry counts as the data it is."""
    return count * np.log(left / count) + determinant + float(np.sum(fit.prior_rows**2)) + free * np.log(count)


def forward(search: Any, score: Callable[[Any, Any], float]) -> list[str]:
    """Add the effect that lowers the score most, until none does."""
    world, added, here = search.world, frozenset(), search.base
    while len(added) < MOST:
        options = following(search, added, here)
        if not options:
            break
        best = min(options, key=lambda key: score(options[key], world.samples))
        if score(options[best], world.samples) >= score(here, world.samples):
            break
        added, here = best, options[best]
    return sorted(added)


def following(search: Any, added: frozenset[str], here: Any) -> dict[frozenset[str], Any]:
    """Every refitted set with one effect more; what the diagnosis has not fitted is fitted now."""
    world = search.world
    larger = [added | {name} for name in world.candidates if name not in added]
    larger = [key for key in larger if key <= world.with_added(sorted(key))]
    larger = [key for key in larger if world.possible(world.with_added(sorted(key)), sorted(key))]
    missing = [key for key in larger if key not in search.fits and frozenset(key - added) in search.fits]
    missing = sorted(missing, key=lambda key: promised(search, here, min(key - added)))[:REFITTED]
    if missing:
        search.fit_level(missing)
    return {key: search.fits[key] for key in larger if key in search.fits}


def promised(search: Any, here: Any, name: str) -> float:
    """Sum of squares left if the change that an effect makes alone were added in any amount."""
    change = search.fits[frozenset([name])].rows - search.base.rows
    columns = np.column_stack([change, here.slopes])
    step = np.linalg.lstsq(columns, here.rows, rcond=1e-10)[0]
    return float(np.sum((here.rows - columns @ step) ** 2))


# ------------------------------------------------------------------------------------------------- sparse regression


def sparse(search: Any, choose: Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]) -> list[str]:
    """The effects of the columns that a sparse regression gives weight."""
    names, columns, left, groups = regression(search)
    weight = np.abs(choose(columns, left, groups))
    taken = np.flatnonzero(weight > 0)
    return sorted(pruned([names[i] for i in taken], columns[:, taken], left))


def pruned(names: Sequence[str], columns: np.ndarray, left: np.ndarray) -> set[str]:
    """What a least-squares refit keeps when effects whose loss lowers the BIC are dropped one by one."""
    kept = set(names)

    def score(chosen: set[str]) -> float:
        mine = columns[:, [name in chosen for name in names]]
        rest = left - mine @ np.linalg.lstsq(mine, left, rcond=1e-10)[0] if mine.shape[1] else left
        return len(left) * np.log(np.sum(rest**2) / len(left)) + mine.shape[1] * np.log(len(left))

    while kept:
        least = min(sorted(kept), key=lambda name: score(kept - {name}))
        if score(kept - {least}) > score(kept):
            break
        kept -= {least}
    return kept


def regression(search: Any) -> tuple[list[str], np.ndarray, np.ndarray, np.ndarray]:
    """Unit signatures of every candidate beside the baseline's slopes, the misfit, and the loops."""
    from fitting.diagnosis.signatures import signatures

    world, base = search.world, search.base
    possible = [name for name in world.candidates if not world.lacking(world.with_added([name]))]
    wanted = [(name, shape) for name in possible for shape in world.shapes(name)[:3]]
    columns = signatures(world, base, wanted)
    fit = np.all(np.isfinite(columns), axis=0) & np.any(columns != 0, axis=0)
    names, columns = [name for (name, _), good in zip(wanted, fit, strict=True) if good], columns[:, fit]
    slopes = base.slopes[:, np.linalg.norm(base.slopes, axis=0) > 0]
    basis = np.linalg.qr(slopes)[0]
    rest = columns - basis @ (basis.T @ columns)
    seen = np.linalg.norm(rest, axis=0) > 1e-4 * np.linalg.norm(columns, axis=0)
    rest = rest[:, seen] / np.linalg.norm(rest[:, seen], axis=0)
    left = -(base.rows - basis @ (basis.T @ base.rows))
    loops = np.unique(np.stack([world.samples.run, world.samples.loop]), axis=1, return_inverse=True)[1]
    return [name for name, kept in zip(names, seen, strict=True) if kept], rest, left, loops


POWERS = [(i, j) for i in range(4) for j in range(3)]  # of contraction and pressure
THRESHOLDS = np.geomspace(0.01, 0.5, 12)  # of the largest weight of a unit column, below which it is dropped


def terms(search: Any) -> list[str]:
    """The terms of a general language that SINDy keeps: powers of contraction and pressure, with and without motion."""
    world, base = search.world, search.base
    names, columns = language(world.samples)
    slopes = base.slopes[:, np.linalg.norm(base.slopes, axis=0) > 0]
    basis = np.linalg.qr(slopes)[0]
    rest = columns - basis @ (basis.T @ columns)
    size = np.linalg.norm(rest, axis=0)
    seen = size > 1e-3 * np.linalg.norm(columns, axis=0)
    left = -(base.rows - basis @ (basis.T @ base.rows))
    paths = [thresholded(rest[:, seen] / size[seen], left, share) for share in THRESHOLDS]
    nothing = (len(left) * np.log(np.sum(left**2) / len(left)), np.zeros(0, int))
    kept = min([nothing, *paths], key=lambda each: each[0])[1]
    return [np.array(names)[seen][k] for k in kept]


def language(samples: Any) -> tuple[list[str], np.ndarray]:
    """The terms and what they are in force over its noise (rows, terms)."""
    x, p = samples.contraction / samples.contraction.max(), samples.pressure / samples.pressure.max()
    speed = samples.rate / max(np.abs(samples.rate).max(), 1e-300)
    ways = {"": np.ones(len(x)), "sign(v) ": samples.branch, "v ": speed, "|v| ": np.abs(speed)}
    made = {f"{way}x^{i} P^{j}": by * x**i * p**j / samples.sigma for way, by in ways.items() for i, j in POWERS}
    made = {name: column for name, column in made.items() if np.any(column)}
    return list(made), np.stack(list(made.values()), axis=1)


def thresholded(columns: np.ndarray, left: np.ndarray, share: float) -> tuple[float, np.ndarray]:
    """Least squares, the small dropped, again until none is small: the BIC and the columns that are left."""
    kept = np.arange(columns.shape[1])
    while len(kept):
        weights = np.linalg.lstsq(columns[:, kept], left, rcond=1e-10)[0]
        large = np.abs(weights) >= share * np.abs(weights).max()
        if large.all():
            break
        kept = kept[large]
    rest = left - columns[:, kept] @ np.linalg.lstsq(columns[:, kept], left, rcond=1e-10)[0] if len(kept) else left
    return len(left) * np.log(np.sum(rest**2) / len(left)) + len(kept) * np.log(len(left)), kept


def lasso(columns: np.ndarray, left: np.ndarray, _groups: np.ndarray) -> np.ndarray:
    """The point of the lasso path with the least BIC. The path ends where columns that are alike have no order left, of
    which the library warns once a column: the point is chosen from what was followed before."""
    from sklearn.exceptions import ConvergenceWarning
    from sklearn.linear_model import LassoLarsIC

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)
        return LassoLarsIC(criterion="bic", fit_intercept=False).fit(columns, left).coef_


def pursuit(columns: np.ndarray, left: np.ndarray, groups: np.ndarray) -> np.ndarray:
    """Orthogonal matching pursuit, as many columns as foretell loops left out best."""
    from sklearn.linear_model import OrthogonalMatchingPursuitCV
    from sklearn.model_selection import GroupKFold

    folds = list(GroupKFold(min(FOLDS, len(np.unique(groups)))).split(columns, left, groups))
    most = min(10, columns.shape[1])
    return OrthogonalMatchingPursuitCV(fit_intercept=False, cv=folds, max_iter=most).fit(columns, left).coef_
