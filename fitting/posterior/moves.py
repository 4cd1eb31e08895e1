"""How walkers move: emcee's differential evolution, a mended snooker, and draws from the curvature at the mode."""

from collections.abc import Callable
from typing import Any

import emcee
import numpy as np

from fitting.posterior.settings import MOVE


class Snooker(emcee.moves.RedBlueMove):
    """Moves along the line to another walker (ter Braak & Vrugt 2008), for distributions of odd shape.

    emcee's own, up to version 3.1.6, does not normalise that line: in five dimensions a normal distribution comes out 3
    to 8 % too narrow in the mix that emcee recommends (mended in its repository by pull request 531).
    """

    def get_proposal(self, sample: np.ndarray, complement: Any, random: Any) -> tuple[np.ndarray, np.ndarray]:
        """Proposed places, and the log of the factor in the acceptance."""
        others = np.concatenate(complement)
        picked = np.argsort(random.rand(len(sample), len(others)), axis=1)[:, :3]
        towards, first, second = (others[picked[:, k]] for k in range(3))
        line = sample - towards
        distance = np.linalg.norm(line, axis=1)
        line = line / distance[:, None]
        proposed = sample + 1.7 * line * np.sum(line * (first - second), axis=1, keepdims=True)
        stretched = np.linalg.norm(proposed - towards, axis=1) / distance
        return proposed, (sample.shape[1] - 1) * np.log(stretched)


class FromMode(emcee.moves.RedBlueMove):
    """Draws from Student's t around the mode, whatever the walker's place: an independence sampler.

    Where the posterior is nearly normal most are accepted, and a chain forgets in a few steps; elsewhere the other
    moves carry on. Coordinates are whitened, so that the mode is the origin.
    """

    def get_proposal(self, sample: np.ndarray, complement: Any, random: Any) -> tuple[np.ndarray, np.ndarray]:
        """Proposed places, and the log of the factor in the acceptance."""
        proposed = around_mode(random.randn(*sample.shape), random.chisquare(MOVE.tails, len(sample)))
        return proposed, log_around_mode(sample) - log_around_mode(proposed)


def around_mode(normal: np.ndarray, chi_square: np.ndarray) -> np.ndarray:
    """Student's t from normal deviates (points, coordinates) and chi-square ones (points,)."""
    return MOVE.scale * normal * np.sqrt(MOVE.tails / chi_square)[:, None]


def log_around_mode(z: np.ndarray) -> np.ndarray:
    """Its log-density at points (points, coordinates), up to a constant.

    scipy's takes apart the matrix of the scales at every call, which costs as much as all else that a step does.
    """
    return -0.5 * (MOVE.tails + z.shape[1]) * np.log1p(np.sum(z**2, axis=1) / (MOVE.tails * MOVE.scale**2))


Moves = list[tuple[emcee.moves.Move, float]]
MOVES: Callable[[], Moves] = lambda: [(emcee.moves.DEMove(), 0.4), (Snooker(), 0.1), (FromMode(), 0.5)]  # noqa: E731
