"""How the search for a fit ended, in words."""

from fitting.least_squares.record import Fit
from fitting.least_squares.summary import Failure, MissedMotions, SearchSummary
from fitting.problem.no_number import state_at
from fitting.showing import counted

UNBENT = (
    "it bends to errors that instruments may have made, so another point was taken, whose error is a little larger and "
    "which leaves less beyond the instruments"
)
AS_NOISE = 1.5  # times the noise of one reading: what misses by less leaves noise alone, more or less


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
    if s.of_forces is not None:
        begun = f"motions read as force, {_ended(s.of_forces)}; from there on the motions themselves, "
    if not s.reached:
        return f"{begun}none of {s.starts} starts gave finite numbers"
    return f"{begun}{_ended(s)}; {UNBENT}" if s.unbent else f"{begun}{_ended(s)}"


def _ended(s: SearchSummary) -> str:
    return f"{counted(s.starts, 'start')}: {s.reached} reached the same best point"


def failure_texts(fit: Fit) -> list[str]:
    """What went wrong on the way, a sentence each."""
    return [_failure_text(fit, failure) for failure in fit.failures]


def _failure_text(fit: Fit, failure: Failure) -> str:
    if isinstance(failure, MissedMotions):
        return _missed_text(failure)
    if failure.sample is None:
        return f"start {failure.start}: the search met a state without finite numbers and stopped"
    row, state = fit.samples.row[failure.sample], state_at(fit.samples, failure.sample)
    return f"start {failure.start}: the model gives no finite number at row {row} ({state})"


def _missed_text(missed: MissedMotions) -> str:
    told = f"the recorded motions are missed by {missed.noises:.0f} times their noise"
    if missed.as_force is not None and missed.as_force < AS_NOISE:
        return (
            f"{told}, where read as force they are missed by {missed.as_force:.1f} times: what is wrong is small "
            "against the forces, as a position that is late or has a zero or a gain, or friction at a standstill"
        )
    return (
        f"{told}, and {missed.reached} of {missed.starts} starts ended there. Either the model lacks something, or the "
        "search stopped far from the best values: 'mckibben fit' with --shooting 8, which follows each motion in 8 "
        "pieces, tells which"
    )
