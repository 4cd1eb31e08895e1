"""Rubber after Ogden: its special cases, its law of uniaxial tension, and two measured hoses of one make."""

import jax
import numpy as np
import pytest
from hidden.simulator import Muscle, Noise, Truth, dataset, loops, with_baseline, write

from fitting import example_data, read_experiment
from fitting.diagnosis.diagnose import diagnose
from fitting.diagnosis.lay_out import universe
from fitting.least_squares.fit import fit
from mckibben_jax.effects import (
    BladderMooneyRivlin,
    BladderNeoHookean,
    BladderOgden,
    CoulombFriction,
    IdealCylinder,
    LinearSpring,
    StrandStretch,
)
from mckibben_jax.laws import rubber
from mckibben_jax.laws.braid import radius_ratio

RADIUS, ANGLE, G = 0.01, np.radians(25.0), 1e6


def elastic_force(contraction, wall_ratio, exponent):
    """Force of a thick wall under a braid, N: minus the slope of its energy in the contraction."""

    def energy(eps):
        braid = RADIUS * radius_ratio(eps, ANGLE)
        return rubber.thick_ogden_energy(braid, 1 - eps, RADIUS, RADIUS * (1 - wall_ratio), RADIUS, G, exponent)

    return -jax.grad(energy)(contraction)


@pytest.mark.parametrize("wall_ratio", [0.05, 0.28])
@pytest.mark.parametrize("contraction", [1e-4, 0.05, 0.15, 0.3])
@pytest.mark.parametrize(("exponent", "constants"), [(2.0, (G / 2, 0.0)), (-2.0, (0.0, G / 2))])
def test_two_exponents_are_the_closed_forms_of_mooney_and_rivlin(exponent, constants, contraction, wall_ratio):
    closed = rubber.thick_elastic_force(contraction, RADIUS, ANGLE, wall_ratio, *constants)
    assert elastic_force(contraction, wall_ratio, exponent) == pytest.approx(float(closed), rel=3e-7)


def test_at_exponent_zero_it_goes_on_smoothly():
    below, at, above = (float(elastic_force(0.1, 0.28, n)) for n in (-0.01, 0.0, 0.01))
    assert min(below, above) < at < max(below, above)
    assert at == pytest.approx((below + above) / 2, rel=1e-3)


@pytest.mark.parametrize("exponent", [-6.0, -1.0, 1.3, 4.0])
@pytest.mark.parametrize("stretch", [0.7, 1.02, 2.5])
def test_a_strip_in_tension_pulls_as_ogden_says(exponent, stretch):
    """Nominal stress of uniaxial tension: (2 G/n) (l^(n-1) - l^(-n/2-1)), Ogden 1972."""

    def energy(axial):
        return rubber.ogden_energy(axial**-0.5, axial, G, exponent)

    stress = 2 * G / exponent * (stretch ** (exponent - 1) - stretch ** (-exponent / 2 - 1))
    assert float(jax.grad(energy)(stretch)) == pytest.approx(stress, rel=1e-9)


def test_two_hoses_of_one_make_have_one_rubber():
    """Of two maps by Martens & Boblan 2017 it halves what a neo-Hookean wall leaves, and agrees with the calliper."""
    found = {}
    for name in ("dmsp10", "dmsp20"):
        measured = read_experiment(example_data(f"martens2017_{name}"))
        plain, mooney, it = (
            fit([measured], [IdealCylinder(), wall], starts=4)
            for wall in (BladderNeoHookean(), BladderMooneyRivlin(), BladderOgden())
        )
        assert it.rmse < 0.6 * plain.rmse
        assert it.rmse < 0.8 * mooney.rmse
        assert np.all(np.abs(it.prior_rows[1:]) < 2)  # radius, angle and wall, in errors of what was measured
        found[name] = it.values
    for parameter in ("G", "n"):
        values = [each[f"bladder_ogden.{parameter}"] for each in found.values()]
        assert np.ptp(values) < 0.2 * np.abs(np.mean(values))


def test_from_every_start_a_search_comes_through_the_valley_of_modulus_and_exponent():
    """Beside strands that stretch; damped by each unknown's own curvature two of the four searches gave up."""
    effects = [BladderOgden(), StrandStretch()]
    world = universe(
        [read_experiment(example_data("martens2017_dmsp10"))], [IdealCylinder(), CoulombFriction()], effects
    )
    names = ["bladder_ogden", "strand_stretch"]
    chosen = world.with_added(names)
    free = world.free(chosen)
    subset = world.subset(chosen, world.layout.at(free), world.start)
    starts = list(world._starts(subset, free, world.start, names))
    ends = [world.searched(subset, place) for place in starts]
    assert len(starts) >= 4
    assert all(end.end.converged for end in ends)
    np.testing.assert_allclose([end.cost for end in ends], min(float(end.cost) for end in ends), rtol=1e-3)


def test_a_wall_that_soon_stops_resisting_more_is_named_among_walls(tmp_path):
    """Recorded by a simulator that shares no code: neither neo-Hookean nor Mooney-Rivlin rubber will do."""
    truth = Truth(Muscle(), with_baseline(f_s=0.012, bladder_ogden={"G": 3e5, "n": -7.0}))
    recording = loops(truth, pressures=(1e5, 2e5, 4e5), speeds=(0.02,), samples=200, noise=Noise(sd=0.5), seed=5)
    muscle = read_experiment(write(dataset(truth, [recording], name="soft", seed=5), tmp_path / "soft"))
    walls = [BladderNeoHookean(), BladderMooneyRivlin(), BladderOgden(), LinearSpring()]
    found = diagnose([muscle], [IdealCylinder(), CoulombFriction()], candidates=walls)
    assert found.explanations == (("bladder_ogden",),)
    assert found.effects["bladder_ogden"].estimate["n"].value == pytest.approx(-7.0, abs=1.5)
