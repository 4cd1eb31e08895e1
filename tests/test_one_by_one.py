"""Factors of matrices one by one: their values, their slopes, and that no program asks LAPACK for a batch.

Against a batch of matrices no test can wait: whether threads of XLA wait for each other for ever is a matter of luck.
"""

import re

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hidden.simulator import Muscle as TrueMuscle
from hidden.simulator import Noise, Truth, dataset, loops, with_baseline, write
from scipy import linalg

from fitting.least_squares.fit import fit
from fitting.posterior.evaluation import compiled
from fitting.posterior.explicit import DRAWN, Explicit
from fitting.posterior.one_by_one import cholesky, solved, solved_transposed
from fitting.posterior.setup import set_up
from fitting.recordings.experiment import read_experiment
from mckibben_jax.effects import CoulombFriction, IdealCylinder


def matrices(count: int = 7, size: int = 4):
    """Matrices that have a Cholesky factor, and right-hand sides."""
    random = np.random.default_rng(0)
    roots = random.standard_normal((count, size, size))
    return roots @ roots.transpose(0, 2, 1) + size * np.eye(size), random.standard_normal((count, size))


def test_factors_and_solutions_are_those_of_scipy():
    many, right = matrices()
    factors = jax.vmap(cholesky)(many)
    there = jax.vmap(solved)(factors, right)
    back = jax.vmap(solved_transposed)(factors, there)
    for matrix, vector, factor, forward, both in zip(many, right, factors, there, back, strict=True):
        expected = linalg.cholesky(matrix, lower=True)
        np.testing.assert_allclose(factor, expected, rtol=1e-12, atol=1e-14)
        np.testing.assert_allclose(forward, linalg.solve_triangular(expected, vector, lower=True), rtol=1e-10)
        np.testing.assert_allclose(both, linalg.solve(matrix, vector), rtol=1e-10)


def misfit(scale: jax.Array) -> jax.Array:
    """Half of b' A^-1 b + log det A for a matrix that grows with `scale`, by its factor."""
    many, right = matrices(1)
    factor = cholesky(jnp.asarray(many[0]) * scale + jnp.eye(4))
    return 0.5 * jnp.sum(solved(factor, jnp.asarray(right[0])) ** 2) + jnp.sum(jnp.log(jnp.diagonal(factor)))


@pytest.mark.parametrize("slope", [jax.grad(misfit), lambda at: jax.jvp(misfit, (at,), (1.0,))[1]])
def test_slopes_are_those_of_the_closed_form(slope):
    """d/ds of half of b' A^-1 b + log det A is half of tr(A^-1 M) - b' A^-1 M A^-1 b, for A = s M + 1."""
    (matrix,), (right,) = matrices(1)
    inverse = linalg.inv(1.7 * matrix + np.eye(4))
    expected = 0.5 * (np.trace(inverse @ matrix) - right @ inverse @ matrix @ inverse @ right)
    assert float(slope(1.7)) == pytest.approx(expected, rel=1e-10)


def in_batches(lowered) -> list[str]:
    """The shapes that a program gives to LAPACK and that are more than one matrix; it has to ask LAPACK at all."""
    shapes = re.findall(r"@lapack_\w+.*?tensor<((?:\d+x)+)f64>", lowered.as_text())
    assert shapes
    return [shape for shape in shapes if shape.count("x") > 2]


def test_no_program_of_a_posterior_asks_lapack_for_a_batch(tmp_path):
    truth = Truth(TrueMuscle(), with_baseline(f_s=0.012))
    recording = loops(truth, pressures=(1e5, 3e5), speeds=(0.02,), samples=60, noise=Noise(sd=0.5), seed=5)
    write(dataset(truth, [recording], name="two loops", seed=5), tmp_path)
    setup = set_up(fit([read_experiment(tmp_path)], (IdealCylinder(), CoulombFriction())), (), noise=[("size",)])
    explicit = Explicit.of(setup)
    assert setup.target.instruments is not None
    assert explicit is not None
    points = jnp.zeros((16, len(setup.names)))
    wide = jnp.zeros((16, len(setup.names) + explicit.columns.shape[1]))
    density = compiled(lambda target, z: target.log_prob(z))
    slope = jax.jit(lambda target, z: jax.grad(target.log_prob)(z))  # as NUTS takes it
    assert in_batches(lowered_for(density, setup.target, points)) == []
    assert in_batches(lowered_for(DRAWN, explicit, wide)) == []
    assert in_batches(slope.lower(setup.target, points[0])) == []


def lowered_for(function, asked, points):
    """The program of a function of many points."""
    leaves, structure = jax.tree.flatten(asked)
    return function.lower(structure, leaves, points)
