"""How much of an effect must be there for the test to find it: amounts injected into flipped noise."""

import numpy as np

POWER = 0.8
TRIALS = 400
HALVINGS = 40
BEYOND = 1e6  # standard errors: what is not found at this amount is not found at all


def detectable(
    columns: np.ndarray, noise: np.ndarray, number: np.ndarray, signs: np.ndarray, level: float
) -> np.ndarray:
    """The amount of each column (rows, columns; of norm one) that is found with power 0.8; infinite where none is.

    The column is added, in growing amounts, to noise whose scores (units, columns) get signs drawn anew for each unit
    (`number`, rows), and found where its score exceeds what flips reach: the largest score of all where it is absent,
    and more the more of it is there, for what is added is flipped too. Rows and columns are whitened and free of the
    model's parameters.
    """
    if not columns.shape[1]:
        return np.zeros(0)
    chance = signs @ noise
    critical = np.quantile(np.abs(chance).max(axis=1), 1 - level)
    signal = np.zeros_like(noise)
    np.add.at(signal, number, columns**2)  # adds up to one
    own = np.quantile(np.abs(signs @ signal), 1 - level, axis=0)
    drawn = chance[:TRIALS]

    def power(amount: np.ndarray) -> np.ndarray:
        return np.mean(np.abs(drawn + amount) > np.hypot(critical, own * amount), axis=0)

    low, high = np.full(len(own), 1e-3), np.full(len(own), BEYOND)
    reachable = power(high) >= POWER
    for _ in range(HALVINGS):
        middle = np.sqrt(low * high)
        enough = power(middle) >= POWER
        low, high = np.where(enough, low, middle), np.where(enough, middle, high)
    return np.where(reachable, high, np.inf)
