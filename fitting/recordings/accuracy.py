"""How far the instruments of a recording may err: as muscle.toml states it, else presumed of their class.

An accuracy is one standard deviation. Errors that stay the same for a whole recording, for one run, or while the load
grows or falls are no noise: no number of readings averages them out.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, fields, replace
from enum import StrEnum


class Channel(StrEnum):
    """A quantity that an instrument reads."""

    PRESSURE = "pressure"
    POSITION = "position"
    FORCE = "force"
    TIME = "time"
    FRICTION = "friction"  # read by no instrument: what differs in the muscle from run to run


@dataclass(frozen=True)
class ChannelAccuracy:
    """Standard deviations of the errors of one channel, in its SI unit (Pa, m, N); None is neither stated nor known."""

    noise: float | None = None  # of one reading, independent of its neighbours
    resolution: float | None = None  # step in which readings are rounded
    zero: float | None = None  # added to every reading of the recording
    gain: float | None = None  # relative, of every reading of the recording
    zero_per_run: float | None = None  # added to every reading of one run
    gain_per_run: float | None = None  # relative, of every reading of one run
    hysteresis: float | None = None  # relative to full scale: between readings of a growing and of a falling quantity
    drift: float | None = None  # of the zero, per second of the clock

    def filled_from(self, other: "ChannelAccuracy") -> "ChannelAccuracy":
        """The same, with what is None taken from another."""
        mine = {each.name: getattr(self, each.name) for each in fields(self)}
        return ChannelAccuracy(**{k: getattr(other, k) if v is None else v for k, v in mine.items()})


@dataclass(frozen=True)
class Accuracy:
    """The accuracies of all channels of one recording."""

    pressure: ChannelAccuracy = field(default_factory=ChannelAccuracy)
    position: ChannelAccuracy = field(default_factory=ChannelAccuracy)
    force: ChannelAccuracy = field(default_factory=ChannelAccuracy)
    skew: float | None = None  # s, between the force and the other channels, one value a run
    friction_per_run: float | None = None  # relative: what the muscle's friction differs by between runs
    presumed: frozenset[tuple[str, str]] = field(default=frozenset(), compare=False)  # channels and kinds not stated

    def presuming(self, other: "Accuracy") -> "Accuracy":
        """The same, with what is None taken from another, and noted as presumed."""
        channels = {
            name: getattr(self, name).filled_from(getattr(other, name)) for name in ("pressure", "position", "force")
        }
        return Accuracy(
            **channels,
            skew=other.skew if self.skew is None else self.skew,
            friction_per_run=other.friction_per_run if self.friction_per_run is None else self.friction_per_run,
            presumed=frozenset(self._not_stated()),
        )

    def without(self, errors: Iterable[tuple[str, str]]) -> "Accuracy":
        """The same where these errors (channel and kind) are none: what a model knows of them stands in an effect."""
        exact = self
        for channel, kind in errors:
            if channel == Channel.TIME:
                exact = replace(exact, skew=0.0)
            else:
                exact = replace(exact, **{channel: replace(getattr(exact, channel), **{kind: 0.0})})
        return exact

    def _not_stated(self) -> Iterator[tuple[str, str]]:
        for channel in (Channel.PRESSURE, Channel.POSITION, Channel.FORCE):
            mine = getattr(self, channel.value)
            yield from ((channel.value, each.name) for each in fields(mine) if getattr(mine, each.name) is None)
        if self.skew is None:
            yield Channel.TIME.value, "skew"
        if self.friction_per_run is None:
            yield Channel.FRICTION.value, "friction_per_run"


NOTHING_STATED = Accuracy()
