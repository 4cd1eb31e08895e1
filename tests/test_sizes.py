"""Layouts that are compiled once for many data sets compute what the plain layout computes."""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hidden.simulator import Muscle, Noise, Truth, dataset, isometric, loops, static, with_baseline, write
from hidden.study.changes import changed

from fitting.problem import sizes
from fitting.problem.residuals import problem
from fitting.problem.sizes import joined, of_standard_size
from fitting.problem.thinning import thinned
from fitting.problem.unknowns import unknowns
from fitting.recordings.experiment import read_experiment
from mckibben_jax.effect import Read
from mckibben_jax.effects import CoulombFriction, Creep, IdealCylinder, Presliding

TRUTH, NOISE, LOUDER = Truth(Muscle(), with_baseline()), Noise(sd=0.5), Noise(sd=2.0)
LOOPS = loops(TRUTH, (2e5,), (0.01,), samples=300, noise=NOISE)
HELD = isometric(TRUTH, (0.05, 0.1), samples=260, noise=LOUDER)
POINTS = static(TRUTH, pressures=(1e5, 3e5), noise=NOISE)


def laid_out(folder, *recordings):
    """These recordings with a model that has memory: unknowns and problem."""
    write(dataset(TRUTH, list(recordings), "Mixed", NOISE, 1), folder)
    experiment = read_experiment(folder)
    layout = unknowns([experiment], [IdealCylinder(), CoulombFriction(), Presliding(), Creep()])
    return layout, problem([experiment], layout)[0]


@pytest.fixture(scope="module")
def mixed(tmp_path_factory):
    """Loops, an isometric test of another length and noise, and a map of points."""
    return laid_out(tmp_path_factory.mktemp("mixed"), LOOPS, HELD, POINTS)


rows_at = eqx.filter_jit(lambda given, *point: given.data_rows(*point))


def rows_of(layout, given):
    return np.asarray(rows_at(given, jnp.asarray(layout.start), jnp.ones(4)))


def test_recordings_of_force_in_one_block_leave_the_same_rows(mixed):
    layout, given = mixed
    one = replace(given, blocks=tuple(joined(given.blocks)))
    assert (len(one.blocks), len(given.blocks)) == (1, 3)
    np.testing.assert_allclose(rows_of(layout, one), rows_of(layout, given), rtol=1e-12, atol=1e-9)


def test_padding_to_standard_sizes_leaves_the_same_rows(mixed):
    layout, given = mixed
    padded, real = of_standard_size(given)
    np.testing.assert_allclose(rows_of(layout, padded)[real], rows_of(layout, given), rtol=1e-12, atol=1e-9)


FEW_LONG = loops(TRUTH, (1e5, 2e5, 3e5), (0.01,), samples=600, noise=NOISE)
MANY_SHORT = loops(TRUTH, (1e5, 2e5, 3e5, 4e5), (0.01, 0.02), samples=190, noise=NOISE)


@pytest.mark.parametrize(
    "recordings",
    [(MANY_SHORT,), (FEW_LONG, HELD), (MANY_SHORT, POINTS), (HELD, FEW_LONG, MANY_SHORT)],
    ids=["short runs", "long runs and isometric", "short runs and a map", "three files"],
)
def test_recordings_of_any_lengths_end_in_arrays_of_a_standard_size(recordings, tmp_path):
    """What was compiled for one of them serves all others of that size."""
    one, other = (
        of_standard_size(laid_out(tmp_path / name, *files)[1])[0]
        for name, files in (("these", recordings), ("those", (FEW_LONG,)))
    )
    assert jax.tree.structure(one) == jax.tree.structure(other)
    assert one.blocks[0].measured.shape in sizes.LANE_SHAPES


@pytest.mark.parametrize(
    ("lengths", "shape"),
    [
        ([9] * 5, (10, 32)), ([57], (1, 320)), ([150] * 5, (4, 320)), ([217] * 10, (10, 256)), ([290] * 10, (4, 960)),
        ([350] * 10, (10, 384)), ([620] * 4, (4, 960)), ([1200], (1, 1280)), ([2900], (1, 3840)),
    ],
)  # fmt: skip
def test_what_a_diagnosis_reads_has_one_of_eight_shapes(lengths, shape):
    """Loops and held lengths alike: after the first of each, nothing of the library is compiled any more."""
    assert sizes._first_with_room(np.array(lengths), np.full(len(lengths), 100.0)).run.shape == shape


def test_no_runs_get_lanes_that_take_far_longer_than_others_would():
    """The time of lanes was measured to go as (lanes + 1) times their samples."""
    time = lambda size: (size[0] + sizes.STEP) * size[1]  # noqa: E731
    others = [(lanes, samples // lanes) for samples in (320, 1280, 2560, 3840, *sizes.SAMPLES) for lanes in (1, 4, 10)]
    for count in (1, 2, 3, 4, 6, 10, 16):
        for length in range(340, 3400 // count, 30):
            runs, ends = np.full(count, length), np.full(count, 100.0)
            own = sizes._first_with_room(runs, ends).run.shape
            least = min(time(size) for size in others if sizes._Lanes.of(runs, ends, size) is not None)
            assert time(own) <= 2 * least, (count, length, own)


def test_runs_that_just_miss_four_lanes_get_four_longer_ones():
    """Three runs of 595 samples and nine of 330 do not fit into 4 x 1,200; one lane of 4,800 takes far more steps."""
    lengths = np.array([595] * 3 + [330] * 9)
    assert sizes._first_with_room(lengths, np.full(12, 100.0)).run.shape == (4, 1500)


def test_runs_that_no_lane_has_room_for_are_padded(mixed, monkeypatch):
    layout, given = mixed
    monkeypatch.setattr(sizes, "LANE_SHAPES", ((2, 40),))
    padded, real = of_standard_size(given)
    assert padded.blocks[0].test != sizes.FORCE
    np.testing.assert_allclose(rows_of(layout, padded)[real], rows_of(layout, given), rtol=1e-12, atol=1e-9)


class Smoothed(Read):
    """A user's own effect that sees a whole run at once."""

    def read(self, signal, time):
        return jnp.cumsum(signal) / (1 + jnp.arange(len(signal)))


def test_a_users_own_reading_of_a_run_is_given_runs_one_by_one(tmp_path):
    write(dataset(TRUTH, [LOOPS, HELD], "Own", NOISE, 1), tmp_path)
    experiment = read_experiment(tmp_path)
    layout = unknowns([experiment], [IdealCylinder(), Smoothed()])
    given = problem([experiment], layout)[0]
    padded, real = of_standard_size(given)
    rows = [np.asarray(rows_at(each, jnp.asarray(layout.start), jnp.ones(2))) for each in (padded, given)]
    np.testing.assert_allclose(rows[0][real], rows[1], rtol=1e-12, atol=1e-9)


def test_what_would_be_mostly_padding_stays_apart(tmp_path):
    """Two rows of a few points beside one long run."""
    _, given = laid_out(tmp_path, LOOPS, POINTS)
    assert len(joined(given.blocks)) == 2


def test_what_is_sampled_ten_times_as_densely_is_thinned_to_the_same_places(tmp_path):
    """So that a verdict does not hang on how fast the rig was read."""
    made = dataset(TRUTH, [loops(TRUTH, (2e5,), (0.01,), samples=900, noise=NOISE)], "Dense", NOISE, 1)
    for name in ("as_it_is", "denser"):
        write(made, tmp_path / name)
    changed(tmp_path / "denser", "10x resampled", np.random.default_rng(0))
    (few,), (many,) = (
        thinned(read_experiment(tmp_path / name), 350).recordings[0].runs for name in ("as_it_is", "denser")
    )
    inside = np.setdiff1d(np.round(few.time[few.weight > 0], 9), np.round(many.time, 9))
    assert len(inside) <= 8  # turning points, which are found a sample earlier or later
    assert len(few) < 400
    assert len(many) < 420
