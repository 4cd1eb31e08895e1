"""Instruments that err: gauges, load cells and rulers as laboratories have them, and what the rig does unseen.

Every size is one standard deviation. What a run errs by is drawn once per run, what a recording errs by once per
recording, from the recording's seed and from random numbers of their own: the noise of the force stays the same in
every kind of instrument, and `EXACT` instruments leave every recording as it was without them.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace

import numpy as np

from .lost import SIZES, maxwell_slip
from .physics import Truth

STREAM = 4242  # beside the seed: the instruments' own random numbers
SLIP, SPREAD = 0.05, 3.0  # of full scale, where the cell's slip elements let go, and the ratio between them
EVER = float("inf")


@dataclass(frozen=True)
class Channel:
    """Errors of one instrument, in the SI unit of what it reads (Pa, N, m)."""

    noise: float = 0.0  # of one reading, independent of its neighbours
    resolution: float = 0.0  # step in which readings are rounded
    zero: float = 0.0  # added to every reading of the recording
    gain: float = 0.0  # relative, of every reading of the recording
    zero_per_run: float = 0.0  # added to every reading of one run
    gain_per_run: float = 0.0  # relative, of every reading of one run
    hysteresis: float = 0.0  # of full scale: what a falling quantity reads more than a growing one
    full_scale: float = 1000.0
    drift: float = 0.0  # of the zero, per second of the clock
    settling: float = EVER  # s: time constant with which the drift comes to rest

    def scaled(self, share: float) -> Channel:
        """The same instrument with errors `share` times as large."""
        kept = ("full_scale", "settling")
        return replace(self, **{f.name: share * getattr(self, f.name) for f in fields(self) if f.name not in kept})


@dataclass(frozen=True)
class Instruments:
    """Errors of all channels of a recording, and of the rig."""

    pressure: Channel = field(default_factory=Channel)
    force: Channel = field(default_factory=Channel)  # its noise is `Noise`, unless more white noise is asked for
    position: Channel = field(default_factory=Channel)
    skew: float = 0.0  # s by which the force is read later than the other channels, one value a run
    jitter: float = 0.0  # s, the same of single readings
    held_length: float = 0.0  # m by which a length that is held differs from the one written down, one value a run
    ripple: float = 0.0  # Pa, amplitude: the regulator answers the stroke, and the gauge does not show it
    ripple_pitch: float = 0.02  # m of stroke for one wave
    warming: float = 0.0  # share by which dry friction has changed when everything is warm; not drawn, always this size
    warm_after: float = 600.0  # s of the clock, time constant
    number: int | None = None  # of a set of instruments: what lasts is the same in all its recordings; None: a new set

    def scaled(self, share: float) -> Instruments:
        """The same rig with errors `share` times as large."""
        channels = {name: getattr(self, name).scaled(share) for name in ("pressure", "force", "position")}
        alone = ("skew", "jitter", "held_length", "ripple", "warming")
        return replace(self, **channels, **{name: share * getattr(self, name) for name in alone})


EXACT = Instruments()


@dataclass(frozen=True)
class Drawn:
    """What one channel errs by in one run."""

    zero: float
    gain: float
    hysteresis: float  # of full scale, never negative
    drift: float


@dataclass(frozen=True)
class RunErrors:
    """What every instrument errs by in one run; `random` draws what differs from reading to reading."""

    instruments: Instruments
    pressure: Drawn
    force: Drawn
    position: Drawn
    skew: float
    held_length: float
    phase: float
    random: np.random.Generator

    def rippled(self, pressure, stroke):
        """The muscle's pressure (Pa) where the regulator answers the stroke (m); its mean is what the gauge shows."""
        wave = np.sin(2 * np.pi * stroke / self.instruments.ripple_pitch + self.phase)
        return pressure + self.instruments.ripple * (wave - np.mean(wave))

    def warmed(self, truth: Truth, clock) -> Truth:
        """The muscle whose dry friction warms by the clock (s)."""
        if not self.instruments.warming:
            return truth
        factor = 1 + self.instruments.warming * -np.expm1(-np.asarray(clock) / self.instruments.warm_after)
        frictions = {name: changed(truth.effects[name], factor) for name in SIZES if name in truth.effects}
        return replace(truth, effects={**truth.effects, **frictions})

    def moments(self, time):
        """When (s) the force is read that stands beside `time`."""
        return time - self.skew + self.instruments.jitter * self.random.standard_normal(len(time))

    def shown(self, name: str, true, clock):
        """What the channel `name` makes of its true quantity, without noise; `clock` in s since the session began."""
        channel, drawn = getattr(self.instruments, name), getattr(self, name)
        lagging = true - drawn.hysteresis * channel.full_scale / 2 * slipped(true, channel.full_scale, drawn.hysteresis)
        return lagging * (1 + drawn.gain) + drawn.zero + drawn.drift * drifted(clock, channel.settling)

    def read(self, name: str, shown):
        """Readings of a channel: white noise added, rounded to its resolution."""
        channel = getattr(self.instruments, name)
        return rounded(shown + channel.noise * self.random.standard_normal(len(shown)), channel.resolution)


def changed(given: dict[str, float], factor) -> dict:
    """A dry friction whose size is `factor` (of every sample) times as large: all but an exponent are in proportion."""
    size = next(key for key in given if key != "beta")
    return {**given, size: given[size] * factor}


def slipped(true, full_scale: float, share: float):
    """Direction in [-1, 1] of a load cell's own friction: slip elements loaded from zero, with return-point memory."""
    if not share:
        return np.zeros(len(true))
    return maxwell_slip(np.concatenate([[0.0], true]), SLIP * full_scale, SPREAD)[1:]


def drifted(clock, settling: float):
    """Seconds of drift: those of the clock, or those that a drift which comes to rest has made of them."""
    return clock if settling == EVER else -settling * np.expm1(-np.asarray(clock) / settling)


def rounded(values, step: float):
    """Values in whole steps; 0 leaves them alone."""
    return step * np.round(values / step) if step else values


class Session:
    """The instruments of one recording: what errs all along is drawn now, the rest run by run."""

    def __init__(self, instruments: Instruments, seed: int):
        self.instruments, self.random = instruments, np.random.default_rng([seed, STREAM])
        channels = (instruments.pressure, instruments.force, instruments.position)
        made = self.random if instruments.number is None else np.random.default_rng([instruments.number, STREAM])
        self.lasting = [self.drawn(channel, made) for channel in channels]
        self.phase = made.uniform(0, 2 * np.pi)

    def drawn(self, channel: Channel, made: np.random.Generator) -> Drawn:
        """What a channel errs by in the whole recording."""
        zero, gain, hysteresis, drift = made.standard_normal(4)
        return Drawn(zero * channel.zero, gain * channel.gain, abs(hysteresis) * channel.hysteresis,
                     drift * channel.drift)  # fmt: skip

    def of_run(self, channel: Channel, lasting: Drawn) -> Drawn:
        """The same in one run."""
        zero, gain = self.random.standard_normal(2)
        return replace(lasting, zero=lasting.zero + zero * channel.zero_per_run,
                       gain=lasting.gain + gain * channel.gain_per_run)  # fmt: skip

    def next_run(self) -> RunErrors:
        """What the instruments err by in the next run."""
        mine = self.instruments
        pressure, force, position = map(self.of_run, (mine.pressure, mine.force, mine.position), self.lasting)
        skew, held = self.random.standard_normal(2)
        return RunErrors(mine, pressure, force, position, skew * mine.skew, held * mine.held_length, self.phase,
                         np.random.default_rng(self.random.integers(2**63)))  # fmt: skip


# Laboratory size: data sheets of a 10 bar gauge of class 0.25 read with 12 bits, a 1 kN load cell of class 0.1, an
# encoder, a length set with a ruler. A force noise of 0.6 N is what the zero of a run is set by.
KINDS = {
    "gauge noise": Instruments(pressure=Channel(noise=150.0)),
    "gauge resolution": Instruments(pressure=Channel(resolution=1e6 / 2**12)),
    "gauge zero and gain": Instruments(pressure=Channel(zero=500.0, gain=0.0025)),
    "gain per run": Instruments(force=Channel(gain_per_run=0.002)),
    "zero per run": Instruments(force=Channel(zero_per_run=0.6)),
    "hysteresis": Instruments(force=Channel(hysteresis=5e-4)),
    "drift": Instruments(force=Channel(drift=5.0 / 3600)),
    "skew": Instruments(skew=0.005),
    "position noise": Instruments(position=Channel(noise=1e-5)),
    "held length": Instruments(held_length=1e-3),
    "friction warming": Instruments(warming=0.02),
    "jitter": Instruments(jitter=0.001),
    "ripple": Instruments(ripple=100.0),
}
# No data sheet bounds what a regulator does where no gauge sees it: a small ripple is an effect that no library has,
# and no method can tell the two apart. It is a kind of its own and no part of what laboratories have all together.
LABORATORY = Instruments(
    pressure=Channel(noise=150.0, resolution=1e6 / 2**12, zero=500.0, gain=0.0025),
    force=Channel(zero_per_run=0.6, gain_per_run=0.002, hysteresis=5e-4, drift=5.0 / 3600),
    position=Channel(noise=1e-5),
    skew=0.005,
    jitter=0.001,
    held_length=1e-3,
    warming=0.02,
)
EVERY_KIND = {"exact": EXACT, **KINDS, "laboratory": LABORATORY}
