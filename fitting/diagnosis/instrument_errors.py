"""What instruments within their accuracy can make of a recording: part of the null model of every test.

An error that stays the same for a run or for a whole recording looks like physics: a load cell whose gain differs from
run to run looks like an effect of the pressure. Every such error is a nuisance with a Gaussian prior whose width is the
instrument's accuracy. Marginalised, the rows have the covariance noise + U U', U being the change of the rows by one
standard deviation of each error; rows are whitened by it, and nothing that instruments could have made is left to look
for an effect in. What friction differs by from run to run (humidity, wear) is treated the same way.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from fitting.diagnosis import omnibus
from fitting.diagnosis.findings import RELATIVE, ErrorKind, Source
from fitting.diagnosis.settings import INSTRUMENTS, InstrumentSettings
from fitting.least_squares.through import roots
from fitting.problem.residuals import Samples
from fitting.recordings.accuracy import Accuracy, Channel, ChannelAccuracy


@dataclass(frozen=True)
class Signal:
    """One channel as an error of it is felt: arrays (rows,) of its readings, their rate, and d(row)/d(reading).

    In the channel's unit, rows in the order of measurement; `full_scale` is the largest reading.
    """

    slope: np.ndarray
    reading: np.ndarray
    rate: np.ndarray
    full_scale: float

    def lags(self, run: np.ndarray, widths: Sequence[float]) -> np.ndarray:
        """How far the reading lags behind, from -1 to 1, in cells that turn around within each width (rows, widths).

        Prandtl's play: an instrument whose reading turns follows only when it has moved by twice a width, which is a
        share of full scale. It starts in the middle of its play in every run.
        """
        way = self.full_scale * np.asarray(widths)
        out, state, before = np.empty((len(run), len(way))), np.zeros(len(way)), None
        for i, (one, reading) in enumerate(zip(run, self.reading, strict=True)):
            if one != before:
                before, last, state = one, reading, np.zeros(len(way))
            state = np.minimum(np.maximum(state + (reading - last) / way, -1.0), 1.0)
            out[i], last = state, reading
        return out


@dataclass(frozen=True)
class InstrumentErrors:
    """Changes of the rows by one standard deviation of each error, and where each comes from.

    Of `per_run` (rows, k) every run has a coefficient of its own, of `shared` (rows, m) all runs have the same.
    """

    per_run: np.ndarray
    shared: np.ndarray
    sources_per_run: tuple[Source, ...]
    sources_shared: tuple[Source, ...]
    run: np.ndarray  # (rows,) of each row

    @classmethod
    def none(cls, run: np.ndarray) -> "InstrumentErrors":
        """Instruments that do not err."""
        empty = np.zeros((len(run), 0))
        return cls(empty, empty, (), (), run)

    @property
    def sources(self) -> tuple[Source, ...]:
        """Every source once, in order."""
        return tuple(dict.fromkeys((*self.sources_per_run, *self.sources_shared)))

    @property
    def columns(self) -> np.ndarray:
        """All columns, those of single runs as a column for each run (rows, runs x k + m)."""
        runs = [np.where((self.run == one)[:, None], self.per_run, 0.0) for one in np.unique(self.run)]
        return np.hstack([*runs, self.shared])

    def changed(self, per_run: np.ndarray, shared: np.ndarray) -> "InstrumentErrors":
        """The same errors of other rows, for example whitened ones."""
        return replace(self, per_run=per_run, shared=shared)

    def at(self, rows: np.ndarray) -> "InstrumentErrors":
        """Of some rows alone (positions)."""
        return replace(self, per_run=self.per_run[rows], shared=self.shared[rows], run=self.run[rows])

    def widened(self, source: Source, times: float) -> "InstrumentErrors":
        """The same with one source so many times as large."""
        factors = [
            np.array([times if each == source else 1.0 for each in sources])
            for sources in (self.sources_per_run, self.sources_shared)
        ]
        return self.changed(self.per_run * factors[0], self.shared * factors[1])

    @property
    def allowed(self) -> "InstrumentErrors":
        """Only those that an accuracy allows."""
        return self.chosen([each for each in self.sources if each.allowed > 0])

    def chosen(self, sources: Sequence[Source]) -> "InstrumentErrors":
        """Only these."""
        own = [i for i, each in enumerate(self.sources_per_run) if each in sources]
        common = [i for i, each in enumerate(self.sources_shared) if each in sources]
        return InstrumentErrors(
            self.per_run[:, own],
            self.shared[:, common],
            tuple(self.sources_per_run[i] for i in own),
            tuple(self.sources_shared[i] for i in common),
            self.run,
        )

    def whitener(self) -> "InstrumentWhitener":
        """What takes these errors out of rows of unit white noise."""
        return InstrumentWhitener.of(self)


@dataclass(frozen=True)
class InstrumentWhitener:
    """Multiplies by a root of the inverse of 1 + U U': first run by run, then what all runs share.

    The root is 1 - U M U' (`roots`).
    """

    parts: tuple[tuple[np.ndarray, np.ndarray, np.ndarray], ...]  # rows, U (rows, k), M (k, k)

    @classmethod
    def of(cls, errors: InstrumentErrors) -> "InstrumentWhitener":
        """For rows of unit white noise beside these errors."""
        parts = []
        for one in np.unique(errors.run):
            at = np.flatnonzero(errors.run == one)
            parts.append((at, errors.per_run[at], roots(errors.per_run[at])[0]))
        shared = cls(tuple(parts))(errors.shared)
        return cls((*parts, (np.arange(len(errors.run)), shared, roots(shared)[0])))

    def __call__(self, columns: np.ndarray) -> np.ndarray:
        """Columns (rows, q) or rows (rows,), without these errors as far as priors let them go."""
        return self._applied(np.array(columns, dtype=float), self.parts)

    def residual(self, rows: np.ndarray) -> np.ndarray:
        """Rows (rows,) without the most likely errors: (1 + U U')^-1 rows."""
        return self._applied(self(rows), self.parts[::-1])

    def _applied(self, out: np.ndarray, parts: Sequence[tuple[np.ndarray, np.ndarray, np.ndarray]]) -> np.ndarray:
        for at, errors, taken in parts:
            if errors.shape[1]:
                out[at] -= errors @ (taken @ (errors.T @ out[at]))
        return out


def instrument_errors(
    samples: Samples,
    accuracies: Sequence[Accuracy],
    signals: Mapping[Channel, Signal],
    friction: np.ndarray,
    settings: InstrumentSettings = INSTRUMENTS,
    every: bool = False,
) -> InstrumentErrors:
    """The errors that the instruments of each recording (by its number) are allowed; with `every` all there could be.

    `signals` are those of pressure (Pa), position (m) and force (N); `friction` (rows, effects) is what each effect
    that is lost to motion does to the rows. Recordings of one accuracy were read by the same instruments.
    """
    clock, made = clock_time(samples, settings.point_time), list[tuple[Source, np.ndarray]]()
    for accuracy in dict.fromkeys(accuracies):
        mine = np.isin(samples.recording, [i for i, each in enumerate(accuracies) if each == accuracy])
        for channel, signal in signals.items():
            allowed: ChannelAccuracy = getattr(accuracy, channel.value)
            for kind in KINDS:
                source = _source(channel, kind, getattr(allowed, kind.value) or 0.0, signal, clock, every, settings)
                if source.width > 0:
                    found = _columns(kind, signal, clock, samples.run, settings)
                    made += [(source, np.where(mine, source.width * column, 0.0)) for column in found]
        skew, force = accuracy.skew or 0.0, signals[Channel.FORCE]
        source = Source(Channel.TIME, ErrorKind.SKEW, skew, max(skew, settings.least_skew * every))
        if source.width > 0:
            made.append((source, np.where(mine, source.width * force.slope * force.rate, 0.0)))
    width = settings.friction_per_run
    made += [(Source(None, ErrorKind.FRICTION_PER_RUN, width, width), width * column) for column in friction.T]
    return _laid_out(made, samples.run)


KINDS = (
    ErrorKind.ZERO, ErrorKind.GAIN, ErrorKind.ZERO_PER_RUN, ErrorKind.GAIN_PER_RUN, ErrorKind.HYSTERESIS,
    ErrorKind.DRIFT,
)  # fmt: skip
PER_RUN = (ErrorKind.ZERO_PER_RUN, ErrorKind.GAIN_PER_RUN, ErrorKind.SKEW, ErrorKind.FRICTION_PER_RUN)


def most_errors(
    accuracies: Sequence[Accuracy], runs: int, lost: int, settings: InstrumentSettings = INSTRUMENTS
) -> int:
    """How many columns such errors have at most, in so many runs, beside so many effects that are lost to motion."""
    several = {ErrorKind.HYSTERESIS: len(settings.hysteresis_widths), ErrorKind.DRIFT: 2}
    own, common = lost, 0
    for accuracy in dict.fromkeys(accuracies):
        for channel, kind in product((Channel.PRESSURE, Channel.POSITION, Channel.FORCE), KINDS):
            if getattr(getattr(accuracy, channel.value), kind.value):
                own += kind in PER_RUN
                common += several.get(kind, 1) * (kind not in PER_RUN)
        own += bool(accuracy.skew)
    return runs * own + common


def _source(
    channel: Channel,
    kind: ErrorKind,
    allowed: float,
    signal: Signal,
    clock: np.ndarray,
    every: bool,
    settings: InstrumentSettings,
) -> Source:
    """One kind of error of a channel; where none is allowed but `every` is asked for, of a small size."""
    small = settings.least_share
    if kind not in RELATIVE:
        small *= signal.full_scale
    if kind is ErrorKind.DRIFT:
        small /= max(float(np.ptp(clock)), 1e-300)
    return Source(channel, kind, allowed, allowed or small * every)


def _columns(
    kind: ErrorKind, signal: Signal, clock: np.ndarray, run: np.ndarray, settings: InstrumentSettings
) -> list[np.ndarray]:
    """Changes of the rows by one unit of one kind of error of a channel."""
    if kind in (ErrorKind.GAIN, ErrorKind.GAIN_PER_RUN):
        return [signal.slope * signal.reading]
    if kind is ErrorKind.HYSTERESIS:
        return [signal.slope * signal.full_scale * lag for lag in signal.lags(run, settings.hysteresis_widths).T]
    if kind is ErrorKind.DRIFT:  # from the first reading on: a steady one, and one that dies away as what warms up does
        since, span = clock - clock.min(), max(float(np.ptp(clock)), 1e-300)
        dying = -span * np.expm1(-since / (settings.warming_share * span))
        return [signal.slope * since, signal.slope * dying]
    return [signal.slope]


def clock_time(samples: Samples, point_time: float = INSTRUMENTS.point_time) -> np.ndarray:
    """The time of the clock at every row, s: runs one after another, where each begins at zero again.

    The points of a map, which have no time, are `point_time` (s) apart.
    """
    out, end = np.zeros(len(samples)), 0.0
    seconds = np.where(omnibus.kinds(samples) == omnibus.POINTS, point_time, 1.0)
    for one in dict.fromkeys(samples.run):
        mine = samples.run == one
        time = (seconds * samples.time)[mine]
        begin = float(time[0]) if time[0] >= end else end
        out[mine] = time - time[0] + begin
        end = float(out[mine][-1])
    return out


def _laid_out(made: Sequence[tuple[Source, np.ndarray]], run: np.ndarray) -> InstrumentErrors:
    own = [each for each in made if each[0].kind in PER_RUN]
    common = [each for each in made if each[0].kind not in PER_RUN]
    empty = np.zeros((len(run), 0))
    arrays = [np.column_stack([column for _, column in part]) if part else empty for part in (own, common)]
    return InstrumentErrors(
        arrays[0], arrays[1], tuple(each for each, _ in own), tuple(each for each, _ in common), run
    )
