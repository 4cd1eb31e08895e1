"""Bases that know no effect: what they span, and the parity of a misfit that they need not know."""

from dataclasses import replace

import numpy as np
import pytest
from test_flips import samples

from fitting.comparison import parity
from fitting.diagnosis import omnibus
from fitting.problem.kinds import kinds

LOOPS = samples(120)


def static_map(branches=(1.0, -1.0)):
    """Nine contractions at five pressures, approached from either side."""
    contraction, pressure, branch = (
        part.ravel() for part in np.meshgrid(np.linspace(0, 0.24, 9), np.arange(1e5, 6e5, 1e5), branches, indexing="ij")
    )
    zero = np.zeros(len(branch))
    return replace(
        LOOPS.where(np.zeros(len(branch), int)), contraction=contraction, pressure=pressure, branch=branch, rate=zero,
        pressure_rate=zero, run=np.arange(len(branch)), half=np.arange(len(branch)),
    )  # fmt: skip


def held():
    """Lengths held while the pressure goes up and down."""
    pressure = np.tile(np.concatenate([np.linspace(1e5, 5e5, 50), np.linspace(5e5, 1e5, 50)]), 4)
    zero, branch = np.zeros(400), np.tile(np.repeat([1.0, -1.0], 50), 4)
    return replace(
        LOOPS.where(np.zeros(400, int)), contraction=np.repeat([0.0, 0.05, 0.1, 0.15], 100), pressure=pressure,
        rate=zero, pressure_rate=1e4 * branch, branch=branch, run=np.repeat(np.arange(4), 100),
        half=np.repeat(np.arange(8), 50),
    )  # fmt: skip


def left_of(law, columns):
    """The share of a law's size that the columns do not follow."""
    return np.linalg.norm(law - columns @ np.linalg.lstsq(columns, law, rcond=None)[0]) / np.linalg.norm(law)


def test_a_map_is_spanned_up_to_the_third_power():
    """In contraction and pressure together; and in the direction, with its slope along the stroke."""
    s = static_map()
    basis = omnibus.basis(s)
    x, p = s.contraction, s.pressure / 1e5
    assert np.all(np.isfinite(basis.smooth))
    assert basis.fine.shape[1] == 0
    for law in (x**3, p**3, x * p**2, x**2 * p, 1 + x + p, s.branch, s.branch * x):
        assert left_of(law, basis.smooth) < 1e-9
    for law in (x**4, x**2 * p**2, s.branch * p, s.branch * x**2):
        assert left_of(law, basis.smooth) > 0.01
    still = omnibus.basis(static_map(branches=(0.0,)))
    assert still.smooth.shape[1] == basis.smooth.shape[1] - 2


def test_what_loops_change_smoothly_is_spanned_at_every_pressure():
    """With contraction piecewise in a straight line, with speed, with the cycle, and all with the direction."""
    s = LOOPS
    basis = omnibus.basis(s)
    x, p = s.contraction, s.pressure / 1e5
    nodes = np.linspace(x.min(), x.max(), 6)
    for law in (
        x,
        x * p,
        np.abs(x - nodes[2]) * (p == 3),
        np.log(np.abs(s.rate)),
        s.loop.astype(float),
        s.branch * x * p,
    ):
        assert left_of(law, basis.smooth) < 1e-6
    for law in (np.sin(2 * np.pi * x / 0.02), s.branch * np.sin(2 * np.pi * x / 0.02)):
        assert left_of(law, basis.smooth) > 0.3
        assert left_of(law, basis.whole) < 0.15


@pytest.mark.parametrize("count", [70, 120, 400])
def test_few_readings_have_few_columns(count):
    """At most one for three of them, or nothing would be left that tells the noise; and still each direction's own."""
    few = LOOPS.where(np.linspace(0, len(LOOPS) - 1, count).astype(int))
    columns = omnibus.basis(few).smooth
    assert 3 * columns.shape[1] <= count
    assert np.linalg.matrix_rank(columns) < count / 2
    for law in (few.contraction, few.branch.astype(float)):
        assert left_of(law, columns) < 1e-6
    assert columns.shape[1] < omnibus.basis(LOOPS).smooth.shape[1] or count == 400


def test_recordings_have_bases_of_their_own():
    """And each is told by what was imposed."""
    parts = [LOOPS.where(LOOPS.run == 0), held(), static_map()]
    whole = {
        key: np.concatenate([vars(replace(part, recording=np.full(len(part), i)))[key] for i, part in enumerate(parts)])
        for key in vars(LOOPS)
    }
    s = replace(LOOPS, **whole)
    np.testing.assert_array_equal(kinds(s), np.repeat([0, 1, 2], [len(part) for part in parts]))
    basis = omnibus.basis(s)
    for i in range(3):
        other = basis.whole[s.recording != i]
        own = np.any(basis.whole[s.recording == i] != 0, axis=0)
        assert not np.any(other[:, own])


def test_a_held_length_is_spanned_along_the_pressure():
    s = held()
    basis = omnibus.basis(s)
    p = s.pressure / 1e5
    for law in (p, s.branch, s.branch * p, np.where(s.contraction == 0.1, p, 0.0)):
        assert left_of(law, basis.smooth) < 1e-6


@pytest.mark.parametrize(("even", "odd"), [(3.0, 1.0), (0.0, 2.0), (1.5, 0.0)])
def test_a_misfit_is_split_into_what_turns_with_the_direction_and_what_does_not(even, odd):
    """Its share is that of the squares, whatever the size in newtons."""
    for size in (1.0, 1e-3):
        found = parity.cells(LOOPS, size * (even + odd * LOOPS.branch), np.ones(len(LOOPS), bool))
        known = np.isfinite(found.even)
        np.testing.assert_allclose(found.even[known], size * even, atol=1e-12)
        np.testing.assert_allclose(found.odd[known], size * odd, atol=1e-12)
        assert found.odd_share == pytest.approx(odd**2 / (even**2 + odd**2))


def test_one_direction_has_no_parity():
    up = LOOPS.where(LOOPS.branch > 0)
    assert parity.cells(up, np.ones(len(up)), np.ones(len(up), bool)).odd_share is None
    assert parity.cells(LOOPS, np.zeros(len(LOOPS)), np.ones(len(LOOPS), bool)).odd_share is None
