"""How readings err: white noise, noise that remembers itself, and an offset that a whole run shares.

Each recording has its own. `size` is the standard deviation of one reading's error in units of its stated (or
estimated) noise. A share `run` of its variance is common to a run; of the rest a share `remembered` fades from reading
to reading as exp(-apart/memory), a first-order autoregression; what remains is white. Of many readings whose errors are
alike, this likelihood counts what is independent. Prior: flat in log size and log memory, flat in the shares.

Which components there are is chosen from the residual of the fit by the Bayesian information criterion (Schwarz 1978).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from scipy.optimize import minimize

from fitting.posterior.settings import NOISE
from fitting.problem.residuals import Samples

KINDS = (("size",), ("size", "run"), ("size", "remembered", "memory"), ("size", "remembered", "memory", "run"))
PARTS = ("size", "remembered", "memory", "run")


class Lanes(eqx.Module):
    """Runs beside each other, (runs, readings), the last reading of each repeated to one length."""

    at: jax.Array  # the row of each reading, in order
    gap: jax.Array  # positions since the reading before
    present: jax.Array  # whether it is a reading, not a repetition
    run_of: jax.Array  # (runs,): recording

    @classmethod
    def of(cls, samples: Samples, wanted: np.ndarray | None = None) -> "Lanes":
        """The runs of those rows that are `wanted` (a mask of whole runs); all, unless it is given."""
        wanted = np.ones(samples.run.size, bool) if wanted is None else wanted
        numbers = np.unique(samples.recording, return_inverse=True)[1]
        runs = [np.flatnonzero(samples.run == run) for run in np.unique(samples.run[wanted])]
        longest = max(map(len, runs), default=0)
        at = np.array([np.pad(run, (0, longest - len(run)), mode="edge") for run in runs], int)
        at = at.reshape(len(runs), longest)
        present = np.array([np.arange(longest) < len(run) for run in runs], bool).reshape(at.shape)
        gap = np.maximum(np.diff(samples.position[at], axis=1, prepend=-1), 1) if runs else at
        run_of = np.asarray(numbers[at[:, 0]] if runs else np.zeros(0), int)
        return cls(jnp.asarray(at), jnp.asarray(gap, float), jnp.asarray(present), jnp.asarray(run_of))


class Noise(eqx.Module):
    """The likelihood of the rows of a problem, from the components of each recording's noise.

    The parameters stand in one vector of places in the unit box, recording by recording, as in `PARTS`.
    """

    lanes: Lanes  # of the runs whose readings err alike
    recording: jax.Array  # of every row
    which: jax.Array  # (part, recording): position in the parameters, counted on into `ABSENT`
    lower: jax.Array  # of the parameters
    upper: jax.Array
    logarithmic: jax.Array

    def values(self, place: jax.Array) -> jax.Array:
        """The parameters from their places in the unit box."""
        straight = self.lower + place * (self.upper - self.lower)
        return jnp.where(self.logarithmic, jnp.exp(straight), straight)

    def terms(self, rows: jax.Array, place: jax.Array) -> jax.Array:
        """Log-likelihood of each row given those before it in its run; up to a constant."""
        size, *others = self._by_recording(place)
        log_size = jnp.log(size)[self.recording]
        terms = -0.5 * (rows * jnp.exp(-log_size)) ** 2 - log_size
        lanes = self.lanes
        if lanes.at.size == 0:
            return terms
        mine = [part[lanes.run_of] for part in (size, *others)]
        error, variance = innovations(rows[lanes.at][..., None], lanes.gap, *mine)
        alike = -0.5 * (error[..., 0] ** 2 / variance + jnp.log(variance))
        # the padding goes to a row that is not there
        return terms.at[jnp.where(lanes.present, lanes.at, len(rows))].set(alike, mode="drop")

    def whitened(self, columns: jax.Array, lanes: Lanes, place: jax.Array) -> jax.Array:
        """Columns (runs, readings, q) in units of what each reading adds to those before it in its run."""
        mine = [part[lanes.run_of] for part in self._by_recording(place)]
        if self.lanes.at.size == 0:  # nothing but white noise anywhere
            return columns / mine[0][:, None, None]
        error, variance = innovations(columns, lanes.gap, *mine)
        return error / jnp.sqrt(variance)[..., None]

    def _by_recording(self, place: jax.Array) -> jax.Array:
        """Size, remembered share, memory and share of a run, each (recordings,)."""
        return jnp.concatenate([self.values(place), ABSENT])[self.which]


ABSENT = jnp.array([0.0, 1.0])  # a share that is not there, a memory that does not matter


def innovations(
    rows: jax.Array, gap: jax.Array, size: jax.Array, remembered: jax.Array, memory: jax.Array, run: jax.Array
) -> tuple[jax.Array, jax.Array]:
    """What each reading adds to those before it in its run, and the variance of that: a Kalman filter.

    Rows (runs, readings, q) are q columns, each filtered for itself; the variance (runs, readings) is that of all.
    Parameters (runs,). Its two states are the fading error and the run's offset.
    """
    variance = size**2
    common, rest = run * variance, (1 - run) * variance
    fading, white = remembered * rest, (1 - remembered) * rest
    zero, nothing = jnp.zeros_like(size), jnp.zeros((len(rows), rows.shape[-1]))

    def step(carry: tuple, now: tuple) -> tuple[tuple, tuple]:
        a, b, aa, ab, bb = carry
        row, apart = now
        keep = jnp.exp(-apart / memory)
        a, aa, ab = keep[:, None] * a, keep**2 * aa + (1 - keep**2) * fading, keep * ab
        to_a, to_b = aa + ab, ab + bb
        total = to_a + to_b + white
        error = row - a - b
        gain_a, gain_b = to_a / total, to_b / total
        a, b = a + gain_a[:, None] * error, b + gain_b[:, None] * error
        return (a, b, aa - gain_a * to_a, ab - gain_a * to_b, bb - gain_b * to_b), (error, total)

    begin = (nothing, nothing, fading, zero, common)
    _, (error, total) = jax.lax.scan(step, begin, (jnp.swapaxes(rows, 0, 1), gap.T), unroll=4)
    return jnp.swapaxes(error, 0, 1), total.T


# The choice -----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class RecordingNoise:
    """The noise of one recording: its components, and their most likely values."""

    parts: tuple[str, ...]
    values: tuple[float, ...]

    @property
    def text(self) -> str:
        """In words."""
        if self.parts == ("size",):
            return "white (the residual shows nothing else)"
        at = dict(zip(self.parts, self.values, strict=True))
        words = []
        if "memory" in at:
            words.append(f"{100 * at['remembered']:.0f} % fades over {at['memory']:.3g} readings (AR(1))")
        if "run" in at:
            words.append(f"{100 * at['run']:.0f} % is shared by a run")
        white = (1 - at.get("run", 0.0)) * (1 - at.get("remembered", 0.0))
        rest = ", the rest white" if white >= 0.005 else ""
        return f"{', '.join(words)}{rest}; chosen from the residual by BIC"


def choose_noise(
    rows: np.ndarray, samples: Samples, parts: Sequence[tuple[str, ...]] | None = None
) -> tuple[RecordingNoise, ...]:
    """The noise of each recording that its residual speaks for; of these `parts` where they are given."""
    numbers = np.unique(samples.recording)
    return tuple(
        _choose(rows[mask], samples.where(mask), KINDS if parts is None else (parts[i],))
        for i, mask in enumerate(samples.recording == number for number in numbers)
    )


def _choose(rows: np.ndarray, samples: Samples, offered: Sequence[tuple[str, ...]]) -> RecordingNoise:
    known = len(offered) == 1
    found = []
    for parts in offered:
        if known or _sensible(parts, samples):
            values, log_likelihood = _most_likely(rows, samples, parts)
            found.append((log_likelihood - 0.5 * len(parts) * np.log(len(rows)), RecordingNoise(parts, values)))
    return max(found, key=lambda one: one[0])[1]


def _sensible(parts: tuple[str, ...], samples: Samples) -> bool:
    runs = len(np.unique(samples.run))
    alone = len(samples) == runs
    return ("memory" not in parts or (len(samples) >= NOISE.few_readings and not alone)) and (
        "run" not in parts or (runs >= NOISE.few_runs and not alone)
    )


@jax.jit
def _cost(noise: Noise, rows: jax.Array, place: jax.Array) -> tuple[jax.Array, jax.Array]:
    return jax.value_and_grad(lambda at: -jnp.sum(noise.terms(rows, at)) / len(rows))(place)


def _most_likely(rows: np.ndarray, samples: Samples, parts: tuple[str, ...]) -> tuple[tuple[float, ...], float]:
    """The values of these parts under which the rows are most likely, and their log-likelihood.

    The others stay as good as absent: one compiled function serves all choices.
    """
    rms = float(np.sqrt(np.mean(rows**2)))
    if parts == ("size",):
        return (rms,), -len(rows) * (0.5 + np.log(max(rms, 1e-300)))
    noise, measured = noise_of_rows(samples, [PARTS], [rms]), jnp.asarray(rows)
    free = [PARTS.index(part) for part in parts]

    def whole(at: np.ndarray) -> np.ndarray:
        place = np.array([0.5, 0.0, 0.5, 0.0])
        place[free] = at
        return place

    def cost(at: np.ndarray) -> tuple[float, np.ndarray]:
        value, slope = _cost(noise, measured, jnp.asarray(whole(at)))
        return float(value), np.asarray(slope)[free]

    bounds = [(NOISE.edge, 1 - NOISE.edge)] * len(parts)
    starts = np.array([[0.5, 0.9, 0.3, 0.2], [0.5, 0.5, 0.7, 0.2]])[:, free]
    ends = [minimize(cost, start, jac=True, method="L-BFGS-B", bounds=bounds) for start in starts]
    best = min(ends, key=lambda end: end.fun)
    values = np.asarray(noise.values(jnp.asarray(whole(best.x))))[free]
    return tuple(map(float, values)), -float(best.fun) * len(rows)


# The layout -----------------------------------------------------------------------------------------------------------


def noise_of_rows(samples: Samples, parts: Sequence[tuple[str, ...]], sizes: Sequence[float]) -> Noise:
    """The noise of these rows, with each recording's components; sizes may vary around `sizes`."""
    numbers = np.unique(samples.recording, return_inverse=True)[1]
    alike = [i for i, mine in enumerate(parts) if len(mine) > 1]
    lanes = Lanes.of(samples, np.isin(numbers, alike))
    longest = lanes.at.shape[1]
    lower, upper, log, which, count = [], [], [], np.zeros((len(PARTS), len(parts)), int), 0
    total = sum(map(len, parts))
    for i, mine in enumerate(parts):
        ends = _ends(sizes[i], longest)
        for k, part in enumerate(PARTS):
            which[k, i] = count if part in mine else total + (part == "memory")
            if part in mine:
                count += 1
                lower, upper = [*lower, ends[part][0]], [*upper, ends[part][1]]
                log.append(part in ("size", "memory"))
    return Noise(
        lanes=lanes,
        recording=jnp.asarray(numbers),
        which=jnp.asarray(which),
        lower=jnp.asarray(lower),
        upper=jnp.asarray(upper),
        logarithmic=jnp.asarray(log),
    )


def _ends(size: float, longest: int) -> dict[str, tuple[float, float]]:
    middle, span = np.log(max(size, 1e-10)), np.log(NOISE.size_span)
    memory = (np.log(NOISE.shortest), np.log(max(NOISE.longest * longest, 10.0)))
    return {"size": (middle - span, middle + span), "remembered": (0.0, 1.0), "memory": memory,
            "run": (0.0, 1.0)}  # fmt: skip
