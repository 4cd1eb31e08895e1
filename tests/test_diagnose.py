"""The whole loop on shipped data whose truth comes from a simulator that shares no code with the library."""

import base64
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from small_muscle import loops, write

from fitting.diagnosis.diagnose import diagnose, of_force
from fitting.diagnosis.estimates import estimate
from fitting.diagnosis.flip_groups import rests_on_in_words
from fitting.diagnosis.lay_out import universe
from fitting.diagnosis.tiers import proposals, worth_judging
from fitting.errors import InputError
from fitting.recordings.experiment import read_experiment
from fitting.report.text.reasons import why_text
from mckibben_jax.effect import Pulling, name_of
from mckibben_jax.effects import LIBRARY, CoulombFriction, IdealCylinder, LinearSpring, TextileFriction
from mckibben_jax.model import with_effects
from mckibben_jax.parameter import parameter

DATA = Path(__file__).parents[1] / "data"
BASELINE = (IdealCylinder(), CoulombFriction())
SETS = ("muscle_a", "muscle_b", "muscle_c", "muscle_d")


def hidden(name: str) -> list[str]:
    """The sealed truth."""
    sealed = json.loads((DATA / "sealed" / f"{name}.json").read_text())["sealed"]
    return json.loads(base64.b64decode(sealed))["hidden"]


@pytest.fixture(scope="module")
def diagnoses():
    """All four, by the same compiled functions."""
    return {name: diagnose([read_experiment(DATA / name)], BASELINE) for name in SETS}


@pytest.mark.parametrize("name", SETS)
def test_the_hidden_effect_is_named(diagnoses, name):
    """Uniquely; and where nothing is hidden, nothing is named."""
    found, truth = diagnoses[name], hidden(name)
    if truth:
        assert found.verdict == "missing"
        assert found.explanations == (tuple(truth),)
        assert found.leading is not None
        assert truth[0] in found.leading.effects
        assert found.leading.share == pytest.approx(1 - (found.leading.held_out_rmse / found.held_out_rmse) ** 2)
    else:
        assert found.verdict == "nothing detectable"
        assert found.explanations == ()


@pytest.mark.parametrize("name", SETS)
def test_the_error_falls_to_the_noise_on_runs_left_out(diagnoses, name):
    """Within 1.1 of the noise that the simulator put in, and not below 0.95."""
    found = diagnoses[name]
    stated = read_experiment(DATA / name).recordings[0].noise
    added = "+".join(hidden(name))
    left = found.effects[added].held_out_rmse if added else found.held_out_rmse
    assert 0.95 < left / stated < 1.1


def test_the_evidence_says_why(diagnoses):
    """Every effect of the library has its line: tested, or why not."""
    found = diagnoses["muscle_a"]
    expected = {name_of(kind) for kind in LIBRARY if not kind.rival} - {name_of(e) for e in BASELINE}
    assert set(found.effects) == expected
    for evidence in found.effects.values():
        assert evidence.why or evidence.rmse is not None
    assert "needs" in why_text(found.effects["hertz_friction"].why)
    assert "signs of 20 loops" in rests_on_in_words(found.rests_on)
    assert found.effects["pressure_gain"].absorbed_share > 0.99  # geometry gives way to nearly all of it
    assert found.effects["dead_band"].similar["pressure_offset"] > 0.99


def test_what_explains_the_data_and_is_not_named_says_why(diagnoses):
    """Mooney and Rivlin's rubber does all that the hidden neo-Hookean one does; so may others, each with its reason."""
    wider = diagnoses["muscle_a"].effects["bladder_mooney_rivlin"]
    assert wider.adequate
    assert why_text(wider.why) == "explains the data, and so does its special case ⟦bladder_neo_hookean⟧"
    for found in diagnoses.values():
        unnamed = [e for e in found.effects.values() if e.adequate and (e.name,) not in found.explanations]
        assert all(why_text(e.why).startswith("explains the data, ") for e in unnamed)


def test_estimates_hold_the_truth(diagnoses):
    """The modulus within four robust errors of what was put in."""
    sealed = json.loads((DATA / "sealed" / "muscle_a.json").read_text())["sealed"]
    truth = json.loads(base64.b64decode(sealed))["parameters"]["bladder_neo_hookean.G"]
    value, error, _ = diagnoses["muscle_a"].effects["bladder_neo_hookean"].estimate["G"]
    assert abs(value - truth) < 4 * error


def test_what_to_add_next(diagnoses):
    """The explanation where it is unique, nothing where nothing is missing."""
    assert worth_judging(diagnoses["muscle_b"])[0] == [("textile_friction",)]
    assert proposals(diagnoses["muscle_d"]) == []


def test_what_changes_nothing_is_not_added(diagnoses):
    """Where nothing is unique, only what lowers the left-out error visibly."""
    found = replace(diagnoses["muscle_a"], verdict="not in the library", explanations=())
    assert ("bladder_neo_hookean",) in worth_judging(found)[0]
    idle = tuple(replace(e, held_out_rmse=found.held_out_rmse * (1 - 1e-6)) for e in found.tried)
    assert worth_judging(replace(found, tried=idle)) == []


def test_adding_a_rival_replaces_it():
    """Textile friction in place of Coulomb's."""
    assert [name_of(e) for e in with_effects(BASELINE, [TextileFriction()])] == ["ideal_cylinder", "textile_friction"]


class Screw(Pulling):
    """A ripple along the stroke, as a rig's drive screw makes."""

    source = "a user's own file"
    A: float = parameter(1.0, "N", "amplitude", range=(-20.0, 20.0))
    pitch: float = parameter(0.012, "m", "pitch", range=(0.005, 0.03))

    def force(self, muscle, state):
        """The ripple, N."""
        import jax.numpy as jnp

        return self.A * jnp.sin(2 * jnp.pi * muscle.length * state.contraction / self.pitch)


@pytest.mark.slow
def test_a_users_own_effect_is_found(tmp_path):
    """Ten lines in a user's file, and it is tested, named and measured like any other."""
    from hidden.simulator import Muscle, Noise, Truth, rich, with_baseline, write

    truth = Truth(Muscle(), with_baseline(f_s=0.012, screw_ripple={"A": 4.0, "p": 0.012}))
    write(rich(truth, noise=Noise(sd=0.6, phi=0.7), seed=3), tmp_path)
    known = [kind() for kind in LIBRARY if not kind.rival]
    found = diagnose([read_experiment(tmp_path)], BASELINE, candidates=[*known, Screw()])
    assert found.explanations == (("screw",),)


def test_positions_alone_are_refused_with_the_cure(tmp_path):
    """The test needs a force."""
    lines = ["time [s],pressure [bar],displacement [mm],load [kg]"]
    lines += [f"{t:.3f},5,{10 * (1 - np.exp(-5 * t)):.4f},10" for t in np.linspace(0, 1, 50)]
    (tmp_path / "release.csv").write_text("\n".join(lines))
    (tmp_path / "muscle.toml").write_text(
        '[muscle]\nlength = "300 mm"\nradius = "7 mm"\nbraid_angle = "20 deg"\n'
        '[[recording]]\nfile = "release.csv"\ntest = "quick release"\n'
    )
    with pytest.raises(InputError, match="recording of force"):
        of_force([read_experiment(tmp_path)])


def test_what_stands_at_the_end_of_its_range_has_no_error(tmp_path):
    experiment = read_experiment(write(tmp_path, loops(lambda eps, *_: 400.0 * eps)))
    world = universe([experiment], BASELINE, [LinearSpring()])
    fit = world.fit(world.with_added(["linear_spring"]), world.start, ["linear_spring"])
    (value, error, _), (same, none, _) = (
        estimate(world, replace(fit, at_bound=ends), "linear_spring")["K"] for ends in ((), ("linear_spring.K",))
    )
    assert value == same
    assert 0 < error < 0.1 * abs(value)
    assert np.isnan(none)
