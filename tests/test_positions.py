"""Tests in which the position is measured: pressure swept under a load, pressure steps, quick releases.

Data of the independent simulator must be fitted to their noise; what the program simulates must be read back.
"""

import json
from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from click.testing import CliRunner
from hidden.simulator import Muscle, Noise, Truth, isotonic, loops, quick_release, step, with_baseline
from hidden.simulator import dataset as hidden_dataset
from hidden.simulator import write as write_hidden
from scipy.optimize import brentq
from stick_slip import Truth as Formulas

from fitting.cli.main import main
from fitting.comparison.compare import compare
from fitting.least_squares.fit import fit
from fitting.recordings.experiment import read_experiment
from mckibben_jax.effects import (
    CoulombFriction,
    IdealCylinder,
    KineticFriction,
    Presliding,
    StrandStretch,
    SupplyLag,
    Tip,
)
from mckibben_jax.model import model
from mckibben_jax.motion.isotonic import standing, swept
from mckibben_jax.muscle import Muscle as Braid
from mckibben_jax.state import State

TRUTH = Formulas(f_s=0.012)
MUSCLE = Braid(TRUTH.length, TRUTH.radius, TRUTH.angle)
RUBBING = model(MUSCLE, IdealCylinder(), CoulombFriction(TRUTH.f_s))
SWEPT = eqx.filter_jit(swept)


def states(pressure, time=None) -> State:
    pressure = jnp.asarray(pressure, dtype=float)
    zero = jnp.zeros_like(pressure)
    return State(zero, pressure, zero, zero, zero, zero, jnp.arange(len(pressure)) * 0.1 if time is None else time)


def balance(pressure, load, sign):
    """Contraction at which pull and friction of this sign carry the load, by scipy."""
    return brentq(lambda eps: TRUTH.pull(eps, pressure) - sign * TRUTH.friction(eps, 0.0, pressure) - load, 0, 0.5)


# Swept pressure ------------------------------------------------------------------------------------------------------

SWEEP = np.concatenate([np.linspace(1.5e5, 4e5, 40), np.linspace(4e5, 2e5, 40), np.linspace(2e5, 3e5, 30)])


def played(load, start):
    """The position stays until friction is overcome: a play operator between both balances."""
    place, places = start, []
    for pressure in SWEEP:
        place = min(max(place, balance(pressure, load, 1)), balance(pressure, load, -1))
        places.append(place)
    return np.array(places)


@pytest.mark.parametrize("load", [60.0, 150.0])
def test_a_swept_muscle_stays_until_friction_is_overcome(load):
    start = brentq(lambda eps: TRUTH.pull(eps, SWEEP[0]) - load, 0, 0.5)
    np.testing.assert_allclose(standing(RUBBING, SWEEP[0], load), start, atol=1e-10)
    expected = played(load, start)
    assert (np.diff(expected) == 0).sum() > 10  # it sticks at the start and at both turns
    found = SWEPT(RUBBING, states(SWEEP), load, start)
    np.testing.assert_allclose(found, expected, atol=1e-9)


def test_slopes_of_a_sweep_are_those_of_finite_differences():
    def run(vector):
        braid = Braid(TRUTH.length, vector[1], TRUTH.angle)
        given = model(braid, IdealCylinder(), CoulombFriction(vector[0]), Tip(1.1))
        return swept(given, states(SWEEP), 100.0, vector[2])

    both = jax.jit(lambda v: (run(v), jax.jacfwd(run)(v)))
    at = np.array([0.012, 0.007, 0.2])
    slopes = np.asarray(both(at)[1])
    for i, value in enumerate(at):
        change = np.zeros(3)
        change[i] = 1e-6 * value
        difference = (both(at + change)[0] - both(at - change)[0]) / (2e-6 * value)
        np.testing.assert_allclose(slopes[:, i], difference, atol=1e-5 * max(np.abs(difference).max(), 1e-3))


def test_strands_that_give_way_move_the_muscle_while_the_braid_sticks():
    soft = model(MUSCLE, IdealCylinder(), CoulombFriction(0.2), StrandStretch(2e4))
    rigid = model(MUSCLE, IdealCylinder(), CoulombFriction(0.2))
    pressure = np.linspace(3e5, 3.2e5, 20)
    held, gave = SWEPT(rigid, states(pressure), 400.0, 0.1), SWEPT(soft, states(pressure), 400.0, 0.1)
    assert np.ptp(held) == 0
    assert np.ptp(gave) > 1e-5

    def path(contraction, p):  # T = axial / cos alpha, eta = T/EA, path from the unstretched cord (effect 10)
        alpha = np.arccos(np.cos(TRUTH.angle) * (1 - contraction))
        radius = TRUTH.radius * np.sin(alpha) / np.sin(TRUTH.angle)
        stretch = 2 * np.pi * radius**2 * p / (np.tan(alpha) ** 2 * np.cos(alpha)) / 2e4
        return 1 - (1 - contraction) / (1 + stretch)

    paths = np.array([path(*both) for both in zip(np.asarray(gave), pressure, strict=True)])
    assert np.ptp(paths) < 0.02 * np.ptp(gave)


def test_a_load_that_no_length_carries_hangs_on_straight_strands():
    found = SWEPT(RUBBING, states(SWEEP), 5e3, 0.1)
    np.testing.assert_allclose(found, 1 - 1 / np.cos(TRUTH.angle), atol=1e-12)


def test_presliding_turns_round_the_corners_of_a_sweep():
    """With friction of memory z the muscle creeps at once; far along it is where Coulomb friction leaves it."""
    soft = model(MUSCLE, IdealCylinder(), CoulombFriction(TRUTH.f_s), Presliding(5e-4))
    start = float(standing(RUBBING, SWEEP[0], 100.0))
    round_, sharp = (np.asarray(SWEPT(m, states(SWEEP), 100.0, start)) for m in (soft, RUBBING))
    assert sharp[1] == sharp[0]
    assert round_[1] > round_[0]
    assert np.abs(round_ - sharp)[39] < 2e-4
    assert np.abs(round_ - sharp).max() < 5e-3


# The independent simulator ------------------------------------------------------------------------------------------

RULER = Noise(sd=1e-4)


def measured(folder, *recordings, truth) -> object:
    write_hidden(hidden_dataset(truth, recordings, "Hidden"), folder)
    return read_experiment(folder)


def test_sweeps_and_loops_are_fitted_together_to_their_noise_each_in_its_own_unit(tmp_path):
    truth = Truth(Muscle(), with_baseline(tip={"k": 1.15}))
    load = isotonic(truth, masses=(10.0, 20.0), samples=300, noise=RULER, seed=4)
    pull = loops(truth, pressures=(1e5, 3e5), speeds=(0.01,), samples=300, noise=Noise(sd=0.5), seed=5)
    data = measured(tmp_path, load, pull, truth=truth)
    found = fit([data], [IdealCylinder(), CoulombFriction(), Tip(1.05)], starts=2)
    assert found.converged
    scores = {score.test: score for score in compare(found, [data]).by_recording}
    assert (scores["isotonic"].unit, scores["loop"].unit) == ("m", "N")
    assert scores["isotonic"].rmse == pytest.approx(1e-4, rel=0.15)
    assert scores["loop"].rmse == pytest.approx(0.5, rel=0.15)
    assert found.rmse == pytest.approx(scores["loop"].rmse)  # of the forces alone, N
    assert found.values["tip.k"] == pytest.approx(1.15, abs=5 * found.error("tip.k"))
    assert found.values["coulomb_friction.f_s"] == pytest.approx(0.012, abs=5 * found.error("coulomb_friction.f_s"))


def test_a_noisy_pressure_does_not_work_the_muscle_past_its_friction(tmp_path):
    truth = Truth(Muscle(), with_baseline())
    noisy = replace(RULER, pressure=300.0)
    data = measured(tmp_path, isotonic(truth, masses=(15.0,), samples=400, noise=noisy, seed=6), truth=truth)
    found = fit([data], [IdealCylinder(), CoulombFriction()], starts=1)
    assert found.values["coulomb_friction.f_s"] == pytest.approx(0.012, rel=0.02)
    assert found.rmse < 1.6e-4


@pytest.mark.slow
def test_steps_through_a_lagging_supply_are_fitted_to_their_noise(tmp_path):
    truth = Truth(Muscle(), with_baseline(supply_lag={"tau": 0.03}))
    steps = step(truth, levels=((1.5e5, 3e5),), masses=(10.0, 20.0), duration=0.8, noise=RULER, seed=7)
    data = measured(tmp_path, steps, truth=truth)
    found = fit([data], [IdealCylinder(), CoulombFriction(), SupplyLag()], starts=6)
    assert found.rmse == pytest.approx(1e-4, rel=0.1)
    assert found.values["supply_lag.tau"] == pytest.approx(0.03, abs=5 * found.error("supply_lag.tau") + 1e-5)


@pytest.mark.slow
def test_releases_are_fitted_to_their_noise(tmp_path):
    truth = Truth(Muscle(), with_baseline(kinetic_friction={"ratio": 4.0, "v_s": 0.2}))
    data = measured(tmp_path, quick_release(truth, masses=(20.0, 45.0), duration=0.4, noise=RULER, seed=8), truth=truth)
    found = fit([data], [IdealCylinder(), CoulombFriction(), KineticFriction()], starts=4)
    assert found.rmse == pytest.approx(1e-4, rel=0.1)
    assert found.values["kinetic_friction.ratio"] == pytest.approx(4.0, abs=5 * found.error("kinetic_friction.ratio"))


# Simulated, written, read back ---------------------------------------------------------------------------------------

MODEL = """format = 1
program = "0.1.0"
[muscle]
length = { value = "300 mm", state = "fixed" }
radius = { value = "7 mm", state = "fixed" }
braid_angle = { value = "20 deg", state = "fixed" }
[[effect]]
name = "ideal_cylinder"
[[effect]]
name = "coulomb_friction"
f_s = { value = "0.012", state = "fixed" }
[[effect]]
name = "creep"
K1 = { value = "0.3 N/mm", state = "fixed" }
tau = { value = "0.2 s", state = "fixed" }
"""
ORDERS = {
    "loop": ("--pressure", "1,3 bar", "--turns", "0,0.2,0.05", "--speed", "20 mm/s"),
    "isometric": ("--pressure", "1,3,1 bar", "--contraction", "0,0.1", "--duration", "2 s"),
    "static": ("--pressure", "1,3 bar"),
    "isotonic": ("--pressure", "1.5,4,1.5 bar", "--load", "10 kg", "--duration", "2 s"),
    "quick release": ("--pressure", "4 bar", "--load", "35,40 kg", "--duration", "0.5 s"),
    "step": ("--pressure", "1.5,3 bar", "--load", "10 kg", "--duration", "0.6 s"),
}


def run(*words):
    result = CliRunner().invoke(main, [str(word) for word in words])
    assert result.exit_code == 0, result.output
    return result.output


@pytest.mark.parametrize("test", ORDERS)
def test_what_is_simulated_is_read_back(test, tmp_path):
    file, out = tmp_path / "model.toml", tmp_path / "out"
    file.write_text(MODEL)
    run("simulate", file, "--test", test, *ORDERS[test], "--out", out)
    run("compare", out, "--model", file, "--json", tmp_path / "c.json")
    score = json.loads((tmp_path / "c.json").read_text())["by_recording"][0]
    # integrated with steps of another length for the padding, and differences of speed at a loop's corners
    assert score["rmse"] < (2e-5 if test in ("quick release", "step") else 1e-6) * score["full_scale"]


def test_simulating_beyond_the_stroke_is_said(tmp_path):
    file = tmp_path / "model.toml"
    file.write_text(MODEL)
    said = run("simulate", file, "--turns", "0,0.4,0", "--out", tmp_path / "out", "--json", tmp_path / "s.json")
    assert "beyond the end of the stroke" in said
    warnings = json.loads((tmp_path / "s.json").read_text())["warnings"]
    largest = 1 - 1 / (np.sqrt(3) * np.cos(np.radians(20)))
    assert f"from contraction {largest:.3g}"[:-1] in warnings[0]
    heavy = ("--test", "isotonic", "--pressure", "0.2,1 bar", "--load", "60 kg")
    said = run("simulate", file, *heavy, "--out", tmp_path / "b")
    assert "too heavy" in said


def test_a_load_that_flies_is_refused(tmp_path):
    file = tmp_path / "model.toml"
    file.write_text(MODEL.split('[[effect]]\nname = "creep"')[0])
    light = ["--test", "quick release", "--pressure", "6 bar", "--load", "1 kg"]
    result = CliRunner().invoke(main, ["simulate", str(file), *light, "--out", str(tmp_path / "o")])
    assert result.exit_code == 2
    assert "where no braided muscle goes" in result.output
    assert not (tmp_path / "o").exists()
