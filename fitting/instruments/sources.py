"""Where an error of a reading comes from: which channel, and what of it stays the same."""

from dataclasses import dataclass, field
from enum import StrEnum

from fitting.recordings.accuracy import Channel


class ErrorKind(StrEnum):
    """What stays the same in an error: the names of accuracies, and what differs in the muscle from run to run."""

    ZERO = "zero"
    GAIN = "gain"
    ZERO_PER_RUN = "zero_per_run"
    GAIN_PER_RUN = "gain_per_run"
    HYSTERESIS = "hysteresis"
    DRIFT = "drift"
    SKEW = "skew"
    FRICTION_PER_RUN = "friction_per_run"


RELATIVE = (ErrorKind.GAIN, ErrorKind.GAIN_PER_RUN, ErrorKind.HYSTERESIS)  # sizes without a unit


@dataclass(frozen=True)
class Source:
    """Where an error comes from (channel None: the muscle), its accuracy, and the size that a column stands for.

    `allowed` and `width` in the unit of the kind: that of the channel, 1 for a share, unit/s for a drift, s for a skew.
    `presumed`: muscle.toml does not state the accuracy.
    """

    channel: Channel | None
    kind: ErrorKind
    allowed: float
    width: float
    presumed: bool = field(default=False, compare=False)
