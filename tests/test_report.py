"""What a user reads: sentences, tables, pictures, the page, and the model file."""

import dataclasses
import re

import numpy as np
import pytest
from small_muscle import loops, write

from fitting import figures
from fitting.compare import compare
from fitting.diagnosis import Diagnosis, Evidence, Explanation, Leading
from fitting.errors import InputError
from fitting.figures import Stage
from fitting.model_file import is_edited, read_model, write_model
from fitting.options import Asked
from fitting.own_effects import library
from fitting.page import page
from fitting.report import comparison_report, console, diagnosis_report, fit_report
from fitting.sentences import amount, kind_in_words, next_command, verdict_in_words, with_error
from fitting.task import fitted, task_of

EVIL = "<script>alert(1)</script> & $x_1 'it'"


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """A data set with a nasty name, its task, its comparison."""
    folder = write(tmp_path_factory.mktemp("study"), loops(lambda eps, *_: 400 * eps, repeats=2), name=EVIL)
    task = task_of(Asked(data=(str(folder),), starts=2))
    return task, compare(fitted(task), task.experiments)


@pytest.fixture(scope="module")
def diagnosis(study):
    """A diagnosis as `diagnose` would give it."""
    _, c = study
    best = Explanation(("linear_spring",), rmse=0.31, held_out_rmse=0.32, fall=9.0, p_value=0.4, adequate=True)
    return Diagnosis(
        verdict="missing", negligible=False, explanations=(("linear_spring",),), classes=(("weight", "force_offset"),),
        nearest=(), leading=Leading(("linear_spring",), 0.98, 0.32, 4.0), p_value=0.001, level=0.01,
        rests_on="signs of 6 loops flipped", rmse=c.rmse, held_out_rmse=1.1 * c.rmse, noise_floor=0.3,
        full_scale=c.full_scale,
        effects={
            "linear_spring": Evidence("linear_spring", 0.01, 0.31, 0.32, 0.2, 0.1, {"end_stop": 0.9},
                                      {"K": (1600.0, 20.0)}, True),
            "viscous_damping": Evidence("viscous_damping", 0.9, c.rmse, 1.1 * c.rmse, 0.2, 0.1),
            "mullins": Evidence("mullins", reason="cannot be tested: needs rubber"),
        },
        tried=(best,), baseline=c.fit, residual=c.fit.residual, notes=(),
    )  # fmt: skip


def text_of(shown):
    out = console()
    with out.capture() as captured:
        for thing in shown:
            out.print(thing)
    return captured.get()


# ------------------------------------------------------------------------------------------------------------ the page


def test_the_page_needs_no_network_and_no_script(study, diagnosis):
    task, c = study
    text = page(task, c, diagnosis, [Stage("baseline", 5.0, 6.0, "missing"), Stage("+ linear_spring", 0.3, 0.31)])
    without_namespaces = re.sub(r'xmlns(:\w+)?="[^"]*"', "", text)
    assert "http://" not in without_namespaces.replace("http://www.w3.org", "")
    assert "https://" not in without_namespaces
    assert not re.search(r"<(script|link|img|iframe|image)\b", text)
    assert "default-src 'none'" in text
    assert len(text.encode()) < 10e6


def test_names_from_files_are_escaped_on_the_page(study, diagnosis):
    task, c = study
    text = page(task, c, diagnosis)
    assert EVIL not in text
    assert "&lt;script&gt;" in text


def test_the_page_begins_with_the_verdict_and_holds_every_part(study, diagnosis):
    text = page(*study, diagnosis)
    assert "linear_spring is missing." in re.search(r"<h1>(.*?)</h1>", text)[1]
    for title in ("The error, down to the noise", "Measured and model", "Where it fails", "Which effects",
                  "Parameters", "Where this comes from"):  # fmt: skip
        assert title in text
    assert study[0].experiments[0].sha256 in text
    assert "K = 1.600 +/- 0.020 N/mm" in text


def test_text_in_pictures_is_text_in_the_colour_of_the_page(study):
    svg = figures.as_svg(figures.residual_map(study[1]), "map")
    assert re.search(r"<text[^>]*fill: currentColor[^>]*>pressure \[kPa\]</text>", svg)
    assert figures.INK not in svg
    assert "<image" not in svg
    assert 'id="map-' in svg


def test_pictures_of_one_page_share_no_names(study):
    pictures = [figures.as_svg(figures.waterfall([Stage("a", 1.0, None)], 0.5), name) for name in ("one", "two")]
    first, second = (set(re.findall(r'id="([^"]+)"', svg)) for svg in pictures)
    assert first
    assert not first & second


def test_a_long_recording_still_makes_a_small_page(tmp_path):
    folder = write(tmp_path, loops(points=1500, pressures=(1e5, 2e5, 3e5, 4e5)))
    task = task_of(Asked(data=(str(folder),), starts=1))
    assert len(page(task, compare(fitted(task), task.experiments))) < 2e6


# ---------------------------------------------------------------------------------------------------------- the words


def test_the_terminal_says_the_error_where_and_what_kind(study):
    words = text_of(comparison_report(study[1]))
    assert "of full scale" in words
    assert "the same in both directions" in words
    assert "repeated loops agree to" in words
    assert "by pressure" in words


def test_the_terminal_says_what_is_missing_what_is_not_and_what_cannot_be_seen(diagnosis):
    words = text_of(diagnosis_report(diagnosis))
    assert "VERDICT   linear_spring is missing." in words
    assert "NOT IT    viscous_damping" in words
    assert "mullins: cannot be tested: needs rubber" in words
    assert next_command(diagnosis, ["here"]) == "mckibben add here linear_spring"


@pytest.mark.parametrize(
    ("verdict", "explanations", "words"),
    [
        ("nothing detectable", (), "Nothing is missing that these data could show."),
        ("one of", (("tip",), ("dead_band", "weight")), "cannot tell which: tip; dead_band with weight."),
        ("not in the library", (), "no effect of the library explains all of it"),
        ("inconclusive", (), "cannot say"),
    ],
)
def test_every_verdict_has_its_sentence(diagnosis, verdict, explanations, words):
    assert words in verdict_in_words(dataclasses.replace(diagnosis, verdict=verdict, explanations=explanations))


def test_warnings_name_bounds_ties_and_what_is_held(study):
    fit = dataclasses.replace(study[1].fit, at_bound=("muscle.radius",), held=("x.y",), converged=False)
    words = " ".join(text_of(fit_report(fit)).split())
    for part in ("did not converge", "muscle.radius lies at an end of its range", "cannot see them: x.y"):
        assert part in words


def test_noise_has_no_kind(study):
    c = dataclasses.replace(study[1], rmse=0.3)
    assert "mostly noise" in kind_in_words(c)


@pytest.mark.parametrize(
    ("value", "unit", "shown"),
    [
        (1063.4, "N", "1063 N"), (0.6, "N", "0.6 N"), (0.00012, "m", "0.12 mm"), (0.0, "N", "0 N"),
        (12345.6, "N", "12346 N"),
    ],
)
def test_amounts_are_written_without_powers_of_ten(value, unit, shown):
    assert amount(value, unit) == shown


def test_a_value_goes_as_far_as_its_error():
    assert with_error(0.00710014, 0.000032, "m") == ("7.100 mm", "0.032 mm")
    assert with_error(0.5, float("nan"), "1") == ("0.5", "")


# ------------------------------------------------------------------------------------------------------ the model file


def test_a_model_file_gives_back_what_was_written(study, tmp_path):
    task, c = study
    path = tmp_path / "model.toml"
    assert write_model(path, c.fit, task.experiments) is None
    found = read_model(path, library())
    assert [type(effect).__name__ for effect in found.effects] == ["IdealCylinder", "CoulombFriction"]
    for name, value in found.values.items():
        assert value == pytest.approx(c.fit.values[name], rel=1e-9)
    assert found.states["coulomb_friction.f_s"] == "fitted"
    assert found.states["muscle.length"] == "fixed"
    assert found.fitted_to(task.experiments)
    np.testing.assert_allclose(float(found.muscle.radius), c.fit.values["muscle.radius"], rtol=1e-9)


def test_a_model_file_that_was_edited_is_left_alone(study, tmp_path):
    task, c = study
    path = tmp_path / "model.toml"
    write_model(path, c.fit, task.experiments)
    assert not is_edited(path)
    assert write_model(path, c.fit, task.experiments) is None  # its own it may replace
    path.write_text(path.read_text().replace("fitted", "fixed", 1))
    before = path.read_text()
    assert "left alone" in write_model(path, c.fit, task.experiments)
    assert path.read_text() == before


def test_a_place_that_cannot_be_written_to_is_said(study, tmp_path):
    task, c = study
    assert "cannot be written" in write_model(tmp_path / "nowhere" / "model.toml", c.fit, task.experiments)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("format = 1", "format = 2"), "newer program"),
        (('"coulomb_friction"', '"coulomb_fricton"'), "did you mean 'coulomb_friction'"),
        (("f_s = ", "f_t = "), "did you mean 'f_s'"),
        (('state = "fitted"}', 'state = "fited"}'), "did you mean 'fitted'"),
        (("radius = {value = \"", "radius = {value = \"? "), "not a number"),
    ],
)
def test_a_model_file_with_a_slip_is_refused_with_the_cure(study, tmp_path, change, words):
    task, c = study
    path = tmp_path / "model.toml"
    write_model(path, c.fit, task.experiments)
    path.write_text(path.read_text().replace(*change))
    with pytest.raises(InputError) as error:
        read_model(path, library())
    assert words in str(error.value)
    assert str(path) in str(error.value)
