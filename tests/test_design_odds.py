"""Designs of what comes out a little different, and trade-offs."""

import dataclasses

import numpy as np
import pytest
from designing import ALONE, BAR, IDEAL, MUSCLE, RANGES, TASK, quantity

from mckibben_jax.design.best import Limit, Task, design
from mckibben_jax.design.merit import built
from mckibben_jax.design.pareto import Second, front
from mckibben_jax.design.scatter import design_cautiously, odds, scatter_of
from mckibben_jax.effects import Tip
from mckibben_jax.laws import braid


def test_half_of_what_is_made_keeps_an_active_limit_and_more_when_asked():
    scatter = scatter_of({"wall_thickness": 0.05e-3, "radius": 0.1e-3})
    careless, careful = design(ALONE), design_cautiously(ALONE, scatter, 0.95)
    assert careful.outcome == "optimal"
    assert odds(ALONE, careless.muscle, scatter).all_hold == pytest.approx(0.5, abs=0.05)
    assert odds(ALONE, careful.muscle, scatter).all_hold == pytest.approx(0.95, abs=0.03)
    assert careful.value < careless.value


def test_odds_are_those_of_a_quadrature():
    """Force goes as the square of the radius: its mean over +-d is that of r^2, r0^2 + d^2/3."""
    scatter = scatter_of({"radius": 0.5e-3}, count=4096)
    task = dataclasses.replace(ALONE, constraints=(Limit("force", TASK.at, min=1.0),))
    nominal = quantity("force", built(MUSCLE, IDEAL), **TASK.at)
    fate = odds(task, MUSCLE, scatter)
    assert fate.mean == pytest.approx(nominal * (1 + (0.5 / 8) ** 2 / 3), rel=1e-6)
    assert fate.q95 == pytest.approx(nominal * (1 + 0.9 * 0.5 / 8) ** 2, rel=1e-3)
    assert fate.all_hold == 1


def test_draws_of_a_posterior_move_the_model():
    """A tip factor that is not known exactly: the stroke is eps_max/k."""
    draws = np.array([1.1, 1.2, 1.3])
    scatter = scatter_of({}, {"tip.k": draws}, count=512)
    task = Task(MUSCLE, {"braid_angle": RANGES["braid_angle"]}, "stroke", {"pressure": 3 * BAR}, (), (*IDEAL, Tip()))
    strokes = float(braid.largest_contraction(MUSCLE.braid_angle)) / scatter.parameters["tip.k"]
    assert set(scatter.parameters["tip.k"]) == set(draws)
    assert odds(task, MUSCLE, scatter).mean == pytest.approx(strokes.mean(), rel=1e-9)


def test_a_front_runs_from_one_best_to_the_other():
    """Force against stroke by the braid angle alone: the closed forms of both at every point."""
    task = dataclasses.replace(ALONE, constraints=(Limit("strand_length", max=0.33),))
    found = front(dataclasses.replace(task, variables=task.variables | {"radius": (6e-3, 9e-3)}),
                  Second("gas_volume", {"contraction": 0.1}, maximise=False, points=5))  # fmt: skip
    forces, volumes = np.array([(one.value, one.constraints[-1].value) for one in found]).T
    assert all(one.outcome == "optimal" for one in found)
    assert np.all(np.diff(forces) < 0)
    np.testing.assert_allclose(volumes, np.linspace(volumes[0], volumes[-1], 5), rtol=1e-5)
    for one, before, after in zip(found[1:-1], forces[:-2], forces[2:], strict=True):
        price = one.constraints[-1].multiplier * -np.diff(volumes)[0]  # what the next millilitre brings: the slope
        low, high = sorted((before - one.value, one.value - after))
        assert low * 0.999 <= price <= high * 1.001
