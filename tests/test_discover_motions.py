"""A discovery on motions alone reads them as force; what it saves was fitted to the motions themselves."""

import json
from dataclasses import replace
from types import SimpleNamespace

import pytest
from click.testing import CliRunner
from small_muscle import loops, write
from test_inverse_dynamics import released

from fitting.cli.main import main
from fitting.library.library import library
from fitting.model_files.model_file import read_model
from fitting.report.text.changes import on_motions_result, on_motions_text
from fitting.study import discovering
from fitting.study.confined import confined
from fitting.study.diagnosing import in_newtons
from fitting.study.discovering import on_motions
from fitting.study.request import Request
from fitting.study.task import task_of
from mckibben_jax.effects import ViscousDamping

B = 150.0  # N s/m, of the drag that is hidden


def told(*_):
    """Progress that nobody looks at."""


def found_on(task, is_confined=False):
    """A discovery that added a drag, with its value from the motions read as force."""
    fit = SimpleNamespace(values={"viscous_damping.B": 138.0})
    larger = in_newtons(task).with_effects([*task.effects, ViscousDamping()])
    if is_confined:
        larger = replace(larger, experiments=confined(larger.experiments))
    return SimpleNamespace(task=larger, comparison=SimpleNamespace(fit=fit))


@pytest.fixture
def after():
    """The error of the model that was found, m."""
    return 4e-3


@pytest.fixture
def asked(monkeypatch, after):
    """The tasks that are fitted, in their order; nothing is computed, and an error is that of its place."""
    tasks = []

    def fit(task):
        tasks.append(task)
        rmse = (4e-3, after)[len(tasks) - 1]
        return SimpleNamespace(values={}, free=(), rmse=rmse, over_noise=rmse / 5e-5)

    monkeypatch.setattr(discovering, "fit_task", fit)
    return tasks


@pytest.fixture
def denying(monkeypatch):
    """The tasks that are fitted, in their order; a fit with a drag denies the radius, unless it may not."""
    tasks = []

    def fit(task):
        tasks.append(task)
        confined_sizes = any(experiment.is_confined for experiment in task.experiments)
        far = "viscous_damping" in task.names and not confined_sizes
        mean, error = task.experiments[0].priors["muscle.radius"]
        values = {"muscle.radius": mean + far * 10 * error}
        return SimpleNamespace(
            values=values, free=tuple(values), layout=task.layout, rmse=1e-3 * (2 - far), over_noise=2.0
        )

    monkeypatch.setattr(discovering, "fit_task", fit)
    return tasks


@pytest.mark.parametrize(("after", "confirmed"), [(5e-5, True), (3e-4, True), (3.99e-3, False), (5e-3, False)])
def test_the_motions_themselves_have_the_last_word(tmp_path, asked, after, confirmed):
    released(tmp_path)
    task = task_of(Request(data=(str(tmp_path),)))
    motions = on_motions(task, found_on(task), told)
    before, last = asked
    assert before.names == task.names
    assert last.names == (*task.names, "viscous_damping")
    assert last.known["viscous_damping.B"] == 138.0
    assert [r.test for e in last.experiments for r in e.recordings] == ["quick release"]
    assert motions.confirmed == confirmed
    said = on_motions_text(motions)
    assert ("They confirm the model." in said) == (after == 5e-5)
    assert ("They confirm what was added, but the model misses them by 6.0 times their noise." in said) == (
        after == 3e-4
    )


def test_sizes_that_the_discovery_confined_stay_so_in_the_motions(tmp_path, asked):
    released(tmp_path)
    task = task_of(Request(data=(str(tmp_path),)))
    on_motions(task, found_on(task, is_confined=True), told)
    before, last = asked
    assert [e.is_confined for e in (*before.experiments, *last.experiments)] == [False, True]
    assert [r.test for e in last.experiments for r in e.recordings] == ["quick release"]


def test_positions_do_not_overrule_a_caliper_where_forces_do_not(tmp_path, denying):
    released(tmp_path)
    task = task_of(Request(data=(str(tmp_path),)))
    motions = on_motions(task, found_on(task), told)
    assert [task.experiments[0].is_confined for task in denying] == [False, False, True, True]
    assert "muscle.radius" in motions.held
    assert motions.after.rmse == 2e-3
    assert "(equation of motion, with the sizes of the muscle as measured): " in on_motions_text(motions)
    assert len(denying[1].known) == 2
    assert [task.starts > 1 for task in denying] == [True, False, True, False]


def test_a_model_to_which_nothing_was_added_denies_no_caliper_either(tmp_path, denying):
    released(tmp_path)
    task = task_of(Request(data=(str(tmp_path),)))
    task = task.with_effects([*task.effects, ViscousDamping()])
    same = SimpleNamespace(task=in_newtons(task), comparison=None)
    motions = on_motions(task, same, told)
    assert [task.experiments[0].is_confined for task in denying] == [False, True]
    assert motions.after is motions.before
    assert motions.held


def test_a_size_that_is_asked_to_be_free_may_be_denied(tmp_path, denying):
    released(tmp_path)
    task = task_of(Request(data=(str(tmp_path),), free=("muscle.radius",)))
    assert on_motions(task, found_on(task), told).held == ()
    assert len(denying) == 2


def test_where_force_was_measured_it_was_in_the_fit_already(tmp_path, asked):
    task = task_of(Request(data=(str(write(tmp_path / "loops", loops(points=20, repeats=2))),)))
    assert on_motions(task, found_on(task), told) is None
    assert asked == []
    assert on_motions_result(None) == {}


@pytest.mark.slow
def test_what_is_saved_was_fitted_to_the_motions(tmp_path):
    """Read as force the drag is known to half a per cent, by the equation of motion to 0.05 %."""
    folder = tmp_path / "releases"
    folder.mkdir()
    released(folder, viscous_damping={"B": B})
    order = ["discover", str(folder), "--candidates", "viscous_damping", "--json", str(tmp_path / "r.json")]
    done = CliRunner().invoke(main, order)
    assert done.exit_code == 0, done.output
    assert "They confirm the model." in " ".join(done.output.split())
    saved = read_model(folder / "model.toml", library()).values["viscous_damping.B"]
    result = json.loads((tmp_path / "r.json").read_text())
    assert saved == pytest.approx(result["motion"]["parameters"]["viscous_damping.B"]["value"], rel=1e-8)
    assert saved == pytest.approx(B, rel=0.003)
    assert abs(result["parameters"]["viscous_damping.B"]["value"] - saved) > 1e-3 * B
