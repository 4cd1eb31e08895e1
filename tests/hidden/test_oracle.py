"""The oracle against closed forms and against recordings that the simulator draws."""

import numpy as np
import pytest
from scipy.stats import chi2

from .instruments import EXACT, Channel, Instruments
from .oracle import LEVEL, NO_RULES, Rules, forces, needed, next_to_turning, oracle_size, runs_of, scene_of
from .rig import NOISES, Noise
from .simulator import TYPICAL, Truth, loops, with_baseline
from .study.protocols import PROTOCOLS, WHOLE
from .study.sizes import hiding, scaled

WHITE = Noise(sd=0.6)
BASE = with_baseline()


def test_the_noncentrality_gives_the_power():
    """Of a normal variable beyond the bound of both tails at 1 %, the other tail being 1e-9."""
    assert needed() == pytest.approx((2.5758293 + 0.8416212) ** 2, rel=1e-4)


def test_an_offset_in_white_noise_against_its_closed_form():
    """sd/sqrt(n) of the mean; friction, odd in the direction of motion, takes next to nothing of a constant."""
    found = oracle_size("force_offset", "poor", WHITE, rules=NO_RULES)
    assert found.rms == pytest.approx(0.6 * np.sqrt(needed() / 1600), rel=0.01)
    assert found.factor * TYPICAL["force_offset"]["F_off"] == pytest.approx(found.rms, rel=0.01)


def test_an_offset_in_coloured_noise_whose_zero_steps_against_its_closed_form():
    """1' C^-1 1 of an AR(1), and the zero of two runs on top of the mean of each."""
    noise, phi, count = NOISES["ar"], 0.9, 800
    precision = ((1 - phi) ** 2 * (count - 2) + 2 * (1 - phi)) / (noise.sd**2 * (1 - phi**2))
    for zero in (0.0, 0.6):
        erring = Instruments(force=Channel(zero_per_run=zero))
        found = oracle_size("force_offset", "poor", noise, erring, NO_RULES)
        expected = np.sqrt(needed() * (1 / precision + zero**2) / 2)
        assert found.rms == pytest.approx(expected, rel=0.02), zero


def test_worse_instruments_never_help():
    sizes = [oracle_size("tip", "poor", NOISES["ar"], TWISTED.scaled(share)).factor for share in (0.0, 0.5, 1.0)]
    assert sizes == sorted(sizes)
    assert sizes[2] > 1.5 * sizes[0]


def test_what_a_recording_cannot_show_has_no_size():
    assert oracle_size("viscous_damping", "isometric", WHITE) is None
    assert oracle_size("supply_lag", "poor", WHITE) is None


# What the simulator draws for each run must be what the oracle reckons with. Fixed errors (warming) and those of the
# inputs are not drawn into the force and stand in the tests below.
TWISTED = Instruments(
    force=Channel(zero_per_run=0.6, gain_per_run=0.002, hysteresis=5e-4, drift=5 / 3600), skew=0.005, jitter=0.001
)


def test_the_power_is_what_recordings_show():
    """100 recordings with the effect and 100 without: 80 % and 1 % beyond the bound, as far as so few tell."""
    effect, noise = "tip", NOISES["ar"]
    scene = scene_of("poor", noise, TWISTED, rules=NO_RULES)
    size = oracle_size(effect, "poor", noise, TWISTED, NO_RULES)
    hidden = hiding(BASE, {effect: scaled(effect, size.factor, {})})
    signature = scene.left(forces("poor", hidden) - scene.force)
    signature = signature / np.linalg.norm(signature)

    def statistics(truth):
        for seed in range(100):
            made = PROTOCOLS["poor"].recordings(truth, noise, seed, instruments=TWISTED)[0]
            yield signature @ scene.left(made.columns["force"] - scene.force)

    absent, there = (np.array(list(statistics(truth))) for truth in (Truth(WHOLE, BASE), hidden))
    bound = np.sqrt(chi2.isf(LEVEL, 1))
    assert np.std(absent) == pytest.approx(1.0, abs=0.2)
    assert np.mean(there > bound) == pytest.approx(0.8, abs=0.12)
    assert np.mean(np.abs(absent) > bound) < 0.05


def test_errors_of_inputs_are_slopes_of_the_simulator():
    """A gauge that reads too much: what is lost to it is the pull at another pressure, as `loops` makes it."""
    exact, gauge = (
        scene_of("poor", WHITE, one, rules=NO_RULES) for one in (EXACT, Instruments(pressure=Channel(zero=500.0)))
    )
    truth = Truth(WHOLE, BASE)
    given = PROTOCOLS["poor"].parts[0].given
    made = loops(truth, **{**given, "pressures": (2.005e5, 4.005e5)}, noise=Noise(sd=0.0))
    change = made.clean - exact.force
    assert exact.evidence(change) > 1000.0
    assert gauge.evidence(change) < 1.01


def test_readings_next_to_turning_points_and_ends_judge_nothing():
    """Four branches of 200: three samples beside each of five edges, and the turning samples themselves."""
    made = PROTOCOLS["poor"].recordings(Truth(WHOLE, BASE), Noise(sd=0.0))
    for run in runs_of(made):
        near = np.flatnonzero(next_to_turning(run, run.at))
        assert len(near) == 2 * 4 + 3 * 7
        assert set(near[:4]) == {0, 1, 2, 3}
        assert all(np.ptp(run.stroke[near[i : i + 7]]) < 0.05 * np.ptp(run.stroke) for i in (4, 11, 18))
    # an offset stands in all readings alike: those that are left out count by their number
    found = oracle_size("force_offset", "poor", WHITE, rules=Rules(True, 0.0))
    assert found.rms == pytest.approx(0.6 * np.sqrt(needed() / (1600 - 2 * 29)), rel=0.01)


def test_friction_that_may_differ_from_run_to_run_hides_what_differs_so():
    """Hertz's law differs from Coulomb's mostly by how runs of different pressure differ; a tip shows in every loop."""
    sizes = {
        effect: [oracle_size(effect, "rich", WHITE, rules=Rules(True, spread)).rms for spread in (0.0, 0.01, 0.02)]
        for effect in ("hertz_friction", "tip")
    }
    least, middle, most = sizes["hertz_friction"]
    assert 4 * least < 2 * middle < 1.2 * most
    assert sizes["tip"] == pytest.approx([sizes["tip"][0]] * 3, rel=0.01)
