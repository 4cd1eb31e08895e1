"""The posterior against closed forms, and what it says when it must not be trusted."""

import dataclasses
from argparse import Namespace
from functools import cache
from pathlib import Path
from types import SimpleNamespace

import emcee
import jax
import numpy as np
import pytest
from scipy import stats

from fitting.errors import InputError
from fitting.least_squares.fit import fit
from fitting.posterior.evaluation import slopes_at
from fitting.posterior.moves import log_around_mode
from fitting.posterior.noise import choose_noise, noise_of_rows
from fitting.posterior.quick import quick_look
from fitting.posterior.record import Missing
from fitting.posterior.sample import Snooker, describe, sample, save, to_json
from fitting.posterior.settings import MOVE
from fitting.posterior.setup import set_up, thin_to_shares
from fitting.posterior.summary import cut_off
from fitting.posterior.warnings import notes
from fitting.recordings.records import Experiment, Recording, Run
from mckibben_jax.effects import BladderNeoHookean, CoulombFriction, ForceOffset, IdealCylinder
from mckibben_jax.model import model
from mckibben_jax.muscle import Muscle
from mckibben_jax.state import State
from tests.exact_instruments import trusting

MUSCLE = Muscle(length=0.3, radius=7e-3, braid_angle=np.radians(20.0), wall_thickness=5e-4)


def loops(
    *effects, noise=2.0, pressure=2e5, muscle=MUSCLE, count=120, seed=0, errors=None, repeats=3, priors=None, runs=2
):
    """A data set of triangular loops of these effects, without turning points; white noise unless `errors` are."""
    measured = []
    random = np.random.default_rng(seed)
    for number, p in enumerate(np.linspace(0.5, 1.0, runs) * pressure):
        phase = (np.arange(count * repeats) + 0.5) / count
        contraction = 0.2 * np.abs(2 * (phase % 1) - 1)
        branch = np.where(phase % 1 < 0.5, -1.0, 1.0)
        rate, still = 0.01 * branch, np.zeros(count * repeats)
        state = State(contraction, still + p, rate, still, still, still, 40 * phase)
        clean = np.asarray(model(muscle, *effects).force(state))
        wrong = random.standard_normal(clean.size) * noise if errors is None else errors(random, phase)
        half = np.floor(2 * phase).astype(int)
        measured.append(
            Run(name=f"{number}", time=40 * phase, pressure=still + p, contraction=contraction, rate=rate,
                pressure_rate=still, measured=clean + wrong, weight=still + 1, branch=branch, loop=half // 2, half=half,
                row=np.arange(clean.size) + 2)
        )  # fmt: skip
    recording = Recording("loops.csv", "loop", tuple(measured), noise)
    return Experiment("Braid", Path("."), muscle, (recording,), priors or {}, "0" * 64)


@cache
def straight_line():
    """A fit that is linear in its two parameters, friction and an offset of the load cell: one for all tests."""
    effects = (IdealCylinder(), CoulombFriction(f_s=0.015), ForceOffset(F_off=3.0))
    experiment = loops(*effects)
    return trusting(fit([experiment], effects, starts=2)), experiment


@pytest.fixture(scope="module")
def line():
    found, _ = straight_line()
    return found, sample(found, seed=1, limit_s=1e4)


def student(found, posterior):
    """Closed form of a linear problem with flat priors in parameters and log noise: Student's t, location and scale."""
    slopes, rows = found.slopes, found.residual / found.samples.sigma
    freedom = posterior.readings - len(found.free)
    shape = np.linalg.inv(slopes.T @ slopes) * posterior.readings / freedom
    return freedom, np.sqrt(np.diag(shape) * np.mean(rows**2))


def test_a_linear_problem_has_its_closed_form(line):
    found, posterior = line
    freedom, scale = student(found, posterior)
    assert posterior.trusted, posterior.warnings
    for name, width in zip(found.free, scale, strict=True):
        q = posterior.parameters[name]
        expected = found.values[name] + width * stats.t(freedom).ppf([0.05, 0.5, 0.95])
        np.testing.assert_allclose([q.q05, q.median, q.q95], expected, atol=4 * 2.1 * width / np.sqrt(q.ess_tail))
        np.testing.assert_allclose(q.sd, width, rtol=4 / np.sqrt(q.ess_bulk))
        assert q.rhat < 1.01
        assert min(q.ess_bulk, q.ess_tail) > 1000


def test_parameters_are_correlated_as_they_should_be(line):
    found, posterior = line
    draws = posterior.draws.values[..., :2].reshape(-1, 2)
    expected = found.covariance / np.sqrt(np.outer(np.diag(found.covariance), np.diag(found.covariance)))
    np.testing.assert_allclose(np.corrcoef(draws.T), expected, atol=0.05)


def test_the_noise_is_found(line):
    found, posterior = line
    (noise,) = posterior.noise.values()
    assert noise.q05 < np.std(found.residual) / 2.0 < noise.q95


def test_a_search_in_the_logarithm_does_not_change_the_prior():
    """G is searched in the logarithm, its prior is uniform: force is linear in G, so its posterior is a cut normal."""
    effects = (IdealCylinder(), BladderNeoHookean(G=2e5))
    found = trusting(fit([loops(*effects, noise=40.0, count=30, repeats=1, seed=3)], effects, starts=2))
    posterior = sample(found, seed=2, limit_s=1e4)
    freedom, (scale,) = student(found, posterior)
    centre = found.values["bladder_neo_hookean.G"]
    law, low = stats.t(freedom, centre, scale), 1e3
    expected = law.ppf(law.cdf(low) + np.array([0.05, 0.5, 0.95]) * law.sf(low))
    q = posterior.parameters["bladder_neo_hookean.G"]
    assert scale > 0.15 * centre  # wide enough for a wrong prior to show
    np.testing.assert_allclose([q.q05, q.median, q.q95], expected, atol=4 * 2.1 * scale / np.sqrt(q.ess_tail))


def test_the_prior_speaks_where_the_data_are_silent():
    effects = (IdealCylinder(), ForceOffset(F_off=1.0))
    priors = {"muscle.radius": (7e-3, 1e-4)}
    found = fit([loops(*effects, pressure=30.0, noise=5.0, priors=priors)], effects, starts=2)
    q = sample(found, seed=0, max_steps=400).parameters["muscle.radius"]
    np.testing.assert_allclose([q.median, q.sd], [7e-3, 1e-4], atol=5e-6)
    np.testing.assert_allclose([q.q05, q.q95], 7e-3 + 1e-4 * stats.norm.ppf([0.05, 0.95]), atol=1e-5)


def test_a_parameter_at_its_bound_is_cut_off_there():
    found = fit([loops(IdealCylinder(), noise=2.0, seed=4)], (IdealCylinder(), CoulombFriction()), starts=2)
    posterior = sample(found, seed=0, max_steps=400)
    q = posterior.parameters["coulomb_friction.f_s"]
    assert 0 <= q.q05 < q.median < q.q95 < 1e-3
    assert any("end of the range cuts off: coulomb_friction.f_s" in note for note in posterior.notes)


def test_the_same_seed_gives_the_same_posterior():
    found, _ = straight_line()
    first, again, other = (sample(found, seed=s, max_steps=100) for s in (5, 5, 6))
    np.testing.assert_array_equal(first.draws.values, again.draws.values)
    assert not np.array_equal(first.draws.values, other.draws.values)


def test_a_chain_that_is_too_short_says_so():
    found, _ = straight_line()
    posterior = sample(found, seed=0, max_steps=100)
    assert not posterior.trusted
    assert any("correlation times long, not 50" in warning for warning in posterior.warnings)
    assert any("after 100 steps" in warning for warning in posterior.warnings)


def test_time_runs_out():
    found, _ = straight_line()
    told = []
    posterior = sample(found, limit_s=0.0, progress=lambda steps, effective: told.append((steps, effective)))
    assert f"stopped after {told[-1][0]} steps" in posterior.warnings[0]  # and not "after 0 s"
    assert told[-1][0] < 50
    assert told[-1][1] >= 0


def fading(keep, white=0.0, offset=0.0):
    """Errors that fade by `keep` from reading to reading, variance 1, beside white ones and an offset of each run."""

    def errors(random, phase):
        found = np.zeros(phase.size)
        found[0] = random.standard_normal()
        for i in range(1, phase.size):
            found[i] = keep * found[i - 1] + np.sqrt(1 - keep**2) * random.standard_normal()
        return found + white * random.standard_normal(phase.size) + offset * random.standard_normal()

    return errors


def test_the_noise_model_is_the_normal_density_with_its_covariance():
    """The recursion against scipy with the whole covariance matrix; two runs of uneven length with gaps."""
    random = np.random.default_rng(0)
    position = np.concatenate([np.cumsum(random.integers(1, 4, 25)), np.cumsum(random.integers(1, 4, 18))])
    run = np.repeat([0, 1], [25, 18])
    parts = ("size", "remembered", "memory", "run")
    samples = Namespace(recording=np.zeros(43, int), run=run, position=position)
    noise = noise_of_rows(samples, [parts], [1.0])
    size, remembered, memory, shared = map(float, noise.values(place := np.array([0.55, 0.6, 0.4, 0.3])))
    apart = np.abs(position[:, None] - position[None, :])
    fades = (1 - shared) * (remembered * np.exp(-apart / memory) + (1 - remembered) * np.eye(43))
    covariance = size**2 * (run[:, None] == run[None, :]) * (shared + fades)
    law = stats.multivariate_normal(np.zeros(43), covariance)
    rows = random.standard_normal((2, 43))
    ours = [float(np.sum(noise.terms(row, place))) - 0.5 * 43 * np.log(2 * np.pi) for row in rows]
    np.testing.assert_allclose(ours, law.logpdf(rows), rtol=1e-10)


@pytest.mark.parametrize(
    ("errors", "parts"),
    [
        (fading(0.0), ("size",)),
        (fading(0.9), ("size", "remembered", "memory")),
        (fading(0.0, offset=1.0), ("size", "run")),
    ],
)
def test_the_noise_is_chosen_from_the_residual(errors, parts):
    effects = (IdealCylinder(), CoulombFriction(f_s=0.015))
    (found,) = noise_found([loops(*effects, noise=1.0, errors=errors, repeats=2, runs=8)], effects)
    assert found.parts == parts


def noise_found(experiments, effects):
    found = fit(experiments, effects, starts=2)
    return choose_noise(found.residual / found.samples.sigma, found.samples)


def test_alike_neighbours_count_less():
    """Errors that fade over ten readings: intervals are those of generalised least squares with their covariance."""
    effects = (IdealCylinder(), CoulombFriction(f_s=0.015), ForceOffset(F_off=3.0))
    found = trusting(fit([loops(*effects, noise=1.0, errors=fading(0.9), repeats=8)], effects, starts=2))
    posterior = sample(found, seed=0, max_steps=400)
    assert posterior.noise["noise.memory@recording 1"].median == pytest.approx(1 / -np.log(0.9), rel=0.4)
    s = found.samples
    covariance = (s.run[:, None] == s.run) * 0.9 ** np.abs(s.position[:, None] - s.position)
    slopes = found.slopes * s.sigma[:, None]
    expected = np.sqrt(np.diag(np.linalg.inv(slopes.T @ np.linalg.solve(covariance, slopes))))
    for name, width in zip(found.free, expected, strict=True):
        assert posterior.parameters[name].sd == pytest.approx(width, rel=0.25)
        assert posterior.parameters[name].sd > found.error(name, robust=False)


def test_a_wrong_model_is_not_trusted():
    """Rubber that the model does not have: chains converge, to something that must not be believed."""
    experiment = loops(IdealCylinder(), BladderNeoHookean(G=5e5), noise=0.5, pressure=4e5)
    found = fit([experiment], (IdealCylinder(), CoulombFriction()), starts=2)
    posterior = sample(found, seed=0, max_steps=400)
    assert not posterior.trusted
    assert not posterior.calibrated
    assert any("something is missing" in warning and "not calibrated" in warning for warning in posterior.warnings)


def test_a_misfit_above_the_stated_noise_is_warned_of():
    """White errors of 1.72 N, which no flip of signs can tell from noise: only the owner's word speaks against them."""
    effects = (IdealCylinder(), CoulombFriction(f_s=0.015))
    experiment = loops(*effects, noise=1.0, errors=fading(0.0, white=1.4))
    found = fit([experiment], effects, starts=2)
    told = quick_look(found, [experiment], draws=500).warnings
    assert any("1.7 times the stated noise" in warning for warning in told)
    silent = dataclasses.replace(
        experiment, recordings=tuple(dataclasses.replace(rec, noise=None) for rec in experiment.recordings)
    )
    assert not any("times the" in warning for warning in quick_look(found, [silent], draws=500).warnings)


def test_a_test_that_was_not_made_is_said():
    """Positions alone are not tested for anything missing; silence would read as a clean bill."""
    found, _ = straight_line()
    what, tested = set_up(found), Missing(0.5, 0.01, False, "signs of loops")
    assert not any("was not tested" in note for note in notes(found, what, (), tested, 9))
    assert any("was not tested" in note for note in notes(found, what, (), None, 9))


def test_thinning_keeps_the_noise_and_widens_what_is_independent():
    found, experiment = straight_line()
    experiment = dataclasses.replace(
        experiment, recordings=tuple(dataclasses.replace(rec, noise=None) for rec in experiment.recordings)
    )
    whole = sample(found, seed=0, max_steps=400)
    thin = sample(found, [experiment], rows=200, seed=0, max_steps=400)
    assert thin.readings < 300
    assert any("thinned from 720" in note for note in thin.notes)
    (before,), (after,) = whole.noise.values(), thin.noise.values()
    assert after.median == pytest.approx(before.median, rel=0.2)
    ratio = thin.parameters["force_offset.F_off"].sd / whole.parameters["force_offset.F_off"].sd
    assert ratio == pytest.approx(np.sqrt(whole.readings / thin.readings), rel=0.15)


def test_slopes_by_differences_are_the_slopes():
    """Of a wandering point near the mode, against jax's own derivative."""
    found, _ = straight_line()
    target = set_up(found).target
    z = np.array([0.3, -0.7, 0.4])
    exact = np.asarray(jax.jit(jax.jacfwd(target.log_prob))(z))
    np.testing.assert_allclose(slopes_at(target, z).all, exact, atol=2e-3)


def test_readings_of_a_motion_stay_when_loops_are_thinned():
    loop = loops(IdealCylinder(), count=120, repeats=3).recordings[0]
    run = dataclasses.replace(loop.runs[0], load=np.full(len(loop.runs[0]), 100.0), time=loop.runs[0].time / 1e3)
    release = Recording("release.csv", "quick release", (run,), 1e-4)
    both = dataclasses.replace(loops(IdealCylinder()), recordings=(release, loop))
    slim = thin_to_shares(both, {True: 1.0, False: 0.2})
    assert [rec.test for rec in slim.recordings] == ["quick release", "loop"]
    assert len(slim.recordings[0].runs[0]) == len(run)
    assert len(slim.recordings[1].runs[0]) < 0.4 * len(loop.runs[0])


def test_nothing_to_sample():
    found, _ = straight_line()
    found = dataclasses.replace(found, free=())
    with pytest.raises(InputError, match="nothing varies"):
        sample(found)


def test_what_is_handed_on(line, tmp_path):
    _, posterior = line
    written = to_json(posterior)
    assert written["trusted"] is True
    assert {"median", "q05", "q95", "rhat", "ess_bulk", "ess_tail", "robust_error", "unit"} <= set(
        written["parameters"]["force_offset.F_off"]
    )
    assert "force_offset.F_off" in describe(posterior)
    save(posterior, tmp_path / "chain.nc")
    import xarray

    back = xarray.open_dataset(tmp_path / "chain.nc", group="posterior")
    np.testing.assert_array_equal(back["force_offset.F_off"][0], posterior.draws.values[0, :, 0, 1])


def test_draws_for_which_there_is_no_room_are_not_begun(line, tmp_path, monkeypatch):
    _, posterior = line
    room = posterior.draws.values.nbytes // 2
    monkeypatch.setattr("shutil.disk_usage", lambda _: Namespace(free=room))
    with pytest.raises(OSError, match="No space left"):
        save(posterior, tmp_path / "chain.nc")
    assert not list(tmp_path.iterdir())


def test_the_snooker_move_leaves_a_normal_distribution_as_it_is():
    sampler = emcee.EnsembleSampler(
        48, 3, lambda z: -0.5 * np.sum((z / 0.2) ** 2, axis=1), moves=Snooker(), vectorize=True
    )
    sampler.random_state = np.random.RandomState(0).get_state()
    sampler.run_mcmc(0.2 * np.random.RandomState(1).randn(48, 3), 3000)
    found = sampler.get_chain(discard=300).reshape(-1, 3) / 0.2
    np.testing.assert_allclose(found.std(axis=0), 1, atol=0.04)  # emcee's own: 0.7


def test_draws_around_the_mode_have_the_density_of_students_t():
    z = np.random.default_rng(0).standard_normal((50, 4))
    theirs = stats.multivariate_t(np.zeros(4), MOVE.scale**2 * np.eye(4), df=MOVE.tails).logpdf(z)
    np.testing.assert_allclose(np.diff(log_around_mode(z)), np.diff(theirs), atol=1e-12)


def test_a_value_that_is_small_in_a_wide_range_is_not_cut_off():
    """Far from the end in its own standard deviations, whatever share of the range that is."""
    random = np.random.default_rng(0)
    draws = {"small": 0.008 + 1e-5 * random.normal(size=4000), "cut": np.abs(0.005 * random.normal(size=4000)),
             "inside": 0.5 + 0.1 * random.normal(size=4000)}  # fmt: skip
    target = SimpleNamespace(places=lambda z: z, free=3)
    found = cut_off(
        SimpleNamespace(target=target, priors=dict.fromkeys(draws)), np.stack([*draws.values()], axis=1)[None]
    )
    assert found == ("cut",)
