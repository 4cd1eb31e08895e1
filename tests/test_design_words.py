"""What is said and drawn of a design."""

import re

import pytest
from designing import ALONE, BAR, IDEAL, MUSCLE, RANGES, TASK, quantity

from fitting.designs.answer import answer
from fitting.designs.order import DesignOrder
from fitting.report.text.design import answer_text, describe, odds_text
from mckibben_jax.design.best import Task, design
from mckibben_jax.design.merit import built
from mckibben_jax.design.pareto import Second
from mckibben_jax.design.scatter import Odds


def test_where_one_design_is_best_in_both_that_is_said():
    task = Task(MUSCLE, {"radius": RANGES["radius"]}, "force", {"contraction": 0.1, "pressure": BAR}, (), IDEAL)
    found = answer(DesignOrder(task, {}, None, Second("gas_volume", {"contraction": 0.1})), {})
    assert answer_text(found).startswith("no trade-off: one design is best in force and in gas_volume")
    assert float(found.first.muscle.radius) == pytest.approx(RANGES["radius"][1])


def test_who_asked_for_a_chance_is_not_told_to():
    found, fate = design(ALONE), Odds(1.0, 0.5, 1.5, (0.5,) * len(ALONE.constraints), 0.5, 10)
    assert "ask for it" in odds_text(found, fate)
    assert "ask for it" not in odds_text(found, fate, asked=True)


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
    from fitting.report.pictures.design import to_scale

    figure = to_scale(MUSCLE, 0.25, 3 * BAR)
    rest, contracted = (axes.patches[0] for axes in figure.axes)
    assert (rest.get_width(), rest.get_height()) == pytest.approx((0.3, 0.016))
    assert contracted.get_width() == pytest.approx(0.225)
    assert contracted.get_height() == pytest.approx(2 * quantity("outer_radius", built(MUSCLE, ()), contraction=0.25))
    assert all(axes.get_aspect() == 1 for axes in figure.axes)
    assert figure.axes[0].get_xlim() == figure.axes[1].get_xlim()
    figure.savefig(tmp_path / "muscle.svg")
