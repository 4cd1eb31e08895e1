"""Isotonic tests as recordings of force: what a sliding muscle pulls is the load, and what stands still is not seen."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hidden.motion import isotonic
from hidden.simulator import Muscle, Noise, State, Truth, dataset, felt, loops, lost, pull, with_baseline, write
from test_discover_motions import found_on, told

from fitting.comparison.compare import compare
from fitting.diagnosis.diagnose import diagnose
from fitting.instruments.settings import INSTRUMENTS
from fitting.instruments.signals import of_held_force
from fitting.least_squares.fit import fit
from fitting.problem.unknowns import unknowns
from fitting.recordings.experiment import read_experiment
from fitting.recordings.inverse_dynamics import as_force
from fitting.recordings.noise import noise_of
from fitting.report.text.comparison import fails
from fitting.study.baseline import BASELINE
from fitting.study.discovering import on_motions
from fitting.study.request import Request
from fitting.study.task import task_of
from mckibben_jax.effects import ConstantFriction, KineticFriction, Tip, ViscousDamping

MASSES = (6.0, 12.0, 20.0)
NOISE = Noise(sd=2e-5, pressure=100.0)


def swept(folder, *, noise=NOISE, more=(), ramp=0.5e5, **hidden):
    """A data set of pressure sweeps under hung loads and `more` recordings, and the truth behind it."""
    truth = Truth(Muscle(), with_baseline(**hidden))
    sweeps = isotonic(truth, masses=MASSES, samples=600, noise=noise, seed=3, ramp=ramp)
    write(dataset(truth, [sweeps, *(make(truth) for make in more)], seed=3, radius=1e-4), folder)
    return read_experiment(folder), truth, sweeps


def test_the_force_is_the_simulators_own_within_its_noise(tmp_path):
    data, truth, _ = swept(tmp_path, constant_friction={"F_c": 4.0})
    read, notes = as_force(data)
    (recording,) = read.recordings
    assert recording.test == "loop"
    assert "read as force" in " ".join(notes)
    off = []
    for run in recording.runs:
        state = felt(truth, State(run.contraction, run.pressure, run.time, run.rate))
        force = pull(truth, state) - lost(truth, state)
        off.append((run.measured - force)[run.weight > 0] / noise_of(recording))
    assert np.sqrt(np.mean(np.concatenate(off) ** 2)) < 1.5
    assert all(abs(np.mean(each)) < 0.5 for each in off)
    assert all(len(each) > 100 for each in off)


def test_a_standstill_is_not_seen(tmp_path):
    """While friction changes sides the muscle stands still, and its force is not that of either direction."""
    data, _, sweeps = swept(tmp_path, constant_friction={"F_c": 4.0})
    (recording,) = as_force(data)[0].recordings
    clean = sweeps.clean.reshape(len(MASSES), -1)
    for run, stroke in zip(recording.runs, clean, strict=True):
        stands = np.flatnonzero((np.diff(stroke, prepend=stroke[0]) == 0) & (np.diff(stroke, append=stroke[-1]) == 0))
        assert len(stands) > 5
        assert np.mean(run.weight[stands] > 0) < 0.1


def test_what_an_accelerated_load_pulls_is_not_its_weight(tmp_path):
    slow, fast = (as_force(swept(tmp_path / str(ramp), ramp=ramp)[0])[0] for ramp in (0.5e5, 2e7))
    counts = [sum(np.sum(run.weight) for one in read.recordings for run in one.runs) for read in (slow, fast)]
    assert counts[0] > 900
    assert counts[1] < 0.2 * counts[0]


def test_runs_with_few_readings_are_named(tmp_path):
    data, *_ = swept(tmp_path)
    (recording,) = data.recordings
    first, *others = recording.runs
    cut = first.leave_out(np.arange(len(first)) > 8, "for this test")
    some, notes = as_force(replace(data, recordings=(replace(recording, runs=(cut, *others)),)))
    assert [run.name for run in some.recordings[0].runs] == [run.name for run in others]
    assert f"not read as force, run {first.name}" in " ".join(notes)
    none, notes = as_force(replace(data, recordings=(replace(recording, runs=(cut,)),)))
    assert none.recordings == ()
    assert "read as force: the load" not in " ".join(notes)


def test_a_muscle_that_lifts_weights_is_diagnosed_beside_loops_in_one_unit(tmp_path):
    pulled = lambda truth: loops(truth, pressures=(2e5,), speeds=(0.01,), samples=200, noise=Noise(sd=0.3), seed=5)  # noqa: E731
    data, *_ = swept(tmp_path, more=(pulled,))
    effects = [kind() for kind in BASELINE]
    assert [recording.test for recording in as_force(data)[0].recordings] == ["loop", "loop"]
    assert unknowns(as_force(data)[0:1], effects).names == unknowns([data], effects).names


@pytest.mark.parametrize(("hidden", "found"), [({}, ()), ({"tip": {"k": 1.12}}, (("tip",),))])
def test_a_hidden_effect_is_found_where_weights_are_lifted(tmp_path, hidden, found):
    data, *_ = swept(tmp_path, **hidden)
    candidates = [Tip(), ConstantFriction(), KineticFriction(), ViscousDamping()]
    verdict = diagnose([data], [kind() for kind in BASELINE], candidates=candidates)
    assert verdict.explanations == found


def test_a_weight_that_reads_the_same_at_every_repetition_tells_no_noise(tmp_path):
    data, *_ = swept(tmp_path, constant_friction={"F_c": 4.0})
    (read, _), effects = as_force(data), [*(kind() for kind in BASELINE), ConstantFriction()]
    found = compare(fit([read], effects, starts=1), [read])
    assert found.noise_floor is None or found.noise_floor >= 0.3 * found.noise
    assert not fails(found)


@pytest.mark.parametrize(
    ("force", "held"),
    [(np.full(60, 98.0), True), (98 + 0.3 * np.sin(np.arange(60.0)), True), (np.linspace(549, 650, 60), False)],
)
def test_a_force_is_held_where_it_differs_by_its_noise_alone(force, held):
    """A loop of little stroke is none: of a force that changes a late load cell shows another one."""
    one, zero = np.ones(60), np.zeros(60, int)
    samples = SimpleNamespace(run=zero, measured=force, sigma=0.3 * one)
    assert np.all(of_held_force(samples, INSTRUMENTS) == held)
    few = SimpleNamespace(run=np.arange(60) // 4, measured=force, sigma=0.3 * one)
    assert not np.any(of_held_force(few, INSTRUMENTS))


def test_loops_alone_say_nothing_of_motions_that_cannot_be_read(tmp_path):
    pulled = lambda truth: loops(truth, pressures=(2e5,), speeds=(0.01,), samples=200, noise=Noise(sd=0.3), seed=5)  # noqa: E731
    data, *_ = swept(tmp_path, more=(pulled,))
    isotonic_one, loop = data.recordings
    run = isotonic_one.runs[0].leave_out(np.arange(len(isotonic_one.runs[0])) > 8, "for this test")
    poor = replace(data, recordings=(replace(isotonic_one, runs=(run,)), loop))
    effects = [kind() for kind in BASELINE]
    assert fit([poor], effects, starts=2).search.of_forces is None
    assert fit([data], effects, starts=2).search.of_forces is not None


def test_where_weights_are_lifted_slowly_no_motion_has_to_confirm(tmp_path):
    swept(tmp_path)
    task = task_of(Request(data=(str(tmp_path),)))
    assert on_motions(task, found_on(task), told) is None
