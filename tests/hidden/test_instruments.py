"""Instruments that err: sizes as stated, memory as load cells have it, and nothing where they are exact."""

import tomllib
from dataclasses import replace

import numpy as np
import pytest

from .instruments import EVERY_KIND, EXACT, KINDS, LABORATORY, Channel, Instruments, Session, slipped
from .rig import Noise, disturbed
from .simulator import Muscle, Truth, dataset, isometric, loops, pull, static, with_baseline, write
from .simulator import State as Simulated

TRUTH = Truth(Muscle(), with_baseline())
QUIET = Noise(sd=0.0)
SMALL = {
    loops: {"pressures": (2e5, 5e5), "speeds": (0.02,), "samples": 120},
    isometric: {"contractions": (0.0, 0.1), "ramps": (2e5,), "samples": 120},
    static: {},
}


def drawn(instruments: Instruments, count=2000):
    """What the instruments err by in many recordings of one run."""
    return [Session(instruments, seed).next_run() for seed in range(count)]


def recorded(test, instruments=EXACT, noise=QUIET, seed=3, truth=TRUTH, **given):
    """A small recording of one kind of test."""
    return test(truth, noise=noise, seed=seed, instruments=instruments, **{**SMALL[test], **given})


@pytest.mark.parametrize("test", list(SMALL))
def test_exact_instruments_change_no_bit(test):
    noise = Noise(phi=0.7, zero=0.3)
    by_default, exact = test(TRUTH, noise=noise, seed=3, **SMALL[test]), recorded(test, EXACT, noise)
    for key in by_default.columns:
        np.testing.assert_array_equal(by_default.columns[key], exact.columns[key])
    made = recorded(test)
    np.testing.assert_array_equal(made.columns["force"], made.clean)


def test_the_noise_of_the_force_is_drawn_as_it_was_before_instruments_erred():
    """One run by hand: gauge, ruler and force take their numbers from the seed in this order."""
    noise = Noise(phi=0.7, pressure=50.0, position=1e-5)
    made = recorded(loops, noise=noise, pressures=(3e5,))
    random, count = np.random.default_rng(3), len(made.clean)
    gauge = 3e5 + 50.0 * random.standard_normal(count)
    ruler = recorded(loops, pressures=(3e5,)).columns["displacement"] + 1e-5 * random.standard_normal(count)
    force = disturbed(random, made.clean, np.full(count, 3e5), noise)
    np.testing.assert_array_equal(made.columns["pressure"], gauge)
    np.testing.assert_array_equal(made.columns["displacement"], ruler)
    np.testing.assert_array_equal(made.columns["force"], force)


@pytest.mark.parametrize("name", ["pressure", "force", "position"])
def test_draws_have_the_stated_moments(name):
    channel = Channel(zero=3.0, gain=0.04, zero_per_run=4.0, gain_per_run=0.03, hysteresis=2e-3, drift=0.5)
    runs = [getattr(one, name) for one in drawn(Instruments(**{name: channel}))]
    for key, size in {"zero": 5.0, "gain": 0.05, "hysteresis": 2e-3, "drift": 0.5}.items():
        values = np.array([getattr(run, key) for run in runs])
        assert np.sqrt(np.mean(values**2)) == pytest.approx(size, rel=0.05), key
        assert (np.all(values >= 0)) if key == "hysteresis" else abs(np.mean(values)) < 0.08 * size, key


def test_skew_and_held_length_have_the_stated_moments_and_differ_from_run_to_run():
    session = Session(Instruments(skew=0.004, held_length=1e-3), 5)
    runs = [session.next_run() for _ in range(2000)]
    assert np.std([run.skew for run in runs]) == pytest.approx(0.004, rel=0.05)
    assert np.std([run.held_length for run in runs]) == pytest.approx(1e-3, rel=0.05)


def test_what_errs_all_along_is_the_same_in_every_run_of_a_recording_and_no_other():
    session = Session(Instruments(force=Channel(zero=2.0, drift=0.1)), 5)
    one, other = session.next_run(), session.next_run()
    assert one.force == other.force
    assert one.force != Session(Instruments(force=Channel(zero=2.0, drift=0.1)), 6).next_run().force


def test_noise_and_resolution_of_a_gauge():
    made = recorded(loops, Instruments(pressure=Channel(noise=150.0)), samples=2000).columns["pressure"]
    assert np.std(made[:2000]) == pytest.approx(150.0, rel=0.06)
    stepped = recorded(loops, KINDS["gauge resolution"], noise=Noise(pressure=500.0)).columns["pressure"] * 4096 / 1e6
    np.testing.assert_allclose(stepped, np.round(stepped), atol=1e-9)
    assert len(np.unique(np.round(stepped))) > 3


def test_hysteresis_closes_reads_more_on_the_way_down_and_remembers_where_it_turned():
    up, down = np.linspace(0, 1000, 401), np.linspace(1000, 0, 401)
    rising, falling = np.split(slipped(np.concatenate([up, down[1:], up[1:]]), 1000.0, 1.0), [401])
    assert rising[200] - falling[199] == pytest.approx(2.0)  # at half of full scale, where every element slides
    again = slipped(np.concatenate([up, down[1:], up[1:], down[1:]]), 1000.0, 1.0)
    np.testing.assert_allclose(again[1201:], falling[:400], atol=1e-12)
    inner = np.array([0.0, 1000.0, 940.0, 960.0, 940.0, 800.0])
    np.testing.assert_allclose(slipped(inner, 1000.0, 1.0)[-1], slipped(inner[[0, 1, 5]], 1000.0, 1.0)[-1], atol=1e-12)


def test_a_cell_with_hysteresis_shows_its_share_of_full_scale():
    cell = Instruments(force=Channel(hysteresis=1e-3, full_scale=1000.0))
    share = Session(cell, 3).next_run().force.hysteresis
    made = recorded(isometric, cell, contractions=(0.0,), samples=400)
    error = made.columns["force"] - made.clean
    assert np.ptp(error) == pytest.approx(share * 1000.0, rel=0.02)


def test_a_drift_follows_the_clock_from_run_to_run():
    made = recorded(loops, Instruments(force=Channel(drift=0.01)))
    error, clock = made.columns["force"] - made.clean, made.columns["time"].copy()
    clock[120:] += clock[119]
    rate = Session(Instruments(force=Channel(drift=0.01)), 3).next_run().force.drift
    np.testing.assert_allclose(error, rate * clock, atol=1e-9)
    settled = recorded(loops, Instruments(force=Channel(drift=0.01, settling=5.0)))
    left = settled.columns["force"] - settled.clean
    np.testing.assert_allclose(left, rate * 5.0 * (1 - np.exp(-clock / 5.0)), atol=1e-9)


def test_a_skew_shifts_the_force_in_time():
    made = recorded(loops, Instruments(skew=0.2), samples=400, pressures=(3e5,))
    shift = Session(Instruments(skew=0.2), 3).next_run().skew
    time, middle = made.columns["time"], slice(50, 350)
    earlier = np.interp(time - shift, time, made.clean)
    turning = np.abs(np.gradient(made.columns["displacement"], time)) < 0.0199
    nearby = np.convolve(turning, np.ones(9), mode="same")[middle] > 0
    force = made.columns["force"][middle]
    np.testing.assert_allclose(force[~nearby], earlier[middle][~nearby], atol=0.01)
    assert np.max(np.abs(made.columns["force"] - made.clean)) > 1.0


def test_a_held_length_is_off_and_written_as_it_was_meant():
    made = recorded(isometric, KINDS["held length"], contractions=(0.1,))
    off = Session(KINDS["held length"], 3).next_run().held_length
    np.testing.assert_array_equal(made.columns["displacement"], np.full(120, 0.1 * 0.3))
    there = pull(TRUTH, Simulated(0.1 - off / 0.3, made.columns["pressure"]))
    np.testing.assert_allclose(made.clean, there, rtol=1e-12)
    imposed = recorded(loops, KINDS["held length"])
    np.testing.assert_array_equal(imposed.columns["force"], recorded(loops).columns["force"])


def test_a_ripple_moves_the_force_and_not_the_gauge_and_comes_again_with_the_stroke():
    ideal, rippled = Truth(Muscle(), {"ideal_cylinder": {}}), Instruments(ripple=1000.0)
    made, exact = (recorded(loops, one, truth=ideal, pressures=(2e5,)) for one in (rippled, EXACT))
    np.testing.assert_array_equal(made.columns["pressure"], exact.columns["pressure"])
    unseen = 2e5 * (made.clean / exact.clean - 1)  # the ideal pull is in proportion to the pressure
    wave = np.sin(2 * np.pi * made.columns["displacement"] / 0.02 + Session(rippled, 3).phase)
    assert np.ptp(unseen - 1000.0 * wave) < 1e-6
    np.testing.assert_array_equal(recorded(isometric, rippled).clean, recorded(isometric).clean)


@pytest.mark.parametrize("effects", [with_baseline(), with_baseline(textile_friction={"beta": 0.7, "f_s": 0.02})])
def test_friction_warms_by_the_clock(effects):
    truth = Truth(Muscle(), effects)
    made = recorded(loops, Instruments(warming=0.5, warm_after=1e-3), truth=truth)
    exact = recorded(loops, truth=truth)
    cold = Truth(Muscle(), {"ideal_cylinder": {}})
    without = recorded(loops, truth=cold).clean
    np.testing.assert_allclose((made.clean - without)[1:], 1.5 * (exact.clean - without)[1:], atol=1e-6)


@pytest.mark.parametrize("test", list(SMALL))
@pytest.mark.parametrize("kind", list(EVERY_KIND))
def test_every_kind_runs_in_every_test_and_repeats(kind, test):
    one, other = (recorded(test, EVERY_KIND[kind], noise=Noise()) for _ in range(2))
    for key in ("pressure", "displacement", "force"):
        assert np.all(np.isfinite(one.columns[key]))
        np.testing.assert_array_equal(one.columns[key], other.columns[key])


def test_half_the_laboratory_errs_by_half():
    half = LABORATORY.scaled(0.5)
    assert half.skew == LABORATORY.skew / 2
    assert half.force == replace(LABORATORY.force.scaled(0.5), full_scale=LABORATORY.force.full_scale)
    assert half.force.full_scale == LABORATORY.force.full_scale
    assert EXACT.scaled(0.5) == EXACT


def test_data_sheets_are_written_as_the_contract_says(tmp_path):
    recordings = [recorded(loops, LABORATORY), recorded(isometric, LABORATORY), recorded(static)]
    data = dataset(TRUTH, recordings)
    silent = (write(data, tmp_path / "silent") / "muscle.toml").read_text()
    assert "accuracy" not in silent
    text = (write(data, tmp_path / "said", say_accuracy=True) / "muscle.toml").read_text()
    assert text.split("[[recording]]")[0] == silent.split("[[recording]]")[0]
    loop, held, points = tomllib.loads(text)["recording"]
    assert loop["accuracy"]["pressure"] == {
        "noise": "150 Pa", "resolution": "244.141 Pa", "zero": "500 Pa", "gain": "0.25 %",
    }  # fmt: skip
    assert loop["accuracy"]["force"] == {
        "zero_per_run": "0.6 N", "gain_per_run": "0.2 %", "hysteresis": "0.05 %", "drift": "5 N/h",
    }  # fmt: skip
    assert loop["accuracy"]["displacement"] == {"noise": "0.01 mm"}
    assert loop["accuracy"]["time"] == {"skew": "5 ms"}
    assert held["accuracy"]["displacement"] == {"noise": "0.01 mm", "zero_per_run": "1 mm"}
    assert "accuracy" not in points
