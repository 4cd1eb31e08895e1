"""What is left when parameters have given way, and what is read off it: against numpy's least squares and scipy."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from fitting.diagnosis.nuisance import Nuisance
from fitting.diagnosis.omnibus import Basis
from fitting.diagnosis.projected import projected
from fitting.diagnosis.settings import FLIP_TEST

ROWS, STATED, SHARED = 80, 4, 3  # two statements on three of five parameters, and one on each of the others
RANDOM = np.random.default_rng(11)
J = RANDOM.normal(size=(ROWS, 5))
E = RANDOM.normal(size=ROWS)
Z = 0.2 * RANDOM.normal(size=(ROWS, 4)) + J @ RANDOM.normal(size=(5, 4))  # mostly what parameters do
BASIS = Basis(RANDOM.normal(size=(ROWS, 3)), RANDOM.normal(size=(ROWS, 2)))
PRIORS = np.zeros((STATED, 5))
PRIORS[:2, :SHARED] = 6 * RANDOM.normal(size=(2, SHARED))  # they hold about as well as the rows do
PRIORS[2:, SHARED:] = np.eye(2)
STATEMENTS = np.array([1.5, -0.7, 0.0, 0.0])
BY = Nuisance(J, STATEMENTS, PRIORS)


def least(target, below):
    """Parameters of least squares beside their priors."""
    return np.linalg.lstsq(np.vstack([J, PRIORS]), np.concatenate([target, below]), rcond=None)[0]


@pytest.fixture(scope="module")
def found():
    return projected(E, J, Z, BASIS, BY)


def test_rows_and_candidates_are_left_as_by_least_squares(found):
    """Rows beside what is stated; candidates and bases beside priors that state nothing."""
    np.testing.assert_allclose(found.e, E - J @ least(E, STATEMENTS), rtol=1e-9, atol=1e-12)
    nothing = np.zeros((len(PRIORS), Z.shape[1]))
    left = Z - J @ least(Z, nothing)
    np.testing.assert_allclose(found.z, left, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(found.kept, np.linalg.norm(left, axis=0))
    assert found.seen.all()
    assert found.parameters == 5


def test_the_bases_are_orthonormal_and_span_what_is_left_of_them(found):
    np.testing.assert_allclose(found.o.T @ found.o, np.eye(5), atol=1e-10)
    assert found.smooth == 3
    parts = (found.o[:, :3], BASIS.smooth), (found.o, BASIS.whole)
    for own, columns in parts:
        left = columns - J @ least(columns, np.zeros((len(PRIORS), columns.shape[1])))
        np.testing.assert_allclose(own @ (own.T @ left), left, atol=1e-9)


def test_a_candidate_that_parameters_take_whole_is_not_seen():
    """Whatever the size of its neighbours."""
    free = replace(BY, prior_rows=np.zeros(0), prior_slopes=np.zeros((0, 5)))
    columns = np.column_stack([J @ [1.0, 2.0, 0.0, -1.0, 0.5], 1e-3 * E, 1e5 * Z[:, 1]])
    np.testing.assert_array_equal(projected(E, J, columns, BASIS, free).seen, [False, True, True])


@pytest.mark.parametrize("kind", ["smooth", "fine"])
def test_rounding_is_no_direction_to_look_along(kind):
    """What parameters take whole of a basis is rounding, which would be blown up to a direction of length one."""
    free = replace(BY, prior_rows=np.zeros(0), prior_slopes=np.zeros((0, 5)))
    taken = np.column_stack([getattr(BASIS, kind), J @ [1.0, 2.0, 0.0, -1.0, 0.5]])
    with_it, without = (projected(E, J, Z, basis, free) for basis in (replace(BASIS, **{kind: taken}), BASIS))
    assert with_it.o.shape == without.o.shape
    np.testing.assert_allclose(with_it.o @ with_it.o.T, without.o @ without.o.T, atol=1e-10)
    assert with_it.ratio_p == pytest.approx(without.ratio_p)


def test_where_parameters_take_every_direction_nothing_is_seen_in_any():
    free = replace(BY, prior_rows=np.zeros(0), prior_slopes=np.zeros((0, 5)))
    found = projected(E, J, Z, Basis(J @ np.ones((5, 1)), np.zeros((ROWS, 0))), free)
    assert found.o.shape == (ROWS, 0)
    assert found.ratio_p == 1.0
    assert np.all(found.explained == np.inf)


def test_a_statement_that_is_wrong_sways_scores_as_said(found):
    """The change of a candidate's score with each statement, over the score's spread by noise of size one."""
    scores = lambda at: at.z.T @ at.e  # noqa: E731
    changes = [
        scores(projected(E, J, Z, BASIS, replace(BY, prior_rows=STATEMENTS + np.eye(4)[i]))) - scores(found)
        for i in range(STATED)
    ]
    np.testing.assert_allclose(found.pulled, np.linalg.norm(changes, axis=0) / found.kept, rtol=1e-8)
    np.testing.assert_allclose(found.dull, np.sqrt(1 + found.pulled**2))
    assert found.dull.max() > 1.01


def test_a_ratio_is_that_of_the_f_test(found):
    """Where nothing is stated: explained over unexplained, each for its degrees of freedom."""
    taken = np.sum((found.o.T @ found.e) ** 2)
    left = found.e - found.o @ (found.o.T @ found.e)
    np.testing.assert_allclose(found.clean, left)
    assert found.freedom == ROWS - 5 - 5
    assert found.ratio_p == pytest.approx(stats.f.sf(taken / 5 / (np.sum(left**2) / 70), 5, 70))
    larger = replace(found, e=found.e + 3 * found.o[:, 0] * np.sign(found.o[:, 0] @ found.e))
    assert larger.ratio_p < found.ratio_p


def test_amounts_beyond_a_bound_are_found_four_times_in_five(found):
    """A likelihood ratio of as much of each candidate as is said to be found by it."""
    size = np.sum((found.o.T @ found.z * found.explained) ** 2, axis=0)
    power = stats.ncx2.sf(stats.chi2.isf(FLIP_TEST.misfit_p, 5), 5, size)
    np.testing.assert_allclose(power, 0.8, atol=0.01)
