"""Settings of design files and sweeps: each number with its unit. All were chosen: nobody derived them."""

from dataclasses import dataclass


@dataclass(frozen=True)
class FileSettings:
    """What a design file may ask for: what memory has room for."""

    starts: int = 10_000  # of the search for the best design; chosen
    best: int = 1_000_000  # designs that are kept; chosen
    bins: int = 100_000  # of a histogram; chosen
    count: int = 10**12  # designs of a sweep, and any other whole number; chosen


@dataclass(frozen=True)
class SweepSettings:
    """How a sweep is done, and what is kept where the file does not say."""

    piece: int = 2**20  # designs of a file, or of one step of progress; chosen
    look: int = 4096  # designs that the range of a histogram is taken from; chosen
    best: int = 1000  # designs that are kept; chosen
    save_every: float = 2.0  # s between writings of what is known so far; chosen


LIMITS, SWEEP = FileSettings(), SweepSettings()
