"""Settings of Hill's curves: each number with its unit. Where nothing else is said they were chosen."""

from dataclasses import dataclass


@dataclass(frozen=True)
class ReleaseSettings:
    """Speeds read off quick releases, and curves through them."""

    fewest_loads: int = 4  # of a curve: three numbers are fitted; derived
    fewest_samples: int = 12  # of a release; chosen
    least_travel: float = 1e-4  # m, that a load must move; chosen
    bent: float = 0.001  # of the travel, rms: a stretch that leaves its straight line by more is not straight; chosen
    same: float = 2.0  # standard errors within which two a/F0 are the same; the custom of two
    worse: float = 2.0  # times the misfit: a curve that fits so much worse is not the one; chosen
    read: float = 0.01  # of a speed: no reading of a straight part is better; chosen


@dataclass(frozen=True)
class MotionSettings:
    """Fits to motions, with Hill's force and without."""

    starts: int = 4  # of the fit to the motion at most: it begins from what is known; chosen
    faded: float = 90.0  # m/s: Hill's b at which the force is next to nothing; chosen
    far: float = 1.5  # times the noise: there is something left for viscosity to explain; chosen
    straight: float = 10.0  # times the fastest speed: with b above it Hill's force is straight to some 10 %; derived


RELEASES, MOTION = ReleaseSettings(), MotionSettings()
