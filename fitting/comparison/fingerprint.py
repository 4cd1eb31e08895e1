"""What kind of thing is missing: the traces that a misfit leaves, whatever its law.

A fit hides part of what it lacks: its own parameters move until the misfit is least. So the exponents are not read
off the residual itself, but off what is left of each power law after the fit's parameters have readjusted: the
exponent is the one whose power law, with any shape in contraction, takes most of the misfit away.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fitting.comparison.settings import FINGERPRINT
from fitting.least_squares.decomposed import svd
from fitting.least_squares.record import Fit
from fitting.problem.residuals import Samples


@dataclass(frozen=True)
class Fingerprint:
    """Shares and exponents; None where the data do not define them."""

    odd_share: float | None
    pressure_exponent_even: float | None
    pressure_exponent_odd: float | None
    speed_exponent_odd: float | None
    cycle_drift: float | None  # change from one loop to its repetition, as a share of the misfit


@dataclass(frozen=True)
class Rows:
    """Whitened residuals and the fit's slopes, thinned; behind the samples come the priors."""

    samples: Samples
    residual: np.ndarray
    basis: np.ndarray  # orthonormal columns that span what the fit's parameters can do


@dataclass(frozen=True)
class Exponent:
    """The exponent that takes most of the misfit away, and whether the data know it."""

    value: float
    known: bool


def exponents(fit: Fit, mask: np.ndarray) -> tuple[float | None, float | None, float | None]:
    """Pressure exponents of the even and the odd part, and the speed exponent of the odd part."""
    rows = _rows(fit, mask)
    pressure = _relative(rows.samples.pressure)
    branch = rows.samples.branch.astype(float)
    course = _course(rows, np.ones(len(branch)))
    even = _best(rows, lambda n: course * _power(pressure, n)[:, None], FINGERPRINT.pressure_grid, pressure)
    if not (np.any(branch > 0) and np.any(branch < 0)):
        return _told(even), None, None
    return _told(even), *map(_told, _of_friction(rows, pressure, branch))


def _of_friction(rows: Rows, pressure: np.ndarray, branch: np.ndarray) -> tuple[Exponent | None, Exponent | None]:
    """In pressure and in speed. Each is looked for beside the best of the other, sure or not: what one leaves hides
    the other."""
    shape, speed = _course(rows, branch), _relative(np.abs(rows.samples.rate))
    odd = fast = None
    for _ in range(FINGERPRINT.rounds):
        moving = branch * _power(speed, fast.value if fast else 0.0)
        bent = lambda n, by=moving: shape * (by * _power(pressure, n))[:, None]  # noqa: E731
        odd = _best(rows, bent, FINGERPRINT.pressure_grid, pressure)
        held, before = branch * _power(pressure, odd.value if odd else 0.0), fast
        fast = _best(rows, lambda m, by=held: shape * (by * _power(speed, m))[:, None], FINGERPRINT.speed_grid, speed)
        if fast is None or fast == before:
            break
    return odd, fast


def _told(found: Exponent | None) -> float | None:
    return found.value if found and found.known else None


def _rows(fit: Fit, mask: np.ndarray) -> Rows:
    at = np.flatnonzero(mask)
    at = at[:: max(1, len(at) // FINGERPRINT.rows)]
    samples = fit.samples.where(at)
    count = len(fit.samples)
    priors = fit.prior_rows / np.sqrt(mask.sum() / len(at))
    slopes = np.concatenate([fit.slopes[at], fit.slopes[count:] / np.sqrt(mask.sum() / len(at))])
    residual = np.concatenate([fit.residual[at] / samples.sigma, priors])
    scale = np.maximum(np.linalg.norm(slopes, axis=0), 1e-300)
    basis = _spanned(slopes / scale)
    return Rows(samples, residual - basis @ (basis.T @ residual), basis)


def _best(
    rows: Rows, law: Callable[[float], np.ndarray], tried: tuple[float, float, float], along: np.ndarray
) -> Exponent | None:
    """The exponent that takes most of the misfit away; None where that is little, or it ends at an end of its grid."""
    if np.quantile(along, 0.95) < 1.5 * np.quantile(along, 0.05):
        return None
    grid = np.round(np.arange(*tried), 2)
    taken = np.array([_taken(rows, law(exponent)) for exponent in grid])
    best = int(np.argmax(taken))
    total = float(np.sum(rows.residual**2))
    noise = 30.0 * law(1.0).shape[1]  # in units of the noise of one reading; neighbouring samples err together
    if taken[best] < max(FINGERPRINT.notable * total, noise) or best in (0, len(grid) - 1):
        return None
    lost = taken[best] - max(np.interp(grid[best] + step, grid, taken) for step in (-0.5, 0.5))
    left = rows.residual - _fitted(rows, law(float(grid[best])))
    known = lost > FINGERPRINT.sure**2 * float(left @ left) / _independent(left[: len(along)], rows.samples)
    return Exponent(float(grid[best]) + 0.0, known)  # + 0.0: minus zero is not for people


def _taken(rows: Rows, columns: np.ndarray) -> float:
    """How much of the squared residual these columns take away, beyond what the fit's parameters can."""
    fitted = _fitted(rows, columns)
    return float(fitted @ rows.residual)


def _fitted(rows: Rows, columns: np.ndarray) -> np.ndarray:
    """What of the residual these columns follow, beyond what the fit's parameters can."""
    whole = np.zeros((len(rows.residual), columns.shape[1]))
    whole[: len(columns)] = columns / rows.samples.sigma[:, None]
    whole /= np.maximum(np.linalg.norm(whole, axis=0), 1e-300)
    left = whole - rows.basis @ (rows.basis.T @ whole)
    strength, vectors = np.linalg.eigh(left.T @ left)  # tenfold as fast as taking all rows apart
    kept = strength > 1e-12 * max(strength[-1], 1.0)
    along = vectors[:, kept].T @ (left.T @ rows.residual) / strength[kept]
    return left @ (vectors[:, kept] @ along)


def _independent(left: np.ndarray, samples: Samples) -> float:
    """How many independent readings as many are worth whose errors fade from one to the next."""
    follows = (samples.run[1:] == samples.run[:-1]) & (samples.half[1:] == samples.half[:-1])
    square = max(float(left @ left) / len(left), 1e-300)
    memory = float(np.mean((left[1:] * left[:-1])[follows])) / square if follows.any() else 0.0
    memory = min(max(memory, 0.0), FINGERPRINT.most_memory)
    return len(left) * (1 - memory) / (1 + memory)


def _spanned(columns: np.ndarray) -> np.ndarray:
    """Orthonormal columns that span these; directions that rounding made are left out."""
    if not columns.shape[1]:
        return columns
    vectors, strength, _ = svd(columns)
    return vectors[:, strength > 1e-6 * max(strength[0], 1.0)]


def _course(rows: Rows, direction: np.ndarray) -> np.ndarray:
    """Any course along the contraction: few hat functions, or many where few cannot follow the misfit."""
    few, many = _hats(rows.samples.contraction, FINGERPRINT.nodes), _hats(rows.samples.contraction, FINGERPRINT.fine)
    taken = [_taken(rows, shape * direction[:, None]) for shape in (few, many)]
    return many if taken[1] > FINGERPRINT.finer * taken[0] else few


def _hats(contraction: np.ndarray, count: int) -> np.ndarray:
    """Hat functions, evenly spread (rows, count)."""
    nodes = np.linspace(contraction.min(), contraction.max(), count)
    if nodes[-1] - nodes[0] < 1e-6:
        return np.ones((len(contraction), 1))
    return np.stack([np.interp(contraction, nodes, hat) for hat in np.eye(count)], axis=1)


def _relative(values: np.ndarray) -> np.ndarray:
    return np.maximum(values, FINGERPRINT.lowest * max(float(values.max()), 1e-300)) / max(float(values.max()), 1e-300)


def _power(values: np.ndarray, exponent: float) -> np.ndarray:
    return values**exponent
