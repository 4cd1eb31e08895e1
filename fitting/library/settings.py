"""Settings of effects from a file or from one line. All were chosen: nobody derived them."""

from dataclasses import dataclass


@dataclass(frozen=True)
class FormulaSettings:
    """What a formula may be: longer or deeper ones are mistakes, or attacks."""

    longest: int = 400  # characters; chosen
    deepest: int = 30  # brackets, or operations inside each other; chosen
    power: int = 20  # largest exponent that is a number; chosen


@dataclass(frozen=True)
class LineSettings:
    """What a line that defines an effect may be."""

    longest: int = 1000  # characters; chosen
    parameters: int = 12  # of one effect at most; chosen
    spread: tuple[float, ...] = (0.8, 0.5, 0.2)  # of its range: where else a search for its value begins; chosen


FORMULA, LINE = FormulaSettings(), LineSettings()
