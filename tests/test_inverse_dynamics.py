"""Releases and steps read as force, against a simulator that shares no code with the library."""

from dataclasses import replace

import numpy as np
import pytest
from hidden.simulator import (
    Muscle,
    Noise,
    State,
    Truth,
    dataset,
    felt,
    loops,
    lost,
    pull,
    quick_release,
    with_baseline,
    write,
)
from hidden.simulator import step as pressure_step
from scipy.signal import savgol_filter

from fitting.diagnosis.diagnose import diagnose, of_force
from fitting.errors import InputError
from fitting.recordings.experiment import read_experiment
from fitting.recordings.inverse_dynamics import Motion, as_force
from fitting.recordings.records import NoiseSource
from fitting.recordings.settings import DYNAMICS
from mckibben_jax.effect import name_of
from mckibben_jax.effects import LIBRARY, CoulombFriction, IdealCylinder

BASELINE = (IdealCylinder(), CoulombFriction())
SOUGHT = ("viscous_damping", "bladder_neo_hookean", "presliding")
FEW = {"pressures": (5e5, 6e5), "masses": (50.0, 70.0), "duration": 1.0}
MANY = {"pressures": (5e5, 6e5), "masses": (45.0, 55.0, 65.0, 75.0), "duration": 1.0}
READ = "release.csv: read as force through the moving mass"


def released(folder, *more, seed=1, noise=5e-5, muscle=None, protocol=FEW, **hidden):
    """A data set of quick releases and `more` recordings, and the truth behind it."""
    truth = Truth(muscle or Muscle(), with_baseline(**hidden))
    releases = quick_release(truth, **protocol, seed=seed, noise=Noise(sd=noise), file="release.csv")
    write(dataset(truth, [releases, *(make(truth) for make in more)], seed=seed, radius=1e-4), folder)
    return read_experiment(folder), truth


def errors(data, truth):
    """Of every force that counts, in standard deviations as stated: against the mean of the simulator's own."""
    found = []
    for recording in data.recordings:
        for run in recording.runs:
            state = felt(truth, State(run.contraction, run.pressure, run.time, run.rate))
            force, reach = pull(truth, state) - lost(truth, state), run.averaging.shape[1] // 2
            counts = np.flatnonzero(run.weight)
            mean = [run.averaging[at] @ force[at - reach : at + reach + 1] for at in counts]
            found.append((run.measured[counts] - mean) / recording.noise)
    return found


# ---------------------------------------------------------------------------------------------------- the force


@pytest.mark.parametrize("hidden", [{}, {"viscous_damping": {"B": 100.0}}, {"hill": {"a_over_F0": 0.12, "b": 0.5}}])
@pytest.mark.parametrize("noise", [2e-5, 1e-4])
def test_the_force_is_the_simulators_own_within_its_stated_noise(tmp_path, hidden, noise):
    """No bias in any part of the motion, and a scatter of one standard deviation."""
    data, truth = released(tmp_path, noise=noise, protocol=MANY, **hidden)
    read, _ = as_force(data)
    off = np.concatenate(errors(read, truth))
    assert len(off) > 40
    assert abs(off.mean()) < 4 / np.sqrt(len(off))
    assert 0.75 < np.sqrt(np.mean(off**2)) < 1.25


def test_a_moving_mass_besides_the_load_counts(tmp_path):
    """Stated in muscle.toml, it is in M; unstated, light releases would be wrong."""
    data, truth = released(tmp_path, muscle=Muscle(moving_mass=20.0))
    off = np.concatenate(errors(as_force(data)[0], truth))
    assert np.sqrt(np.mean(off**2)) < 1.25
    without = replace(data, muscle=replace(data.muscle, moving_mass=np.array(0.0)))
    assert np.sqrt(np.mean(np.concatenate(errors(as_force(without)[0], truth)) ** 2)) > 1.5


def test_only_motion_one_way_counts(tmp_path):
    """Nothing near a reversal or a standstill, nothing where an error of the mass would show; few share a window."""
    data, _ = released(tmp_path)
    read, _ = as_force(data)
    for recording in read.recordings:
        assert recording.test == "loop"
        for run in recording.runs:
            counts = run.weight > 0
            assert np.all(np.sign(run.rate[counts]) == run.branch[counts])
            assert np.abs(run.rate[counts]).min() * 0.3 > 0.01
            load = float(np.median(np.asarray(data.recordings[0].runs[int(run.name)].load)))
            inertia = np.abs(run.measured[counts] - load)
            assert np.all(inertia < DYNAMICS.inertia * load + 4 * recording.noise)
            weights = run.averaging[counts]
            assert weights.sum(1) == pytest.approx(1.0)
            assert weights.max() < 0.5  # no state alone
            assert set(np.unique(run.branch[~counts])) <= {0}


def test_noise_is_that_of_the_position_times_the_mass(tmp_path):
    """Twice the noise of a reading is more noise in the force: windows grow, but not for nothing."""
    quiet, loud = (as_force(released(tmp_path / str(sd), noise=sd)[0])[0] for sd in (2e-5, 2e-4))
    level = lambda data: np.median([r.noise for r in data.recordings for _ in r.runs])  # noqa: E731
    assert level(quiet) < level(loud)
    assert {recording.noise_source for recording in quiet.recordings} == {NoiseSource.MOTION}  # nobody stated it


def stroke(folder, position):
    """A data set of one release whose readings of the position (m) are these."""
    data, _ = released(folder, protocol={**FEW, "pressures": (5e5,), "masses": (50.0,)})
    (recording,) = data.recordings
    (run,) = recording.runs
    count = len(position)
    made = replace(run.at(slice(0, count)), measured=position, time=0.002 * np.arange(count), weight=np.ones(count))
    return replace(data, recordings=(replace(recording, runs=(made,)),)), made


def test_no_polynomial_reaches_into_a_standstill(tmp_path):
    """However long it is beside the window of the mean: the speed would be wrong."""
    time = 0.002 * np.arange(300)
    begins = 100
    position = 0.05 * (1 - np.cos(6 * np.maximum(time - time[begins], 0.0)))
    _, run = stroke(tmp_path, position)
    for window, half in ((67, 20), (9, 20)):
        motion = Motion(run, 0.002, window, half // 4, 2e-5, 50.0, 490.0)
        first = int(np.argmax(motion.moving))
        assert first > begins + max(window // 2, half)
        assert first < begins + max(window // 2, half) + 40


def test_a_short_stroke_is_read_though_long_polynomials_would_not_blur_it(tmp_path):
    """An eighth of a second of even acceleration."""
    time = 0.002 * np.arange(65)
    noise = 2e-5 * np.random.default_rng(4).normal(size=65)
    data, _ = stroke(tmp_path, 0.02 * time + 0.5 * time**2 + noise)
    read, notes = as_force(data)
    ((run,),) = (recording.runs for recording in read.recordings)
    assert np.count_nonzero(run.weight) >= DYNAMICS.fewest
    assert all(note.startswith(READ) for note in notes)
    mass = float(np.median(data.recordings[0].runs[0].load)) / 9.80665 + float(data.muscle.moving_mass)
    force = float(np.median(data.recordings[0].runs[0].load)) + mass * 1.0
    off = (run.measured - force)[run.weight > 0] / read.recordings[0].noise
    assert np.abs(off).max() < 4


def test_noise_of_neighbours_is_hardly_alike_and_never_taken_for_less(tmp_path):
    """Of positions that are noise alone, a quarter of a window apart: as far as is said where readings are chosen."""
    data, _ = released(tmp_path, protocol=MANY)
    half = 4 * 6
    found = savgol_filter(np.random.default_rng(0).normal(size=200_000), 2 * half + 1, 2, deriv=2)[half:-half]
    alike = lambda lag: np.corrcoef(found[:-lag], found[lag:])[0, 1]  # noqa: E731
    assert alike(half // 2) == pytest.approx(-0.09, abs=0.03)
    assert alike(half) == pytest.approx(-0.44, abs=0.03)
    for recording in as_force(data)[0].recordings:
        for run in recording.runs:
            states = np.flatnonzero(run.weight)
            apart = np.diff(states)
            assert np.all(apart >= 2)  # states of the muscle from one reading to the next


# ------------------------------------------------------------------------------------------------ what is set aside


def test_recordings_of_force_stay_as_they_are(tmp_path):
    """And a release beside them joins."""
    data, _ = released(tmp_path, lambda truth: loops(truth, pressures=(3e5,), samples=400))
    read, notes = as_force(data)
    assert any(recording is data.recordings[1] for recording in read.recordings)
    assert {r.file for r in read.recordings} == {"release.csv", "loops.csv"}
    assert [note for note in notes if note.startswith(READ)] == list(notes)


@pytest.mark.parametrize(
    ("change", "why"),
    [
        ({"noise": 1.2e-2}, "too noisy|even motion"),
        ({"protocol": {"masses": (30.0,), "duration": 0.15}}, "even motion"),
    ],
)
def test_releases_that_say_too_little_are_set_aside_with_the_reason(tmp_path, change, why):
    """In a note beside other recordings, in the error alone."""
    data, _ = released(tmp_path, lambda truth: loops(truth, pressures=(3e5,), samples=400), **change)
    kept, notes = of_force([data])
    assert [r.file for r in kept[0].recordings] == ["loops.csv"]
    assert len(notes) == 1
    alone = replace(data, recordings=data.recordings[:1])
    with pytest.raises(InputError, match="recording of force") as refusal:
        of_force([alone])
    for said in (notes[0], str(refusal.value)):
        assert any(word in said for word in why.split("|"))


@pytest.mark.parametrize("load", [lambda load: 0 * load, lambda load: load * np.linspace(1, 2, len(load))])
def test_an_unknown_mass_is_refused(tmp_path, load):
    """No load, or one that a spring makes."""
    data, _ = released(tmp_path)
    (recording,) = data.recordings
    runs = tuple(replace(run, load=load(run.load)) for run in recording.runs)
    with pytest.raises(InputError, match="moving mass is not known"):
        of_force([replace(data, recordings=(replace(recording, runs=runs),))])


def test_unevenly_sampled_stretches_do_not_count(tmp_path):
    """A polynomial over even steps would take a gap for a jump."""
    data, truth = released(tmp_path)
    (recording,) = data.recordings
    gaps = tuple(_without(run, np.r_[60:75, 200:210]) for run in recording.runs)
    read, _ = as_force(replace(data, recordings=(replace(recording, runs=gaps),)))
    off = np.concatenate(errors(read, truth))
    assert len(off) > DYNAMICS.fewest
    assert np.abs(off).max() < 5


def _without(run, places):
    keep = np.setdiff1d(np.arange(len(run)), places)
    return replace(run, **{k: v[keep] for k, v in vars(run).items() if isinstance(v, np.ndarray)})


# ------------------------------------------------------------------------------------------------- pressure steps


def stepped(folder):
    """Steps with the valve's set-point alone, and the truth."""
    truth = Truth(Muscle(), with_baseline())
    recording = pressure_step(
        truth, levels=((2e5, 5e5), (5e5, 3.5e5)), masses=(20.0, 30.0), rate=500.0, rise=0.1, file="step.csv"
    )
    write(dataset(truth, [recording], radius=1e-4), folder)
    return read_experiment(folder), truth


def test_a_step_without_the_muscles_pressure_is_set_aside(tmp_path):
    """A set-point does not say what pulls."""
    data, _ = stepped(tmp_path)
    with pytest.raises(InputError, match="only the valve's set-point"):
        of_force([data])


def test_a_step_with_its_pressure_is_read_where_that_hardly_changes(tmp_path):
    """The window straddles no jump."""
    data, truth = stepped(tmp_path)
    (recording,) = data.recordings
    measured = tuple(replace(run, set_pressure=None) for run in recording.runs)
    read, notes = as_force(replace(data, recordings=(replace(recording, runs=measured),)))
    assert notes[0].startswith("step.csv: read as force")
    off = np.concatenate(errors(read, truth))
    assert np.sqrt(np.mean(off**2)) < 1.4
    assert all(run.time[run.weight > 0].min() > 0.1 for r in read.recordings for run in r.runs)


# -------------------------------------------------------------------------------------------------- the diagnosis


@pytest.fixture(scope="module")
def candidates():
    """Few, which compile in seconds."""
    return [effect for effect in (kind() for kind in LIBRARY) if name_of(effect) in SOUGHT]


def test_hidden_damping_is_named_from_releases_alone(tmp_path, candidates):
    """With its size, and with words on what releases do not show."""
    data, _ = released(tmp_path, protocol=MANY, viscous_damping={"B": 60.0})
    found = diagnose([data], BASELINE, candidates=candidates)
    assert found.verdict == "missing"
    assert found.explanations == (("viscous_damping",),)
    size, error, _ = found.effects["viscous_damping"].estimate["B"]
    assert abs(size - 60.0) < 3 * error < 60.0
    assert any(note.startswith(READ) for note in found.notes)


def test_clean_releases_raise_no_alarm(tmp_path, candidates):
    """Nothing is named, and the limits are honest numbers."""
    data, _ = released(tmp_path, protocol=MANY)
    found = diagnose([data], BASELINE, candidates=candidates)
    assert found.verdict == "inconclusive"  # no break-away was seen
    assert found.explanations == ()
    assert all(found.effects[name].detection_limit for name in SOUGHT)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2, 8))
def test_clean_releases_raise_no_alarm_again_and_again(tmp_path, candidates, seed):
    """At a level of 1 %."""
    data, _ = released(tmp_path, seed=seed, protocol=MANY)
    assert diagnose([data], BASELINE, candidates=candidates).explanations == ()


@pytest.mark.slow
def test_loops_and_releases_are_diagnosed_together(tmp_path, candidates):
    """Slow loops cannot see a damping that fast releases show."""
    data, _ = released(tmp_path, lambda truth: loops(truth, noise=Noise(sd=0.6)), viscous_damping={"B": 60.0})
    found = diagnose([data], BASELINE, candidates=candidates)
    assert found.explanations == (("viscous_damping",),)
