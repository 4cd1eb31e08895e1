"""The power of a proposed recording: its arithmetic against closed forms and drawn readings."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from fitting.diagnosis.flip_groups import FlipGroups
from fitting.diagnosis.omnibus import Basis
from fitting.instruments.errors import InstrumentErrors
from fitting.instruments.sources import ErrorKind, Source
from fitting.least_squares import held_out
from fitting.least_squares.working_noise import Noise as Memory
from fitting.planning.rejection import Drawn
from fitting.planning.separation import Outlook, Readings, of_means
from fitting.recordings.accuracy import Channel


@pytest.mark.parametrize("phi", [0.3, 0.7, 0.95])
def test_means_of_correlated_readings(phi):
    """Covariance of block means of a first-order autoregression, against the double sum."""
    block, blocks = 7, 5
    at = np.arange(block * blocks)
    whole = phi ** np.abs(at[:, None] - at[None, :])
    expected = whole.reshape(blocks, block, blocks, block).mean(axis=(1, 3))
    centres = block * np.abs(np.arange(blocks)[:, None] - np.arange(blocks)[None, :])
    assert np.allclose(of_means(centres.astype(float), phi, block), expected, rtol=1e-6)


def outlook_of(random, rows=8, free=(2, 3)):
    """Two explanations with slopes drawn at random, and one candidate of two cycles; the noise is white."""
    old, new = np.arange(20), np.arange(20, 20 + 2 * rows)
    made = []
    for count in free:
        prior = np.vstack([np.zeros((0, count)), np.eye(count)])
        slopes, values = random.standard_normal((20 + 2 * rows, count)), random.standard_normal(20 + 2 * rows)
        made.append(SimpleNamespace(effects=(str(count),), rows=values, slopes=slopes, prior_slopes=prior))
    samples = SimpleNamespace(
        run=np.zeros(20, int),
        loop=np.arange(20) // 5,
        position=np.arange(20),
        where=lambda at: SimpleNamespace(
            run=np.zeros(len(at), int),
            loop=np.arange(20) // 5 if len(at) == 20 else np.zeros(len(at), int),
            position=np.arange(len(at)),
            time=np.arange(len(at), dtype=float),
            __len__=lambda: len(at),
        ),
    )
    planned = SimpleNamespace(samples=samples, old=old, rows=(new,), again=lambda _: np.arange(2 * rows) >= rows)
    return made, old, planned


def test_discrepancy_is_that_of_box_and_hill(monkeypatch):
    """Against the density with which either explanation predicts the other's mean."""
    random = np.random.default_rng(5)
    (a, b), old, planned = outlook_of(random)
    outlook = Outlook(planned, (a, b), Memory(1.0, np.zeros(10)), Readings(1.0, 1.0, 100.0))
    monkeypatch.setattr(Outlook, "factors", ((np.eye(8), 1.0),))
    repeats = 4
    again = [*range(20, 28), *list(range(28, 36)) * (repeats - 1)]
    spread = np.eye(len(again))
    for e in (a, b):
        known = e.slopes[old].T @ e.slopes[old] + np.eye(e.slopes.shape[1])
        spread += e.slopes[again] @ np.linalg.inv(known) @ e.slopes[again].T
    apart = (a.rows - b.rows)[again]
    density = multivariate_normal(np.zeros(len(again)), spread)
    expected = 2 * (density.logpdf(np.zeros(len(again))) - density.logpdf(apart))
    assert outlook.discrepancy(0, 1, 0, repeats) == pytest.approx(expected, rel=1e-9)


def test_points_of_a_map_have_no_time_and_err_one_by_one():
    """A map of one length: its nodes are all at the same time, and no memory joins them."""

    class Points(SimpleNamespace):
        def __len__(self):
            return 5

    points = Points(loop=np.zeros(5, int), time=np.zeros(5))
    noise = SimpleNamespace(white=1.0, shares=np.array([0.5]), memories=np.array([0.9]))
    covariance, per_node = Readings(1.0, 1.0, 100.0).covariance(noise, points)
    assert per_node == 1.0
    assert covariance == pytest.approx(1.5 * np.eye(5))


def test_the_error_of_one_group_alone_is_without_a_bound():
    fall, error = held_out.difference(np.full(4, 2.0), np.ones(4), np.zeros(4, int))
    assert (fall, error) == (3.0, np.inf)


def drawn(shift, draws=300, units=16, per=10):
    """Rows of a model with one parameter beside one signature; `shift` of it is really there."""
    random = np.random.default_rng(3)
    count = units * per
    slope, column, other = random.standard_normal((3, count, 1))
    rows = random.standard_normal((count, draws)) + shift * column + 0.3 * slope
    groups = FlipGroups(np.repeat(np.arange(units), per), 0.01, np.repeat(np.arange(units), per))
    exact, basis = InstrumentErrors.none(np.zeros(count)), Basis(other, np.zeros((count, 0)))
    return Drawn(rows, slope, np.zeros((1, 1)), exact, np.hstack([column, other]), basis, groups)


def test_rejections_keep_their_level_and_have_power():
    """At most the level where nothing is missing; nearly all where the missing signature is six sigma strong."""
    assert np.mean(drawn(0.0).rejections(0)) < 0.03
    assert np.mean(drawn(8 / np.sqrt(160)).rejections(0)) > 0.9


def erring(by, beyond=0.0, draws=200, runs=8, per=20):
    """Rows in which a load cell's zero differs between runs, by so many standard deviations of its accuracy.

    `beyond` is what every other run has beside it, in the same direction each time.
    """
    random = np.random.default_rng(4)
    count = runs * per
    run = np.repeat(np.arange(runs), per)
    zero = Source(Channel.FORCE, ErrorKind.ZERO_PER_RUN, 1.0, 1.0)
    errors = InstrumentErrors(np.full((count, 1), 3.0), np.zeros((count, 0)), (zero,), (), run)
    rows = random.standard_normal((count, draws)) + by * errors.columns @ random.standard_normal((runs, draws))
    slope, column = random.standard_normal((2, count, 1))
    groups = FlipGroups(np.repeat(np.arange(2 * runs), per // 2), 0.01, run)
    looked_along = np.where(run[:, None] % 2, 1.0, -1.0)  # every other run: as if the pressure did it
    basis = Basis(looked_along, np.zeros((count, 0)))
    rows += beyond * looked_along
    return Drawn(rows, slope, np.zeros((1, 1)), errors, column, basis, groups)


def test_what_instruments_may_do_is_rejected_as_seldom_as_the_level_says():
    """A zero that steps by its accuracy between runs is no misfit; steps in one direction by ten of them are."""
    assert np.mean(erring(1.0).rejections(0)) < 0.05
    assert np.mean(erring(1.0, beyond=30.0).rejections(0)) > 0.9
