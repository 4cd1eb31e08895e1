"""What could stand in for an effect of the model: a tie that is not forgotten when one of it was added."""

from types import SimpleNamespace

import pytest
from hidden.simulator import Muscle as TrueMuscle
from hidden.simulator import Noise, Truth, dataset, loops, with_baseline, write

from fitting.diagnosis.lay_out import universe
from fitting.diagnosis.substitutes import substitutes
from fitting.recordings.experiment import read_experiment
from fitting.report.text.diagnosis import substitutes_text
from fitting.report.text.names import marked
from mckibben_jax.effects import (
    BladderMooneyRivlin,
    BladderNeoHookean,
    CoulombFriction,
    DeadBand,
    ForceOffset,
    IdealCylinder,
    LinearSpring,
    PressureOffset,
)

NOISE = 1.0


def recorded(folder, pressures, **missing):
    """Loops of a muscle with something beside Coulomb's friction."""
    truth = Truth(TrueMuscle(), with_baseline(f_s=0.012, **missing))
    recording = loops(truth, pressures=pressures, speeds=(0.02,), samples=150, noise=Noise(sd=0.5), seed=3)
    write(dataset(truth, [recording], name="tie", seed=3), folder)
    return read_experiment(folder)


def pairs(experiment, effects, candidates):
    """What could stand in for one of these effects, fitted."""
    world = universe([experiment], effects, candidates)
    base = world.fit(frozenset(world.base), world.start)
    return substitutes(world, base, {}, world.candidates, NOISE)


BASE = (IdealCylinder(), CoulombFriction())
GAUGE = (PressureOffset(), *BASE)


def test_an_offset_below_the_lowest_pressure_could_be_a_dead_band(tmp_path):
    experiment = recorded(tmp_path, (1e5, 2e5, 3e5), pressure_offset={"P_off": 9e3})
    assert pairs(experiment, GAUGE, (DeadBand(), ForceOffset(), LinearSpring())) == (("pressure_offset", "dead_band"),)
    assert pairs(experiment, (DeadBand(), *BASE), (PressureOffset(),)) == (("dead_band", "pressure_offset"),)


def test_a_pressure_inside_the_dead_band_tells_them_apart(tmp_path):
    experiment = recorded(tmp_path, (4e3, 2e5, 3e5), dead_band={"P_th": 9e3})
    assert pairs(experiment, (DeadBand(), *BASE), (PressureOffset(),)) == ()


def test_what_has_more_numbers_is_no_like(tmp_path):
    """Mooney and Rivlin's rubber follows any neo-Hookean one."""
    experiment = recorded(tmp_path, (1e5, 3e5), bladder_neo_hookean={"G": 4e5})
    assert pairs(experiment, (*BASE, BladderNeoHookean()), (BladderMooneyRivlin(),)) == ()


@pytest.mark.parametrize("others", [("dead_band",), ("dead_band", "radial_gap")])
def test_the_tie_is_said(others):
    found = SimpleNamespace(substitutes=tuple(("pressure_offset", other) for other in others))
    (said,) = substitutes_text(found)
    assert said.startswith(f"{marked(others, ' or ')} could take the place of ⟦pressure_offset⟧")
