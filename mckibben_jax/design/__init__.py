"""Muscles for a purpose: what one is worth, which is best, what tolerances cost, and designs in batches."""

from mckibben_jax.design.best import DESIGN_BASELINE as DESIGN_BASELINE
from mckibben_jax.design.best import Design as Design
from mckibben_jax.design.best import Limit as Limit
from mckibben_jax.design.best import Task as Task
from mckibben_jax.design.best import design as design
from mckibben_jax.design.merit import QUANTITIES as QUANTITIES
from mckibben_jax.design.merit import built as built
from mckibben_jax.design.pareto import Second as Second
from mckibben_jax.design.pareto import front as front
