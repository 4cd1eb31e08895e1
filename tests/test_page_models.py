"""The models of one page: every number is of one model, and all models share the colours of one map."""

import dataclasses
import html
import re
from types import SimpleNamespace

import numpy as np
import pytest
from click.testing import CliRunner
from small_muscle import loops, write
from studied import as_read, headings, off_by, two_steps

from fitting.cli.main import main
from fitting.diagnosis.findings import Attempt
from fitting.diagnosis.outcomes import Verdict
from fitting.diagnosis.record import Leading
from fitting.least_squares.evaluate import held_out_rmse
from fitting.report.page import top
from fitting.report.page.models import models_of
from fitting.report.page.page import page
from fitting.report.page.steps import choices, chosen_of
from fitting.report.pictures import figures, maps
from fitting.report.text.amounts import amount
from fitting.report.text.diagnosis import samples_text
from fitting.study.preview import before_and_after, p_value_with, suggested
from fitting.study.stages import Stage


def test_every_model_has_its_own_errors_and_p_value(study, diagnosis):
    _, c = study
    before, after = models_of(c, diagnosis, two_steps(c, diagnosis))
    for model, p_value in ((before, "0.001"), (after, "0.37")):
        numbers = [value for value, _ in top.cards(model)]
        assert numbers[0] == amount(model.comparison.rmse, "N")
        assert numbers[1] == amount(model.stage.held_out_rmse, "N")
        assert numbers[-1] == p_value
    assert before.diagnosis is diagnosis
    assert after.diagnosis is None


def test_bars_sentences_and_cards_say_the_same_error(study, diagnosis):
    """Of all samples, though the diagnosis of a step has looked at fewer."""
    task, c = study
    first, last = two_steps(c, diagnosis)
    text = as_read(page(task, c, diagnosis, [first, dataclasses.replace(last, rmse=0.987 * c.rmse)]))
    assert amount(0.987 * c.rmse, "N") not in text
    assert f"The error fell from {amount(first.rmse, 'N')} to {amount(c.rmse, 'N')}." in text


def test_a_model_that_was_not_tested_borrows_no_p_value(study, diagnosis):
    _, c = study
    stages = [dataclasses.replace(stage, diagnosis=None, p_value=None, verdict="") for stage in two_steps(c, diagnosis)]
    for model in models_of(c, None, stages):
        assert top.cards(model)[-1] == ("-", "p in the test that nothing is missing: not tested")


@pytest.mark.parametrize(("enough", "drawn"), [(1.0, "coulomb_friction"), (1e-9, "weight")])
def test_what_is_drawn_below_the_headline_is_what_the_headline_names(study, diagnosis, enough, drawn):
    """What was added, where that explains enough; not what leads in the little that is left."""
    task, c = study
    left = dataclasses.replace(
        diagnosis, verdict=Verdict.NOT_IN_LIBRARY, explanations=(), leading=Leading(("weight",), 0.1, 1.0, 1.0)
    )
    first, last = two_steps(c, diagnosis)
    stages = [first, dataclasses.replace(last, verdict="not in the library", diagnosis=left)]
    models = models_of(c, left, stages)
    said = top.head(models[-1], models, task, enough)
    assert [drawn in meaning.name for meaning in said.meanings] == [True]
    assert said.verdict.startswith("⟦coulomb_friction⟧ explain") is (enough == 1.0)


def test_steps_of_which_one_is_not_known_are_no_models_to_choose(study, diagnosis):
    _, c = study
    known, unknown = two_steps(c, diagnosis)[0], Stage("", 0.3, 0.31, added=("it",))
    models = models_of(c, diagnosis, [known, unknown])
    assert [model.number for model in models] == [0]
    assert choices(models, str) == []


def test_the_table_of_steps_has_the_test_and_the_sizes_of_every_model(study, diagnosis):
    task, c = study
    text = page(task, c, diagnosis, two_steps(c, diagnosis))
    table = text.split("The error, down to the noise</h2>")[1].split("</table>")[0]
    heads, *rows = [re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", row) for row in table.split("</tr>")[:-1]]
    assert heads[1:3] == ["measured", "before"]
    assert len(heads) == 4
    told = {what: cells for what, *cells in rows}
    assert told["p"][1:] == ["0.001", "0.37"]
    sizes = [name for name in c.fit.free if name.startswith("muscle.")]
    assert sizes
    for name in sizes:
        mean, error = c.fit.layout.entry(name).prior
        measured, *values = told[name.removeprefix("muscle.").replace("_", " ")]
        apart = abs(c.fit.values[name] - mean) / error
        assert "+/-" in measured
        assert all(value.endswith(f", {apart:.1f} errors away") for value in values)
    assert list(told) == ["RMS", "on held-out runs", "p", *list(told)[3:-1], "verdict then"]


def test_a_diagnosis_shows_what_would_come_of_it_and_stays_with_its_own_model(study, diagnosis):
    task, c = study
    before, after = before_and_after(task, c, diagnosis, lambda *_: None)
    assert after.rmse < 0.2 * before.rmse  # the spring was put into the data
    assert after.p_value == 0.4  # of the same set of effects in the diagnosis
    text = page(task, c, diagnosis, [before, after], chosen=0)
    assert re.findall(r'id="step(\d)" checked', text) == ["0"]
    first, second = headings(text)
    assert first == "Spring in parallel linear_spring is missing."
    assert second.startswith("With Spring in parallel linear_spring added: the model describes these data")
    assert "is in the model now" not in text
    assert "In this model the sign-flip test finds nothing missing any more (p = 0.4, level 0.01)." in text
    assert "mckibben add" in text


def test_the_evidence_says_which_model_it_is_about_and_its_bars_follow_the_switch(study, diagnosis):
    task, c = study
    before, after = two_steps(c, diagnosis)
    text = page(task, c, diagnosis, [before, dataclasses.replace(after, added=("linear_spring",))])
    section = text.split("which effects could explain the misfit</h2>")[1].split("</section>")[0]
    assert "Model 'before': which effects could explain the misfit</h2>" in html.unescape(text)
    said = re.findall(r'<p class="model m(\d)">(.*?)</p>', html.unescape(section))
    assert [number for number, _ in said] == ["1"]
    assert "This section is about the model 'before', which was diagnosed" in said[0][1]
    assert "finds nothing missing any more (p = 0.37, level 0.01)" in said[0][1]
    rows = re.findall(r'<label class="row (step\d)" for="\1"><span class="name">(.*?)<', section)
    assert rows == [("step0", "model as it is"), ("step1", "+ Spring in parallel ")]


def test_one_model_alone_has_nothing_to_say_of_others(study, diagnosis):
    task, c = study
    text = page(task, c, diagnosis)
    assert "You have chosen" not in text
    assert '<label class="row' not in text


def test_errors_of_fewer_samples_are_said_to_be_so(study, diagnosis):
    task, c = study
    seen = len(diagnosis.baseline.samples)
    assert samples_text(diagnosis, c) == samples_text(diagnosis, None) == []
    force = np.ones(2 * seen, bool)
    given = SimpleNamespace(samples=range(2 * seen), problem=SimpleNamespace(of_force=lambda _: force))
    twice = dataclasses.replace(c, fit=given, rmse=3.97)
    (said,) = samples_text(dataclasses.replace(diagnosis, rmse=4.19), twice)
    assert f"{seen:,} samples of " in said
    assert f"taken evenly from the {2 * seen:,}" in said
    assert "4.19 N over these, is 3.97 N over all samples" in said
    force[0] = False  # a position: a diagnosis reads the motion as force
    (said,) = samples_text(diagnosis, twice)
    assert said.endswith("these suffice to decide.")
    assert "taken evenly" not in page(task, c, diagnosis)  # it has looked at all of these
    before, _ = before_and_after(task, c, diagnosis, lambda *_: None)
    assert before.held_out_rmse == held_out_rmse(c.fit)  # of all samples, as the error after


def test_a_diagnosis_that_suggests_nothing_has_no_model_to_show(study, diagnosis):
    task, c = study
    unsure = dataclasses.replace(diagnosis, verdict="inconclusive", explanations=(), leading=None)
    assert suggested(unsure) == ()
    assert before_and_after(task, c, unsure, lambda *_: None) == ()
    assert p_value_with(diagnosis, ("end_stop",)) is None


def test_what_a_discovery_did_not_keep_is_not_proposed(study, diagnosis):
    task, c = study
    stages = two_steps(c, diagnosis)[:1]
    tried = dataclasses.replace(stages[0], attempts=(Attempt(("linear_spring",), 1.0, 9.0, ()),))
    for given, proposed in ((stages, True), ([tried], False)):
        models = models_of(c, diagnosis, given)
        assert (top.next_command(chosen_of(models), models, task) is not None) is proposed


def test_the_map_shows_where_the_first_model_failed_and_that_the_last_does_not(study, diagnosis):
    task, c = study
    text = page(task, off_by(c, 0), diagnosis, two_steps(c, diagnosis))
    where = text.split("Where it fails</h2>")[1].split("</section>")[0]
    assert where.count('<div class="maps model m0">') == where.count('<div class="maps model m1">') == 2
    assert "below twice the noise, " in as_read(where)


@pytest.mark.parametrize(
    ("times", "colour"),
    [
        (0.0, figures.GREY),
        (1.9, figures.GREY),
        (2.1, figures.VERMILION),
        (-2.1, figures.BLUE),
        (9e2, figures.VERMILION),
    ],
)
def test_a_cell_is_grey_within_the_noise_and_takes_the_colour_of_its_sign(study, times, colour):
    from matplotlib.colors import to_rgb

    _, c = study
    cells = dataclasses.replace(c.cells, mean={b: np.full_like(v, times * c.floor) for b, v in c.cells.mean.items()})
    drawn = maps.branch_maps(dataclasses.replace(c, cells=cells), maps.scale_of([c]))[0]
    mesh = drawn.axes[0].collections[0]
    faces = mesh.to_rgba(mesh.get_array()).reshape(-1, 4)
    assert np.allclose(faces[:, :3], to_rgb(colour), atol=0.01)


def test_all_models_are_drawn_on_one_scale_of_colours(study):
    _, c = study
    small = dataclasses.replace(c, cells=dataclasses.replace(c.cells, mean={b: 0 * v for b, v in c.cells.mean.items()}))
    assert maps.scale_of([c, small]) == maps.scale_of([small, c])
    assert len(maps.scale_of([small]).steps) == 2
    assert np.allclose(maps.scale_of([small]).ends, c.floor * np.array([-5, -2, 2, 5]))


def test_the_page_of_an_addition_asks_on_with_the_model_that_was_saved(tmp_path):
    folder = write(tmp_path / "small", loops(lambda eps, *_: 400 * eps, repeats=2))
    saved, place = tmp_path / "own.toml", tmp_path / "page.html"
    words = ["add", str(folder), "linear_spring", "--baseline", "--save", str(saved), "--html", str(place)]
    result = CliRunner().invoke(main, words)
    assert result.exit_code == 0, result.output
    text = place.read_text(encoding="utf-8")
    following = re.search(r"<p>Is anything still missing\? <code>(.*?)</code></p>", text)
    assert following is not None
    assert following[1] == f"mckibben diagnose {folder} --model {saved}"
    assert re.findall(r'id="step(\d)" checked', text) == ["1"]
    assert "verdict then" not in text
