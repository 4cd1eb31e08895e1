"""Settings of every method of a diagnosis: each number with its unit, and where it comes from.

"Study" is the study of hidden effects, whose pages lie in tests/hidden/results. "Chosen" says that nobody derived it.
"""

from dataclasses import dataclass, field

from fitting.instruments.settings import InstrumentSettings
from fitting.least_squares.working_noise import NoiseSettings
from fitting.problem.unknowns import BELIEVED
from fitting.threads import worker_count


@dataclass(frozen=True)
class FlipTestSettings:
    """The test that anything is missing, by flips of the signs of groups of samples."""

    flips: int = 1999  # drawn signs, where not all are taken: no p-value is below 1/2000; chosen
    level: float = 0.01  # of the test; at 5 % a baseline could be both inadequate and without a missing effect: study
    level_of_blocks: float = 0.005  # of the same by flips of blocks, which rest on the noise model; chosen
    fewest_groups: int = 12  # fewer are divided further: 2 * 2**-11 is a tenth of the level; derived
    memories_of_block: float = 8.0  # correlation times (1 + m)/(1 - m) that a block lasts; chosen
    shortest_block: int = 20  # samples; chosen
    many: float = 2.5  # times the noise: a misfit, though flips may be blind to it; 1.25 raised 5 alarms in 24: study
    misfit_p: float = (
        1e-3  # p-value of the likelihood ratio of the bases that goes with it: a fifth of the level; study
    )


@dataclass(frozen=True)
class OddRunSettings:
    """Runs that differ from the others by more than their instruments may err by."""

    p_value: float = 1e-3  # of all runs together, that their errors are as allowed; chosen
    widths: float = 3.0  # accuracies, by which the largest error of an odd run must be off; chosen
    most: float = 0.25  # of all runs: where more are odd, the accuracies are wrong; chosen


@dataclass(frozen=True)
class LimitSettings:
    """Detection limits: amounts of an effect that are added to noise drawn anew."""

    power: float = 0.8  # share of recordings in which an effect of that size is found; the custom of power analysis
    draws: int = 24  # of noise, at most: one draw alone would scatter the limit by a quarter; study
    fewest_draws: int = 16  # of noise; chosen
    flips: int = 999  # of those of the test; chosen for speed
    entries: float = 1.2e7  # flips x columns x draws that are held at a time: 100 MB; chosen
    near: float = 0.03  # standard errors, to which the limit is found: half a percent of it; derived
    same: float = 0.999  # cosine from which columns are one, whose limit is found once; chosen
    least: float = 2.0  # standard errors, the lower end of the bracket: below, nothing is told from noise; chosen
    most: float = 30.0  # standard errors, the upper end; chosen


@dataclass(frozen=True)
class FitSettings:
    """Fits of sets of effects among all candidates."""

    padded: tuple[int, ...] = (24, 48)  # free parameters; each count is compiled once; chosen
    steps: int = 60  # of one search: what converges more slowly is of no use among many; chosen
    further: int = 2  # searches of a model alone behind the first, until one has converged; chosen
    searches: int = 6  # one after another, of what every set begins at; measured: a hose with creep needs 4; chosen
    screened: float = 1e-4  # of the sum of squares: a step that promises less ends a search among many; chosen
    decided: float = 1e-5  # the same of sets that are to be decided, and where data are asked what they hold; chosen
    inside: float = 0.1  # share of a range, where a parameter is tried that ended at the end of it; chosen
    undecided: float = 2.0  # times the mean square, of half the sum of squares: two standard errors; derived
    surely: float = 30.0  # times as much to first order: no refit is needed; 4 of 283 decided otherwise (20 mm hose)
    denied: float = 4.0  # standard errors of a stated measurement, from which a fit denies it; chosen
    believed: float = BELIEVED  # standard errors of a stated size, if a free fit denies it
    starts: int = 4  # of a new effect's parameters; chosen
    workers: int = field(default_factory=worker_count)  # compiled code leaves the lock of the interpreter alone


@dataclass(frozen=True)
class SearchSettings:
    """The search over sets of effects, level by level."""

    bettered: float = 0.6  # of its rms: a set that one more effect brings below was not the whole of it; study
    best_singles: int = 20  # from which pairs are built; study
    best_tripled: int = 12  # from which triples are built; study
    refitted: int = 24  # larger sets that survive the linear screening; study
    added: int = 18  # sets that a linear look suggests, each time; study
    grown: int = 6  # best smaller sets to which every other effect is added in a linear look; study
    rounds: int = 2  # of growing: the second grows what the best larger sets are made of; study
    tested_at_a_look: int = 4  # sets of two where none can stand, and larger ones where smaller stand; chosen
    tested: int = 16  # sets of one size; study
    hopeless: float = (
        0.25  # of the squared misfit, if all effects together leave more: no larger set explains it; chosen
    )
    unmoved: float = 1e-6  # share of the rows: an effect that changes less changes nothing; rounding


@dataclass(frozen=True)
class VerdictSettings:
    """What is said of the sets that were tested."""

    invisible: float = 0.02  # share of a signature's square that must survive the model's own parameters; chosen
    rounding: float = 1e-3  # share of a signature below which what survives is error of the slopes; chosen
    shown_amount: float = 0.1  # of an effect's declared size: if so little is found, the data see it; chosen
    similar: float = 0.9  # cosine of two signatures from which it is listed; chosen
    most_left: float = 0.25  # of the squared error, where runs that differ a little would have to do the rest; study
    unreal: float = 1e4  # times its usual size that an effect had to have to be seen; chosen
    followed: float = 0.1  # of the noise: a set that follows another's prediction so closely contains it; study
    clearly: float = 2.0  # standard errors of a fall of the held-out error; the custom of two
    rivalled_p: float = 0.005  # p-value below which a rival is seen in what an adequate set leaves; study
    leads: float = 0.01  # of the squared held-out error, below which a single effect leads nowhere; chosen
    each: int = 10  # readings for a fitted number, at least, where they alone decide: the criterion is for many; chosen
    likelier: float = 100.0  # times another set may be likelier than a named one; if larger, for each candidate; chosen
    worse: float = 3.0  # standard errors by which an adequate set may predict held-out runs worse than the best; study
    worse_share: float = 0.005  # of the squared error, by which it must be worse as well; chosen
    most_blamed: float = 0.1  # of full scale: in a set of several no instrument is believed to err by more; chosen
    untold: float = 0.1  # standard errors that no value of an effect reaches: nothing is known of it; chosen
    taken: float = 0.1  # share of a signature's square that one effect of the model alone absorbs; chosen
    spare_readings: int = 5  # readings more than fitted numbers, or nothing is judged; chosen
    ratio_p: float = 1e-4  # p-value of the likelihood ratio that leaves blocks of samples undecided; chosen
    helps: float = 0.98  # of the held-out error: an effect that leaves more is no near explanation; chosen
    explains: float = 0.9  # of what the model leaves unexplained: an effect that leaves more does not help; chosen
    nearest: int = 3  # explanations that are listed where none is adequate; chosen


@dataclass(frozen=True)
class DiagnosisSettings:
    """All of a diagnosis."""

    samples: int = 3500  # readings of all data sets together; more change nothing: study
    noise: NoiseSettings = field(default_factory=NoiseSettings)
    instruments: InstrumentSettings = field(default_factory=InstrumentSettings)
    flip_test: FlipTestSettings = field(default_factory=FlipTestSettings)
    fits: FitSettings = field(default_factory=FitSettings)
    search: SearchSettings = field(default_factory=SearchSettings)
    verdict: VerdictSettings = field(default_factory=VerdictSettings)


FLIP_TEST, LIMITS = FlipTestSettings(), LimitSettings()
FITS, SEARCH, VERDICT, ODD_RUNS = FitSettings(), SearchSettings(), VerdictSettings(), OddRunSettings()
DIAGNOSIS = DiagnosisSettings()
