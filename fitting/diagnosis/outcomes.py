"""How a diagnosis can end, and why an effect is not tested, not adequate or not named: as data, not as sentences."""

from dataclasses import dataclass
from enum import Enum, StrEnum, auto


class Verdict(StrEnum):
    """What a diagnosis says."""

    NOTHING = "nothing detectable"
    MISSING = "missing"
    ONE_OF = "one of"
    NOT_IN_LIBRARY = "not in the library"
    INCONCLUSIVE = "inconclusive"
    WITHIN_INSTRUMENTS = "within the instruments"


NOTHING_MISSING = frozenset({Verdict.NOTHING, Verdict.WITHIN_INSTRUMENTS})  # the model stands as it is


class Reason(Enum):
    """Why something is not tested, not adequate, not named, or not decided."""

    NEEDS = auto()  # an effect cannot be tested without what is named
    NO_FORCE = auto()  # an effect cannot be tested where no force was measured
    NO_NUMBER = auto()  # an effect gives no number on these data
    NOT_FITTED = auto()  # an effect cannot be tested
    NOT_SEEN = auto()  # these data cannot see an effect
    FAR_WORSE = auto()  # a set is not tested: others leave far less
    LARGE_MISFIT = auto()  # a set leaves many times the noise
    STILL_MISSING = auto()  # something is still missing from a set
    MOST_LEFT = auto()  # a set leaves most of the error, many times the noise
    AT_BOUND = auto()  # the named parameters end at their bounds
    CONTRADICTS = auto()  # a set contradicts the named measurements
    UNBELIEVED = auto()  # a set of several needs an instrument that errs by a large part of full scale
    UNTOLD = auto()  # a set of several has effects of which the data tell no value at all
    NO_GAIN = auto()  # a set does not lower the held-out error
    BETTERED = auto()  # one more effect brings the error far down
    PREDICTS_WORSE = auto()  # an adequate set predicts held-out runs worse than others
    RIVAL_SEEN = auto()  # others are seen in what an adequate set leaves
    LESS_LIKELY = auto()  # an adequate set leaves so much more than another that it is out of the question
    SPECIAL_CASE = auto()  # an adequate set contains the named one, which does as well
    FEW_READINGS = auto()  # too few readings for the fitted numbers
    TEST_BLIND = auto()  # an added effect lowers the error, but the test sees nothing missing
    FEW_LOOPS = auto()  # too few loops to flip, and the noise model alone rejects
    FAINT = auto()  # the named effects could hide at more than the noise of a reading
    ONLY_MOTIONS = auto()  # motions that show neither a break-away nor a standstill


@dataclass(frozen=True)
class Why:
    """One reason, with what it is about: effects, parameters or needs by name, a p-value, counts."""

    reason: Reason
    names: tuple[str, ...] = ()
    p_value: float | None = None
    readings: int = 0
    fitted: int = 0  # numbers


@dataclass(frozen=True)
class Screened:
    """How many sets of one size were refitted, of how many there are; a linear look left out the others."""

    size: int
    refitted: int
    possible: int
