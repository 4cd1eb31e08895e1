"""Static maps: points without history, whatever the order in which they were written down, and verdicts on them."""

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest
from hidden.simulator import NOISES, dataset, static, with_baseline, write
from hidden.study.sizes import hiding

from fitting.diagnosis.diagnose import diagnose
from fitting.diagnosis.sign_flips import flipped_signs
from fitting.least_squares.working_noise import Kinds
from fitting.problem.residuals import problem
from fitting.problem.unknowns import unknowns
from fitting.recordings.experiment import read_experiment
from fitting.recordings.noise import noise_of, one_load_cell
from mckibben_jax.effects import (
    CoulombFriction,
    Creep,
    IdealCylinder,
    MaxwellSlip,
    Presliding,
    SupplyLag,
    TimeDelay,
)

REMEMBERING = (Presliding(x_s=5e-4), MaxwellSlip(x_s=1e-3, spread=2.0), Creep(), SupplyLag(), TimeDelay())


@pytest.fixture(scope="module")
def points(tmp_path_factory):
    """Ninety points on two branches of a muscle that has friction; nothing else is hidden."""
    return recorded(tmp_path_factory.mktemp("points"), {})


def recorded(folder, hidden):
    truth = hiding(with_baseline(), hidden)
    recording = static(truth, noise=NOISES["white"], seed=5)
    return read_experiment(write(dataset(truth, [recording], "Points", NOISES["white"], 5), folder / "data"))


def residual(experiment, *effects):
    layout = unknowns([experiment], effects)
    given, samples = problem([experiment], layout)
    switches = layout.templates[0].switches
    return np.asarray(given.data_rows(jnp.asarray(layout.start), switches)), samples


@pytest.mark.parametrize("effect", REMEMBERING, ids=lambda e: type(e).__name__)
def test_what_remembers_has_come_to_rest_at_a_point(points, effect):
    """Slid, crept and settled: sliding friction is developed along the branch, and whatever fades has faded."""
    plain, _ = residual(points, IdealCylinder(), CoulombFriction(0.012))
    with_memory, _ = residual(points, IdealCylinder(), CoulombFriction(0.012), effect)
    np.testing.assert_allclose(with_memory, plain, atol=0.02)


def test_points_at_low_pressure_are_presumed_no_better_than_the_rest(points):
    """One load cell read them all: what is presumed of a reading goes by the largest force of the data set."""
    (whole,) = (replace(recording, noise=None) for recording in points.recordings)
    weak = replace(whole, runs=tuple(replace(run, measured=0.1 * run.measured) for run in whole.runs))
    assert noise_of(weak) == pytest.approx(0.1 * noise_of(whole))
    assert [noise_of(r) for r in one_load_cell([whole, weak])] == [noise_of(whole)] * 2
    assert one_load_cell([replace(weak, noise=0.7), whole])[0].noise == 0.7


@pytest.mark.parametrize("effect", REMEMBERING, ids=lambda e: type(e).__name__)
def test_the_order_of_points_changes_nothing(points, effect):
    (recording,) = points.recordings
    (run,) = recording.runs
    order = np.random.default_rng(0).permutation(len(run))
    mixed = {name: value[order] for name, value in vars(run).items()
             if isinstance(value, np.ndarray) and name not in ("time", "loop", "half")}  # fmt: skip
    shuffled = replace(points, recordings=(replace(recording, runs=(replace(run, **mixed),)),))
    before, _ = residual(points, IdealCylinder(), CoulombFriction(0.012), effect)
    after, _ = residual(shuffled, IdealCylinder(), CoulombFriction(0.012), effect)
    np.testing.assert_allclose(after, before[order], atol=0.02)


@pytest.mark.parametrize("effect", REMEMBERING, ids=lambda e: type(e).__name__)
def test_points_whose_branch_nobody_knows_have_no_friction(points, effect):
    (recording,) = points.recordings
    (run,) = recording.runs
    unknown = replace(run, branch=0 * run.branch, rate=0 * run.rate)
    blind = replace(points, recordings=(replace(recording, runs=(unknown,)),))
    without, _ = residual(blind, IdealCylinder())
    with_memory, _ = residual(blind, IdealCylinder(), CoulombFriction(0.012), effect)
    np.testing.assert_allclose(with_memory, without, atol=1e-9)


def test_signs_of_many_units_are_many():
    """Numpy's integers overflow at 2^63: then there was one flip, and nothing could ever be found."""
    signs = flipped_signs(np.int64(90), seed=0)
    assert signs.shape == (2000, 90)
    assert np.all(signs[0] == 1)


def test_points_of_a_map_err_one_by_one(points):
    """A slow wander cannot be told from a smooth surface, so none is made up for points that were set one by one."""
    rows, samples = residual(points, IdealCylinder(), CoulombFriction(0.012))
    surface = np.stack([np.ones(len(rows)), samples.contraction, samples.pressure], axis=1)
    noise = Kinds.after_removal(surface, samples).noise(rows)
    assert noise.memory == 0.0
    assert noise.white == pytest.approx(np.var(rows), rel=0.2)


def test_a_map_with_nothing_hidden_says_nothing(points):
    found = diagnose([points], [IdealCylinder(), CoulombFriction()])
    assert found.verdict == "nothing detectable"
    for name in ("supply_lag", "time_delay", "viscous_damping", "kinetic_friction"):
        assert found.effects[name].detection_limit is None  # no point shows it
    assert (
        found.effects["bladder_neo_hookean"].detection_limit < 1.2
    )  # beside a gauge that is presumed to be of class 0.25


def test_a_map_names_the_rubber(tmp_path):
    found = diagnose([recorded(tmp_path, {"bladder_neo_hookean": {"G": 3e5}})], [IdealCylinder(), CoulombFriction()])
    assert found.explanations == (("bladder_neo_hookean",),)
    value, error, _ = found.effects["bladder_neo_hookean"].estimate["G"]
    assert abs(value - 3e5) < 4 * error
