"""Settings of reading recordings: each number with its unit, and where it comes from. "Chosen": nobody derived it."""

from dataclasses import dataclass

LISTED = 8  # rows that a message about many names; chosen


@dataclass(frozen=True)
class TableSettings:
    """Files that people write, and what a braided muscle and its rig can at most read."""

    csv_bytes: int = 100_000_000  # some two million samples, read within 2 GiB of memory; measured
    unpacked_bytes: int = 1_000_000_000  # of a packed file: the text of a full sheet of ten columns; chosen
    sheet_rows: int = 1_048_576  # of a sheet: Excel's own limit
    toml_bytes: int = 1_000_000  # of a file of some dozens of lines; chosen
    lines_before_header: int = 50  # about the rig, that a logger may put there; chosen
    lines_looked_at: int = 1000  # to tell how many cells a row has; chosen
    largest_number: float = 1e30  # SI: what is squared and summed later stays finite; chosen
    contractions: tuple[float, float] = (-0.2, 0.6)  # beyond these no braided muscle goes; chosen
    largest_pressure: float = 50e5  # Pa; chosen
    loop_pressure: float = 1e3  # Pa, that a loop reaches unless it says that it was vented; chosen
    fewest_samples: int = 5  # of a run; chosen
    held: float = 0.01  # contraction that an isometric test may wander; chosen


@dataclass(frozen=True)
class MotionSignalSettings:
    """Noise, turning points and speeds of a recorded motion."""

    window: int = 21  # samples in a local polynomial at most; longer windows average blocks first; chosen
    fewest: int = 5  # samples in a local polynomial at least; chosen
    brief: int = 4  # samples that stay near a turning value without being a rest; chosen
    piece: int = 100_000  # windows worked on at once: bounds the memory; chosen


@dataclass(frozen=True)
class AccuracySettings:
    """Accuracies as they are stated in muscle.toml, found in readings, and left to fill in."""

    same: float = 1e-6  # relative, by which two statements of one noise may differ: rounding of units; chosen
    rounded: float = 1e-6  # of the largest reading: finer steps are arithmetic, or a file of all digits; chosen
    dust: float = 1e-9  # of the largest reading: smaller scatter is arithmetic, for no instrument is so good; chosen
    coarsest: float = 4.0  # noises, that a step of rounding may be: alone it makes a noise of step/sqrt(12); chosen
    changes: int = 10  # of a run's readings, where at least half repeat the one before: fewer are a set-point's; chosen
    figures: int = 2  # of what is left to fill in: nobody knows an accuracy better; chosen
    pressure: float = 5e5  # Pa, largest of a file that cannot be read yet, for lack of a unit; chosen
    step: float = 0.02  # s, between its readings; chosen


@dataclass(frozen=True)
class GapSettings:
    """Holes in a recording."""

    fewest: int = 50  # readings of a run in which a hole is looked for; chosen
    times: float = 10.0  # the steps of nearly all others, that a step across a hole is in time and in a signal; chosen
    nearly_all: float = 0.99  # of a run's steps: holes are rare; chosen
    beside: int = 50  # readings on each side of a pause, whose middle is the pressure there; chosen
    other: float = 0.05  # of the largest pressure, by which the pressures of two runs differ at least; chosen
    steady: float = 2.0  # times what it varies by within these readings: else the pressure is swept; chosen


@dataclass(frozen=True)
class CutShortSettings:
    """Runs that end long before the others do."""

    fewest: int = 3  # runs, of which one may be cut short: of two nobody knows which is odd; chosen
    alike: float = 0.05  # share by which the durations of the others differ at most; chosen
    short: float = 0.8  # of the others' duration: a shorter run may have been cut off; chosen
    back: float = 0.2  # of its way: a run that ends so near to where it began is whole; chosen


@dataclass(frozen=True)
class JumpSettings:
    """Jumps of a signal, which no smooth course makes: such samples carry no weight."""

    isolated: float = 4.0  # times the steps next but one on both sides; chosen
    beyond_noise: float = 8.0  # times the noise of one reading; chosen
    fewest: int = 10  # samples of a branch in which a jump is looked for; chosen


@dataclass(frozen=True)
class SpikeSettings:
    """Readings that stand alone among their neighbours."""

    beyond_noise: float = 8.0  # times the noise of one reading; Gaussian noise reaches it once in 10^15; chosen
    least_share: float = 2.5e-4  # of the largest reading: one step of a 12 bit converter; chosen
    beyond_steps: float = 6.0  # times the usual step between neighbours: five lie between the medians of both sides
    near: int = 25  # samples of which the usual step is the median; chosen
    most: float = 0.01  # of a run's readings: more are no disturbances but the instrument's noise; chosen
    fewest: int = 20  # samples of a run in which spikes are looked for; chosen


@dataclass(frozen=True)
class PlausibleSettings:
    """Readings that no muscle gives."""

    beyond: float = 30.0  # times the ideal force, or one part in as many: a wrong unit or a dead sensor; chosen
    odd: float = 4.0  # times the ideal force: worth a word; whole numbers of that size are a converter's counts; chosen
    pulls: float = 1e5  # Pa: below, rubber may take more than the ideal muscle pulls with; chosen
    falls: float = 0.5  # of the largest force, that it falls along a stroke of which a word is said; chosen
    steeper: float = 4.0  # times the ideal force's fall: worth a word; muscles of any make reach 1.3; measured
    fast: float = 2.0  # m/s on average over a loop: worth a word; 75 mm in a tenth of a second is 0.75; chosen
    standstill: float = 1e-4  # contraction; chosen
    fewest: int = 5  # readings from which something is said of how they go together; chosen
    least_pressure: float = 1e3  # Pa: of a vented muscle the ideal law says nothing; chosen
    least_change: float = 0.05  # of the ideal force: where it changes less, nothing is asked of the readings; chosen
    opposed: float = -0.8  # correlation of the readings with the ideal force; chosen


@dataclass(frozen=True)
class InverseDynamicsSettings:
    """Motions read as force, through the second derivative of a smoothed position."""

    order: int = 4  # of the polynomials; chosen
    shortest: int = 9  # samples in a window at least; chosen
    longest: float = 0.15  # s, that a window lasts at most; chosen
    longer: float = 1.25  # times, from one window that is tried to the next; chosen
    blurred: float = 1.5  # standard errors by which a shorter window may differ beyond noise, in mean square; chosen
    slow: float = 0.01  # m/s: below, friction may not be what it is in motion, and the speed's error counts; chosen
    inertia: float = 0.3  # largest |M x''| over the load: a mass known to 1 % errs there by 0.3 % of it; chosen
    loud: float = 0.2  # largest noise of a force over the load; chosen
    steady: float = 0.05  # of the largest pressure: with more change in a window a corner is rounded off; chosen
    uneven: float = 0.05  # of a sampling interval, by which another may differ; chosen
    quiet: float = 0.01  # noise of a force over the load that is low enough; chosen
    plenty: int = 12  # readings of one run, which a longer window should leave; chosen
    fewest: int = 8  # readings of one run; chosen
    alike: float = 4.0  # ratio of the noises of runs that make one recording; chosen


@dataclass(frozen=True)
class HungLoadSettings:
    """Isotonic tests read as force."""

    fewest: int = 12  # readings of one run while the muscle slides; chosen
    inertia: float = 0.005  # largest |M x''| over the load: it is left out of the force; chosen
    clear: float = 5.0  # errors of one position by which a muscle has left where it stood; chosen
    window: float = 0.01  # of a run's readings, to either side of one, from which its acceleration is told; chosen


@dataclass(frozen=True)
class ReleaseSettings:
    """When a muscle is let go."""

    fewest: int = 6  # readings; chosen
    resting: int = 4  # readings at the beginning, from which the way is counted; chosen
    beyond_noise: float = 5.0  # times the noise of a position: a way that is one; chosen
    least: float = 0.005  # of the largest way, from which the beginning of the motion is carried back; chosen
    most: float = 0.1  # of the largest way, up to which; chosen
    whole: float = 0.98  # quantile of the way that is the largest, but for faults of the sensor; chosen
    clear: float = 3.0  # times the way that is told from noise, up to which the motion has to be followed; chosen
    off: float = 0.5  # of a sampling interval, by which readings may lie off a motion from rest; chosen
    jitter: float = 0.0025  # s, by which they may lie off it besides, for the position is noisy; chosen
    worse: float = 2.0  # times as far off they have to lie if the motion had begun at 0; chosen
    apart: float = 0.01  # s from time 0 below which nobody began to read at another time; chosen
    readings_apart: float = 4.0  # the same in sampling intervals; chosen
    named: int = 6  # runs in a note; chosen


@dataclass(frozen=True)
class CycleSettings:
    """Runs cut into cycles."""

    at_rest: float = 1e-9  # 1/s: a static point approached infinitely slowly, only the sign counts; chosen
    at_zero: float = 1e-5  # contraction: some micrometres, nearer to the length at rest than anybody sets it; chosen
    smallest_loop: float = 0.01  # share of the stroke that a minor loop must have to be one; chosen
    smallest_cycle: float = 0.08  # the same of the pressure: a port's springs back when its valve closes; chosen


TABLES, SIGNALS, JUMPS = TableSettings(), MotionSignalSettings(), JumpSettings()
PLAUSIBLE, DYNAMICS, CYCLES = PlausibleSettings(), InverseDynamicsSettings(), CycleSettings()
ACCURACY, SPIKES, GAPS, CUT_SHORT = AccuracySettings(), SpikeSettings(), GapSettings(), CutShortSettings()
RELEASES, HUNG = ReleaseSettings(), HungLoadSettings()
