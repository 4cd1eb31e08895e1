"""Where a model fails: its error by pressure, contraction, branch, speed and run, and what kind of error it is."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fitting import units
from fitting.comparison.bins import Bins, bins, medians
from fitting.comparison.fingerprint import Fingerprint, exponents
from fitting.comparison.parity import Cells, cells, loop_numbers, pressure_bins
from fitting.comparison.repeats import OneWay, Pair, drift, find_repeats, noise_floor, one_way
from fitting.comparison.settings import ERRORS
from fitting.comparison.slips import Mended, force_over_stated, likely_slips
from fitting.least_squares.evaluate import rmse_at_pressures
from fitting.least_squares.force_band import ForceBand, force_bands
from fitting.least_squares.record import Fit
from fitting.problem.residuals import Samples
from fitting.problem.unknowns import BELIEVED
from fitting.recordings.channel_errors import ChannelErrors, channel_errors
from fitting.recordings.noise import noise_of, source_of_noise
from fitting.recordings.noted import notes_of
from fitting.recordings.records import MOVING_TESTS, Experiment, NoiseSource, Recording

PRESSURE_LED = ("isometric", "isotonic", "step")  # tests in which the pressure moves
NEGLIGIBLE = ERRORS.negligible  # of full scale


@dataclass(frozen=True)
class Row:
    """The error in one group of samples; in the comparison's unit."""

    label: str
    count: int
    rmse: float
    bias: float  # mean of model minus measurement
    largest: float


@dataclass(frozen=True)
class Table:
    """The error by one quantity."""

    title: str
    rows: tuple[Row, ...]


@dataclass(frozen=True)
class Score:
    """The error of one recording in its own unit."""

    dataset: str
    file: str
    test: str
    unit: str
    count: int
    rmse: float
    largest: float
    full_scale: float
    noise: float  # standard deviation of one reading
    noise_source: NoiseSource


@dataclass(frozen=True)
class WorstPlace:
    """Where the error is largest: a group of pressure, of contraction, and a direction."""

    pressure: str  # label of the group; empty where there is only one
    contraction: str  # the same
    branch: int  # +1 or -1, 0 where the direction is unknown
    test: str  # in which directions are named
    times: float  # root mean square error there over that of all samples


@dataclass(frozen=True)
class Comparison:
    """A model beside what was measured. Errors in `unit`: N, or m where only positions were measured."""

    fit: Fit
    unit: str
    rmse: float
    largest: float
    full_scale: float
    noise: float  # of one reading
    noise_sources: tuple[NoiseSource, ...]  # of the recordings, each once
    noise_floor: float | None  # from repeated loops; None where nothing was repeated
    by_recording: tuple[Score, ...]
    tables: tuple[Table, ...]
    worst: WorstPlace
    cells: Cells | None
    fingerprint: Fingerprint
    notes: tuple[str, ...]
    channels: tuple[ChannelErrors, ...] = ()  # what the instruments of each recording may err by
    if_absolute: float | None = None  # the error, were the pressures absolute; None where they cannot be
    over_stated: float | None = None  # measured force over that of the stated sizes, where the fit denies one of them
    slips: tuple[Mended, ...] = ()  # of the pen, that would explain a force unlike that of the stated sizes
    one_way: OneWay | None = None  # what every loop changes by beside the one before, where all runs agree
    bands: tuple[ForceBand, ...] = ()  # where force readings of a new run will lie, for each kind of test

    @property
    def share(self) -> float:
        """Root mean square error as a share of full scale."""
        return self.rmse / self.full_scale

    @property
    def negligible(self) -> bool:
        """Whether the error is below half a per cent of full scale."""
        return self.share < ERRORS.negligible

    @property
    def floor(self) -> float:
        """The best known floor: from repeated loops, else (or where these agree to the digit) one reading's noise."""
        return self.noise_floor or self.noise


def compare(fit: Fit, experiments: Sequence[Experiment]) -> Comparison:
    """Compare a fitted (or evaluated) model with the data sets it was laid out for."""
    recordings = [(experiment, recording) for experiment in experiments for recording in experiment.recordings]
    scores = tuple(_score(fit, number, *both) for number, both in enumerate(recordings))
    unit = "N" if any(score.unit == "N" for score in scores) else "m"
    mask = np.array([scores[k].unit == unit for k in fit.samples.recording])
    samples, residual = fit.samples.where(mask), fit.residual[mask]
    tests = np.array([recordings[k][1].test for k in samples.recording])
    pairs = repetitions(samples, residual, tests)
    rmse, moved = _rms(residual), drift(pairs)
    parity = cells(samples, residual, tests == "loop") if unit == "N" else None
    even, odd, speed = exponents(fit, mask) if parity is not None else (None, None, None)
    traces = Fingerprint(
        None if parity is None else parity.odd_share,
        even,
        odd,
        speed,
        None if moved is None else moved / max(rmse, 1e-300),
    )
    chosen = [score for score in scores if score.unit == unit]
    full_scale = max(score.full_scale for score in chosen)
    noise = float(np.sqrt(np.average([s.noise**2 for s in chosen], weights=[s.count for s in chosen])))
    return Comparison(
        fit=fit,
        unit=unit,
        rmse=rmse,
        largest=float(np.max(np.abs(residual))),
        full_scale=full_scale,
        noise=noise,
        noise_sources=tuple(dict.fromkeys(score.noise_source for score in chosen)),
        noise_floor=floor_of(samples, pairs, tests, noise),
        one_way=one_way(pairs),
        by_recording=scores,
        tables=_tables(samples, residual, tests, fit, recordings),
        worst=_worst(samples, residual, tests),
        cells=parity,
        fingerprint=traces,
        notes=_notes(experiments, pairs, parity),
        channels=_channels(recordings),
        if_absolute=_if_absolute(fit, rmse / full_scale) if unit == "N" else None,
        over_stated=force_over_stated(fit) if unit == "N" and np.any(np.abs(fit.prior_rows) > BELIEVED) else None,
        slips=likely_slips(fit) if unit == "N" else (),
        bands=force_bands(fit),
    )


def floor_of(samples: Samples, pairs: tuple[Pair, ...], tests: np.ndarray, noise: float) -> float | None:
    """Standard deviation of one reading from repetitions; None without any. `noise` is that of one reading.

    A model takes out of a repetition what pressure and length differ by. One that is far off puts more in than it takes
    out: then the readings themselves agree better, and no model may make noise of its own failure. A load that hangs
    reads the same at every repetition, which tells nothing: no less than the noise of one reading is taken from there.
    """
    floor, of_readings = (noise_floor(each) for each in (pairs, repetitions(samples, samples.measured, tests)))
    if floor is None or of_readings is None:
        return floor
    least = max(of_readings, noise)
    return least if floor > ERRORS.put_in * least else floor


def _channels(recordings: Sequence[tuple[Experiment, Recording]]) -> tuple[ChannelErrors, ...]:
    """Those of every file, once: a file of motions may be several recordings of force."""
    files = {(experiment.name, recording.file): recording for experiment, recording in recordings}
    return tuple(errors for recording in files.values() for errors in channel_errors(recording))


def _if_absolute(fit: Fit, share: float) -> float | None:
    """The error, were an atmosphere in every pressure; None where no gauge reads so, or little is missed."""
    lowest = np.min(fit.samples.pressure[fit.problem.of_force(fit.samples)])
    if share < ERRORS.notable or lowest < ERRORS.vented * units.ATMOSPHERE:
        return None
    return rmse_at_pressures(fit, -units.ATMOSPHERE)


def repetitions(samples: Samples, residual: np.ndarray, tests: np.ndarray) -> tuple[Pair, ...]:
    """Branches measured again. A swing is no repetition of the one before it, nor of one under another load."""
    again = ~np.isin(tests, MOVING_TESTS)
    if not again.any():
        return ()
    return find_repeats(samples.where(again), residual[again], np.isin(tests[again], PRESSURE_LED))


def _score(fit: Fit, number: int, experiment: Experiment, recording: Recording) -> Score:
    residual = fit.residual[fit.samples.recording == number]
    return Score(
        dataset=experiment.name,
        file=recording.file,
        test=recording.test,
        unit=recording.unit,
        count=len(residual),
        rmse=_rms(residual),
        largest=float(np.max(np.abs(residual))),
        full_scale=max(float(np.max(np.abs(run.measured))) for run in recording.runs),
        noise=noise_of(recording),
        noise_source=source_of_noise(recording),
    )


def _rms(residual: np.ndarray) -> float:
    return float(np.sqrt(np.mean(residual**2)))


# ------------------------------------------------------------------------------------------------------------- tables


def _tables(
    samples: Samples, residual: np.ndarray, tests: np.ndarray, fit: Fit, recordings: list[tuple[Experiment, Recording]]
) -> tuple[Table, ...]:
    speed = np.abs(samples.rate) * np.array([float(t.muscle.length) for t in fit.layout.templates])[samples.dataset]
    held = np.isin(tests, ("loop",))
    speed = np.where(held, medians(speed, loop_numbers(samples)), speed)
    tables = [
        _table("pressure", pressure_bins(samples, tests == "loop"), "Pa", residual),
        _table("contraction", bins(samples.contraction), "1", residual),
        _branches(samples, residual, tests),
        _table("speed", bins(speed), "m/s", residual) if speed.max() > 1e-6 else None,
        _runs(samples, residual, recordings),
    ]
    return tuple(table for table in tables if table is not None)


def _table(title: str, groups: Bins, si: str, residual: np.ndarray) -> Table:
    rows = (_row(groups.label(k, si), residual[groups.of == k]) for k in range(len(groups)))
    return Table(title, tuple(row for row in rows if row is not None))


def _row(label: str, residual: np.ndarray) -> Row | None:
    if not len(residual):
        return None
    return Row(label, len(residual), _rms(residual), float(np.mean(residual)), float(np.max(np.abs(residual))))


def branch_name(branch: int, test: str) -> str:
    """What people call a direction in this kind of test."""
    up, down = ("inflating", "deflating") if test in ("isometric", "isotonic") else ("contracting", "elongating")
    return {1: up, -1: down}.get(branch, "direction unknown")


def _branches(samples: Samples, residual: np.ndarray, tests: np.ndarray) -> Table | None:
    names = np.array([branch_name(int(b), t) for b, t in zip(samples.branch, tests, strict=True)])
    rows = tuple(row for name in dict.fromkeys(names) if (row := _row(str(name), residual[names == name])))
    return Table("branch", rows) if len(rows) > 1 else None


def _runs(samples: Samples, residual: np.ndarray, recordings: list[tuple[Experiment, Recording]]) -> Table | None:
    where = (lambda e, r: "") if len(recordings) == 1 else (lambda e, r: f"{e.name}, {r.file}, ")
    names = [f"{where(e, r)}run {run.name}" for e, r in recordings for run in r.runs]
    rows = (_row(name, residual[samples.run == k]) for k, name in enumerate(names))
    found = tuple(row for row in rows if row is not None)
    return None if len(found) < 2 else Table("run", found)


# --------------------------------------------------------------------------------------------------- the worst place


def _worst(samples: Samples, residual: np.ndarray, tests: np.ndarray) -> WorstPlace:
    """Where the error is largest: pressure, contraction, direction, and how large."""
    pressure, contraction = pressure_bins(samples, tests == "loop"), bins(samples.contraction)
    place = np.stack([pressure.of, contraction.of, samples.branch])
    cases, of, count = np.unique(place, axis=1, return_inverse=True, return_counts=True)
    square = np.bincount(of, residual**2) / count
    enough = count >= min(ERRORS.fewest, max(2, len(samples) // 30), count.max())
    at = int(np.argmax(np.where(enough, square, -1.0)))
    p, c, b = cases[:, at]
    return WorstPlace(
        pressure.label(p, "Pa") if len(pressure) > 1 else "",
        contraction.label(c, "1"),
        int(b),
        str(tests[0]),
        float(np.sqrt(square[at]) / max(_rms(residual), 1e-300)),
    )


def _notes(experiments: Sequence[Experiment], pairs: tuple, parity: Cells | None) -> tuple[str, ...]:
    """What to know of the recordings."""
    notes = list(notes_of(experiments))
    if not pairs:
        notes.append("nothing was repeated at equal state: no noise floor from repeats, that of one reading is used")
    if parity is not None and parity.odd_share is None:
        notes.append("no place was reached in both directions: even and odd misfit cannot be told apart")
    return tuple(notes)
