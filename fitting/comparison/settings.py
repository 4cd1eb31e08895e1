"""Settings of comparisons: each number with its unit, and where it comes from. "Chosen": nobody derived it."""

from dataclasses import dataclass


@dataclass(frozen=True)
class BinSettings:
    """Sorting samples by a quantity."""

    levels: int = 12  # that a quantity may have to be sorted by levels; chosen
    apart: float = 0.02  # of the span: levels closer than this are one; chosen
    wide: float = 0.05  # of the span: a level that spreads further is none; chosen
    zero: float = 1e-4  # of the largest level: a smaller one is called 0; chosen
    cells: int = 12  # steps of pressure and of contraction on the map of the misfit; chosen


@dataclass(frozen=True)
class ErrorSettings:
    """What is said of an error."""

    negligible: float = 0.005  # of full scale: an error so small is real, but nobody need mind; chosen
    notable: float = 0.02  # of full scale: from here on it is asked whether pressures are absolute; chosen
    vented: float = 0.9  # atmospheres, at least: what a gauge shows that reads absolute; chosen
    fewest: int = 10  # samples in a place that may be called the worst; chosen
    fewest_shared: int = 8  # samples that two branches must share to be repetitions; chosen
    put_in: float = 2.0  # times what readings differ by between repetitions, that a model far off makes of it; chosen
    fewest_agreeing: int = 6  # runs whose loops all change in one direction: by chance in 1 of 32; derived


@dataclass(frozen=True)
class FingerprintSettings:
    """The traces that a misfit leaves: the power laws that remove most of it."""

    rows: int = 4000  # readings that are enough; more are thinned; chosen for speed
    nodes: int = 6  # of the course along the stroke; chosen
    fine: int = 40  # nodes where a ripple along the stroke, or friction in stripes, needs them; chosen
    finer: float = 2.0  # times what few nodes remove, that many must; chosen
    pressure_grid: tuple[float, float, float] = (-0.5, 3.01, 0.05)  # exponents from, to, step; chosen
    speed_grid: tuple[float, float, float] = (-0.5, 2.01, 0.05)  # the same in speed; chosen
    notable: float = 0.05  # of the squared misfit: what a power law must remove to be spoken of; chosen
    most_memory: float = 0.99  # correlation of neighbouring errors at most; chosen
    sure: float = 4.0  # standard errors that an exponent wrong by a half must be away: known to an eighth; derived
    rounds: int = 3  # of an exponent in pressure and one in speed, each beside the other; chosen
    lowest: float = 0.02  # of the largest pressure or speed: below, a power is not defined well; chosen


@dataclass(frozen=True)
class SlipSettings:
    """Slips of the pen that are offered where a muscle pulls far more or less than its sizes say."""

    likely: tuple[float, float] = (0.35, 1.2)  # measured over ideal force, a slip mended: rubber takes half; chosen
    left: float = 0.65  # of the force, that the ideal cylinder times that ratio may leave; hoses leave up to 0.55
    nearer: float = 0.85  # of what it leaves before, that a slip may leave that is more than a factor; chosen
    most: int = 4  # slips that are named; chosen
    pulls: float = 0.1  # of the ideal cylinder's largest pull: below, rubber and friction are as large; chosen


BINS, ERRORS, FINGERPRINT, SLIPS = BinSettings(), ErrorSettings(), FingerprintSettings(), SlipSettings()
