"""What a search over sets of effects came to."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import comb

from fitting.diagnosis.adequacy import AdequacyTest
from fitting.diagnosis.candidate_fit import CandidateFit
from fitting.diagnosis.examine import Examiner
from fitting.diagnosis.outcomes import Screened
from fitting.diagnosis.universe import Universe
from fitting.least_squares.record import Fit


@dataclass(frozen=True)
class SearchResult:
    """Every fit and every test of a search, by the set that was added."""

    world: Universe
    base: CandidateFit
    baseline: Fit
    examiner: Examiner
    missing_effect_test: AdequacyTest  # of the base itself
    base_is_adequate: bool
    fits: Mapping[frozenset[str], CandidateFit]
    adequacy_tests: Mapping[frozenset[str], AdequacyTest]
    adequate: tuple[frozenset[str], ...]
    numberless: frozenset[frozenset[str]]  # sets that give no number, from any starting value
    notes: tuple[str, ...] = ()  # on the recordings
    moving_only: bool = False  # all that is tested are motions read as force
    run_names: tuple[tuple[str, str], ...] = ()  # file and name of each run, as samples number them
    hopeless: bool = False  # no three effects were looked for, for all together would not do

    @property
    def noise(self) -> float:
        """What noise alone leaves, N: the least that any tested set and the omnibus basis left of it together."""
        return min(adequacy.noise for adequacy in (self.missing_effect_test, *self.adequacy_tests.values()))

    @property
    def screened(self) -> tuple[Screened, ...]:
        """How many pairs and triples were fitted, of how many, where smaller sets did not do."""
        sizes = sorted({len(added) for added in self.adequacy_tests if len(added) > 1})
        sizes += [3] * self.hopeless
        whole = len(self.world.candidates)
        return tuple(Screened(n, sum(len(added) == n for added in self.fits), comb(whole, n)) for n in sizes)
