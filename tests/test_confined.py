"""Sizes that a discovery had to confine stay so in the commands after it, or each would speak of another muscle."""

import json
import shutil
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from click.testing import CliRunner
from folders import folder_of, loop_columns, model_beside, table

from fitting.cli.main import main
from fitting.diagnosis.course import Step
from fitting.diagnosis.step_rules import RULES
from fitting.instruments.errors import InstrumentErrors
from fitting.instruments.sources import ErrorKind, Source
from fitting.least_squares.uncertainty import beside_stated, clusters, covariances
from fitting.model_files.model_file import read_model
from fitting.model_files.writer import model_text
from fitting.problem.estimate import ParameterState
from fitting.recordings.accuracy import Channel
from fitting.report.text.amounts import amount
from fitting.report.text.changes import change_text
from fitting.report.text.layout import console
from fitting.report.text.study import opening, step_report
from fitting.study import discovering
from fitting.study.changing import change, with_added
from fitting.study.request import Request
from fitting.study.task import fit_task, task_of
from mckibben_jax.effects import CoulombFriction, IdealCylinder, LinearSpring

DATA = Path(__file__).parents[1] / "data"


def held(folder, state="fixed", **sizes):
    """The folder's task once a model of its muscle lies in it; stated are 7.0 +/- 0.1 mm and 20 +/- 0.5 deg."""
    model_beside(folder, state, **{"length": "300 mm", "radius": "7 mm", "braid_angle": "20 deg"} | sizes)
    return lambda **more: task_of(Request(data=(str(folder),), **more))


@pytest.fixture
def folder(tmp_path):
    return folder_of(tmp_path, table(loop_columns()))


def text_of(shown):
    out = console()
    with out.capture() as captured:
        for thing in shown:
            out.print(thing)
    return " ".join(captured.get().split())


def ranges(task, name):
    entry = task.layout.entry(name)
    return entry.lower, entry.upper


def test_sizes_that_the_model_file_holds_are_confined_to_what_was_stated(folder):
    task = held(folder, radius="7.2 mm")()
    assert (task.held, task.kept) == (("muscle.radius",), ("muscle.braid_angle",))
    np.testing.assert_allclose(ranges(task, "muscle.radius"), (6.8e-3, 7.2e-3))
    np.testing.assert_allclose(ranges(task, "muscle.braid_angle"), np.radians((19.0, 21.0)))
    assert "muscle.braid_angle" not in task.free_names  # which stands at no limit: somebody fixed it


def test_they_are_let_go_by_name_and_by_another_model(folder):
    told = held(folder, radius="7.2 mm")
    free = told(free=("muscle.radius", "muscle.braid_angle"))
    assert free.held == free.kept == told(baseline=True).held == ()
    lower, upper = ranges(free, "muscle.radius")
    assert upper - lower > 4e-3
    assert told(free=("muscle.braid_angle",)).held


def test_sizes_that_somebody_fixed_stay_fixed_until_they_are_let_go(folder):
    """At values of their own choice, not at the limit of what a fit may make of them."""
    told = held(folder, radius="7.1 mm")
    task = told()
    assert (task.held, task.kept) == ((), ("muscle.radius", "muscle.braid_angle"))
    assert not {*task.kept} & {*task.free_names}
    assert fit_task(task).values["muscle.radius"] == pytest.approx(7.1e-3)
    assert "radius (muscle.radius), braid angle (muscle.braid_angle) fixed (--free" in text_of(opening(task))
    assert "muscle.radius" in told(free=("muscle.radius",)).free_names
    assert told(baseline=True).kept == ()


def test_a_size_that_was_measured_badly_is_not_taken_for_one_that_may_not_be_denied(folder):
    """Its range is as narrow as its error is wide."""
    text = (folder / "muscle.toml").read_text(encoding="utf-8").replace("7.0 +/- 0.1 mm", "7.0 +/- 12 mm")
    (folder / "muscle.toml").write_text(text, encoding="utf-8")
    entry = task_of(Request(data=(str(folder),), baseline=True)).layout.entry("muscle.radius")
    assert entry.upper - entry.lower < 4 * 12e-3
    assert not entry.is_confined
    assert held(folder, braid_angle="21 deg")().layout.entry("muscle.radius").is_confined


@pytest.mark.parametrize("freed", [False, True])
def test_what_a_discovery_confined_on_the_way_it_may_set_free_again(folder, freed, monkeypatch):
    """Once the effect is dropped that made a fit deny it."""
    task = task_of(Request(data=(str(folder),), baseline=True))
    values = fit_task(task).values
    told = SimpleNamespace(baseline=SimpleNamespace(values=values), is_strained=False, p_value=0.5)
    path = [
        Step(("baseline",), 3.0, 3.0, "missing", told),
        Step(("linear_spring",), 2.0, 2.0, "missing", told, held=("muscle.radius",)),
        Step((), 1.0, 1.0, "missing", told, dropped=("linear_spring",), freed=freed),
    ]

    def discovered(*_, on_step, **__):
        for step in path:
            on_step(step)
        return path

    monkeypatch.setattr(discovering, "discover", discovered)
    found = discovering.discover_task(task, [LinearSpring()], lambda *_: None)
    assert found.task.held == (() if freed else ("muscle.radius",))
    assert found.task.experiments[0].is_confined is not freed
    assert [stage.freed for stage in found.stages] == [False, False, freed]
    shown = text_of(step_report(found.stages[-1]))
    assert ("all are free again" in shown) is freed


def test_an_effect_is_added_to_a_muscle_of_believable_sizes(folder):
    """Nobody's muscle: a force of two straight lines bends a free fit, and a discovery would confine the sizes."""
    made = change(*adding(folder), lambda *_: None)
    assert [stage.held != () for stage in made.stages] == [False, True, False]
    assert [stage.added for stage in made.stages] == [(), (), ("linear_spring",)]
    assert made.stages[0].rmse < made.before.rmse == made.stages[1].rmse
    for found in (made.before, made.after):
        assert np.all(np.abs(found.prior_rows) < 2.001)
    assert made.task.experiments[0].is_confined
    words = change_text(made, "N")
    assert words.startswith("+ ⟦linear_spring⟧: error " + amount(made.before.rmse, "N"))


@pytest.mark.parametrize("free", [("muscle.radius", "muscle.braid_angle"), ("muscle.braid_angle",)])
def test_who_lets_a_size_go_gets_all_free(folder, free):
    """By name."""
    made = change(*adding(folder, free=free), lambda *_: None)
    assert [stage.held for stage in made.stages] == [(), ()]
    assert np.abs(made.after.prior_rows).max() > RULES.denied
    assert not made.task.experiments[0].is_confined


def adding(folder, **more):
    """The arguments of a change: the baseline, the same with a spring, and how they differ."""
    task = task_of(Request(data=(str(folder),), baseline=True, starts=2, **more))
    return task, *with_added(task, ["linear_spring"])


def test_what_was_fitted_and_what_lies_outside_confine_nothing(folder):
    """Who set a size outside what was stated wanted it there; and a size that was fitted may go where it likes."""
    assert held(folder, "fitted")().held == ()
    outside = held(folder, radius="7.3 mm")()
    assert outside.held == outside.kept == ()


def test_a_model_of_other_data_confines_nothing(folder):
    told = held(folder, radius="7.2 mm")
    (folder / "data.csv").write_text(table(loop_columns(loops=3)), encoding="utf-8")
    assert told().held == ()


def test_sizes_at_their_end_are_written_as_held_and_others_with_their_error(folder, tmp_path):
    fitted = fit_task(held(folder, radius="7.2 mm")())
    assert "muscle.radius" in fitted.at_bound  # nobody's muscle: a force of two straight lines
    written = tmp_path / "written.toml"
    written.write_text(model_text(fitted, task_of(Request(data=(str(folder),))).experiments), encoding="utf-8")
    states = read_model(written).states
    assert states["muscle.radius"] is ParameterState.FIXED


@pytest.fixture(scope="module")
def after_discovery(tmp_path_factory):
    """A published map whose rubber a free fit would pay for with the length, and what `discover` says of it."""
    folder = tmp_path_factory.mktemp("hose") / "hose"
    shutil.copytree(DATA / "martens2017_dmsp20", folder)
    options = ["--baseline", "--candidates", "bladder_neo_hookean", "--candidates", "tip"]
    return folder, told("discover", folder, *options)


def told(command, folder, *options):
    """What a command prints, in one line, and its JSON."""
    file = folder / "told.json"
    result = CliRunner().invoke(main, [command, str(folder), *options, "--json", str(file)], catch_exceptions=False)
    return " ".join(result.output.split()), json.loads(file.read_text(encoding="utf-8"))


def test_commands_after_a_discovery_speak_of_its_muscle(after_discovery):
    folder, (said, ended) = after_discovery
    assert "later commands with the model that is saved keep to it" in said
    modulus = ended["parameters"]["bladder_neo_hookean.G"]
    assert 0.1 < modulus["robust_error"] / modulus["value"] < 0.6  # sizes that are known to 3 to 10 % make most of it
    text, again = told("diagnose", folder, "--candidates", "tip")
    assert "No size of the muscle may lie further than 2 standard errors" in text
    assert "Left free, this model would deny what was measured" in text
    assert again["rmse_N"] == pytest.approx(ended["rmse_N"], rel=1e-3)
    assert again["verdict"] == ended["verdict"]
    free = [word for name in again["provenance"]["confined"] for word in ("--free", name)]
    let_go = told("diagnose", folder, "--candidates", "tip", *free)[1]
    assert let_go["rmse_N"] < 0.9 * ended["rmse_N"]


@pytest.mark.parametrize("times", [1, 25])
def test_all_readings_say_as_little_of_a_stated_size_as_they_are_missed_by(times):
    """A slope and a size that the data tie to each other; each reading is written several times."""
    random, count = np.random.default_rng(3), 400
    x = np.linspace(0.0, 1.0, count)
    once, said = np.column_stack([x, 0.5 * x + x**2, np.sign(x - 0.5)]), 0.3 * random.normal(size=count)
    once[:, 2] -= once[:, :2] @ np.linalg.lstsq(once[:, :2], once[:, 2], rcond=None)[0]  # what the size does not move
    priors, loop, stated = np.array([[0.0, 1 / 0.2, 0.0]]), np.repeat(np.arange(8), count // 8), np.arange(3) == 1
    data, rows, cluster = (np.repeat(each, times, axis=0) for each in (once, said, loop))
    held = covariances(data[:, ~stated], rows, priors[:, ~stated], cluster)
    for found, alone in zip(beside_stated(data, rows, priors, cluster, stated), held, strict=True):
        known = np.linalg.inv(once.T @ once / (said @ said) + priors.T @ priors)[1, 1]
        slope = (x @ once[:, 1]) / (x @ x)  # how the slope gives way to the size
        assert found[1, 1] == pytest.approx(known)
        assert found[0, 0] == pytest.approx(alone[0, 0] + slope**2 * known)
        assert found[0, 1] == pytest.approx(-slope * known)
        assert found[2, 2] == pytest.approx(alone[1, 1])
    assert 0.5 * 0.2**2 < known < 0.2**2


def test_what_each_run_errs_by_counts_beside_a_confined_size():
    """One run whose gain nobody knows to better than a tenth."""
    x = np.linspace(0.1, 1.0, 100)
    data, rows = np.column_stack([x, x**2]), 0.01 * np.random.default_rng(1).normal(size=100)
    gain = Source(Channel.FORCE, ErrorKind.GAIN_PER_RUN, 0.1, 0.1)
    errors = InstrumentErrors(0.1 * x[:, None], np.zeros((100, 0)), (gain,), (), np.zeros(100, int))
    loose = beside_stated(data, rows, np.array([[0.0, 100.0]]), np.arange(100) // 10, np.arange(2) == 1, errors)
    assert np.sqrt(loose[1][0, 0]) == pytest.approx(0.1, rel=0.1)


def test_the_same_muscle_is_predicted_however_wrong_its_caliper_is(folder):
    """A size that a fit may not deny is known to no better than was stated; the forces fitted beside it are."""
    fitted = fit_task(
        held(folder, radius="7.2 mm")().with_effects([IdealCylinder(), CoulombFriction(), LinearSpring()])
    )
    stated = [fitted.layout.entry(name).is_confined for name in fitted.free]
    assert any(stated)
    assert not all(stated)
    assert not fitted.repeatable[stated].any()
    spread = lambda covariance: np.sqrt(np.einsum("ri,ij,rj->r", slopes, covariance, slopes)).max()  # noqa: E731
    slopes = fitted.slopes[: len(fitted.samples)]
    assert 0 < spread(fitted.repeatable) < spread(fitted.robust)
    count, varies = len(fitted.samples), ~np.array(stated)
    own = fitted.slopes[:, varies]
    cluster = clusters(fitted.samples, fitted.slopes)
    expected = covariances(own[:count], fitted.residual / fitted.samples.sigma, own[count:], cluster)[1]
    np.testing.assert_allclose(fitted.repeatable[np.ix_(varies, varies)], expected, rtol=1e-9)
