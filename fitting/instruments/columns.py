"""Every error that instruments are allowed, as columns: the change of the rows by one standard deviation of it."""

from collections.abc import Mapping, Sequence
from itertools import product

import numpy as np

from fitting.instruments.errors import InstrumentErrors
from fitting.instruments.settings import INSTRUMENTS, InstrumentSettings
from fitting.instruments.signals import Signal
from fitting.instruments.sources import RELATIVE, ErrorKind, Source
from fitting.problem.kinds import POINTS, kinds
from fitting.problem.residuals import Samples
from fitting.recordings.accuracy import Accuracy, Channel, ChannelAccuracy


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
                width = _width(kind, getattr(allowed, kind.value) or 0.0, signal, clock, every, settings)
                source = _source(accuracy, channel, kind, getattr(allowed, kind.value) or 0.0, width)
                if source.width > 0:
                    found = _columns(kind, signal, clock, samples.run, settings)
                    made += [(source, np.where(mine, source.width * column, 0.0)) for column in found]
        skew, force = accuracy.skew or 0.0, signals[Channel.FORCE]
        source = _source(accuracy, Channel.TIME, ErrorKind.SKEW, skew, max(skew, settings.least_skew * every))
        if source.width > 0:
            made.append((source, np.where(mine, source.width * force.slope * force.rate, 0.0)))
        differs = accuracy.friction_per_run or 0.0
        width = max(differs, settings.least_share * every)
        source = _source(accuracy, Channel.FRICTION, ErrorKind.FRICTION_PER_RUN, differs, width)
        if source.width > 0:
            made += [(source, np.where(mine, source.width * column, 0.0)) for column in friction.T]
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
    own, common = 0, 0
    for accuracy in dict.fromkeys(accuracies):
        for channel, kind in product((Channel.PRESSURE, Channel.POSITION, Channel.FORCE), KINDS):
            if getattr(getattr(accuracy, channel.value), kind.value):
                own += kind in PER_RUN
                common += several.get(kind, 1) * (kind not in PER_RUN)
        own += bool(accuracy.skew) + lost * bool(accuracy.friction_per_run)
    return runs * own + common


def most_independent(accuracies: Sequence[Accuracy], runs: int, held: int, lost: int) -> int:
    """How many of them may be independent, where so many of the runs are held at one length.

    Nothing is lost to friction there, and a length that is off changes the force as a gain of the load cell does.
    """
    own = lambda accuracy: (  # noqa: E731
        lost * bool(accuracy.friction_per_run)
        + bool(accuracy.position.zero_per_run or accuracy.position.gain_per_run) * bool(accuracy.force.gain_per_run)
    )
    alike = max(map(own, accuracies), default=0)
    return most_errors(accuracies, runs, lost) - held * alike


def _source(accuracy: Accuracy, channel: Channel, kind: ErrorKind, allowed: float, width: float) -> Source:
    """One kind of error of a channel; what friction differs by is of the muscle."""
    presumed = (channel.value, kind.value) in accuracy.presumed
    return Source(None if channel is Channel.FRICTION else channel, kind, allowed, width, presumed)


def _width(
    kind: ErrorKind, allowed: float, signal: Signal, clock: np.ndarray, every: bool, settings: InstrumentSettings
) -> float:
    """The size that a column of one kind stands for; where none is allowed but `every` is asked for, a small one."""
    small = settings.least_share
    if kind not in RELATIVE:
        small *= signal.full_scale
    if kind is ErrorKind.DRIFT:
        small /= max(float(np.ptp(clock)), 1e-300)
    return allowed or small * every


def _columns(
    kind: ErrorKind, signal: Signal, clock: np.ndarray, run: np.ndarray, settings: InstrumentSettings
) -> list[np.ndarray]:
    """Changes of the rows by one unit of one kind of error of a channel.

    Where nobody knows how an error goes there are several columns, of which each has its share of the variance: where
    they agree they vary together by as much as the accuracy says.
    """
    if kind in (ErrorKind.GAIN, ErrorKind.GAIN_PER_RUN):
        return [signal.slope * signal.reading]
    if kind is ErrorKind.HYSTERESIS:
        # by half its width either way; and a cell's full scale, of which it is a share, is twice what most tests reach
        lags = signal.lags(run, settings.hysteresis_widths).T
        return [signal.slope * signal.full_scale * lag / np.sqrt(len(lags)) for lag in lags]
    if kind is ErrorKind.DRIFT:  # from the first reading on: a steady one, and one that dies away as what warms up does
        since, span = clock - clock.min(), max(float(np.ptp(clock)), 1e-300)
        dying = -span * np.expm1(-since / (settings.warming_share * span))
        return [signal.slope * way / np.sqrt(2) for way in (since, dying)]
    return [signal.slope]


def clock_time(samples: Samples, point_time: float = INSTRUMENTS.point_time) -> np.ndarray:
    """The time of the clock at every row, s: runs one after another, where each begins at zero again.

    The points of a map, which have no time, are `point_time` (s) apart.
    """
    out, end = np.zeros(len(samples)), 0.0
    seconds = np.where(kinds(samples) == POINTS, point_time, 1.0)
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
