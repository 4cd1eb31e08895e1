"""The band around a simulated force, within which readings of a real run like the measured ones would lie."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import jax.numpy as jnp
import numpy as np

from fitting.least_squares.force_band import ForceBand, force_bands
from fitting.least_squares.record import Fit
from fitting.study.courses import Course
from fitting.study.simulate import SimulatedData, band_file, record_course
from fitting.writing import write_text

EDGE = 0.02  # of the range of the readings, which ends a little before the turning points; chosen
HEAD = "run,time [s],force [N],force_low [N],force_high [N]"


@dataclass(frozen=True)
class SimulatedBand:
    """The band that was written; no file where there is none, and then `why`."""

    band: ForceBand | None = None
    file: Path | None = None
    samples: int = 0
    outside: int = 0  # of the samples: beyond the pressures and contractions of the runs, where nothing is known
    why: str = ""


def write_band(data: SimulatedData, fit: Fit, dataset: int = 0) -> SimulatedBand:
    """Write the band of a data set that was simulated from a model of this fit, beside it; force in N.

    `dataset` is the number of the data set whose muscle it is, where the fit has several.

    Cells are empty beyond the pressures and contractions that were measured.
    """
    band = next((band for band in force_bands(fit) if band.test == data.test), None)
    if band is None:
        return SimulatedBand(why=f"no {data.test} run was measured, and runs of another kind of test say nothing of it")
    if not band.known:
        return SimulatedBand(band)
    known = [_is_known(fit, band.test, course) for course in data.courses]
    rows = [row for number, both in enumerate(zip(data.courses, known, strict=True))
            for row in _rows(number, fit, dataset, band, *both)]  # fmt: skip
    file = band_file(data.file)
    write_text(file, "\n".join([HEAD, *rows]) + "\n")
    return SimulatedBand(band, file, len(rows), sum(int(np.sum(~each)) for each in known))


def _rows(number: int, fit: Fit, dataset: int, band: ForceBand, course: Course, known: np.ndarray) -> list[str]:
    force, low, high = _edges(fit, dataset, band, course)
    cells = zip(course.time, force, low, high, known, strict=True)
    return [f"{number},{t:.6g},{f:.9g},{f'{a:.6g}' if k else ''},{f'{b:.6g}' if k else ''}" for t, f, a, b, k in cells]


def _edges(fit: Fit, dataset: int, band: ForceBand, course: Course) -> Sequence[np.ndarray]:
    """The force along a course (N), and the band's lower and upper edge."""
    whole, *without = (fit.layout.model(jnp.asarray(vector), dataset) for vector in (fit.vector, *band.vectors))
    forces = np.array([record_course(each, course, band.test) for each in without])
    return record_course(whole, course, band.test), *band.edges(forces)


def _is_known(fit: Fit, test: str, course: Course) -> np.ndarray:
    """Where along a course (samples,) pressure and contraction are among those of the measured runs of this test."""
    kinds = np.array([block.test for block in fit.problem.blocks])[fit.samples.recording]
    inside = np.ones(len(course.time), bool)
    for values, measured in (
        (course.pressure, fit.samples.pressure),
        (course.contraction, fit.samples.contraction),
    ):
        mine, values = measured[kinds == test], np.asarray(values)
        slack = EDGE * (mine.max() - mine.min())
        inside &= (values >= mine.min() - slack) & (values <= mine.max() + slack)
    return inside
