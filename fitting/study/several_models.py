"""What several models of one muscle say of the same recording: their weighed mean, and how far they lie apart."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import LinearConstraint, minimize

from fitting.errors import InputError
from fitting.least_squares.force_band import left_out_runs
from fitting.least_squares.record import Fit
from fitting.study.fitted_data import fitted_data
from fitting.study.simulate import SimulatedData, models_file, record_course
from fitting.study.stored_model import stored_model
from fitting.writing import write_text
from mckibben_jax.model import Model


@dataclass(frozen=True)
class SeveralModels:
    """What was written of several models: the file, what each counts for, and how far they lie apart in force, N.

    `weights` add up to 1; where they could not be told from measured runs they are equal, and `why` says why.
    `contraction` and `pressure` (Pa) are those of the sample where the models lie furthest apart.
    """

    file: Path
    models: tuple[str, ...]
    weights: tuple[float, ...]
    why: str
    rms_apart: float
    most_apart: float
    contraction: float
    pressure: float


def models_of_request(data: SimulatedData, options: dict[str, Any]) -> SeveralModels | None:
    """Write what MODEL and the other models say of a recording that was simulated from MODEL; None without others."""
    files = [options["model"], *options["also"]]
    if len(files) < 2:
        return None
    read = [stored_model(file, options["muscle"], options["effect_file"], options["of"])[0] for file in files]
    weights, why = np.full(len(files), 1 / len(files)), ""
    try:
        weights = stacked_weights([fitted_data(options | {"model": file})[1] for file in files])
    except InputError as error:
        why = error.problem
    return write_models(data, files, read, weights, why)


def stacked_weights(fits: Sequence[Fit]) -> np.ndarray:
    """What each fit of the same data counts for in their mean (models,): not negative, of sum 1.

    The mean foretells force readings of runs that are left out best, in least squares (stacking: Wolpert 1992, Breiman
    1996). InputError where there is no second run to leave out.
    """
    first = fits[0]
    rows = first.problem.of_force(first.samples)
    runs = np.unique(first.samples.run[rows])
    if len(runs) < 2:
        problem = "one run was measured: no second one is left to foretell it from"
        raise InputError(problem, cure="record another run")
    left = np.stack([left_out_runs(fit, runs)[1][rows] / fit.samples.sigma[rows] for fit in fits], axis=1)
    return least_squares_weights(left)


def least_squares_weights(residuals: np.ndarray) -> np.ndarray:
    """The weights (models,) in the simplex that make the weighed sum of residuals (rows, models) least."""
    count = residuals.shape[1]
    products = residuals.T @ residuals
    products /= max(float(np.trace(products)), 1e-300)
    found = minimize(
        lambda w: w @ products @ w,
        np.full(count, 1 / count),
        jac=lambda w: 2 * products @ w,
        method="SLSQP",
        bounds=[(0.0, 1.0)] * count,
        constraints=LinearConstraint(np.ones((1, count)), 1.0, 1.0),
        options={"ftol": 1e-14, "maxiter": 500},
    )
    weights = np.clip(found.x, 0.0, 1.0)
    return weights / weights.sum()


def write_models(
    data: SimulatedData, names: Sequence[str], models: Sequence[Model], weights: np.ndarray, why: str
) -> SeveralModels:
    """Write the force that each model says (N), their weighed mean, the least and the largest, beside the recording."""
    forces = [np.stack([record_course(model, course, data.test) for model in models]) for course in data.courses]
    columns = [f"force {number} [N]" for number in range(1, len(models) + 1)]
    head = ",".join(["run", "time [s]", "force [N]", "force_low [N]", "force_high [N]", *columns])
    rows = [row for number, (course, force) in enumerate(zip(data.courses, forces, strict=True))
            for row in _rows(number, course.time, force, weights)]  # fmt: skip
    file = models_file(data.file)
    write_text(file, "\n".join([head, *rows]) + "\n")
    apart = np.concatenate([np.ptp(force, axis=0) for force in forces])
    at = int(np.argmax(apart))
    contraction, pressure = (np.concatenate([np.asarray(getattr(course, name)) for course in data.courses])[at]
                             for name in ("contraction", "pressure"))  # fmt: skip
    return SeveralModels(
        file, tuple(map(str, names)), tuple(map(float, weights)), why, float(np.sqrt(np.mean(apart**2))),
        float(apart[at]), float(contraction), float(pressure),
    )  # fmt: skip


def _rows(number: int, time: np.ndarray, force: np.ndarray, weights: np.ndarray) -> list[str]:
    summary = np.stack([weights @ force, force.min(axis=0), force.max(axis=0), *force])
    return [f"{number},{t:.6g},{','.join(f'{value:.9g}' for value in values)}"
            for t, values in zip(time, summary.T, strict=True)]  # fmt: skip
