"""The worked example on the page about other programs does what the page says."""

import re
from pathlib import Path

import jax.numpy as jnp
import pytest

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
