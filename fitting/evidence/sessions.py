"""Sessions diagnosed one after another: which models the evidence so far excludes, and which still stand."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from fitting.diagnosis.candidate_fit import CandidateFit
from fitting.diagnosis.diagnose import one_thread, prepared
from fitting.diagnosis.findings import RestsOn
from fitting.diagnosis.search import Search
from fitting.evidence.bets import Bets, bets_of
from fitting.evidence.growing import log_evidence, log_mean
from fitting.evidence.settings import EVIDENCE
from fitting.problem.varying import Varying
from fitting.progress import Progress
from fitting.recordings.records import Experiment
from mckibben_jax.effect import Effect

Added = tuple[str, ...]  # effects that were added to the model; () for the model as it is


@dataclass(frozen=True)
class Weighed:
    """A model and the evidence against it after each session."""

    added: Added
    evidence: tuple[float, ...]  # how many to one, after each session
    rmse: float  # N, of all readings of all sessions, each session fitted by itself
    points_at: str | None  # the candidate along which the evidence is largest

    def excluded_by(self, enough: float = EVIDENCE.enough) -> int | None:
        """The number of the session (from 0) at which the evidence first was enough, and stays so; None if never."""
        return next((k for k, value in enumerate(self.evidence) if value >= enough), None)


@dataclass(frozen=True)
class GrowingEvidence:
    """Models weighed by sessions in their order: the model as it is, and with each single candidate."""

    sessions: tuple[str, ...]
    rests_on: tuple[RestsOn, ...]  # of each session's scores
    as_it_is: Weighed
    singles: tuple[Weighed, ...]  # those that stand first, each part with the smallest error first
    enough: float = field(default=EVIDENCE.enough)

    @property
    def is_lacking(self) -> bool:
        """Whether something is missing from the model."""
        return self.as_it_is.excluded_by(self.enough) is not None

    @property
    def standing(self) -> tuple[Weighed, ...]:
        """Models with one effect more that no session has excluded."""
        return tuple(each for each in self.singles if each.excluded_by(self.enough) is None)


@dataclass(frozen=True)
class _Session:
    bets: Mapping[Added, Bets]
    squares: Mapping[Added, float]  # sums of squares, N^2
    readings: int
    rests_on: RestsOn


def weigh(
    sessions: Sequence[Experiment],
    effects: Sequence[Effect],
    *,
    candidates: Sequence[Effect] | None = None,
    fix: Sequence[str] = (),
    free: Sequence[str] = (),
    seed: int = 0,
    start: Mapping[str, float] | None = None,
    progress: Progress | None = None,
) -> GrowingEvidence:
    """Weigh a model of `effects` and each larger one by these data sets of one muscle, in the order of recording.

    Every session is fitted by itself, and what it says is multiplied. A model is excluded when the evidence against it
    reaches `enough`: at most one in a hundred right models ever is, however many sessions follow and whenever one
    stops. That is so if instruments err as stated or presumed and are the same in all sessions.
    """
    varying, heard = Varying(tuple(fix), tuple(free)), list[_Session]()
    for number, session in enumerate(sessions):
        if progress is not None:
            progress(f"session {session.name}", number / len(sessions))
        heard.append(_heard(prepared([session], effects, candidates, varying, seed, None, start)))
    return concluded([session.name for session in sessions], heard)


def _heard(search: Search) -> _Session:
    """What one session says of the model, and of every model with one effect more."""
    with one_thread():
        search.fit_singles()
        fits: dict[Added, CandidateFit] = {(): search.base}
        fits |= {tuple(sorted(added)): search.seen.decided(fit) for added, fit in search.fits.items()}
        world, examiner = search.world, search.examiner
        readings = int(np.sum(world.in_newtons))
        squares = {key: readings * world.rmse(fit.plain.rows) ** 2 for key, fit in fits.items()}
        bets = {key: bets_of(examiner, fit) for key, fit in fits.items()}
    return _Session(bets, squares, readings, examiner.rests_on)


def concluded(names: Sequence[str], heard: Sequence[_Session]) -> GrowingEvidence:
    """What sessions add up to; a model that some session could not be fitted with is left out."""
    keys = [key for key in heard[0].bets if all(key in session.bets for session in heard)]
    weighed = [_weighed(key, heard) for key in keys]
    as_it_is, *singles = sorted(weighed, key=lambda w: (len(w.added), w.excluded_by() is not None, w.rmse))
    return GrowingEvidence(tuple(names), tuple(session.rests_on for session in heard), as_it_is, tuple(singles))


def _weighed(key: Added, heard: Sequence[_Session]) -> Weighed:
    by_candidate = log_evidence([session.bets[key] for session in heard])
    most = max(by_candidate, key=lambda name: by_candidate[name][-1], default=None)
    logs = log_mean(by_candidate) if by_candidate else np.zeros(len(heard))
    rmse = np.sqrt(sum(s.squares[key] for s in heard) / sum(s.readings for s in heard))
    evidence = tuple(float(value) for value in np.exp(np.minimum(logs, 600.0)))
    return Weighed(key, evidence, float(rmse), most if most and by_candidate[most][-1] > 0 else None)
