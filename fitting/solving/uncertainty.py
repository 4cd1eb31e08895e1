"""How well a fit knows what it fitted: covariance, what is at its bound, what can make up for what."""

from collections.abc import Sequence

import numpy as np

from fitting.residuals import Samples


def clusters(samples: Samples) -> np.ndarray:
    """Number of the closed loop that each row belongs to: neighbours within a loop err together."""
    return np.unique(np.stack([samples.run, samples.loop]), axis=1, return_inverse=True)[1]


def covariances(
    data: np.ndarray, rows: np.ndarray, priors: np.ndarray, cluster: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Covariance of the free parameters: as if samples were independent, and robust to errors shared in a cluster."""
    freedom = max(len(rows) - data.shape[1], 1)
    variance = np.sum(rows**2) / freedom
    known = priors.T @ priors
    bread = _inverse(data.T @ data / variance + known)
    count = cluster.max() + 1 if len(cluster) else 1
    scores = np.zeros((count, data.shape[1]))
    np.add.at(scores, cluster, data * (rows / variance)[:, None])
    meat = scores.T @ scores * (count / max(count - 1, 1)) + known
    return bread, bread @ meat @ bread


def _inverse(matrix: np.ndarray) -> np.ndarray:
    scale = 1 / np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    return np.linalg.pinv(matrix * np.outer(scale, scale), rcond=1e-14, hermitian=True) * np.outer(scale, scale)


def at_bound(names: Sequence[str], place: np.ndarray) -> tuple[str, ...]:
    """Those of the free names that ended at an end of their range."""
    return tuple(name for name, p in zip(names, place, strict=True) if p < 1e-6 or p > 1 - 1e-6)


def ties(names: Sequence[str], slopes: np.ndarray, index: float = 20.0) -> dict[str, tuple[str, ...]]:
    """Which parameters can make up for each other: collinearity index above 20 (Brun, Reichert & Kuensch 2001)."""
    if len(names) < 2:
        return {}
    unit = slopes / np.maximum(np.linalg.norm(slopes, axis=0), 1e-300)
    strength, direction = np.linalg.eigh(unit.T @ unit)
    tied: dict[str, set[str]] = {}
    for value, vector in zip(strength, direction.T, strict=True):
        if value < 1 / index**2:
            group = [name for name, share in zip(names, vector, strict=True) if abs(share) > 0.3]
            for name in group:
                tied.setdefault(name, set()).update(other for other in group if other != name)
    return {name: tuple(sorted(others)) for name, others in tied.items() if others}
