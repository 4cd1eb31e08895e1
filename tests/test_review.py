"""The review's table: complete, callable, and what it calls sound or unsound is so."""

import inspect

import jax.numpy as jnp
import pytest

from mckibben_jax.laws import braid, rubber, textile
from mckibben_jax.laws.review import EQUATIONS, lookup
from mckibben_jax.laws.symbols import meanings, undefined

# A typical muscle, by the names of arguments; every function of the table is called with these.
TYPICAL = {
    "contraction": 0.1, "pressure": 3e5, "length": 0.3, "radius": 0.007, "braid_angle": 0.35, "wall_ratio": 0.1,
    "inner_radius": 0.008, "cone_ratio": 0.3, "factor": 1.25, "angle": 0.5, "right_angle_radius": 0.0204,
    "cord_length": 0.32, "turns": 2.5, "side": 0.01, "columns": 10, "hoop_stretch": 1.5, "axial_stretch": 0.9,
    "radial_stretch": 0.74, "circumferential_stretch": 1.5, "shear_modulus": 0.54e6, "c10": 1.2e5, "c01": 1e4,
    "coefficients": ((0.0, 1e4), (1.2e5, 1e3)), "breaking_stress": 28e6, "stiffness": 1e4, "coefficient": 0.02,
    "contact_surface": 0.013, "strand_modulus": 2e9, "strand_poisson": 0.4, "strand_width": 1e-3, "load": 200.0,
    "exponent": 0.7, "speed": 0.05, "static_coefficient": 0.015, "kinetic_coefficient": 0.1, "speed_scale": 0.1,
    "activation": 0.8, "spring_force": 500.0, "resistance": 20.0, "position": 0.02, "velocity": 0.1,
    "contractile_force": 400.0, "mass": 10.0, "damping": 300.0, "gravity": 9.8, "isometric_force": 1000.0, "a": 120.0,
    "b": 0.07, "force_ratio": 0.5, "curvature": 0.12, "pull_at_rest": 800.0, "stroke": 0.09, "kinetic_friction": 40.0,
    "wall_volume": 1e-5, "force": 300.0,
    "volume": lambda eps: braid.cylinder_volume(eps, 0.3, 0.007, 0.35),
    "ratio": lambda eps: braid.radius_ratio(eps, 0.35),
}  # fmt: skip


@pytest.mark.parametrize("equation", EQUATIONS, ids=lambda equation: equation.number)
def test_every_entry_is_callable(equation):
    for law in filter(None, (equation.function, equation.printed)):
        values = law(**{name: TYPICAL[name] for name in inspect.signature(law).parameters})
        assert all(jnp.isfinite(value) for value in (values if isinstance(values, tuple) else (values,)))


def test_every_equation_of_the_review_is_there_once():
    numbers = [equation.number for equation in EQUATIONS]
    assert len(numbers) == len(set(numbers))
    assert {str(n) for n in range(1, 49)} | {"23T", "23F", "25E", "28E", "32T", "tip"} <= set(numbers)


@pytest.mark.parametrize("equation", EQUATIONS, ids=lambda equation: equation.number)
def test_entries_say_what_is_wrong(equation):
    assert equation.status in {"ok", "misprint", "questionable", "addition"}
    assert all((equation.quantity, equation.formula, equation.symbols))
    assert equation.correction or equation.status == "ok"
    assert (equation.printed is None) or equation.printed.__name__.endswith("_printed")
    assert not equation.function.__name__.endswith("_printed")


@pytest.mark.parametrize("equation", EQUATIONS, ids=lambda equation: equation.number)
def test_functions_say_where_they_come_from(equation):
    assert "Tondu 2012" in equation.function.__doc__


@pytest.mark.parametrize("asked", ["25E", "25e", " 25E ", "eq 25E", "Eq. 25E"])
def test_lookup_is_forgiving(asked):
    assert lookup(asked).function is braid.cone_force


def test_lookup_by_number():
    assert lookup("10").function is braid.ideal_force
    assert lookup("32T").function is rubber.thick_elastic_force
    assert lookup("40").function is textile.power_law_friction


def test_lookup_of_an_unknown_number_offers_the_nearest():
    with pytest.raises(ValueError, match=r"no equation '25X'.*25E"):
        lookup("25X")


@pytest.mark.parametrize("equation", EQUATIONS, ids=lambda equation: equation.number)
def test_every_symbol_of_a_formula_has_a_meaning(equation):
    assert undefined(equation.formula, equation.own_symbols) == ()
    assert equation.symbols


def test_a_symbol_without_a_meaning_is_noticed():
    assert undefined("F = zeta r^2, c = 2 r", "q heat") == ("zeta",)
    assert meanings("F = zeta r^2", "zeta factor, r radius of the bore") == (
        "zeta factor, r radius of the bore, F pull of the muscle"
    )
