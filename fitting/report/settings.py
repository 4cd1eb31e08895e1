"""Settings of texts and pictures: each number with its unit, and where it comes from. "Chosen": nobody derived it."""

from dataclasses import dataclass


@dataclass(frozen=True)
class LayoutSettings:
    """Columns and letters of the terminal."""

    width: int = 110  # letters of a line, where the output is no terminal and COLUMNS is not set; chosen
    label: int = 9  # letters of the label before a line; chosen
    note: int = 16  # letters to which the last column, often a remark, may be narrowed; chosen
    gap: int = 2  # letters between columns; chosen
    bar: int = 12  # letters of the longest bar; chosen


@dataclass(frozen=True)
class AmountSettings:
    """How much of a thing is shown to people: who wants all of it reads the JSON, or the table."""

    attempts: int = 5  # of a step; chosen
    folders: int = 20  # rows, messages and parameters of many folders; chosen
    designs: int = 5  # best designs of a sweep; chosen
    listed_designs: int = 1000  # of the best ones in the result for machines; chosen
    runs: int = 12  # in a table of errors; chosen
    denied: int = 4  # sizes that a fit denies, of the many that several data sets have; chosen
    valued: int = 3  # explanations of which the values are shown; chosen
    named: int = 4  # effects of a list on the terminal that have their names for readers beside identifiers; chosen
    explained: int = 4  # effects that are explained under the verdict of a page; chosen
    combinations: int = 4  # of numbers that are strongly correlated; chosen


@dataclass(frozen=True)
class ReadingPictureSettings:
    """Readings beside what was estimated from them."""

    rows: int = 8  # recordings and channels; chosen
    readings: int = 1500  # of a run, of which others are left out evenly; chosen


@dataclass(frozen=True)
class ErrorTextSettings:
    """What is said of an error of a model."""

    slow: float = 6.0  # times the scatter of neighbours: so much may still be noise that changes slowly; chosen
    near_floor: float = 1.5  # times the floor: what is left is hardly more than noise; chosen
    mostly: float = 0.8  # share that is nearly all; chosen
    fewest_runs: int = 4  # of which one can be called odd; chosen
    alone: float = 3.0  # times the error of the next: one run alone is off; chosen
    flat: float = 0.15  # an exponent that is none; chosen


@dataclass(frozen=True)
class WarningTextSettings:
    """From where on readings are warned of."""

    unlikely: float = 0.3  # of full scale: no effect that is known leaves so much; chosen
    likely: tuple[float, float] = (0.6, 1.6)  # measured over modelled force: no wrong unit gives it; chosen
    stated: tuple[float, float] = (0.35, 2.2)  # the same with stated sizes, where rubber may take half; chosen
    half: float = 0.5  # of the error: less must be left without the atmosphere; chosen
    fastest: float = 5.0  # muscle lengths a second, the median of loops: ten times what laboratories drive; chosen
    noisier: float = 3.0  # stated errors of one reading, by which neighbours scatter; chosen
    absurd: float = 5.0  # stated errors, from which nobody thinks that a size was read so; chosen
    apart: float = 3.0  # stated errors between a fitted size and a measured one: 3 honest ones in 1000 are; chosen


@dataclass(frozen=True)
class AdviceTextSettings:
    """What is said of diagnoses, of numbers that cannot be told apart, of plans and of designs."""

    hopeless: float = 0.1  # power of a recording that separates as good as nothing; chosen
    similar: float = 0.9  # cosine of two signatures from which one effect could be taken for the other; chosen
    known: float = 0.1  # of its range: a combination of numbers with less error is known from the data; chosen
    weighty: float = 0.3  # of a combination: numbers with less share are not worth naming; chosen
    rest: float = 60.0  # s between recordings, for creep and warmth to fade; chosen
    little: float = 1e-3  # of the objective: a price below is not worth a sentence; chosen
    few: int = 3  # of a unit in a limit: of less, no whole one is spoken of; chosen


@dataclass(frozen=True)
class FigureSettings:
    """Pictures of data and fits."""

    columns: int = 4  # of small panels; chosen
    effects: int = 10  # in one picture; chosen
    panels: int = 24  # at most; chosen
    similar: int = 24  # effects on the map of similarity; chosen
    swept_pressure: float = 0.5  # of the largest, by which the pressure changes within half a loop of a sweep; chosen
    same_pressure: float = 0.05  # of the highest of a map: it varies by more, or it is held; chosen
    points: int = 400  # in a panel; chosen
    fewest_on_a_curve: int = 3  # points of a map at one pressure, on average, that a line joins; chosen
    fewest_on_a_branch: int = 24  # points, or it has no shape: of too many branches some whole loops are drawn; chosen
    margin: float = 0.04  # of the span, around the readings; chosen
    sigmas: float = 2.0  # of the band in the strip that is noise; the custom of two
    noise_steps: tuple[float, ...] = (
        2.0,
        5.0,
        10.0,
        20.0,
        35.0,
        50.0,
        100.0,
        200.0,
    )  # times the noise: a colour each; chosen
    steps_labelled: int = 7  # colours on one side from which only every second has its number; chosen
    least_noise: float = 1e-9  # N: what divides by the noise divides by no less
    room: float = 1.15  # of the strip, over the largest misfit; chosen
    parts: int = 40  # of the stroke, over which the misfit of a branch is averaged for the overview; chosen


@dataclass(frozen=True)
class LiveSettings:
    """The picture that follows the pointer."""

    readings: int = 10_000  # at most, of all runs; about 20 bytes each with two models; chosen
    candidates: int = 6  # effects that may be tried beside each model, 2 bytes a reading; chosen
    fewest: int = 24  # of a run, or it has no shape; of more runs than that leaves room for, some are left out; chosen
    fewest_on_a_branch: int = 6  # readings, or its corners are lost; chosen


@dataclass(frozen=True)
class EffectPictureSettings:
    """The picture of what one effect does."""

    samples: int = 480  # of a test; chosen
    plain: float = 0.25  # of what the plainest test shows: with as much, an earlier test is shown instead; chosen
    least: float = 0.05  # N: less is nothing; chosen


@dataclass(frozen=True)
class PosteriorPictureSettings:
    """Pictures of draws."""

    parameters: int = 8  # at most; chosen
    bands: int = 16  # at most; chosen
    mass: tuple[float, float] = (0.9, 0.5)  # of the draws, in the places of each colour; chosen
    ticks: int = 2  # steps of an axis: three numbers of six figures run into each other; chosen
    small: float = 6.5  # points, of a power of ten beside an axis; chosen


@dataclass(frozen=True)
class DesignPictureSettings:
    """A muscle drawn to scale."""

    strands: int = 10  # drawn of each family; chosen
    fitting: float = 0.08  # length of an end fitting over that of the muscle; chosen
    pressure: float = 3e5  # Pa, where a task names none; chosen


@dataclass(frozen=True)
class StatedTextSettings:
    """When a parameter is said to rest on stated sizes."""

    most: float = 0.5  # of its variance, that stated sizes make together; chosen
    part: float = 0.1  # of its variance, from which a size is named; chosen
    named: int = 2  # sizes and instruments that are named for one parameter; chosen
    at_end: float = 0.01  # standard errors, from the end of what was stated, as a file rounds it; chosen
    agree: float = 0.5  # of what is presumed of runs: where they show less, it is said; chosen


@dataclass(frozen=True)
class LikelierTextSettings:
    """When values that allow for errors of instruments stand beside those of the curve of least error."""

    sharper: float = 0.8  # times the standard error of any parameter; chosen


LAYOUT, SHOWN, ERROR_TEXT, WARNING_TEXT = LayoutSettings(), AmountSettings(), ErrorTextSettings(), WarningTextSettings()
ADVICE, FIGURE, PICTURE = AdviceTextSettings(), FigureSettings(), EffectPictureSettings()
POSTERIOR_PICTURE, DESIGN_PICTURE = PosteriorPictureSettings(), DesignPictureSettings()
LIVE, READINGS, STATED = LiveSettings(), ReadingPictureSettings(), StatedTextSettings()
LIKELIER = LikelierTextSettings()
