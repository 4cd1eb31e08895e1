"""Settings of exports. All were chosen: nobody derived them."""

from dataclasses import dataclass


@dataclass(frozen=True)
class ExportSettings:
    """Source code and tables of a muscle for other programs."""

    width: int = 100  # characters: an expression longer than this is given a name; chosen
    window: int = 8  # samples of a signal that show whether an instrument looks back; chosen
    pulley: float = 0.1  # of the muscle's length, radius in the scene of a joint: 1 rad is a contraction of 0.1; chosen
    middle: float = 0.12  # contraction of both muscles of a joint where it stands at 0, half of what they have; chosen
    scene_pressure: float = 3e5  # Pa, for which the loads of the scenes are made; chosen
    scene_load: float = 0.3  # of the force at rest length at that pressure: the load that is lifted; chosen
    joint_load: float = 0.25  # of one muscle's torque at that pressure: the weight on the arm; chosen
    misfit_share: float = 0.99  # of the readings, that differ from the model by less than its misfit; chosen
    deviations: float = 2.0  # standard deviations of the force that parameters leave open; chosen
    even: float = 0.5  # of the largest uncertainty of the force: if most readings have more, no place is named; chosen
    pushes: float = 1e-3  # N below zero, from which on a row of a table is said to push; chosen
    edge: float = 0.02  # of the range of contraction and of pressure: so far beyond, a place counts as measured; chosen
    corner: float = 0.1  # of the range of contraction and of pressure: how near to a corner readings fill it; chosen
    spread_draws: int = 4000  # of a posterior, whose covariance is taken; chosen
    tries: int = 100  # rounds of draws, until enough lie within the ranges; chosen
    rows: int = 1_000_000  # of a table at most; chosen


EXPORT = ExportSettings()
