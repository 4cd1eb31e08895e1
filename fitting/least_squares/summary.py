"""How the search for a fit ended, as data: `report` makes the sentences."""

from dataclasses import dataclass


@dataclass(frozen=True)
class SearchSummary:
    """From how many places a search began, and how many of them ended at the best point."""

    starts: int = 0  # 0: nothing was searched
    reached: int = 0  # the same best point; 0 where no start gave finite numbers
    stretches: int = 0  # of each run in the multiple shooting from whose best ends the search began; 0: there was none
    shooting_starts: int = 0  # of that
    of_forces: "SearchSummary | None" = None  # of the fit to the motions read as force, at whose best end it began
    evaluated: bool = False  # at values that were given
    unbent: bool = False  # whether the best point was left for one in a valley that instruments do not bend


@dataclass(frozen=True)
class FailedStart:
    """A start from which the search met no finite numbers."""

    start: int  # its number, from 1
    sample: int | None  # of the fit, at which the model gives none where the search begins; None: later on its way


@dataclass(frozen=True)
class MissedMotions:
    """Motions that a fit misses by far: the model lacks something, or the search was caught on its way."""

    noises: float  # root mean square error, in standard deviations of the noise
    reached: int  # starts that ended there
    starts: int
    as_force: float | None = None  # the same of the fit to the motions read as force, if there was one


Failure = FailedStart | MissedMotions
