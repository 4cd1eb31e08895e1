"""What a self-test tries: each number, and where it comes from."""

from dataclasses import dataclass


@dataclass(frozen=True)
class SelftestSettings:
    """Sizes in which an effect is hidden, and how they are sought."""

    sizes: tuple[float, ...] = (2.0, 1.0, 4.0, 8.0)  # times its printed detection limit, in the order of trial; chosen
    as_good_as_absent: float = 0.05  # of the noise or of its limit: what leaves less counts as absent; chosen
    around: float = 8.0  # times shorter and longer than to first order, between which a size is sought by fits; chosen
    near_enough: float = 0.02  # of the logarithm of the way, to which it is sought; chosen
    first: float = 1e-5  # of a parameter's range, the shortest way from where its effect is absent; chosen
    far: float = 1.5  # times the noise of a reading: a model that misses more does not describe the muscle; chosen
    halvings: int = 14  # of the ratio between the shortest and the longest way: to a thousandth; derived


SELFTEST = SelftestSettings()
