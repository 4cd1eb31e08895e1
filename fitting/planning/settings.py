"""Settings of planning: each number with its unit, and where it comes from. "Chosen" says that nobody derived it."""

from dataclasses import dataclass


@dataclass(frozen=True)
class GridSettings:
    """The grid of recordings that could be made, and how each is laid out to be predicted."""

    nodes: int = 24  # places on each branch at which a candidate is predicted; each stands for all around it; chosen
    cycles: int = 2  # the first has a fresh memory, the second stands for all that follow; derived
    pressures: tuple[float, ...] = (0.1, 0.2, 0.35, 0.5, 0.75, 1.0)  # of the largest seen; chosen
    strokes: tuple[tuple[float, float], ...] = ((0.0, 1.0), (0.0, 0.5), (0.5, 1.0), (0.4, 0.6))  # of that seen; chosen
    faster: float = 3.0  # times the speed shown, which most rigs can still do; chosen
    much_faster: float = 10.0  # times the speed shown; chosen
    slower: float = 5.0  # times slower than shown; chosen
    more_pressure: float = 1.5  # times the largest seen; chosen
    longest: float = 600.0  # s, of one loop; chosen
    fewest: int = 20  # readings on a branch, at the rate of the data; chosen
    hold: float = 30.0  # s of rest at each end of a loop; chosen
    ramp: float = 5.0  # s from lowest to highest pressure, where none was seen; chosen


@dataclass(frozen=True)
class PredictionSettings:
    """Explanations fitted to the data, which then predict what nobody has recorded."""

    flat_prior: float = 12.0**0.5  # one over the standard deviation of a place anywhere in its range [0, 1]; derived
    steps: int = 60  # of one fit; chosen, as of the fits of a diagnosis
    near: float = 1e-5  # places closer to an end of their range than this stand there; chosen


@dataclass(frozen=True)
class CountSettings:
    """Counting of rejections over drawn sets of rows."""

    draws: int = 100  # recordings drawn for one power: its standard error is then 0.05 at most; chosen
    flips: int = 800  # of those of the test; chosen for speed


@dataclass(frozen=True)
class ChoiceSettings:
    """The choice among candidates that separate what is tied."""

    explanations: int = 6  # that are told apart, at most; chosen
    repeats: tuple[int, ...] = (3, 6, 9, 12)  # loops that may be asked for; chosen
    usual: int = 6  # loops by which candidates are compared; chosen
    hopeless: float = 6.0  # squared standard errors: closer, no number of loops one would record helps; chosen
    plenty: float = 200.0  # squared standard errors: more than this separates no better; chosen
    enough_power: float = 0.9  # probability that the wrong one of a pair is rejected; chosen
    worth_more: float = 0.2  # of power, for which a rig may be asked for what it has not shown; chosen
    refitted: int = 3  # of the best candidates, whose power is counted; chosen for speed


@dataclass(frozen=True)
class SharpenSettings:
    """The choice among candidates that show what the data do not see."""

    effects: int = 4  # that one recording is chosen for, at most; chosen
    critical: float = 3.3  # the score that chance reaches among a library of effects, typically; measured
    power_quantile: float = 0.84  # of the normal distribution: the power 0.8 that a detection limit has; derived
    least_gain: float = 1.3  # times smaller to be seen: below this a recording is not worth proposing; chosen
    unseen: float = 100.0  # times smaller: said of effects that the data do not see at all; chosen
    shown_size: float = 0.5  # of the present detection limit: the size for which the power is given; chosen
    dust: float = 1e-6  # of the largest squared strength: less is rounding; chosen


GRID, PREDICTION, COUNTS = GridSettings(), PredictionSettings(), CountSettings()
CHOICE, SHARPEN = ChoiceSettings(), SharpenSettings()
