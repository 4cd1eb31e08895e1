"""What runs show of their differences: nothing that was only presumed is taken for larger than they bear."""

from dataclasses import replace

import numpy as np
import pytest

from fitting.instruments.errors import InstrumentErrors
from fitting.instruments.sources import ErrorKind, Source
from fitting.least_squares.run_differences import as_runs_show
from fitting.least_squares.uncertainty import covariances

NO_PRIOR = np.zeros((0, 3))
PRESUMED = Source(None, ErrorKind.FRICTION_PER_RUN, 0.02, 0.02, presumed=True)
ALONE = lambda errors: np.zeros(len(errors.run), dtype=int)  # noqa: E731  one muscle
IN_A_RUN = np.linspace(0, 1, 60)


def recording(runs, differ, rng, source=PRESUMED):
    """Slopes of three parameters, errors of each run (20 times the noise) and readings of `differ` as much."""
    run, time = np.repeat(np.arange(runs), len(IN_A_RUN)), np.tile(IN_A_RUN, runs)
    pressure = rng.uniform(0.5, 1.5, runs)[run]
    friction = 20 * pressure * np.sin(np.pi * time)
    slopes = np.column_stack([2.5 * friction, 30 * time, 40 * pressure * time**2])
    errors = InstrumentErrors(friction[:, None], np.zeros((len(run), 0)), (source,), (), run)
    return slopes, errors, rng.normal(size=len(run)) + (differ * rng.normal(size=runs))[run] * friction


def fitted(slopes, readings):
    values = np.linalg.lstsq(slopes, readings, rcond=None)[0]
    return values, readings - slopes @ values


def bound(slopes, errors, readings):
    """The size that the runs leave, as a share of that presumed."""
    _, left = fitted(slopes, readings)
    shown = as_runs_show(errors, ALONE(errors), slopes, left, NO_PRIOR[:, : slopes.shape[1]])
    return np.linalg.norm(shown.per_run) / np.linalg.norm(errors.per_run)


@pytest.mark.parametrize("differ", [0.0, 0.1, 1.0])
@pytest.mark.parametrize("runs", [2, 6, 20])
def test_the_truth_is_within_the_errors_however_much_runs_differ(runs, differ):
    """Intervals of 95 %: few runs make them wide, never too narrow."""
    rng, inside, shares = np.random.default_rng(runs), [], []
    for _ in range(300):
        slopes, errors, readings = recording(runs, differ, rng)
        values, left = fitted(slopes, readings)
        shown = as_runs_show(errors, ALONE(errors), slopes, left, NO_PRIOR)
        new, old = (np.sqrt(np.diag(covariances(slopes, left, NO_PRIOR, errors.run, e)[1])) for e in (shown, errors))
        inside.append(np.abs(values) < 1.96 * new)
        shares.append(new / old)
    assert np.mean(inside, axis=0).min() >= 0.90  # a share of 0.95 of 300 is that low in one of ten thousand
    least, most = {0.0: (0.0, 0.1), 0.1: (0.05, 0.5), 1.0: (0.9, 1.0)}[differ]
    assert least < np.mean(shares) <= most


def test_runs_that_differ_as_presumed_leave_it_so():
    rng = np.random.default_rng(0)
    assert np.mean([bound(*recording(10, 1.0, rng)) for _ in range(20)]) > 0.9


def test_what_was_stated_is_believed():
    stated = replace(PRESUMED, presumed=False)
    assert bound(*recording(6, 0.0, np.random.default_rng(1), stated)) == 1.0


def test_a_run_alone_shows_no_difference():
    """Its friction may be what it always is, or off by as much as runs may differ."""
    slopes, errors, readings = recording(1, 0.0, np.random.default_rng(2))
    assert bound(slopes, errors, readings) == 1.0


def test_a_run_alone_shows_it_where_the_friction_is_known():
    """A parameter that does what the difference does leaves nothing to see, unless it is known."""
    slopes, errors, readings = recording(1, 0.0, np.random.default_rng(2))
    for error, bounds in ((1e3, (0.99, 1.01)), (1e-3, (0.0, 0.5))):
        whole, both = np.vstack([slopes[:, :1], [[1 / error]]]), np.append(readings, 0.0)
        _, left = fitted(whole, both)
        shown = as_runs_show(errors, ALONE(errors), slopes[:, :1], left, whole[-1:])
        assert bounds[0] <= np.linalg.norm(shown.per_run) / np.linalg.norm(errors.per_run) < bounds[1]


def test_a_wrong_model_bounds_little():
    """What it leaves goes from run to run as the difference does."""
    slopes, errors, readings = recording(6, 0.0, np.random.default_rng(3))
    missing = 0.3 * errors.per_run[:, 0] * np.where(errors.run % 2, 1.0, -1.0)
    assert bound(slopes, errors, readings + missing) > 0.3


def test_the_bound_is_the_same_in_other_units():
    slopes, errors, readings = recording(6, 0.1, np.random.default_rng(4))
    assert bound(slopes * [1e-9, 1.0, 1e6], errors, readings) == pytest.approx(bound(slopes, errors, readings))
    run = np.array(["c", "a", "f", "b", "e", "d"])[errors.run]
    assert bound(slopes, replace(errors, run=run), readings) == pytest.approx(bound(slopes, errors, readings))


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("size", [1e200, 1e-200, 0.0])
def test_a_parameter_that_changes_nothing_or_everything_is_no_obstacle(size):
    slopes, errors, readings = recording(6, 0.0, np.random.default_rng(5))
    _, left = fitted(slopes[:, 1:], readings)
    shown = as_runs_show(errors, ALONE(errors), slopes * [size, 1.0, 1.0], left, NO_PRIOR)
    assert np.isfinite(shown.per_run).all()
    assert np.linalg.norm(shown.per_run) <= np.linalg.norm(errors.per_run)


def test_the_runs_of_one_muscle_say_nothing_of_anothers():
    """Ten runs of a muscle that agree, and one of another that differs as presumed, with a friction of its own."""
    rng, inside = np.random.default_rng(6), []
    for _ in range(100):
        one, another = recording(10, 0.0, rng), recording(1, 1.0, rng)
        count = len(one[2])
        slopes = np.zeros((count + len(another[2]), 2))
        slopes[:count, 0], slopes[count:, 1] = one[0][:, 0], another[0][:, 0]
        whole = InstrumentErrors(
            np.vstack([one[1].per_run, another[1].per_run]), np.zeros((len(slopes), 0)), (PRESUMED,), (),
            np.append(one[1].run, another[1].run + 10),
        )  # fmt: skip
        values, left = fitted(slopes, np.append(one[2], another[2]))
        muscle = (np.arange(len(slopes)) >= count).astype(int)
        shown = as_runs_show(whole, muscle, slopes, left, NO_PRIOR[:, :2])
        assert np.linalg.norm(shown.per_run[:count]) < 0.2 * np.linalg.norm(whole.per_run[:count])
        found = covariances(slopes, left, NO_PRIOR[:, :2], whole.run, shown)[1]
        inside.append(abs(values[1]) < 1.96 * np.sqrt(found[1, 1]))
    assert np.mean(inside) >= 0.88


def test_tied_parameters_do_not_make_a_bound_of_rounding():
    """Of one run with a friction of its own the likelihood is flat, however closely the readings are fitted."""
    slopes, errors, readings = recording(1, 0.0, np.random.default_rng(7))
    tied = np.column_stack([slopes, slopes @ [1.0, 2.0, 0.0], slopes @ [0.0, 1.0, -3.0]])
    _, left = fitted(slopes, readings)
    for noise in (1.0, 1e-2, 1e-4):
        shown = as_runs_show(errors, ALONE(errors), tied, noise * left, np.zeros((0, 5)))
        assert np.linalg.norm(shown.per_run) == pytest.approx(np.linalg.norm(errors.per_run))
