"""Where a model gives no finite number: a formula of the user's own, or values far from any muscle."""

from collections.abc import Sequence

import numpy as np

from fitting.errors import InputError
from fitting.problem.residuals import Samples
from fitting.recordings.records import Experiment
from fitting.showing import show


def state_at(samples: Samples, at: int) -> str:
    """The state of one sample, in words."""
    pressure = show(float(samples.pressure[at]), "Pa")
    return f"contraction {samples.contraction[at]:.4f}, {pressure}, {samples.rate[at]:.4g}/s"


def refuse_no_number(rows: np.ndarray, samples: Samples, experiments: Sequence[Experiment]) -> None:
    """InputError where a row of the measurements is no finite number: nothing can be said of such a model."""
    bad = np.flatnonzero(~np.isfinite(rows))
    if not len(bad):
        return
    at = int(bad[0])
    files = [
        experiment.folder / recording.stored_in for experiment in experiments for recording in experiment.recordings
    ]
    more = f" ({len(bad)} rows)" if len(bad) > 1 else ""
    raise InputError(
        f"the model gives no finite number{more}",
        files[samples.recording[at]],
        int(samples.row[at]),
        value=state_at(samples, at),
        cure="begin at other values (--set NAME=VALUE --free NAME); of an effect of your own, look at the formula",
    )
