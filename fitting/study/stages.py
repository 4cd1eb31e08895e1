"""The steps of a study: how the error fell from model to model."""

from dataclasses import dataclass, field

import numpy as np

from fitting.diagnosis.findings import Attempt


@dataclass(frozen=True)
class Stage:
    """One step of a study: how its model differs, the error then, the verdict there, and what the model missed where.

    `label` names a model that was not made of the one before it; else `added` and `dropped` are names of effects.
    `residual` is model minus measurement of every sample that carries weight, where it is known; `attempts` are the
    larger models that a discovery tried after this one and did not keep; `held` are stated sizes of the muscle that it
    holds since this step. `strained`: instruments explain its misfit only by errors far beyond their accuracy.
    """

    label: str
    rmse: float
    held_out_rmse: float | None
    verdict: str = ""
    residual: np.ndarray | None = field(default=None, compare=False, repr=False)
    attempts: tuple[Attempt, ...] = ()
    held: tuple[str, ...] = ()
    added: tuple[str, ...] = ()
    dropped: tuple[str, ...] = ()
    strained: bool = False
