"""What a diagnosis or a discovery notes on its way, as data: what texts and pages need, and nothing that computes."""

from dataclasses import dataclass
from enum import StrEnum

from fitting.instruments.settings import INSTRUMENTS
from fitting.instruments.sources import Source


class GroupKind(StrEnum):
    """What one group of samples is."""

    LOOP = "loops"
    HALF_LOOP = "half loops"
    POINT = "single points"
    BLOCK = "blocks"


@dataclass(frozen=True)
class RestsOn:
    """What a test rests on: how many groups of samples were flipped, and of which kinds."""

    groups: int
    kinds: tuple[GroupKind, ...]
    block_samples: int = 0  # of each block, where blocks are flipped: then the test rests on the noise model


@dataclass(frozen=True)
class InstrumentAnswer:
    """One kind of error of one channel (`source`), in the unit of its kind, as standard deviations.

    `found` is its most likely size, all others being within their accuracy; `needed` the size with which nothing would
    be missing, None where none is missing, or where no size of this error explains the misfit.
    """

    source: Source
    found: float
    needed: float | None

    @property
    def is_beyond(self) -> bool:
        """Whether the readings ask for far more than is allowed; not of what is taken as exact."""
        return 0 < INSTRUMENTS.beyond * self.source.allowed < self.found


@dataclass(frozen=True)
class Blamed:
    """An error of an instrument that an explanation stands for: its effect, what is allowed of it, and its size.

    `among` are all effects of the explanation, itself among them, by name. `size` is in the unit of the source's kind;
    `share` is of full scale, None where that says nothing.
    """

    effect: str
    among: tuple[str, ...]
    source: Source
    size: float
    share: float | None


@dataclass(frozen=True)
class OddRun:
    """A run that errs by `size` (in the unit of the source) more than its instruments allow."""

    file: str
    run: str
    source: Source
    size: float
    p_value: float  # of the test that nothing is missing from the model, without this run


class Fault(StrEnum):
    """Why a step is not kept."""

    RISES = "raises the error in sample"
    NO_GAIN = "does not lower the held-out error by more than its standard error"
    SMALL_GAIN = "lowers the held-out error by less than a tenth"
    BOUND = "ends at its bound"
    DENIES = "denies what was measured"
    UNKNOWN = "is smaller than its standard error"
    FEW = "leaves too few readings for its numbers"


@dataclass(frozen=True)
class Objection:
    """One reason against a step: which parameter it is about, if any, and by how much (standard errors, or a share)."""

    reason: Fault
    about: str = ""
    size: float | None = None


@dataclass(frozen=True)
class Attempt:
    """A larger model that was fitted and not kept, its errors (N), and why.

    `confined`: with the stated sizes of the muscle kept to what was stated, for a free fit denied one of them.
    """

    effects: tuple[str, ...]
    rmse: float
    held_out_rmse: float
    why: tuple[Objection, ...]
    confined: bool = False
