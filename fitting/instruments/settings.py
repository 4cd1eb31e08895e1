"""What errors of instruments rest on. Where no source is named it was chosen: nobody derived it."""

from dataclasses import dataclass


@dataclass(frozen=True)
class InstrumentSettings:
    """How errors of instruments are laid out, beside the accuracies that a recording states."""

    hysteresis_widths: tuple[float, ...] = (0.003, 0.03, 0.1, 0.3)  # of full scale, within which a cell turns; chosen
    point_time: float = 10.0  # s from one point of a map to the next: points have no time; chosen
    warming_share: float = 0.2  # of the time of all recordings, in which a drift dies away; chosen
    least_share: float = 1e-3  # of a reading or full scale: where an error begins of which no accuracy is known; chosen
    believed: float = 5.0  # accuracies: none of some hundred errors is larger, if instruments err as they may; chosen
    least_skew: float = 1e-3  # s; the same of a skew; chosen
    sizes: tuple[float, float] = (0.03, 300.0)  # widths of an error among which the likeliest is sought; chosen
    visible: float = 0.03  # standard errors of a reading: an error that changes all rows by less is not seen; chosen
    step: float = 1e-4  # of the largest reading, by which a channel is shifted for its slope; error 1e-8
    held_force: float = 2.0  # noises of one reading, within which a force stays the same throughout a run; chosen
    held_readings: int = 8  # of a run at least, by which that is told; chosen
    beyond: float = 3.0  # accuracies: an instrument as its data sheet says errs by more once in 400; derived


INSTRUMENTS = InstrumentSettings()
