"""The numbers that sampling rests on, by method. Where no source is named they were chosen: nobody derived them."""

from dataclasses import dataclass, field

from fitting.instruments.settings import INSTRUMENTS
from fitting.threads import worker_count


@dataclass(frozen=True)
class SamplerSettings:
    """How chains of emcee are grown, and when they are long enough."""

    rows: int = 4000  # readings that are enough; more are thinned
    ensembles: int = 4  # independent ones: walkers of one ensemble are no independent chains
    fewest_walkers: int = 32  # of one ensemble
    spread: float = 2.0  # standard deviations over which walkers start: wider than the answer, so that R-hat can tell
    warm_up: int = 150  # steps from which the shape of the posterior is learnt; not kept
    burn_in: int = 4  # one step in so many, from the first on, is left out of the chains
    fewest_steps: int = 100  # of kept chains: fewer were not begun with this model, or hardly; chosen
    first_check: int = 200  # steps before the first look at the chains
    check_growth: float = 1.3  # times as many steps before the next look
    stride: int = 50  # steps at most between looks at the clock
    first_stride: int = 4  # steps before the first look at the clock
    patience: float = 2.0  # seconds between looks at the clock
    correlation_times: int = 50  # length of a chain that is long enough (the manual of emcee, "Autocorrelation")
    rhat: float = 1.01  # ensembles agree below this (Vehtari et al. 2021, Bayesian Analysis 16:667)
    rules: str = "3"  # version of these rules: chains that grew under others are not gone on with


@dataclass(frozen=True)
class MoveSettings:
    """Draws of Student's t around the mode."""

    tails: float = 5.0  # degrees of freedom: heavier tails than a posterior's, so that walkers leave any place
    scale: float = 1.1  # of the draws, relative to the curvature at the mode


@dataclass(frozen=True)
class QuickSettings:
    """The quick look by importance sampling."""

    draws: int = 4000
    batch: int = 100  # points of one compiled call
    rows: int = 2000  # readings that are enough
    khat: float = 0.7  # tail of the weights that is still light (Vehtari et al. 2024, JMLR 25(72))
    effective: float = 400.0  # independent draws that are enough (Vehtari et al. 2021: 100 for each of 4 chains)


@dataclass(frozen=True)
class NutsSettings:
    """NUTS by BlackJAX."""

    chains: int = 4
    warm_up: int = 300  # steps
    draws: int = 1000  # of each chain
    piece: int = 50  # draws between looks at the clock
    spread: float = 2.0  # standard deviations over which chains start


@dataclass(frozen=True)
class DensitySettings:
    """The log-density at many points, its slopes, its mode."""

    batch: int = 16  # points of one compiled call where something moves: measured, more gain nothing on a CPU
    weakest: float = 0.05  # curvature along an axis of which the mode knows nothing
    workers: int = field(default_factory=worker_count)  # batches at once: 60 instead of 77 s on two cores
    step: float = 0.02  # of the central differences that give slopes, in standard deviations
    fine: float = 1e-4  # the same where errors of instruments are held, beside which the density is far sharper
    bend: float = 0.1  # of those that give curvatures, in standard deviations
    starts: int = 6  # of a search for where else to look for the mode
    apart: float = 0.02  # of a range: places closer than this are one
    walk: int = 60  # steps of the search for the mode
    inside: float = 1e-6  # of a range: how near its ends a search may begin
    coarser: tuple[int, ...] = (4, 2)  # times as long a step as the fit's, tried in this order where something moves
    same: float = 0.1  # change of the log-density over draws (standard deviation) below which a longer step will do


@dataclass(frozen=True)
class NoiseSettings:
    """The noise of the readings, and which of its components are tried."""

    size_span: float = 1e3  # times: how far the size may be from the residual's, up or down
    shortest: float = 0.3  # readings: a memory below this is white noise
    longest: float = 3.0  # runs: a memory above this is an offset
    few_readings: int = 30  # below which nothing can be said about memory
    few_runs: int = 3  # below which nothing can be said about what runs share
    edge: float = 1e-4  # of a share: where searches stay inside
    felt: float = 0.01  # of one reading's noise, in all rows: a smaller error of an instrument is left out; chosen
    told: float = 0.2  # of the noise along one direction: errors that move rows by less add 2 % to it there; chosen


@dataclass(frozen=True)
class SummarySettings:
    """The record of a posterior: the test for anything missing, ends that cut off, bands."""

    tested: int = 3500  # readings that the test for anything missing looks at, as in a diagnosis
    reached: float = 4.0  # standard deviations of the draws within which an end has to lie to cut them off
    near_end: float = 0.01  # of a range: draws closer to an end than this are near it
    many: float = 0.05  # share of the draws near an end above which the end cuts them off
    band_draws: int = 200  # draws that the band of the readings is made of
    levels: tuple[float, float, float] = (0.05, 0.5, 0.95)  # quantiles of the band


@dataclass(frozen=True)
class WarningSettings:
    """From where on a posterior is warned of."""

    robust_excess: float = 1.5  # times the posterior's standard deviation: the model leaves errors that loops share
    misfit_excess: float = 2.0  # times the noise of a reading: something is missing from the model
    stated_excess: float = 1.5  # the same where the noise is stated, not read from data whose errors may be correlated
    conflict: float = 3.5  # standard deviations of its prior that the data move a parameter: one of both is wrong
    asked: float = INSTRUMENTS.believed  # accuracies that an instrument errs by, as of the values of a fit
    kept_away: float = 1.5  # times the misfit of the fit, which knows no stated priors
    bent: float = 3.0  # standard deviations: a value that lies so far from the fit's is named; chosen
    roughly: float = 1.1  # R-hat above which chains have not arrived, and say nothing of priors
    few_loops: int = 8  # fewer say little about what loops share


SAMPLER = SamplerSettings()
MOVE = MoveSettings()
QUICK = QuickSettings()
NUTS = NutsSettings()
DENSITY = DensitySettings()
NOISE = NoiseSettings()
SUMMARY = SummarySettings()
LIMITS = WarningSettings()
