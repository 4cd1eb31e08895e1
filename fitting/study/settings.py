"""Settings of studies. All were chosen: nobody derived them."""

from dataclasses import dataclass


@dataclass(frozen=True)
class StudySettings:
    """Recordings that are simulated, and plans."""

    stations: tuple[float, ...] = (0.0, 0.05, 0.1, 0.15, 0.2, 0.25)  # contractions of a static map; chosen
    samples: int = 2_000_000  # of a simulated recording at most; chosen
    separated: float = 0.8  # power from which a pair counts as separated; chosen, the custom of power analysis


STUDY = StudySettings()
