"""The worked example on the page about other programs does what the page says."""

import re
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest
from test_export_c import numpy_muscle

from fitting.exporting.python_module import python_module
from mckibben_jax import BladderNeoHookean, CoulombFriction, IdealCylinder, Muscle, model

PAGE = Path(__file__).parents[1] / "notebooks" / "site" / "pages" / "other_programs.md"


@pytest.fixture(scope="module")
def example():
    """What stands after the example in diffrax has run."""
    (block,) = (text for text in re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.S) if "diffrax" in text)
    place = {}
    exec(block, place)  # the page is ours
    return place


def test_the_error_of_the_joint_falls(example):
    assert example["after"] < 0.7 * example["before"]


def test_the_gradient_through_the_joint_is_that_of_differences(example):
    cost, gains = example["cost"], jnp.array([1e5, 1e5, 5e3])
    _, slope = cost(gains)
    for k in range(3):
        change = jnp.zeros(3).at[k].set(1e-3 * gains[k])
        difference = (cost(gains + change)[0] - cost(gains - change)[0]) / (2 * change[k])
        assert float(slope[k]) == pytest.approx(float(difference), rel=1e-3)


def test_many_muscles_in_mjx_move_as_one_by_one_in_numpy():
    pytest.importorskip("mujoco.mjx", reason="MJX is not installed: pip install mujoco-mjx")
    (block,) = (text for text in re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.S) if "import mjx" in text)
    place = {}
    exec(block, place)  # the page is ours
    step, mass, pressures = place["STEP"], place["MASS"], np.asarray(place["pressures"])
    for f_s, modulus, heights in zip(place["friction"], place["moduli"], place["heights"], strict=True):
        effects = IdealCylinder(), BladderNeoHookean(G=float(modulus)), CoulombFriction(f_s=float(f_s))
        muscle = numpy_muscle(python_module(model(Muscle(**place["SIZE"]), *effects), "t"))
        state, height, speed, expected = muscle.start(pressures[0], 0.0), 0.0, 0.0, []
        for pressure in pressures:
            state, pull, friction = muscle.step_parts(state, pressure, height, step)
            speed += step * ((pull - friction * np.tanh(speed / 0.01)) / mass - 9.80665)
            height += step * speed
            expected.append(height)
        assert np.max(expected) > 0.03
        np.testing.assert_allclose(heights, expected, rtol=0, atol=1e-9)
