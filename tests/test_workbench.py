"""The workbench without a browser: its actions, its sliders, and what is taken home."""

import ast
import json
import re
import subprocess
import sys
import time
from contextlib import nullcontext
from types import SimpleNamespace

import jax.numpy as jnp
import numpy as np
import pytest
from small_muscle import LENGTH, loops, write

from fitting.errors import InputError
from fitting.library.library import library
from fitting.model_files.model_file import read_model
from fitting.report.text.stages import stage_text
from fitting.study.request import Request
from fitting.workbench import asked, home
from fitting.workbench import session as bench
from fitting.workbench.live import live_of
from fitting.workbench.text import (
    DESIGN,
    answer_html,
    called,
    error_now,
    evidence,
    fall,
    headline,
    known_effects,
    models,
    offers,
)

CANDIDATES = ("linear_spring", "viscous_damping")
STIFFNESS = 1600.0  # N/m, what is hidden in the data of these tests


def told(*_):
    """Progress that nobody looks at."""


def spring(eps, *_):
    return STIFFNESS * LENGTH * eps


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Loops of a muscle with a spring that the baseline does not know."""
    return write(tmp_path_factory.mktemp("spring"), loops(spring, points=40, repeats=4))


@pytest.fixture(scope="module")
def session(folder):
    """The data opened and fitted."""
    return bench.fit_first(bench.open_session(Request(data=(str(folder),), starts=2)), told)


@pytest.fixture(scope="module")
def found(session):
    """The session with its diagnosis."""
    return bench.examine(session, told, CANDIDATES)


@pytest.fixture(scope="module")
def mended(found):
    """The session with the spring added."""
    return bench.add(found, ["linear_spring"], told)


# ------------------------------------------------------------------------------------------------------ the actions


def test_there_is_a_picture_before_anything_is_fitted(folder):
    step = bench.open_session(Request(data=(str(folder),))).last
    assert step.comparison is None
    picture, error = bench.loops_of(step, bench.frames_of(step), {})
    assert picture.count("<figure>") == 3
    assert error > 0


def test_the_error_falls_when_what_is_missing_is_added(found, mended):
    assert found.last.diagnosis.verdict == "missing"
    assert offers(found.last)[0] == "linear_spring"
    assert mended.last.comparison.rmse < 1.2 * 0.3 < 5 * 0.3 < found.last.comparison.rmse
    assert mended.last.fit.values["linear_spring.K"] == pytest.approx(STIFFNESS, rel=0.1)
    assert [stage_text(stage) for stage in mended.stages] == ["the first model", "+ ⟦linear_spring⟧"]


def test_all_models_stand_side_by_side_once_there_are_several(found, mended):
    assert models(found) == ""
    table = models(mended)
    heads = re.findall(r"<th scope[^>]*>(.*?)</th>", table)
    assert heads[:2] == ["measured", "the first model"]
    assert "Spring in parallel" in heads[2]
    stiffness = re.search(r"linear_spring.K.*?</tr>", table)[0]
    assert "<td></td><td></td><td>1." in stiffness  # neither measured, nor in the first model


def test_undo_goes_back_and_changes_nothing_else(found, mended):
    assert bench.undo(mended) == found
    assert bench.undo(bench.undo(found)).steps == found.steps[:1]


def test_dropping_takes_an_effect_out_again(mended, session):
    without = bench.drop(mended, ["linear_spring"], told)
    assert without.last.comparison.rmse == pytest.approx(session.last.comparison.rmse, rel=1e-3)


def test_a_line_defines_an_effect_that_can_be_added(session):
    line = "bung = -K*x, K = 1 N/mm (0..20)"
    defined, name = bench.define(session, line)
    assert name == "bung"
    after = bench.add(defined, [name], told)
    assert after.last.fit.values["bung.K"] == pytest.approx(STIFFNESS, rel=0.1)
    assert line in home.script_text(after)


@pytest.mark.parametrize("line", ["bung = __import__('os').system('x')", "bung = K*x, K = 1 N (0..20)", "nothing"])
def test_a_line_that_is_no_force_is_refused(session, line):
    with pytest.raises(InputError):
        bench.define(session, line)


def test_words_tell_verdict_and_evidence(found):
    assert 'Spring in parallel <small class="id">linear_spring</small> is missing.' in headline(found)
    table = evidence(found.last, {name: f"<button>{name}</button>" for name in offers(found.last)})
    assert "explains the data" in table
    assert "<button>linear_spring</button>" in table
    assert called(found.last, "linear_spring + tip") == "Spring in parallel + Tip correction"
    assert known_effects(found.last)["Spring in parallel (linear_spring)"] == "linear_spring"


def test_after_an_addition_the_error_before_is_told_and_that_nothing_was_tested(found, mended):
    before = found.last.comparison.rmse
    assert f"(the model before: {before:.3g} N)" in error_now(mended.last, 0.3, {})
    assert "the model before" not in error_now(found.last, before, {})
    assert "run the diagnosis again" in headline(mended)
    assert "run the diagnosis again" not in headline(found)


def test_sliders_have_the_names_for_readers_too(mended):
    labels = [slider.label for slider in mended.last.laid_out.sliders]
    assert "stiffness in parallel (linear_spring.K) [N/mm]" in labels
    moved = error_now(mended.last, 1.0, {"linear_spring.K": 1e3})
    assert 'With stiffness in parallel <small class="id">linear_spring.K</small> moved: ' in moved


def answers(session):
    """What was answered at the last step, by its title."""
    return {answer.title: answer for answer in session.last.said}


def test_an_answer_takes_the_place_of_an_earlier_one_and_its_words_are_no_markup(session):
    first, other = bench.Answer("Next", "one"), bench.Answer("Rest", "<b>two</b>", (("a < b", "<svg/>"),))
    twice = bench.told(bench.told(bench.told(session, first), other), bench.Answer("Next", "three"))
    assert [(answer.title, answer.text) for answer in twice.last.said] == [("Rest", "<b>two</b>"), ("Next", "three")]
    assert '<pre tabindex="0">&lt;b&gt;two&lt;/b&gt;</pre>' in answer_html(other)
    wide = f"{'number':>60}{'number':>60}"  # a row of a table, whose columns stay
    assert f'<pre tabindex="0">{wide}</pre>' in answer_html(bench.Answer("Wide", wide))
    assert f"<p>{'word ' * 30}</p><pre" in answer_html(bench.Answer("Long", "word " * 30 + "\nshort"))
    assert "<svg/><figcaption>a &lt; b</figcaption>" in answer_html(other)


def test_a_design_file_in_the_box_is_answered_and_a_slip_is_named():
    found = asked.find_design(DESIGN, told)
    assert "braid_angle" in found.text
    assert "stroke" in found.text
    ((_, drawing),) = found.pictures
    assert "contracted 37.9 % at 500 kPa: 186.3 mm long" in drawing
    assert "0.379" in found.text
    assert drawing in answer_html(found)
    with pytest.raises(InputError, match="braid_angel"):
        asked.find_design(DESIGN.replace('braid_angle = ["12', 'braid_angel = ["12'), told)


def test_what_to_measure_next_is_asked_after_a_diagnosis_only(session, found):
    with pytest.raises(InputError, match="no diagnosis"):
        asked.plan(session, told)
    planned = asked.plan(found, told)
    assert "PLAN" in answers(planned)[asked.NEXT].text


def test_effects_can_be_tried_beside_a_diagnosed_model(session, found):
    """Their curves come with the readings: to try one costs no time."""
    names = []
    for step in (session.last, found.last):
        element = SimpleNamespace(hold_sync=nullcontext)
        live_of(step, element)
        names.append([one["name"] for one in json.loads(element.content)["candidates"]])
    assert names[0] == []
    assert any(name.startswith("Spring in parallel") for name in names[1])


@pytest.mark.slow
def test_what_is_sampled_stands_in_the_report(mended):
    sampled = asked.sample_posterior(mended, told, seconds=5)
    found = answers(sampled)[asked.POSTERIOR]
    assert "linear_spring.K" in found.text
    assert [picture[:4] for _, picture in found.pictures] == ["<svg", "<svg"]
    assert len(set(re.findall(r'\bid="([^"]+)"', "".join(picture for _, picture in found.pictures)))) == len(
        re.findall(r'\bid="([^"]+)"', "".join(picture for _, picture in found.pictures))
    )
    assert "Do the readings lie where they should?" in home.report_text(sampled)


def test_words_and_sliders_speak_in_the_units_of_the_data(folder, tmp_path):
    """The same loops in psi and pounds; two sessions, each in its own units."""
    copy = tmp_path / "imperial"
    copy.mkdir()
    (copy / "muscle.toml").write_bytes((folder / "muscle.toml").read_bytes().replace(b'"0.3 N"', b'"0.0674 lbf"'))
    head, *rows = (folder / "loops.csv").read_text().splitlines()
    cells = [row.split(",") for row in rows]
    lines = [f"{r},{t},{float(p) / 6.894757:.5f},{x},{float(f) / 4.4482216:.6f}" for r, t, p, x, f in cells]
    head = head.replace("kPa", "psi").replace("[N]", "[lbf]")
    (copy / "loops.csv").write_text("\n".join([head, *lines]) + "\n")
    ours = bench.fit_first(bench.open_session(Request(data=(str(copy),), starts=1)), told)
    theirs = bench.fit_first(bench.open_session(Request(data=(str(folder),), starts=1)), told)
    for session, unit, held in ((ours, "lbf", "14.5 psi"), (theirs, "N", "100 kPa")):
        step = session.last
        picture, error = bench.loops_of(step, bench.frames_of(step), {})
        assert f"force [{unit}]" in picture
        assert held in picture
        assert f" {unit}." in error_now(step, error, {})
        assert f" {unit} " in fall(session)
        assert [s.unit for s in step.laid_out.sliders] == ["mm", "deg", ""]
    assert ours.last.comparison.rmse == pytest.approx(theirs.last.comparison.rmse, rel=1e-3)


# ------------------------------------------------------------------------------------------------------- the sliders


def test_the_loop_follows_a_slider_as_the_model_says(session):
    step = session.last
    slider = next(s for s in step.laid_out.sliders if s.name == "muscle.radius")
    place = slider.places[0]
    moved = step.laid_out.moved({s.name: s.start for s in step.laid_out.sliders} | {"muscle.radius": place})
    assert moved == {"muscle.radius": place * slider.size}
    vector = step.fit.vector.copy()
    vector[step.fit.layout.names.index("muscle.radius")] = place * slider.size
    model = step.fit.layout.model(jnp.asarray(vector))
    force = np.asarray(model.force(step.fit.problem.blocks[0].states)).reshape(-1)
    expected = force[np.asarray(step.fit.problem.blocks[0].keep)] - step.laid_out.samples.measured
    np.testing.assert_allclose(step.laid_out.residual(moved), expected, rtol=1e-9, atol=1e-9)


def test_nothing_moved_is_the_fit(session):
    np.testing.assert_allclose(session.last.laid_out.residual(), session.last.fit.residual, rtol=1e-9, atol=1e-9)
    starts = {s.name: s.start for s in session.last.laid_out.sliders}
    assert session.last.laid_out.moved(starts) == {}


def test_every_slider_holds_its_fitted_value_and_stays_in_range(mended):
    for slider in mended.last.laid_out.sliders:
        entry = mended.last.fit.layout.entries[mended.last.fit.layout.names.index(slider.name)]
        assert slider.start in slider.places
        assert list(slider.places) == sorted(slider.places)
        assert slider.places[0] * slider.size >= entry.lower - 1e-4 * abs(entry.lower)
        assert slider.places[-1] * slider.size <= entry.upper + 1e-4 * abs(entry.upper)


def test_ten_thousand_samples_are_redrawn_at_once(tmp_path):
    folder = write(tmp_path, loops(points=420, repeats=4))
    step = bench.open_session(Request(data=(str(folder),))).last
    assert len(step.laid_out.samples) > 9800
    frames, seconds = bench.frames_of(step), []
    value = step.laid_out.vector[step.laid_out.layout.names.index("muscle.radius")]
    for k in range(30):
        begun = time.process_time()  # of all threads: what else the machine does is not counted
        picture, _ = bench.loops_of(step, frames, {"muscle.radius": value * (1 + 1e-3 * k)})
        seconds.append(time.process_time() - begun)
    assert np.median(seconds) < 0.15
    assert len(picture) < 400_000


# --------------------------------------------------------------------------------------------------------- downloads


def test_the_model_can_be_taken_home(mended, tmp_path):
    path = tmp_path / "model.toml"
    path.write_text(home.model_text(mended))
    stored = read_model(path, library())
    assert stored.values["linear_spring.K"] == pytest.approx(mended.last.fit.values["linear_spring.K"])


def test_the_report_shows_every_step(mended):
    text = home.report_text(mended)
    assert 'id="step0"' in text
    assert 'id="step1" checked' in text
    assert '<g class="model m1">' in text


def test_before_the_first_fit_there_is_nothing_to_take_home(folder):
    with pytest.raises(InputError, match="nothing was fitted"):
        home.model_text(bench.open_session(Request(data=(str(folder),))))


def test_the_script_is_python_that_names_every_command(mended):
    text = home.script_text(mended)
    commands = ast.literal_eval(re.search(r"COMMANDS = (\[.*?\n\])", text, re.DOTALL)[1])
    assert [command[0] for command in commands] == ["fit", "diagnose", "add", "report"]
    assert "linear_spring" in commands[2]
    assert "--baseline" in commands[0]  # a model.toml that lies there when it is run again is not what was fitted
    assert all("--baseline" not in command for command in commands[1:])
    ast.parse(text)


@pytest.mark.slow
def test_the_script_gives_the_same_model(mended, tmp_path):
    (tmp_path / "session.py").write_text(home.script_text(mended))
    ended = subprocess.run([sys.executable, "session.py"], cwd=tmp_path, capture_output=True, text=True, timeout=900)
    assert ended.returncode == 0, ended.stderr
    stored = read_model(tmp_path / "session_model_1.toml", library())
    assert stored.values["linear_spring.K"] == pytest.approx(mended.last.fit.values["linear_spring.K"], rel=1e-3)
