"""Designs against closed forms, a dense grid and finite differences; and what is said when there is none."""

import dataclasses
import re

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

from fitting.designs.answer import answer, model_text
from fitting.designs.file import read_design
from fitting.designs.order import DesignOrder, read_order
from fitting.designs.words import describe, odds_in_words
from fitting.errors import InputError
from fitting.reading.model_file import read_model
from fitting.reading.own_effects import library
from mckibben_jax import braid, gas, rubber
from mckibben_jax.design import Limit, Task, design, quantities_of, to_json
from mckibben_jax.effects import (
    BladderNeoHookean,
    CoulombFriction,
    ForceOffset,
    IdealCylinder,
    Presliding,
    SeriesCompliance,
    Tip,
)  # fmt: skip
from mckibben_jax.merit import QUANTITIES, built
from mckibben_jax.muscle import Muscle
from mckibben_jax.pareto import Second, front
from mckibben_jax.scatter import Odds, design_cautiously, odds, scatter_of

MUSCLE = Muscle(length=0.3, radius=8e-3, braid_angle=np.radians(25.0), wall_thickness=1e-3, shear_modulus=0.54e6,
                breaking_stress=28e6)  # fmt: skip
BAR = 1e5


def quantity(name, given, **at):
    """A quantity of a model."""
    return float(eqx.filter_jit(QUANTITIES[name].law)(given, at))


IDEAL = (IdealCylinder(),)
RANGES = {
    "braid_angle": (np.radians(12.0), np.radians(40.0)), "radius": (4e-3, 12e-3), "wall_thickness": (0.3e-3, 3e-3),
}  # fmt: skip
LIMITS = (
    Limit("stroke", {"pressure": 5 * BAR}, min=0.2),
    Limit("minimum_pressure_thin", max=BAR),
    Limit("burst_pressure", min=5 * BAR),
)
TASK = Task(MUSCLE, RANGES, "force", {"contraction": 0.1, "pressure": 5 * BAR}, LIMITS, IDEAL)


# Closed forms --------------------------------------------------------------------------------------------------------


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


def grid(count):
    """Places all over the ranges."""
    axes = [np.linspace(*ends, count) for ends in RANGES.values()]
    return np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)


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


# Quantities ----------------------------------------------------------------------------------------------------------


def test_quantities_are_the_laws():
    given, at = built(MUSCLE, (IdealCylinder(), BladderNeoHookean())), {"contraction": 0.1, "pressure": 3 * BAR}
    wall = (8e-3, float(MUSCLE.braid_angle), 1 / 8, 0.27e6, 0.0)
    law = jax.jit(lambda eps: rubber.thick_wall_force(eps, 3 * BAR, *wall))
    assert quantity("force", given, **at) == pytest.approx(float(law(0.1)), rel=1e-12)
    end = quantity("stroke", given, pressure=3 * BAR)
    assert float(law(end)) == pytest.approx(0, abs=1e-8)
    places = np.linspace(0, end, 4001)
    area = 0.3 * np.trapezoid(law(places), places)
    assert quantity("work", given, pressure=3 * BAR) == pytest.approx(area, rel=1e-6)
    slope = float(law(0.1001) - law(0.0999)) / 2e-4
    assert quantity("stiffness", given, **at) == pytest.approx(-slope / 0.3, rel=1e-6)
    bore = float(rubber.inner_radius(0.1, *wall[:3]))
    assert quantity("gas_volume", given, contraction=0.1) == pytest.approx(np.pi * bore**2 * 0.27, rel=1e-12)
    outside = 8e-3 * float(braid.radius_ratio(0.1, wall[1]))
    assert quantity("outer_radius", given, contraction=0.1) == pytest.approx(outside, rel=1e-12)


@pytest.mark.parametrize(
    ("effect", "stroke"),
    [(None, 1.0), (Tip(k=1.25), 0.8), (SeriesCompliance(k_s=1e5), 1.0), (CoulombFriction(), 1.0), (ForceOffset(), 1.0)],
    ids=str,
)
def test_any_effects_count(effect, stroke):
    """A tip shortens the stroke; a spring in series changes nothing where F = 0, nor what is lost or read."""
    given = built(MUSCLE, IDEAL if effect is None else (*IDEAL, effect))
    end = stroke * float(braid.largest_contraction(MUSCLE.braid_angle))
    assert quantity("stroke", given, pressure=3 * BAR) == pytest.approx(end, abs=1e-6)


def test_hysteresis_of_the_ideal_muscle_with_coulomb_friction():
    """Twice l0 f_s P int S d eps, S = 2 pi r0 l0/(rho (1 - eps)): int = sin a [arsech(1/sqrt 3) - arsech(cos a)]."""
    given = built(MUSCLE, (IdealCylinder(), CoulombFriction(f_s=0.02)))
    angle = float(MUSCLE.braid_angle)
    area = np.sin(angle) * (np.arccosh(1 / np.cos(angle)) - np.arccosh(np.sqrt(3))) * -1
    loss = 2 * 0.3 * 0.02 * 3 * BAR * 2 * np.pi * 8e-3 * 0.3 * area
    assert quantity("hysteresis_loss", given, pressure=3 * BAR) == pytest.approx(loss, rel=1e-10)
    assert quantity("hysteresis_loss", built(MUSCLE, IDEAL), pressure=3 * BAR) == 0


def test_what_remembers_does_not_change_a_slow_loop():
    plain, remembering = (built(MUSCLE, (IdealCylinder(), CoulombFriction(), *more)) for more in ((), (Presliding(),)))
    loss = quantity("hysteresis_loss", plain, pressure=3 * BAR)
    assert quantity("hysteresis_loss", remembering, pressure=3 * BAR) == pytest.approx(loss, rel=1e-12)


def test_efficiency_is_work_over_the_air_that_is_drawn():
    """The work of the ideal muscle is P dV; the air's by integrating v dp from the atmosphere for the mass drawn."""
    pressure, constant = 3 * BAR, 287.0 * 293.0
    present = pressure + 101325.0
    end = float(braid.largest_contraction(MUSCLE.braid_angle))
    full, rest = (float(braid.cylinder_volume(eps, 0.3, 8e-3, MUSCLE.braid_angle)) for eps in (end, 0.0))
    wall = np.pi * (8e-3**2 - 7e-3**2) * 0.3
    mass = (present * (full - wall) - 101325.0 * (rest - wall)) / constant
    energy = mass * quad(lambda p: constant / p, 101325.0, present)[0]
    expected = pressure * (full - rest) / energy
    assert quantity("efficiency", built(MUSCLE, IDEAL), pressure=pressure) == pytest.approx(expected, rel=1e-8)
    rubbing = built(MUSCLE, (IdealCylinder(), CoulombFriction(f_s=0.02)))
    lost = quantity("hysteresis_loss", rubbing, pressure=pressure) / 2
    assert quantity("efficiency", rubbing, pressure=pressure) == pytest.approx(expected - lost / energy, rel=1e-8)


@pytest.mark.parametrize("pressure", [0.5 * BAR, 5 * BAR])
def test_response_time_is_that_of_the_equation_of_filling(pressure):
    """Choked flow at 5 bar, then not; never choked at 0.5 bar. ISO 6358 integrated by scipy until 90 % are there."""
    supply, volume, conductance = pressure + 101325.0, 4e-5, 5e-9

    def rate(_, p):
        beyond = max(p[0] / supply - 0.3, 0) / 0.7
        return [conductance * supply * 1e5 * np.sqrt(max(1 - beyond**2, 0)) / volume]

    def filled(_, p):
        return p[0] - 101325.0 - 0.9 * pressure

    filled.terminal = True
    solved = solve_ivp(rate, (0, 10), [101325.0], events=filled, rtol=1e-10, atol=1e-3, max_step=5e-4)
    assert float(gas.filling_time(pressure, volume, conductance)) == pytest.approx(solved.t_events[0][0], rel=1e-7)
    given = built(MUSCLE, IDEAL)
    wide = quantity("response_time", given, pressure=pressure, conductance=conductance)
    narrow = quantity("response_time", given, pressure=pressure, conductance=conductance / 2, contraction=0.1)
    share = quantity("gas_volume", given, contraction=0.1) / quantity(
        "gas_volume", given, contraction=quantity("stroke", given, pressure=pressure)
    )
    assert narrow == pytest.approx(2 * share * wide, rel=1e-9)


@pytest.mark.parametrize("name", QUANTITIES)
def test_gradients_are_those_of_finite_differences(name):
    effects = (IdealCylinder(), BladderNeoHookean(), Tip(k=1.1), CoulombFriction())
    task = Task(MUSCLE, RANGES, name, {"contraction": 0.1, "pressure": 4 * BAR}, effects=effects)
    law = jax.jit(lambda v: quantities_of(task)(v)[0])
    at = np.array([np.radians(24.0), 8e-3, 1.1e-3])
    slopes = np.asarray(jax.jacfwd(law)(jnp.asarray(at)))
    for i in range(3):
        step = np.zeros(3)
        step[i] = 1e-5 * at[i]
        difference = (float(law(at + step)) - float(law(at - step))) / (2 * step[i])
        assert slopes[i] == pytest.approx(difference, rel=1e-6, abs=1e-6 * abs(float(law(at))) / at[i])


# What cannot be had --------------------------------------------------------------------------------------------------


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


# Under uncertainty, and trade-offs ------------------------------------------------------------------------------------

ALONE = dataclasses.replace(TASK, variables={"braid_angle": RANGES["braid_angle"]}, constraints=LIMITS[1:2])


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


# Words and pictures --------------------------------------------------------------------------------------------------


def test_where_one_design_is_best_in_both_that_is_said():
    task = Task(MUSCLE, {"radius": RANGES["radius"]}, "force", {"contraction": 0.1, "pressure": BAR}, (), IDEAL)
    found = answer(DesignOrder(task, {}, None, Second("gas_volume", {"contraction": 0.1})), {})
    assert found.words.startswith("no trade-off: one design is best in force and in gas_volume")
    assert float(found.first.muscle.radius) == pytest.approx(RANGES["radius"][1])


def test_who_asked_for_a_chance_is_not_told_to():
    found, fate = design(ALONE), Odds(1.0, 0.5, 1.5, (0.5,) * len(ALONE.constraints), 0.5, 10)
    assert "ask for it" in odds_in_words(found, fate)
    assert "ask for it" not in odds_in_words(found, fate, asked=True)


def test_prices_are_told_in_bars_and_newtons():
    """A price holds for a small part of a limit: of 1 bar for a tenth, of 5 bar for one."""
    found = design(TASK)
    words = describe(found)
    told = [re.search(rf"{start} ([\d.e+]+) N of force", words) for start in (
        "0.1 bar less of minimum_pressure_thin costs", "one bar more of burst_pressure costs",
        "one mm more of radius would bring")]  # fmt: skip
    prices = [*(c.multiplier for c in found.constraints[1:]), found.variables[1].multiplier]
    for match, price, step in zip(told, prices, (0.1 * BAR, BAR, 1e-3), strict=True):
        assert match
        assert float(match[1]) == pytest.approx(price * step, rel=6e-3)


def test_sensitivities_are_exponents():
    """At one contraction and pressure the ideal force goes as r^2 and does not know the wall."""
    found = design(TASK)
    assert found.sensitivity["radius"]["force"] == pytest.approx(2)
    assert found.sensitivity["wall_thickness"]["force"] == pytest.approx(0)


def test_the_picture_is_to_scale(tmp_path):
    from fitting.designs.figures import to_scale

    figure = to_scale(MUSCLE, 0.25, 3 * BAR)
    rest, contracted = (axes.patches[0] for axes in figure.axes)
    assert (rest.get_width(), rest.get_height()) == pytest.approx((0.3, 0.016))
    assert contracted.get_width() == pytest.approx(0.225)
    assert contracted.get_height() == pytest.approx(2 * quantity("outer_radius", built(MUSCLE, ()), contraction=0.25))
    assert all(axes.get_aspect() == 1 for axes in figure.axes)
    assert figure.axes[0].get_xlim() == figure.axes[1].get_xlim()
    figure.savefig(tmp_path / "muscle.svg")


# Files ---------------------------------------------------------------------------------------------------------------

FILE = """
[muscle]
length = "300 mm"
shear_modulus = "0.54 MPa"
breaking_stress = "28 MPa"
[model]
effects = ["ideal_cylinder", "bladder_neo_hookean"]
[variables]
braid_angle    = ["12 deg", "40 deg"]
radius         = ["4 mm", "12 mm"]
wall_thickness = ["0.3 mm", "3 mm"]
[objective]
maximise = "force"
at = { contraction = 0.1, pressure = "5 bar" }
[[constraint]]
quantity = "stroke"
at = { pressure = "5 bar" }
min = "20 %"
[[constraint]]
quantity = "minimum_pressure"
max = "1 bar"
[[constraint]]
quantity = "burst_pressure"
min = "5 bar"
"""


def written(path, text=FILE):
    (path / "design.toml").write_text(text)
    return path / "design.toml"


def test_a_file_becomes_a_design(tmp_path):
    task = read_design(written(tmp_path))
    assert task.variables["braid_angle"] == pytest.approx((np.radians(12), np.radians(40)))
    assert task.at == {"contraction": 0.1, "pressure": 5e5}
    assert task.constraints[0] == Limit("stroke", {"pressure": 5e5}, min=0.2)
    found = design(task)
    made = to_json(found)
    assert made["outcome"] == "optimal"
    assert {"length_m", "radius_m", "braid_angle_rad", "wall_thickness_m", "shear_modulus_Pa"} <= set(made["muscle"])
    assert {"quantity", "value", "min", "max", "active", "multiplier"} <= set(made["constraints"][0])
    assert made["constraints"][1]["value"] == pytest.approx(1e5, rel=1e-5)
    assert "at its limit" in describe(found)


def test_the_rubber_of_the_muscle_is_that_of_its_wall(tmp_path):
    soft = read_design(written(tmp_path, FILE.replace("0.54 MPa", "0.3 MPa")))
    assert float(built(soft.muscle, soft.effects)["bladder_neo_hookean"].G) == pytest.approx(0.3e6)


def test_a_fitted_model_can_be_designed_with(tmp_path):
    (tmp_path / "model.toml").write_text(
        'format = 1\n[muscle]\nlength = "250 mm"\nradius = "7 mm"\nbraid_angle = "20 deg"\nwall_thickness = "0.5 mm"\n'
        '[[effect]]\nname = "ideal_cylinder"\n[[effect]]\nname = "tip"\nk = "1.2"\n'
        '[[effect]]\nname = "bladder_neo_hookean"\nG = "0.4 MPa"\n'
    )
    text = '[model]\nfile = "model.toml"\n[variables]\nbraid_angle = ["15 deg", "40 deg"]\n'
    text += '[objective]\nmaximise = "work"\nat = { pressure = "3 bar" }\n'
    text += '[[constraint]]\nquantity = "stroke"\nat = { pressure = "3 bar" }\nmin = 0.2\n'
    text += '[[constraint]]\nquantity = "minimum_pressure"\nmax = "0.4 bar"\n'
    task = read_design(written(tmp_path, text))
    assert float(task.muscle.length) == 0.25
    assert float(built(task.muscle, task.effects)["tip"].k) == 1.2
    assert float(built(task.muscle, task.effects)["bladder_neo_hookean"].G) == 0.4e6
    assert design(task).outcome == "optimal"


def test_a_design_is_a_model_to_go_on_with(tmp_path):
    task = read_design(written(tmp_path))
    muscle = task.muscle
    found = dataclasses.replace(design(ALONE), muscle=muscle)
    (tmp_path / "model.toml").write_text(model_text(task, found))
    stored = read_model(tmp_path / "model.toml", library())
    assert float(stored.muscle.radius) == pytest.approx(float(muscle.radius))
    assert {type(e) for e in stored.effects} == {IdealCylinder, BladderNeoHookean}


def test_a_file_may_ask_for_more(tmp_path):
    text = FILE + '[tolerance]\nradius = "0.1 mm"\n[uncertainty]\nchance = "95 %"\n[pareto]\nsecond = "stroke"\n'
    order = read_order(written(tmp_path, text + 'at = { pressure = "5 bar" }\npoints = 4\n'))
    assert order.tolerances == {"radius": pytest.approx(1e-4)}
    assert order.chance == pytest.approx(0.95)
    assert order.second == Second("stroke", {"pressure": 5e5}, True, 4)


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ('[tolerance]\nradios = "0.1 mm"', "did you mean 'radius'"),
        ('[tolerance]\nradius = "0.1 bar"', "cannot be the unit"),
        ("[uncertainty]\nchance = 2", "between 50 % and 100 %"),
        ('[pareto]\nsecond = "strike"', "did you mean 'stroke'"),
        ('[pareto]\nsecond = "stroke"', "at which pressure"),
        ("starts = 0", "whole number"),
    ],
)
def test_wrong_wishes_are_refused(tmp_path, more, message):
    text = f"{more}\n{FILE}" if more.startswith("starts") else f"{FILE}{more}\n"
    with pytest.raises(InputError) as error:
        read_order(written(tmp_path, text))
    assert message in str(error.value)


REFUSED = {
    "unknown quantity": ('"stroke"', '"strike"', "did you mean 'stroke'"),
    "unknown variable": ("radius         =", "radios =", "did you mean 'radius'"),
    "unit": ('"4 mm"', '"4 bar"', "cannot be the unit of a length"),
    "no unit": ('"4 mm"', "4", "no unit"),
    "range": ('["4 mm", "12 mm"]', '["12 mm", "4 mm"]', "does not rise"),
    "pair": ('["4 mm", "12 mm"]', '"12 mm"', "not a pair"),
    "no pressure": ('at = { pressure = "5 bar" }', "", "at which pressure"),
    "no limit": ('min = "20 %"', "", "has no limit"),
    "needs": ('breaking_stress = "28 MPa"\n', "", "burst_pressure needs breaking_stress"),
    "effect": ('"bladder_neo_hookean"', '"bladder_neohookean"', "did you mean 'bladder_neo_hookean'"),
    "goal": ('maximise = "force"', "", "not one goal"),
    "key": ("[variables]", "[variable]", "did you mean 'variables'"),
    "condition": ('max = "1 bar"', 'max = "1 bar"\nat = { pressure = "1 bar" }', "not at pressure"),
    "not there": ('length = "300 mm"\n', "", "lacks length"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_a_wrong_file_is_refused_with_a_cure(tmp_path, case):
    old, new, message = REFUSED[case]
    assert old in FILE
    with pytest.raises(InputError) as error:
        read_design(written(tmp_path, FILE.replace(old, new)))
    assert message in str(error.value)
    assert "Cure:" in str(error.value)
    assert "design.toml" in str(error.value)
