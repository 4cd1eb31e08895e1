"""Readings that are means over a stretch of time."""

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.signal import savgol_filter
from test_inverse_dynamics import BASELINE, MANY, released

from fitting.problem.residuals import problem
from fitting.problem.sizes import Standard
from fitting.problem.thinning import thinned_runs
from fitting.problem.unknowns import unknowns
from fitting.recordings.averages import mean_of, of_an_instant, weights_of_mean
from fitting.recordings.inverse_dynamics import as_force


@pytest.mark.parametrize("half", [3, 4, 12])
def test_a_parabolas_second_derivative_is_a_mean_of_second_differences(half):
    """Whatever the positions are: scipy's own filter against the mean."""
    position = np.random.default_rng(half).standard_normal(60)
    filtered = savgol_filter(position, 2 * half + 1, 2, deriv=2)
    second = position[2:] - 2 * position[1:-1] + position[:-2]
    weights = weights_of_mean(half, 1, half)
    inner = slice(half, 60 - half)
    assert weights.sum() == pytest.approx(1.0, abs=1e-14)
    assert np.convolve(second, weights, "same")[half - 1 : 59 - half] == pytest.approx(filtered[inner], abs=1e-10)


def test_few_states_make_nearly_the_same_mean():
    """Of a force that changes as a cube along the window, four states in half a window miss it by a per cent."""
    half, spacing = 40, 10
    every = np.arange(-half, half + 1) / half
    for law in (1 + every, every**2, 1 + every**3):
        exact = weights_of_mean(half, 1, half) @ law
        few = weights_of_mean(half, spacing, 3) @ law[half - 3 * spacing : half + 3 * spacing + 1 : spacing]
        assert few == pytest.approx(exact, abs=0.01)


def test_means_of_neighbours_and_of_single_instants():
    """In numpy and in JAX, against sums that are written out."""
    values, weights = np.arange(10.0) ** 2, of_an_instant(10, 1)
    weights[4] = [0.25, 0.5, 0.25]
    wanted = values.copy()
    wanted[4] = 0.25 * 9 + 0.5 * 16 + 0.25 * 25
    assert mean_of(values, weights) == pytest.approx(wanted)
    assert mean_of(jnp.asarray([values] * 2), jnp.asarray([weights] * 2), jnp)[1] == pytest.approx(wanted)


@pytest.fixture(scope="module")
def read(tmp_path_factory):
    """Eight releases, read as force."""
    data, _ = released(tmp_path_factory.mktemp("releases"), protocol=MANY)
    return as_force(data)[0]


def rows_of(given, layout):
    """The rows at the starting values."""
    return np.asarray(given.rows(jnp.asarray(layout.start), jnp.ones(len(BASELINE))))


def test_means_are_the_same_in_arrays_of_standard_size(read):
    """Where runs stand one behind the other, no mean has a neighbour of another run."""
    layout = unknowns([read], BASELINE)
    given, _ = problem([read], layout)
    usual = Standard.of(given)
    assert rows_of(usual.problem, layout)[usual.rows] == pytest.approx(rows_of(given, layout), abs=1e-9)
    instants = replace(given, blocks=tuple(replace(block, averaging=None) for block in given.blocks))
    assert np.abs(rows_of(instants, layout) - rows_of(given, layout)).max() > 0.1


def test_a_mean_keeps_its_neighbours_where_readings_are_thinned(read):
    """Fewer means, each as it was."""
    layout = unknowns([read], BASELINE)
    count = sum(int(run.weight.sum()) for recording in read.recordings for run in recording.runs)
    fewer = thinned_runs(read, count // 3)
    given, samples = problem([read], layout)
    light, kept = problem([fewer], layout)
    assert count / 4 < len(kept) < count / 2
    whole = dict(zip(zip(samples.run, samples.time, strict=True), rows_of(given, layout), strict=False))
    for run, time, row in zip(kept.run, kept.time, rows_of(light, layout), strict=False):
        assert row == pytest.approx(whole[run, time], abs=1e-9)
