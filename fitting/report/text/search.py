"""How the search for a fit ended, in words."""

from fitting.least_squares.record import Fit
from fitting.least_squares.summary import FailedStart, Failure
from fitting.problem.no_number import state_at
from fitting.showing import counted

UNBENT = (
    "it bends to errors that instruments may have made, so another point was taken, whose error is a little larger and "
    "which leaves less beyond the instruments"
)


def search_text(fit: Fit) -> str:
    """From how many places it began, and how many ended at the best point."""
    s = fit.search
    if s.evaluated:
        return "evaluated, not fitted"
    if not s.starts:
        return "not fitted"
    begun = ""
    if s.stretches:
        begun = (
            f"multiple shooting, {s.stretches} stretches a run, from {s.shooting_starts} starts; from its best ends "
        )
    if not s.reached:
        return f"{begun}none of {s.starts} starts gave finite numbers"
    ended = f"{begun}{counted(s.starts, 'start')}: {s.reached} reached the same best point"
    return f"{ended}; {UNBENT}" if s.unbent else ended


def failure_texts(fit: Fit) -> list[str]:
    """What went wrong on the way, a sentence each."""
    return [_failure_text(fit, failure) for failure in fit.failures]


def _failure_text(fit: Fit, failure: Failure) -> str:
    if not isinstance(failure, FailedStart):
        return (
            f"the motions are missed by {failure.noises:.0f} times their noise, and {failure.reached} of "
            f"{failure.starts} starts ended there: the model lacks something, or the "
            "search was caught in a poor neighbourhood; a fit with --shooting 8 tells which"
        )
    if failure.sample is None:
        return f"start {failure.start}: the search met a state without finite numbers and stopped"
    row, state = fit.samples.row[failure.sample], state_at(fit.samples, failure.sample)
    return f"start {failure.start}: the model gives no finite number at row {row} ({state})"
