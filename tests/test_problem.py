"""The rows of a problem: parts of it give the rows of the whole."""

import sys

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

from fitting.least_squares.starts import starting_places
from fitting.least_squares.subset import subset_of
from fitting.problem.residuals import problem
from fitting.problem.unknowns import unknowns
from fitting.recordings.experiment import read_experiment
from fitting.shipped import shipped_folder
from mckibben_jax.effects import BladderNeoHookean, CoulombFriction, IdealCylinder, Presliding

MODEL = (IdealCylinder(), BladderNeoHookean(), Presliding(), CoulombFriction())


@pytest.fixture(scope="module")
def whole():
    """Loops of one muscle, with where their rows come from, and the effects' starting values."""
    experiment = read_experiment(shipped_folder() / "muscle_a")
    layout = unknowns([experiment], MODEL)
    laid, samples = problem([experiment], layout)
    return laid, samples, layout


@pytest.mark.parametrize(("runs", "every"), [((4,), 1), ((0, 2, 3), 7)])
def test_some_rows_alone_are_those_of_the_whole(whole, runs, every):
    """A fit to a few of many runs sees what a fit to all of them does."""
    laid, samples, layout = whole
    wanted = np.isin(samples.run, runs) & (np.arange(len(samples)) % every == 0)
    subset = subset_of(layout, layout.start, layout.names)
    point = subset.point(subset.place(jnp.asarray(layout.start)))
    rows_at = eqx.filter_jit(lambda given: given.data_rows(*point))
    rows, part = np.asarray(rows_at(laid)), laid.of_rows(wanted)
    np.testing.assert_allclose(np.asarray(rows_at(part)), rows[wanted], rtol=1e-9, atol=1e-9)
    assert sum(block.measured.shape[0] for block in part.blocks) == len(runs)


def test_loops_are_laid_out_without_what_integrates_motions(monkeypatch):
    """A tenth of what `compare` loads is diffrax, which only a muscle that moves a load needs."""
    monkeypatch.setitem(sys.modules, "mckibben_jax.motion.motion", None)
    experiment = read_experiment(shipped_folder() / "muscle_a")
    laid, _ = problem([experiment], unknowns([experiment], MODEL))
    assert [block.steps for block in laid.blocks] == [0]


def test_few_places_to_begin_from_are_the_first_of_many(whole, monkeypatch):
    """Those beyond the declared ones come from scipy.stats, which is not loaded for fewer."""
    _, _, layout = whole
    subset = subset_of(layout, layout.start, layout.names)
    many = starting_places(layout, subset, layout.names, 9, 0)
    monkeypatch.setitem(sys.modules, "scipy.stats", None)
    np.testing.assert_array_equal(starting_places(layout, subset, layout.names, 2, 0), many[:2])
