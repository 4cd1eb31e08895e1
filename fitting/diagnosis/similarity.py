"""What can be known: which effects look alike in these data, which the fitted numbers absorb, and what would open them.

The signature of an effect is what it adds to the force at its typical size. Two effects look alike where the cosine of
their signatures is near 1; an effect is absorbed where the numbers that are fitted anyway (geometry, friction) can make
up for it. Both are asked before anything is fitted to the effect, so that an answer costs no search.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import jax
import jax.numpy as jnp
import numpy as np

from fitting.errors import InputError
from fitting.least_squares.record import Fit
from fitting.problem.points import reached
from fitting.problem.thinning import thinned
from fitting.recordings.noise import noise_of
from fitting.recordings.records import FORCE_TESTS, Experiment, Run
from mckibben_jax.effect import INSTRUMENT, Effect, name_of
from mckibben_jax.model import Model
from mckibben_jax.muscle import Muscle
from mckibben_jax.state import State

SAMPLES = 400  # of each data set; a signature is smooth
SAME = 0.98  # cosine from which two effects look alike
OPENED = 0.9  # cosine below which a measurement has told them apart
FADED = 0.05  # of its rms: what is left of an absorbed effect
CYCLE = 24  # samples on each branch of a measurement that could be made
STEP = 1e-4  # of a parameter's range, for slopes


@dataclass(frozen=True)
class Scene:
    """Runs of one muscle: states (runs, time), which samples count, and the noise of one reading, N."""

    states: State
    counts: np.ndarray
    noise: float
    dataset: int = 0
    change: Callable[[Muscle], Muscle] = lambda muscle: muscle

    def rows(self, whole: Model) -> np.ndarray:
        """The force where it counts, in standard deviations; operation by operation, for a compilation costs more."""
        given = replace(whole, muscle=self.change(whole.muscle))
        return np.asarray(jax.vmap(given.force)(self.states))[self.counts] / self.noise


@dataclass(frozen=True)
class Similarity:
    """How much effects look alike: cosines of their signatures, raw and after the fitted numbers made up for them."""

    names: tuple[str, ...]
    raw: np.ndarray
    freed: np.ndarray
    left: np.ndarray  # of each signature: the share that the fitted numbers cannot make up for
    size: np.ndarray  # rms of each signature at its typical size, in standard deviations

    def cosine(self, one: str, other: str, freed: bool = False) -> float:
        """The cosine of two effects' signatures."""
        at = self.names.index(one), self.names.index(other)
        return float((self.freed if freed else self.raw)[at])

    @property
    def absorbed(self) -> tuple[str, ...]:
        """Effects of which next to nothing is left."""
        return tuple(name for name, left in zip(self.names, self.left, strict=True) if left < FADED)

    @property
    def classes(self) -> tuple[tuple[str, ...], ...]:
        """Effects that look alike, chained: each to at least one other of its class."""
        todo, found = [name for name in self.names if name not in self.absorbed], []
        while todo:
            members = [todo.pop(0)]
            for member in members:
                near = [name for name in todo if abs(self.cosine(member, name, freed=True)) > SAME]
                members += near
                todo = [name for name in todo if name not in near]
            found += [tuple(members)] if len(members) > 1 else []
        return tuple(found)


@dataclass(frozen=True)
class Opening:
    """A measurement that tells two effects apart: in words, and the cosine that it leaves."""

    pair: tuple[str, str]
    what: str
    cosine: float


@dataclass(frozen=True)
class Knowable:
    """What these data can say of the effects that are not in the model."""

    similarity: Similarity
    openings: tuple[Opening, ...]
    unseen: tuple[str, ...]  # without any trace in these data


def knowable(fit: Fit, experiments: Sequence[Experiment], candidates: Sequence[type[Effect]]) -> Knowable:
    """What the data of a fit can say of effects that its model does not have."""
    scenes = [scene for d, experiment in enumerate(experiments) for scene in scenes_of(experiment, d)]
    if not scenes:
        raise InputError("effects are held against each other by the force that they leave, and none was measured",
                         cure="leave out --alike")  # fmt: skip
    models = {scene.dataset: fit.model(scene.dataset) for scene in scenes}
    kinds = [kind for kind in candidates if all(_fits(kind, whole) for whole in models.values())]
    traces = {name_of(kind): signature(kind, models, scenes) for kind in kinds}
    unseen = tuple(name for name, trace in traces.items() if np.sqrt(np.mean(trace**2)) < 1e-6)
    traces = {name: trace for name, trace in traces.items() if name not in unseen and np.isfinite(trace).all()}
    free, priors = slopes(fit, scenes), _priors(fit)
    found = similarity(traces, free, priors)
    more = _More(fit, models, {name_of(kind): kind for kind in kinds}, openings(experiments[0], scenes))
    told = [
        best
        for members in found.classes
        for other in members[1:]
        if (best := _opening((members[0], other), traces, free, priors, more)) is not None
    ]
    return Knowable(found, tuple(told), unseen)


def _fits(kind: type[Effect], whole: Model) -> bool:
    """Whether an effect is not there, has what it needs, and is no other law of the gas itself."""
    others = whole.drop(*_rivals(kind, whole))
    return name_of(kind) not in whole.names and len(others.at("stored")) > 0 and not others.missing_needs(kind)


def _rivals(kind: type[Effect], whole: Model) -> list[str]:
    return [name_of(e) for e in whole.effects if kind.family is not None and e.family == kind.family]


# Signatures ----------------------------------------------------------------------------------------------------------


def signature(kind: type[Effect], models: dict[int, Model], scenes: Sequence[Scene]) -> np.ndarray:
    """What an effect of typical size adds to the force of a model without its rivals, in standard deviations."""
    parts = []
    for scene in scenes:
        base = models[scene.dataset].drop(*_rivals(kind, models[scene.dataset]))
        parts.append(scene.rows(base.add(kind())) - scene.rows(base))
    return np.concatenate(parts)


def slopes(fit: Fit, scenes: Sequence[Scene]) -> np.ndarray:
    """Change of the rows with each number that is fitted, per range of that number: (rows, free)."""
    columns = []
    for name in fit.free:
        index = fit.layout.names.index(name)
        entry, ends = fit.layout.entries[index], []
        step = STEP * (entry.upper - entry.lower)
        for way in (1, -1):
            vector = fit.vector.copy()
            vector[index] = np.clip(vector[index] + way * step, entry.lower, entry.upper)
            models = {scene.dataset: fit.layout.model(jnp.asarray(vector), scene.dataset) for scene in scenes}
            ends.append((vector[index], np.concatenate([s.rows(models[s.dataset]) for s in scenes])))
        (high, above), (low, below) = ends
        columns.append((above - below) / (high - low) * (entry.upper - entry.lower))
    return np.stack(columns, axis=1) if columns else np.zeros((sum(int(s.counts.sum()) for s in scenes), 0))


def _priors(fit: Fit) -> np.ndarray:
    """What is known of the fitted numbers besides these data, in the same unit as their slopes."""
    entries = [fit.layout.entry(name) for name in fit.free]
    return np.diag([(e.upper - e.lower) / e.prior[1] if e.prior else 0.0 for e in entries]).reshape(-1, len(entries))


def similarity(traces: dict[str, np.ndarray], free: np.ndarray, priors: np.ndarray | None = None) -> Similarity:
    """Cosines of signatures (rows), raw and with the columns of `free` fitted away, which `priors` (rows) hold back."""
    rows = np.array(list(traces.values()))
    held = np.zeros((0, free.shape[1])) if priors is None else priors
    padded = np.pad(rows, [(0, 0), (0, len(held))])
    left = padded - _made_up(np.concatenate([free, held]), padded)
    length = np.linalg.norm(rows, axis=1)
    share = np.linalg.norm(left, axis=1) / length
    return Similarity(tuple(traces), _cosines(rows), _cosines(left), share, length / np.sqrt(rows.shape[1]))


def _made_up(columns: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """The part of rows that columns can make."""
    if not columns.shape[1]:
        return np.zeros_like(rows)
    scale = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    return (columns / scale @ np.linalg.lstsq(columns / scale, rows.T, rcond=1e-10)[0]).T


def _cosines(rows: np.ndarray) -> np.ndarray:
    units = rows / np.maximum(np.linalg.norm(rows, axis=1, keepdims=True), 1e-300)
    return units @ units.T


# Runs ----------------------------------------------------------------------------------------------------------------


def scenes_of(experiment: Experiment, dataset: int) -> list[Scene]:
    """A data set's recordings of force, thinned."""
    kept = tuple(r for r in experiment.recordings if r.test in FORCE_TESTS)
    if not kept:
        return []
    slim = thinned(replace(experiment, recordings=kept), SAMPLES)
    return [_scene(recording.runs, noise_of(recording), dataset) for recording in slim.recordings]


def _scene(runs: Sequence[Run], noise: float, dataset: int) -> Scene:
    runs = [part for run in runs for part in reached(run)]
    size = max(len(run) for run in runs)
    pad = lambda values: np.pad(values, (0, size - len(values)), mode="edge")  # noqa: E731
    column = lambda name: jnp.asarray(np.stack([pad(getattr(run, name)) for run in runs]))  # noqa: E731
    names = ("contraction", "pressure", "rate", "pressure_rate", "time")
    counts = np.stack([np.pad(run.weight > 0, (0, size - len(run))) for run in runs])
    zero = jnp.zeros(counts.shape)
    states = State(**{name: column(name) for name in names}, stretch=zero, stretch_rate=zero)
    return Scene(states, counts, noise, dataset)


def openings(experiment: Experiment, scenes: Sequence[Scene]) -> dict[str, Scene]:
    """Measurements that could be made on the first muscle, in words."""
    seen = scenes[0]
    top, stroke = float(seen.states.pressure.max()), float(seen.states.contraction.max())
    pace = float(np.median(np.abs(np.asarray(seen.states.rate))[seen.counts])) or 0.05
    whole, small = (0.0, stroke, 0.0, stroke), (0.0, stroke, 0.4 * stroke, 0.6 * stroke, 0.4 * stroke, stroke, 0.0)
    loop = lambda pressures, turns=whole, rate=pace: _loops(pressures, turns, rate, seen.noise)  # noqa: E731
    shares = (0.1, 0.4, 1.0)
    return {
        "a pull without pressure": loop([0.0]),
        "loops from a tenth of the pressure upwards": loop([0.1 * top, 0.3 * top, top]),
        "a second muscle, half as long": replace(loop([s * top for s in shares]), change=_halved),
        "the same loops ten times as fast": loop([s * top for s in shares], rate=10 * pace),
        "small loops inside large ones": loop([s * top for s in shares], turns=small),
    }


def _halved(muscle: Muscle) -> Muscle:
    return replace(muscle, length=muscle.length / 2)


def _loops(pressures: Sequence[float], turns: Sequence[float], rate: float, noise: float) -> Scene:
    """Between turning contractions at one speed (1/s), at each pressure (Pa)."""
    corners = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(turns)) / rate)])
    inner = (np.arange(CYCLE) + 0.5) / CYCLE
    time = np.concatenate([[0.0], *(a + inner * (b - a) for a, b in pairwise(corners))])
    contraction = np.interp(time, corners, turns)
    speed = rate * np.sign(np.diff(turns))[np.clip(np.searchsorted(corners, time) - 1, 0, None)]
    every = lambda values: jnp.asarray(np.broadcast_to(values, (len(pressures), len(time))))  # noqa: E731
    pressure = every(np.array(pressures)[:, None])
    zero = jnp.zeros(pressure.shape)
    states = State(every(contraction), pressure, every(speed), zero, zero, zero, every(time))
    return Scene(states, np.ones(pressure.shape, bool), noise)


@dataclass(frozen=True)
class _More:
    """Measurements that could be made, and what they would show: each is evaluated once, for many pairs ask for it."""

    fit: Fit
    models: dict[int, Model]
    kinds: dict[str, type[Effect]]
    scenes: dict[str, Scene]
    found: dict[tuple[str, str], np.ndarray] = field(default_factory=dict)

    def trace(self, effect: str, what: str) -> np.ndarray:
        """The signature of an effect."""
        return self._once(effect, what, lambda: signature(self.kinds[effect], self.models, [self.scenes[what]]))

    def slopes(self, what: str) -> np.ndarray:
        """Slopes along the fitted numbers."""
        return self._once("", what, lambda: slopes(self.fit, [self.scenes[what]]))

    def _once(self, of: str, what: str, make: Callable[[], np.ndarray]) -> np.ndarray:
        if (of, what) not in self.found:
            self.found[of, what] = make()
        return self.found[of, what]


def _opening(
    pair: tuple[str, str], traces: dict[str, np.ndarray], free: np.ndarray, priors: np.ndarray, more: _More
) -> Opening | None:
    """The measurement that tells a pair apart best; None where none of them does."""
    of_instrument = [more.kinds[name].source == INSTRUMENT for name in pair]
    if any(of_instrument) and not all(of_instrument):
        return Opening(pair, "the instruments calibrated by themselves", 0.0)
    best = Opening(pair, "", OPENED)
    for what in more.scenes:
        both = {name: np.append(traces[name], more.trace(name, what)) for name in pair}
        found = similarity(both, np.concatenate([free, more.slopes(what)]), priors)
        cosine = abs(found.cosine(*pair, freed=True))
        best = Opening(pair, what, cosine) if cosine < best.cosine else best
    return best if best.what else None
