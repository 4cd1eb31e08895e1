"""What each channel of a recording may err by: as its readings show, as muscle.toml states, as is presumed."""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from fitting.recordings import motion_signals as signals
from fitting.recordings.accuracy import Accuracy, Channel, ChannelAccuracy
from fitting.recordings.inputs import SETTINGS, rounding, stamp_error
from fitting.recordings.noise import noise_of
from fitting.recordings.presumed import allowed
from fitting.recordings.records import FORCE_TESTS, NoiseSource, Recording, Run
from fitting.recordings.settings import ACCURACY

UNITS = {Channel.PRESSURE: "Pa", Channel.POSITION: "m", Channel.FORCE: "N", Channel.TIME: "s", Channel.FRICTION: "1"}
ONLY = {Channel.TIME: "skew", Channel.FRICTION: "friction_per_run"}  # what has one error alone
ROUNDING = 12**-0.5  # of a step, the standard deviation of what is rounded to it
WHITE = ("noise", "resolution")  # errors that readings themselves show


@dataclass(frozen=True)
class ChannelErrors:
    """The errors of one channel of one recording, in its SI `unit`; None is not known."""

    file: str
    channel: Channel
    unit: str
    found: ChannelAccuracy  # noise and resolution, as the readings show them
    allowed: ChannelAccuracy  # as stated, else as presumed
    only: dict[str, float]  # by its name, the one error of what has no other: TIME (s), FRICTION (relative)
    stated: tuple[str, ...]  # names of the errors that muscle.toml states

    @property
    def noise(self) -> float | None:
        """Standard deviation of one reading: as stated; else as found, but no less than a stated rounding makes."""
        if "noise" in self.stated or self.found.noise is None:
            return self.allowed.noise if "noise" in self.stated else None
        return max(self.found.noise, self._of_stated_rounding)

    @property
    def noise_is_stated(self) -> bool:
        """Whether muscle.toml has the last word on the noise of one reading."""
        return "noise" in self.stated or self._of_stated_rounding > (self.found.noise or 0.0)

    @property
    def _of_stated_rounding(self) -> float:
        return ROUNDING * (self.allowed.resolution or 0.0) if "resolution" in self.stated else 0.0

    @property
    def resolution(self) -> float | None:
        """Step in which readings are rounded: as stated, else as found; None where they are not."""
        return self.allowed.resolution if "resolution" in self.stated else self.found.resolution

    @property
    def systematic(self) -> dict[str, float]:
        """The errors that no number of readings averages out, by name."""
        if self.channel in ONLY:
            return self.only
        errors = ((each.name, getattr(self.allowed, each.name)) for each in fields(ChannelAccuracy))
        return {name: size for name, size in errors if size is not None and name not in WHITE}


def channel_errors(recording: Recording) -> tuple[ChannelErrors, ...]:
    """The errors of every channel that the recording has."""
    limits, found = allowed(recording), _found(recording)
    return tuple(
        ChannelErrors(
            recording.file,
            channel,
            UNITS[channel],
            getattr(found, channel, ChannelAccuracy()),
            getattr(limits, channel, ChannelAccuracy()),
            _only(limits, channel),
            _stated(recording.accuracy, channel),
        )
        for channel in _channels(recording)
    )


def _channels(recording: Recording) -> tuple[Channel, ...]:
    """Those that were read: a motion that is read as force has no load cell, points have no time."""
    force = recording.test in FORCE_TESTS and recording.noise_source is not NoiseSource.MOTION
    there = {Channel.FORCE: force, Channel.TIME: recording.test != "static"}
    return tuple(channel for channel in Channel if there.get(channel, True))


def _only(accuracy: Accuracy, channel: Channel) -> dict[str, float]:
    size = getattr(accuracy, ONLY[channel]) if channel in ONLY else None
    return {} if size is None else {ONLY[channel]: size}


def _stated(accuracy: Accuracy, channel: Channel) -> tuple[str, ...]:
    if channel in ONLY:
        return tuple(_only(accuracy, channel))
    stated: ChannelAccuracy = getattr(accuracy, channel)
    return tuple(each.name for each in fields(stated) if getattr(stated, each.name) is not None)


def _found(recording: Recording) -> Accuracy:
    """What the readings show: of a force, the scatter of neighbours within branches, as `noise_of` has it."""
    if recording.test not in FORCE_TESTS or recording.test == "static":
        return recording.found
    scatter = noise_of(replace(recording, noise=None))
    return replace(recording.found, force=replace(recording.found.force, noise=scatter))


def found_errors(parts: Sequence[Run], test: str, length: float) -> Accuracy:
    """Noise and resolution that readings show, before anything is estimated; `length` of the muscle in m."""
    of_force = test in FORCE_TESTS
    position = [length * part.contraction if of_force else part.measured for part in parts]
    return Accuracy(
        pressure=_white([part.pressure for part in parts], parts, test),
        position=_white(position, parts, test),
        force=_white([part.measured for part in parts], parts, test) if of_force else ChannelAccuracy(),
    )


def _white(readings: Sequence[np.ndarray], parts: Sequence[Run], test: str) -> ChannelAccuracy:
    """Noise of one reading, and the step of rounding if there is one; neither is seen in points without history."""
    if test == "static":
        return ChannelAccuracy()
    levels = [_noise(part.time, values) for part, values in zip(parts, readings, strict=True)]
    noise, together = float(np.median(levels)), np.concatenate(readings)
    step = rounding(together)
    finest, coarsest = ACCURACY.rounded * float(np.abs(together).max()), ACCURACY.coarsest * noise
    return ChannelAccuracy(noise=noise, resolution=step if finest < step < coarsest else None)


def _noise(time: np.ndarray, reading: np.ndarray) -> float:
    """Standard deviation of one reading's error: not what rounded time stamps seem to add, nor a set-point's steps."""
    changes = np.count_nonzero(np.diff(reading))
    if changes < min(ACCURACY.changes, len(reading) / 2):
        return 0.0
    level, dust = signals.noise_level(time, reading), ACCURACY.dust * float(np.abs(reading).max())
    return level if level > max(SETTINGS.stamps * stamp_error(time, reading), dust) else 0.0
