"""What is derived from a motion whose truth is known: noise, turning points, branches, speed, weights."""

import itertools

import numpy as np
import pytest

from fitting.recordings import motion_signals as signals
from fitting.recordings import weightless
from fitting.recordings.records import Run
from fitting.recordings.runs import run_of
from fitting.recordings.settings import CYCLES

pytestmark = pytest.mark.filterwarnings("error")

TURNS = (0.0, 0.25, 0.02, 0.15, 0.08, 0.20, 0.02, 0.25, 0.0)


def motion(turns=TURNS, speed=0.02, dt=0.05, shape="triangle"):
    """Times and contractions along these turning points: triangles, half cosines, or triangles with holds."""
    parts = [np.array([turns[0]])]
    for begin, end in itertools.pairwise(turns):
        share = np.linspace(0, 1, max(round(abs(end - begin) / speed / dt), 2) + 1)[1:]
        share = (1 - np.cos(np.pi * share)) / 2 if shape == "cosine" else share
        parts.append(begin + (end - begin) * share)
        if shape == "hold":
            parts.append(np.full(len(share) // 3, end))
    contraction = np.concatenate(parts)
    return np.arange(len(contraction)) * dt, contraction


def readings(time, contraction, pressure=None, measured=None, **more):
    count = len(time)
    pressure = np.full(count, 2e5) if pressure is None else pressure
    measured = 100 + 50 * contraction if measured is None else measured
    row, usable = np.arange(count) + 2, np.ones(count, bool)
    return Run.as_read(name="1", time=time, pressure=pressure, contraction=contraction, measured=measured, row=row,
                       usable=usable, **more)  # fmt: skip


@pytest.mark.parametrize("shape", ["triangle", "cosine"])
@pytest.mark.parametrize("sigma", [1e-4, 2e-3])
@pytest.mark.parametrize("even", [True, False])
def test_noise_is_told_from_motion(shape, sigma, even):
    rng = np.random.default_rng(1)
    time, contraction = motion(shape=shape)
    if not even:
        keep = np.sort(rng.choice(len(time), len(time) // 2, replace=False))
        time, contraction = time[keep], contraction[keep]
    level = signals.noise_level(time, contraction + sigma * rng.normal(size=len(time)))
    assert level == pytest.approx(sigma, rel=0.15)


def test_rounding_counts_as_noise():
    time, contraction = motion(dt=0.005)
    level = signals.noise_level(time, np.round(contraction, 3))
    assert level == pytest.approx(1e-3 / np.sqrt(12), rel=0.5)


@pytest.mark.parametrize("shape", ["triangle", "cosine", "hold"])
@pytest.mark.parametrize(("sigma", "dt"), [(0.0, 0.05), (2e-4, 0.05), (2e-3, 0.05), (1e-3, 0.002)])
def test_turning_points_are_those_of_the_motion(shape, sigma, dt):
    rng = np.random.default_rng(2)
    time, contraction = motion(shape=shape, dt=dt)
    seen = contraction + sigma * rng.normal(size=len(time))
    found = signals.turning_points(seen, signals.turning_threshold(time, seen, 0.01))
    assert len(found) == len(TURNS) - 2
    assert contraction[found] == pytest.approx(TURNS[1:-1], abs=4 * sigma + 1e-3)


def test_turning_values_are_extreme_samples():
    time, contraction = motion()
    seen = contraction + 1e-3 * np.random.default_rng(3).normal(size=len(time))
    branches = signals.branches_of(seen, signals.turning_threshold(time, seen, 0.01))
    for first, last in itertools.pairwise(branches.turns):
        inside = branches.sign[last] * seen[first : last + 1]
        assert inside.min() == inside[0]
        assert inside.max() == inside[-1]


def test_a_motion_that_never_turns_is_one_branch():
    branches = signals.branches_of(np.linspace(0, 1, 50), 0.01)
    assert len(branches.turns) == 0
    assert (branches.half == 0).all()
    assert (branches.sign == 1).all()


def test_a_rest_is_no_branch():
    branches = signals.branches_of(np.zeros(20), 0.01)
    assert len(branches.turns) == 0
    assert (branches.sign == 0).all()


def test_loops_are_two_branches_each():
    time, contraction = motion()
    run = run_of(readings(time, contraction), "loop")
    assert run.half.max() == 7
    assert (run.loop == run.half // 2).all()
    assert (np.diff(run.half) >= 0).all()


@pytest.mark.parametrize("shape", ["triangle", "cosine"])
@pytest.mark.parametrize(("sigma", "dt"), [(0.0, 0.05), (2e-4, 0.05), (2e-3, 0.05), (1e-3, 0.002)])
@pytest.mark.parametrize("even", [True, False])
def test_speed_is_that_of_the_motion(shape, sigma, dt, even):
    rng = np.random.default_rng(4)
    time, contraction = motion(shape=shape, dt=dt)
    true = np.gradient(contraction, time)
    if not even:
        keep = np.sort(rng.choice(len(time), len(time) // 2, replace=False))
        time, contraction, true = time[keep], contraction[keep], true[keep]
    run = run_of(readings(time, contraction + sigma * rng.normal(size=len(time))), "loop")
    counts = run.weight > 0
    assert counts.mean() > 0.85
    assert (np.sign(run.rate) != np.sign(true))[counts].mean() < 2e-3
    assert np.sqrt(np.mean((run.rate - true)[counts] ** 2)) < 0.1 * np.abs(true).max()


def test_the_speed_of_a_parabola_is_exact_up_to_the_ends_of_a_branch():
    time = np.sort(np.random.default_rng(5).uniform(0, 1, 60))
    slope, _ = signals.rate(time, 0.1 * time + 0.2 * time**2, np.array([0, 59]), 1e-9)
    assert slope == pytest.approx(0.1 + 0.4 * time, abs=1e-6)


def test_the_stated_error_of_the_speed_is_its_scatter():
    rng = np.random.default_rng(6)
    time = np.arange(2000) * 0.01
    slope, error = signals.rate(time, 0.3 * time + 1e-3 * rng.normal(size=2000), np.array([0, 1999]), 1e-3)
    assert (slope - 0.3)[100:-100].std() == pytest.approx(error[100:-100].mean(), rel=0.2)


def test_the_speed_never_reaches_across_a_turning_point():
    time, contraction = motion(speed=0.2)
    run = run_of(readings(time, contraction), "loop")
    assert np.abs(run.rate[run.rate != 0]) == pytest.approx(0.2, rel=0.1)


def test_a_held_length_has_no_weight_and_of_speed_only_the_direction_of_its_branch():
    """What lags behind the force sees such a sample; a friction without direction there was an error of 26 sigmas."""
    time, contraction = motion(shape="hold")
    rng = np.random.default_rng(7)
    run = run_of(readings(time, contraction + 2e-4 * rng.normal(size=len(time))), "loop")
    held = np.convolve(np.gradient(contraction, time) == 0, np.ones(9), "same") == 9
    resting = np.abs(run.rate) == CYCLES.at_rest
    assert resting[held].mean() > 0.98
    assert run.weight[held & resting].sum() == 0
    assert (run.branch[held & resting] == 0).all()
    for half in np.unique(run.half):
        assert len(set(np.sign(run.rate[run.half == half]))) == 1


def test_contraction_is_raw_but_for_jitter_that_would_turn_it():
    time, contraction = motion()
    quiet = run_of(readings(time, contraction), "loop")
    assert (quiet.contraction == contraction).all()
    seen = contraction + 1e-3 * np.random.default_rng(8).normal(size=len(time))
    run = run_of(readings(time, seen), "loop")
    branches = signals.branches_of(seen, signals.turning_threshold(time, seen, 0.01))
    for first, last in itertools.pairwise(branches.edges):
        steps = np.diff(run.contraction[first : last + 1])
        assert (steps >= 0).all() or (steps <= 0).all()
    assert np.abs(run.contraction - contraction).max() < 5e-3


def test_samples_next_to_turning_points_and_ends_carry_no_weight():
    time, contraction = motion((0, 0.2, 0, 0.2, 0), dt=0.05)
    run = run_of(readings(time, contraction), "loop")
    edges = [0, 200, 400, 600, 800]
    near = np.min(np.abs(np.arange(801)[:, None] - edges), axis=1) <= 3
    assert (run.weight == ~near).all()


def test_in_short_branches_a_tenth_is_left_out():
    near = weightless.near_edges(np.array([0, 19, 24]), 25)
    assert np.flatnonzero(near).tolist() == [0, 1, 2, 17, 18, 19, 24]


def test_the_cycles_of_a_million_samples_are_told():
    rng = np.random.default_rng(9)
    time = np.cumsum(rng.uniform(0.5e-3, 1.5e-3, 1_000_000))
    contraction = 0.125 * (1 - np.cos(2 * np.pi * time / 20)) + 1e-4 * rng.normal(size=len(time))
    run = run_of(readings(time, contraction), "loop")
    assert run.half.max() == 99


# ---------------------------------------------------------------------------------------------------- isometric tests


def staircase(sigma=300.0, steps=12, dwell=20, top=6e5):
    """A valve's staircase up and down with a long rest at the top, overshoot and spring-back of 3 %."""
    rng = np.random.default_rng(10)
    up = np.repeat(np.linspace(0.1, 1, steps), dwell)
    up[::dwell] += 0.03
    down = np.repeat(np.linspace(1, 0.1, steps), dwell)
    down[::dwell] -= 0.03
    pressure = top * np.concatenate([up, np.full(200, 1.0), down])
    return np.arange(len(pressure)) * 0.05, pressure + sigma * rng.normal(size=len(pressure)), len(up) + 200


@pytest.mark.parametrize("sigma", [0.0, 300.0, 1000.0])
def test_isometric_branches_go_by_pressure_and_a_rest_belongs_to_the_way_there(sigma):
    time, pressure, turn = staircase(sigma)
    run = run_of(readings(time, np.full(len(time), 0.1), pressure, pressure / 1e3), "isometric")
    assert run.half.max() == 1
    assert (run.branch != np.where(np.arange(len(time)) < turn, 1, -1)).sum() <= 25
    assert (run.rate == 0).all()
    assert run.weight.mean() > 0.95


def test_isometric_contraction_is_the_median():
    time, pressure, _ = staircase()
    contraction = 0.1 + 1e-4 * np.random.default_rng(11).normal(size=len(time))
    run = run_of(readings(time, contraction, pressure, pressure / 1e3), "isometric")
    assert (run.contraction == np.median(contraction)).all()


@pytest.mark.parametrize("zero", [-3e-6, 0.0, 2e-3])
def test_a_muscle_held_at_rest_is_held_there_exactly(zero):
    """A reading's error would else decide which way what goes with the contraction moves the braid."""
    time, pressure, _ = staircase()
    contraction = zero + 2e-5 * np.random.default_rng(0).standard_normal(len(time))
    run = run_of(readings(time, contraction, pressure, pressure / 1e3), "isometric")
    assert np.unique(run.contraction) == (pytest.approx(2e-3, rel=0.01) if zero == 2e-3 else [0.0])


def test_pressure_rate_of_an_isometric_ramp():
    time = np.arange(401) * 0.05
    pressure = 5e5 * (1 - np.abs(time / 10 - 1)) + 1e4
    run = run_of(readings(time, np.full(401, 0.1), pressure, pressure / 1e3), "isometric")
    assert run.pressure_rate[run.weight > 0] == pytest.approx(5e4 * run.branch[run.weight > 0], rel=1e-6)


@pytest.mark.parametrize("sigma", [100.0, 2000.0])
def test_a_pressure_that_is_constant_within_its_error_is_constant(sigma):
    time, contraction = motion()
    run = run_of(readings(time, contraction, 2e5 + sigma * np.random.default_rng(12).normal(size=len(time))), "loop")
    assert np.ptp(run.pressure) == 0
    assert run.pressure[0] == pytest.approx(2e5, abs=3 * sigma / np.sqrt(len(time)))
    assert (run.pressure_rate == 0).all()


def test_smoothing_leaves_the_jumps_of_a_noisy_pressure():
    time, pressure, _ = staircase(2000.0)
    run = run_of(readings(time, np.full(len(time), 0.1), pressure, pressure / 1e3), "isometric")
    assert (run.pressure != pressure).mean() > 0.5
    # errors of 2 kPa beside jumps of 50 kPa, and valves that spring back by 18 kPa for one sample
    assert np.abs(run.pressure - pressure).max() <= 5 * signals.noise_level(time, pressure)
    assert np.std(run.pressure - staircase(0.0)[1]) < 2000 / 2


def test_smoothing_keeps_a_straight_line():
    line = np.linspace(3, 7, 40)
    assert signals.smooth(line) == pytest.approx(line)


# --------------------------------------------------------------------------------------------------- clipped readings


def test_saturated_and_slack_readings_carry_no_weight():
    time, contraction = motion((0, 0.25, 0, 0.25, 0))
    force = np.clip(100 - 500 * contraction + 0.5 * np.random.default_rng(13).normal(size=len(time)), 0, 80)
    r = readings(time, contraction, measured=force)
    run = run_of(r, "loop")
    assert run.weight[(force == 0) & (contraction > 0.21)].sum() == 0
    assert run.weight[(force > 5) & (force < 75)].mean() > 0.95
    assert run.without_weight["reading saturated or muscle slack"] > 100


def test_a_held_extreme_is_not_saturation():
    force = np.concatenate([np.linspace(0, 50, 50), np.full(30, 50.0)])
    imposed = np.concatenate([np.linspace(0, 0.2, 50), np.full(30, 0.2)])
    assert not weightless.clipped_samples(force, imposed).any()


# ------------------------------------------------------------------------------------------------------ position tests


def test_a_release_starts_at_zero_and_what_was_before_carries_no_weight():
    time = np.linspace(-0.1, 0.4, 251)
    contraction = np.where(time < 0, 0, 0.1 * (1 - np.exp(-np.clip(time, 0, None) / 0.05)))
    r = readings(time, contraction, load=np.full(251, 100.0))
    run = run_of(r, "quick release")
    assert (run.weight == (time >= 0)).all()
    assert (run.rate[time < 0] == 0).all()
    late = (time > 0.005) & (time < 0.3)
    assert run.rate[late] == pytest.approx(2 * np.exp(-time[late] / 0.05), rel=0.02)
    assert run.without_weight["before t = 0"] == np.count_nonzero(time < 0)


def test_isotonic_branches_go_by_pressure():
    time = np.arange(401) * 0.05
    pressure = 5e5 * (1 - np.abs(time / 10 - 1)) + 1e4
    run = run_of(readings(time, 0.2 * pressure / 5e5, pressure, load=np.full(401, 50.0)), "isotonic")
    assert (run.branch == np.where(np.arange(401) <= 200, 1, -1)).all()
    assert run.rate[run.weight > 0] == pytest.approx(0.02 * run.branch[run.weight > 0], rel=1e-6)
    assert run.weight[[0, 1, 2, 3, 197, 200, 203, 400]].sum() == 0


@pytest.mark.parametrize("sigma", [0.0, 0.5])
@pytest.mark.parametrize("delay", [4, 9])
def test_a_jump_that_comes_late_after_a_turning_point_is_left_out_alone(delay, sigma):
    """Friction of 40 N reverses `delay` samples after the length does: only the samples around the jump go."""
    time, contraction = motion()
    edges = signals.branches_of(contraction, 0.01).edges
    way = np.sign(np.gradient(contraction))
    force = 1000 - 2000 * contraction - 40 * np.concatenate([np.full(delay, way[0]), way[:-delay]])
    force += sigma * np.random.default_rng(3).normal(size=len(time))
    late = weightless.late_jumps(force, edges, signals.noise_level(time, force))
    jumps = np.flatnonzero(np.abs(np.diff(force)) > 30)
    assert len(jumps) >= len(edges) - 2
    assert late[jumps].all()
    assert late[jumps + 1].all()
    assert late.sum() <= 4 * (len(edges) - 1)


def test_what_grows_or_dies_away_smoothly_is_no_late_jump():
    """Noise, presliding and creep after a turning point keep their weight."""
    time, contraction = motion()
    edges = signals.branches_of(contraction, 0.01).edges
    since = np.concatenate([np.arange(b - a) for a, b in itertools.pairwise(edges)] + [[0]])
    rng = np.random.default_rng(4)
    for lasting in (2, 5, 20):
        force = 1000 - 2000 * contraction + 40 * np.exp(-since / lasting)
        late = weightless.late_jumps(force, edges, signals.noise_level(time, force))
        assert not late[since > 3].any()
    found = 0
    for _ in range(50):
        force = 1000 - 2000 * contraction + rng.normal(size=len(time))
        found += weightless.late_jumps(force, edges, signals.noise_level(time, force)).sum()
    assert found == 0


def test_a_loop_whose_friction_turns_late_loses_those_samples_and_says_so():
    time, contraction = motion()
    way = np.sign(np.gradient(contraction))
    force = 1000 - 2000 * contraction - 40 * np.concatenate([np.full(6, way[0]), way[:-6]])
    late, prompt = readings(time, contraction, measured=force), readings(time, contraction)
    run, usual = run_of(late, "loop"), run_of(prompt, "loop")
    jumps = np.flatnonzero(np.abs(np.diff(force)) > 30)
    assert np.all(run.weight[jumps] == 0)
    assert np.all(run.weight[jumps + 1] == 0)
    reason = "where the reading jumps late after a turning point"
    assert run.without_weight[reason] > 0
    assert usual.without_weight[reason] == 0
    assert 0 < usual.weight.sum() - run.weight.sum() <= 4 * len(TURNS)
