"""Designs against closed forms, a dense grid and finite differences; and what is said when there is none."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from designing import BAR, IDEAL, LIMITS, MUSCLE, RANGES, TASK, grid

from fitting.report.text.design import describe
from mckibben_jax.design.best import Limit, Task, design, quantities_of, to_json
from mckibben_jax.effects import BladderNeoHookean, IdealCylinder
from mckibben_jax.muscle import Muscle


def test_the_braid_angle_with_the_largest_work_for_a_given_stroke():
    """Work falls with the braid angle, and so does the stroke: the stroke's limit decides.

    eps = 1 - 1/(sqrt(3) cos a), W = P V0 [2/(3 sqrt(3) cos a sin^2 a) - 1].
    """
    task = Task(MUSCLE, {"braid_angle": RANGES["braid_angle"]}, "work", {"pressure": 3 * BAR},
                (Limit("stroke", {"pressure": 3 * BAR}, max=0.3),), IDEAL)  # fmt: skip
    found = design(task)
    angle = np.arccos(1 / (np.sqrt(3) * 0.7))
    per_pressure_and_length = np.pi * 8e-3**2 * 0.3 * 3 * BAR
    value = per_pressure_and_length * (2 / (3 * np.sqrt(3) * np.cos(angle) * np.sin(angle) ** 2) - 1)
    slope = per_pressure_and_length * 2 / (3 * np.sqrt(3)) * (
        1 / (np.cos(angle) ** 2 * np.sin(angle)) - 2 / np.sin(angle) ** 3
    )  # fmt: skip
    stroke_slope = -np.sin(angle) / (np.sqrt(3) * np.cos(angle) ** 2)
    (limit,) = found.constraints
    assert found.outcome == "optimal"
    assert float(found.muscle.braid_angle) == pytest.approx(angle, rel=1e-7)
    assert found.value == pytest.approx(value, rel=1e-6)
    assert limit.active
    assert limit.multiplier == pytest.approx(slope / stroke_slope, rel=1e-5)


def test_the_largest_volume_of_a_length_of_strand():
    """V = pi R^2 B cos(a) sin^2(a) for strands of length B that reach to R when perpendicular: a = atan(sqrt(2))."""
    ranges = {"braid_angle": np.radians([20.0, 80.0]), "radius": (1e-3, 0.1), "length": (0.01, 1.0)}
    limits = (Limit("strand_length", max=0.4), Limit("outer_radius", {"contraction": 1 - 1e-6}, max=0.02))
    ranges = {name: tuple(ends) for name, ends in ranges.items()}
    found = design(Task(Muscle(0.3, 0.01, 0.5), ranges, "gas_volume", {"contraction": 0.0}, limits, IDEAL))
    strand, across = found.constraints
    assert found.outcome == "optimal"
    assert float(found.muscle.braid_angle) == pytest.approx(np.arctan(np.sqrt(2)), abs=1e-4)
    assert found.value == pytest.approx(np.pi * 0.02**2 * 0.4 * 2 / (3 * np.sqrt(3)), rel=1e-6)
    assert strand.multiplier == pytest.approx(found.value / 0.4, rel=1e-5)
    assert (strand.relative, across.relative) == pytest.approx((1, 2), rel=1e-5)


@pytest.mark.parametrize("effects", [IDEAL], ids=["ideal"])
def test_the_largest_work_of_a_length_of_strand(effects):
    """Of the ideal muscle alone it is at the smallest braid angle: W = P (V_max - V_0), and strands bring about V_max.

    With strands of length B and radius r0 at rest, l0 = B cos a: W = P pi r0^2 B [2/(3 sqrt(3) sin^2 a) - cos a]. Its
    slope, P pi r0^2 B [sin a - 4 cos a/(3 sqrt(3) sin^3 a)], is negative up to 54.7 deg, where W = 0: no angle inside
    is best. (For a fixed radius and length likewise: 1/(cos a sin^2 a) falls until there.) Rubber and rupture decide.
    """
    ranges = {"braid_angle": RANGES["braid_angle"], "length": (0.05, 1.0)}
    limits = (Limit("strand_length", max=0.4),)
    found = design(Task(MUSCLE, ranges, "work", {"pressure": 3 * BAR}, limits, effects))
    angle, scale = np.radians(12.0), 3 * BAR * np.pi * 8e-3**2 * 0.4
    work = scale * (2 / (3 * np.sqrt(3) * np.sin(angle) ** 2) - np.cos(angle))
    slope = scale * (np.sin(angle) - 4 * np.cos(angle) / (3 * np.sqrt(3) * np.sin(angle) ** 3))
    assert found.outcome == "optimal"
    assert float(found.muscle.braid_angle) == pytest.approx(angle, rel=1e-7)
    assert found.value == pytest.approx(work, rel=1e-6)
    assert found.constraints[0].multiplier == pytest.approx(work / 0.4, rel=1e-6)
    assert found.variables[0].multiplier == pytest.approx(-slope, rel=1e-6)


def test_the_conditions_of_an_optimum_hold():
    """Karush-Kuhn-Tucker, by differences: the objective's slope is that of the active limits times multipliers."""
    found = design(TASK)
    place = np.array([float(getattr(found.muscle, name)) for name in RANGES])
    law = jax.jit(quantities_of(TASK))
    steps = 1e-6 * place * np.eye(3)
    slopes = np.array([(law(place + s) - law(place - s)) / (2 * s.sum()) for s in steps]) * place[:, None]
    limits = sum(c.multiplier * (-1 if c.min is None else 1) * slopes[:, row]
                 for row, c in enumerate(found.constraints, 1))  # fmt: skip
    ends = place * [v.multiplier * (-1 if v.value > (v.min + v.max) / 2 else 1) for v in found.variables]
    assert np.abs(slopes[:, 0] + limits + ends).max() < 1e-4 * np.abs(slopes[:, 0]).max()
    assert all(c.multiplier == 0 or c.active for c in (*found.constraints, *found.variables))


@pytest.mark.parametrize("objective", ["force", "work"])
@pytest.mark.parametrize("effects", [IDEAL, (IdealCylinder(), BladderNeoHookean())], ids=["ideal", "rubber"])
def test_angle_wall_and_radius_of_a_strong_muscle(objective, effects):
    """Both pressures and the largest radius decide: two equations for angle and wall, solved beforehand."""
    at = TASK.at if objective == "force" else {"pressure": 5 * BAR}
    found = design(dataclasses.replace(TASK, objective=objective, at=at, effects=effects))
    assert found.outcome == "optimal"
    assert np.degrees(float(found.muscle.braid_angle)) == pytest.approx(15.906058, abs=1e-4)
    assert float(found.muscle.wall_thickness / found.muscle.radius) == pytest.approx(0.10231069, abs=1e-6)
    assert float(found.muscle.radius) == pytest.approx(12e-3)
    assert [c.active for c in found.constraints] == [False, True, True]
    assert all(c.multiplier > 0 for c in found.constraints[1:])
    assert found.constraints[0].multiplier == 0
    assert {v.quantity: v.active for v in found.variables} == {
        "braid_angle": False, "radius": True, "wall_thickness": False,
    }  # fmt: skip
    assert next(v for v in found.variables if v.quantity == "radius").relative == pytest.approx(2)  # force ~ radius^2


def test_no_place_of_a_dense_grid_is_better():
    found = design(TASK)
    values = np.asarray(jax.jit(jax.vmap(quantities_of(TASK)))(jnp.asarray(grid(48))))
    allowed = (values[:, 1] >= 0.2) & (values[:, 2] <= BAR) & (values[:, 3] >= 5 * BAR)
    best = values[allowed, 0].max()
    assert 0.95 * found.value < best <= found.value


def test_multipliers_are_what_a_relaxed_limit_brings():
    found = design(TASK)
    relaxed = (*LIMITS[:2], Limit("burst_pressure", min=4.99 * BAR))
    gain = design(dataclasses.replace(TASK, constraints=relaxed)).value - found.value
    assert gain / 1e3 == pytest.approx(found.constraints[2].multiplier, rel=1e-2)


# What cannot be had ---------------------------------------------------------------------------------------------------


def test_what_cannot_be_met_together_is_named():
    """A wider angle would help both pressures, but its range ends; nowhere on a grid is the worst miss smaller."""
    task = dataclasses.replace(TASK, constraints=(LIMITS[1], Limit("burst_pressure", min=100 * BAR)))
    found = design(task)
    assert found.outcome == "infeasible"
    assert found.fighting == ("minimum_pressure_thin", "burst_pressure", "braid_angle")
    values = np.asarray(jax.jit(jax.vmap(quantities_of(task)))(jnp.asarray(grid(32))))
    miss = np.maximum(values[:, 1] / BAR - 1, 1 - values[:, 2] / (100 * BAR)).min()
    assert miss - 0.02 < found.miss <= miss
    assert "no design meets" in describe(found)
    assert "missed" in describe(found)


def test_a_small_feasible_corner_is_found():
    """Limits a hair from the only design that meets them."""
    limits = (Limit("minimum_pressure_thin", max=BAR), Limit("burst_pressure", min=5 * BAR),
              Limit("force", TASK.at, min=0.9999 * 3756.845))  # fmt: skip
    found = design(dataclasses.replace(TASK, constraints=limits, objective="work", at={"pressure": 5 * BAR}))
    assert found.outcome == "optimal"
    assert np.degrees(float(found.muscle.braid_angle)) == pytest.approx(15.906, abs=0.01)


def test_the_same_task_gives_the_same_design():
    assert to_json(design(TASK)) == to_json(design(TASK))
