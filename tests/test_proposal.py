"""Forms for what no effect explains: found where there is one, valid as definitions, and none for noise."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
from small_muscle import loops, write

from fitting.diagnosis.proposal import Misfit, misfit_of, propose, proposed
from fitting.diagnosis.proposal_terms import line_of, terms
from fitting.least_squares.fit import fit
from fitting.library.line import VARIABLES, effect_from_line
from fitting.recordings.experiment import read_experiment
from fitting.report.text.proposal import proposal_result, proposal_text
from mckibben_jax.effects import CoulombFriction, IdealCylinder
from mckibben_jax.muscle import Muscle
from mckibben_jax.parameter import parameters
from mckibben_jax.state import State

MUSCLE = Muscle(0.3, 0.007, np.radians(20.0))
PRESSURES, SPEEDS, SAMPLES, SIGMA = (1e5, 2e5, 3e5, 4e5), (0.005, 0.02), 150, 0.5


def recorded():
    """States of one loop at each pressure and speed, and the number of the run of each sample."""
    eps = 0.24 * np.concatenate([np.linspace(0, 1, SAMPLES), np.linspace(1, 0, SAMPLES)])
    sign = np.repeat([1.0, -1.0], SAMPLES)
    runs = [(p, v) for v in SPEEDS for p in PRESSURES]
    columns = [(eps, np.full_like(eps, p), v / 0.3 * sign, np.abs(np.arange(2 * SAMPLES)) * 0.1) for p, v in runs]
    eps, pressure, rate, time = (np.concatenate(column) for column in zip(*columns, strict=True))
    states = State(eps, pressure, rate=rate, time=time)
    given = {name: np.asarray(variable.at(MUSCLE, states)) for name, variable in VARIABLES.items()}
    return given, np.repeat(np.arange(len(runs)), 2 * SAMPLES)


STATES, RUN = recorded()
# what a baseline of cylinder and Coulomb friction can do: the size of the braid, its angle, friction
SLOPES = np.stack([STATES["F0"], STATES["P"] * STATES["eps"], STATES["P"] * STATES["S"] * np.sign(STATES["v"])], axis=1)


def correlated(random, memory=0.8):
    """Noise that remembers, fresh in every run."""
    out = random.normal(size=len(RUN))
    for i in range(1, len(out)):
        if RUN[i] == RUN[i - 1]:
            out[i] = memory * out[i - 1] + np.sqrt(1 - memory**2) * out[i]
    return out


def misfit(missing, seed=0, memory=0.8):
    """The rows that a fit of the baseline leaves: model minus measurement, in standard deviations."""
    rows = correlated(np.random.default_rng(seed), memory) - missing / SIGMA
    slopes = SLOPES / SIGMA / np.abs(SLOPES).max(axis=0)
    rows = rows - slopes @ np.linalg.lstsq(slopes, rows, rcond=None)[0]
    return Misfit(rows, slopes, np.zeros(0), np.zeros((0, 3)), np.full(len(RUN), SIGMA), STATES, RUN)


FORMS = {
    "bump": (12 * np.exp(-(((STATES["eps"] - 0.13) / 0.02) ** 2)), "exp(-((eps - {c})/{w})**2)",
             {"A": 12.0, "c": 0.13, "w": 0.02}),
    "ripple": (8 * np.sin(2 * np.pi * STATES["x"] / 0.012), "sin(2*pi*x/{p})", {"A": 8.0, "p": 0.012}),
    "spring": (-60 * (STATES["P"] / 4e5) ** 2 * (STATES["eps"] / 0.2) ** 3, "(P/{P1})**2*(eps/{e1})**3", {}),
}  # fmt: skip


@pytest.mark.parametrize("case", FORMS)
def test_a_form_that_no_effect_has_is_found_with_its_values(case):
    """To within what the noise allows; and what is proposed is a definition as it stands."""
    force, formula, values = FORMS[case]
    found = propose(misfit(force))
    assert found.terms == ("{A}*" + formula,)
    assert found.after < 1.15 * SIGMA < found.before
    kind = effect_from_line(found.line)
    declared = {p.name: p.default for p in parameters(kind)}
    for name, value in values.items():
        assert declared[name] == pytest.approx(value, rel=0.05)
    at = 200
    state = State(STATES["eps"][at], STATES["P"][at], rate=STATES["v"][at] / 0.3, time=STATES["t"][at])
    assert float(kind().force(MUSCLE, state)) == pytest.approx(force[at], abs=0.05 * np.abs(force).max())


def test_two_terms_are_found_where_it_takes_two():
    found = propose(misfit(FORMS["bump"][0] + FORMS["ripple"][0]))
    assert set(found.terms) == {"{A}*" + FORMS["bump"][1], "{A}*" + FORMS["ripple"][1]}
    assert found.after < 1.15 * SIGMA


@pytest.mark.parametrize("memory", [0.0, 0.8, 0.97])
def test_noise_gets_no_proposal_however_long_it_remembers(memory):
    for seed in range(3):
        found = propose(misfit(np.zeros(len(RUN)), seed, memory))
        assert found.line is None
        assert "more than chance" in found.reason


def test_what_differs_from_run_to_run_is_no_form():
    """An offset of its own in every run fits well and foretells nothing."""
    offsets = np.random.default_rng(3).normal(0, 5, RUN.max() + 1)
    assert propose(misfit(offsets[RUN], seed=1)).line is None


def test_every_term_is_a_definition():
    for term in terms(STATES)[::7]:
        kind = effect_from_line(line_of("form", [term], [-3.21]))
        assert kind.__doc__


@pytest.mark.parametrize("amplitude", [0.0321, -3.21, 32100.0])
def test_an_amplitude_is_written_in_the_unit_of_its_size(amplitude):
    """Read again it is the same number of newtons, in a range of five times as much."""
    kind = effect_from_line(
        line_of("form", [next(term for term in terms(STATES) if term.amplitude == "N")], [amplitude])
    )
    declared = next(p for p in parameters(kind) if p.name == "A")
    assert declared.default == pytest.approx(amplitude, rel=1e-3)
    assert declared.upper == pytest.approx(5 * abs(amplitude), rel=0.35)  # to one digit
    assert declared.lower == -declared.upper


def test_a_sign_of_the_speed_takes_motion_both_ways():
    """Alone it would be a constant else; what also depends on how fast it goes stays."""
    contracting = STATES["v"] > 0
    one_way = {name: value[contracting] for name, value in STATES.items()}

    def plain_signs(states):
        return [t.formula for t in terms(states) if "sign(v)" in t.formula and "abs(v)" not in t.formula]

    assert plain_signs(STATES)
    assert not plain_signs(one_way)


def test_it_takes_runs_to_leave_one_out():
    whole = misfit(FORMS["bump"][0])
    few = propose(whole.where(RUN < 3))
    assert few.line is None
    assert "runs" in few.reason


def test_nothing_is_proposed_where_the_library_explains():
    found = proposed(SimpleNamespace(verdict="missing"), lambda *_: None)
    assert found.line is None
    assert "'missing'" in proposal_text(found)
    assert proposal_result(found)["define"] is None


def test_words_and_command_of_a_proposal():
    found = dataclasses.replace(propose(misfit(FORMS["bump"][0])), runs=8)
    assert "not yet a cause" in proposal_text(found)
    assert "8 runs" in proposal_text(found)
    command = found.command(["my data"])
    assert command.startswith("mckibben add 'my data' proposal --define \"proposal = A*exp(")
    assert proposal_result(found)["marked"] == "proposal"


def test_what_the_model_can_do_itself_is_no_term_of_its_own():
    """Its parameters take a constant and a straight line whole; what rounding leaves of them is not picked."""
    given = misfit(FORMS["bump"][0] + 5.0)
    own = np.stack([np.ones(len(RUN)), STATES["eps"], STATES["P"], STATES["P"] * STATES["eps"]], axis=1)
    slopes = np.hstack([given.slopes, own / np.abs(own).max(axis=0)])
    rows = given.rows - slopes @ np.linalg.lstsq(slopes, given.rows, rcond=None)[0]
    found = propose(dataclasses.replace(given, rows=rows, slopes=slopes, prior_slopes=np.zeros((0, slopes.shape[1]))))
    assert found.terms == ("{A}*" + FORMS["bump"][1],)
    assert found.after < 1.15 * SIGMA


def test_the_misfit_of_a_fit_is_its_residual_with_every_name_that_a_formula_knows(tmp_path):
    """In standard deviations, thinned evenly; runs stay whole."""
    experiment = read_experiment(write(tmp_path, loops(lambda eps, pressure, sign: 400 * eps, noise=0.3)))
    fitted = fit([experiment], (IdealCylinder(), CoulombFriction()), starts=1)
    found = misfit_of(fitted)
    samples = fitted.samples
    np.testing.assert_allclose(found.rows * found.sigma, fitted.residual)
    np.testing.assert_allclose(found.slopes, fitted.slopes[: len(samples)])
    assert found.prior_slopes.shape == (len(found.prior_rows), len(fitted.free))
    assert set(found.states) == set(VARIABLES)
    for name, known in (("P", samples.pressure), ("eps", samples.contraction), ("t", samples.time)):
        np.testing.assert_allclose(found.states[name], known)
    np.testing.assert_allclose(found.states["v"], samples.rate * 0.25, rtol=1e-6)
    groups = [np.unique(found.group[samples.run == run]) for run in np.unique(samples.run)]
    assert len(np.unique(np.concatenate(groups))) >= 4
    longer = dataclasses.replace(fitted, samples=samples.where(np.tile(np.arange(len(samples)), 9)),
                                 residual=np.tile(fitted.residual, 9),
                                 slopes=np.vstack([np.tile(fitted.slopes[: len(samples)], (9, 1)),
                                                   fitted.slopes[len(samples) :]]))  # fmt: skip
    assert len(misfit_of(longer).rows) <= 3000
