"""What a rig's instruments make of what is there: errors drawn anew, as large as stated or presumed."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.signal import lfilter

from fitting.instruments.settings import INSTRUMENTS
from fitting.instruments.signals import Signal
from fitting.least_squares.working_noise import Noise
from fitting.recordings.accuracy import Accuracy, Channel, ChannelAccuracy
from fitting.recordings.noise import noise_of
from fitting.recordings.presumed import allowed
from fitting.recordings.records import NoiseSource, Recording, Run


@dataclass(frozen=True)
class Rig:
    """Draws the readings of one recording.

    `noise` is that of the force in readings' noises, `stride` how many of its samples lie between two for which that
    noise was estimated. Recordings of one accuracy were read by the same instruments: `common` keeps what they share,
    by channel, and is filled by the first of them.
    """

    recording: Recording
    noise: Noise
    stride: float
    random: np.random.Generator
    common: dict[Channel, tuple[float, ...]] = field(default_factory=dict)

    def readings(self, shown: Sequence[np.ndarray], length: float) -> list[Run]:
        """What is read of each run in which the muscle (of this length at rest, m) pulls with these forces (N).

        A motion that is read as force has no load cell: it has other noise, and nothing else.
        """
        if self.recording.noise_source is NoiseSource.MOTION:
            both = zip(self.recording.runs, shown, strict=True)
            return [replace(run, measured=force + self._wander(run)) for run, force in both]
        runs, accuracy, found = self.recording.runs, allowed(self.recording), self.recording.found
        forces = [self._delayed(run, force, accuracy.skew or 0.0) for run, force in zip(runs, shown, strict=True)]
        forces = self._systematic(Channel.FORCE, forces, accuracy.force)
        forces = [force + self._wander(run) for run, force in zip(runs, forces, strict=True)]
        pressures = self._read(Channel.PRESSURE, [run.pressure for run in runs], accuracy, found)
        ways = self._read(Channel.POSITION, [run.contraction * length for run in runs], accuracy, found)
        return [self._run(*each, length) for each in zip(runs, pressures, ways, forces, strict=True)]

    def _run(self, run: Run, pressure: np.ndarray, way: np.ndarray, force: np.ndarray, length: float) -> Run:
        return Run.as_read(
            name=run.name,
            time=run.time,
            pressure=pressure,
            contraction=way / length,
            measured=force,
            row=run.row,
            usable=run.usable,
            direction=run.branch if self.recording.test == "static" else None,
        )

    def _read(
        self, channel: Channel, there: Sequence[np.ndarray], accuracies: Accuracy, shown: Accuracy
    ) -> list[np.ndarray]:
        """Readings of a channel whose noise and resolution the recording itself shows, where they are not stated."""
        accuracy, found = getattr(accuracies, channel.value), getattr(shown, channel.value)
        noise = (accuracy.noise if accuracy.noise is not None else found.noise) or 0.0
        step = (accuracy.resolution if accuracy.resolution is not None else found.resolution) or 0.0
        read = [one + noise * self._normal(len(one)) for one in self._systematic(channel, there, accuracy)]
        return [np.round(one / step) * step for one in read] if step else read

    def _systematic(self, channel: Channel, there: Sequence[np.ndarray], accuracy: ChannelAccuracy) -> list[np.ndarray]:
        """What a channel shows whose zero, gain, hysteresis and drift err, one value for all runs or one for each."""
        size = lambda kind: (getattr(accuracy, kind) or 0.0) * float(self.random.standard_normal())  # noqa: E731
        if channel not in self.common:
            width = float(self.random.choice(INSTRUMENTS.hysteresis_widths))
            self.common[channel] = (*(size(kind) for kind in ("zero", "gain", "hysteresis", "drift")), width)
        zero, gain, lag, drift, width = self.common[channel]
        pace = INSTRUMENTS.point_time if self.recording.test == "static" else 1.0
        scale, clock, out = max(float(np.max(np.abs(one))) for one in there), 0.0, []
        for run, one in zip(self.recording.runs, there, strict=True):
            seconds = clock + pace * (run.time - run.time[0])
            clock = float(seconds[-1])
            shown = (1 + gain + size("gain_per_run")) * one + zero + size("zero_per_run") + drift * seconds
            out.append(shown + lag * scale * self._lag(one, scale, width) if lag else shown)
        return out

    def _lag(self, there: np.ndarray, scale: float, width: float) -> np.ndarray:
        still = np.zeros(len(there))
        return Signal(still, there, still, max(scale, 1e-300)).lags(still.astype(int), [width])[:, 0]

    def _delayed(self, run: Run, force: np.ndarray, skew: float) -> np.ndarray:
        """The force as the other channels' clock sees it, that is late by what channels may be apart."""
        if self.recording.test == "static" or not skew:
            return force
        return np.interp(run.time - skew * self.random.standard_normal(), run.time, force)

    def _wander(self, run: Run) -> np.ndarray:
        """The noise of the force, N: white, and slow wanders as those of the real recording."""
        count, noise = len(run), self.noise
        alone = self.recording.test == "static"  # every point was set anew
        out = np.sqrt(noise.white) * self._normal(count)
        for share, memory in zip(noise.shares, noise.memories, strict=True):
            if share > 0:
                kept = 0.0 if alone else memory ** (1 / self.stride)
                out += np.sqrt(share) * self._wandering(count, kept)
        return noise_of(self.recording) * out

    def _wandering(self, count: int, memory: float) -> np.ndarray:
        """An autoregression of unit variance."""
        steps = np.sqrt(1 - memory**2) * self._normal(count)
        steps[0] /= max(np.sqrt(1 - memory**2), 1e-12)
        return lfilter([1.0], [1.0, -memory], steps)

    def _normal(self, count: int) -> np.ndarray:
        return self.random.standard_normal(count)
