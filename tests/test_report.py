"""What a user reads: sentences, tables, pictures, the page, and the model file."""

import dataclasses
import json
import re
from types import SimpleNamespace

import numpy as np
import pytest
from browser import Watched, browser, violations
from click.testing import CliRunner
from small_muscle import loops, write

from fitting import figures, units
from fitting.cli import main
from fitting.compare import compare
from fitting.console.discovering import discovered
from fitting.console.options import Asked
from fitting.console.task import fitted, task_of
from fitting.diagnosis.record import Diagnosis, Evidence, Explanation, Leading
from fitting.errors import InputError
from fitting.figures import Stage
from fitting.reading.model_file import is_edited, read_model, write_model
from fitting.reading.own_effects import library
from fitting.records import Run
from fitting.report import comparison_report, console, diagnosis_report, fit_report
from fitting.showing import maps
from fitting.showing.alike_groups import groups
from fitting.showing.loops_picture import frame
from fitting.showing.page import Section, page
from fitting.showing.panels import Panel, panels
from fitting.showing.sentences import amount, kind_in_words, next_command, verdict_in_words, with_error
from mckibben_jax.effects import LinearSpring

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
            "linear_spring": Evidence("linear_spring", 0.01, 0.31, 0.32, 0.2, 0.1, {"end_stop": 0.95},
                                      {"K": (1600.0, 20.0)}, True),
            "viscous_damping": Evidence("viscous_damping", 0.9, c.rmse, 1.1 * c.rmse, 0.2, 0.1),
            "end_stop": Evidence("end_stop", 0.9, c.rmse, 1.1 * c.rmse, 0.2, 0.1, {"linear_spring": 0.95}),
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
    svg = figures.as_svg(maps.residual_map(study[1]), "map")
    assert re.search(r"<text[^>]*fill: currentColor[^>]*>pressure \[kPa\]</text>", svg)
    assert figures.INK not in svg
    assert "<image" not in svg
    assert 'id="map-' in svg


def test_pictures_of_one_page_share_no_names(study):
    pictures = [figures.as_svg(figures.waterfall([Stage("a", 1.0, None)], 0.5), name) for name in ("one", "two")]
    first, second = (set(re.findall(r'id="([^"]+)"', svg)) for svg in pictures)
    assert first
    assert not first & second


def test_each_step_has_its_bar_and_its_model_and_shows_without_a_script(study, diagnosis):
    task, c = study
    left = c.fit.residual
    stages = [Stage("baseline", 5.0, 6.0, "missing", left + 4), Stage("+ it", c.rmse, 1.1, "", left)]
    text = page(task, c, diagnosis, stages)
    assert text.count('type="radio" name="step"') == 2
    assert "main:has(#step0:checked) .model:not(.m0) { display: none; }" in text
    lines = re.findall(r'<g class="model m([01])">(.*?)</g>', text)
    assert [number for number, _ in lines] == ["0", "1"] * 3
    assert all(first != last for (_, first), (_, last) in zip(lines[::2], lines[1::2], strict=True))


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_page_can_be_read_by_everybody_and_follows_a_click(study, diagnosis, tmp_path, scheme):
    """In a browser: an accessibility check of all of it; a bar shows its model; at 390 px nothing sticks out."""
    task, c = study
    left = c.fit.residual
    stages = [Stage("baseline", 5.0, 6.0, "missing", left + 4), Stage("+ it", c.rmse, 1.1, "", left)]
    place = tmp_path / "page.html"
    place.write_text(page(task, c, diagnosis, stages), encoding="utf-8")
    with browser() as chromium:
        watched = Watched(chromium.new_page(viewport={"width": 1280, "height": 900}, color_scheme=scheme))
        shown = watched.page
        shown.goto(place.as_uri())
        shown.evaluate("document.querySelectorAll('details').forEach(part => { part.open = true; })")
        assert violations(shown) == []
        visible = [shown.locator(f".loops g.m{k}").first.is_visible() for k in (0, 1)]
        assert visible == [False, True]
        shown.get_by_text("baseline").first.click()
        visible = [shown.locator(f".loops g.m{k}").first.is_visible() for k in (0, 1)]
        assert visible == [True, False]
        shown.set_viewport_size({"width": 390, "height": 844})
        assert shown.evaluate("document.documentElement.scrollWidth") <= 390
        small = shown.evaluate(SMALL_LABELS)
        assert small == []
        watched.check()


# words in pictures that are too small to read: letters below 7 px on this screen
SMALL_LABELS = """() => [...document.querySelectorAll("svg text")].filter(word => {
  const drawn = word.getScreenCTM();
  const letters = parseFloat(getComputedStyle(word).fontSize) * Math.hypot(drawn.a, drawn.b);
  return word.getBoundingClientRect().width > 0 && letters < 7;
}).map(word => word.textContent)"""


def test_every_step_of_a_discovery_can_be_chosen(study):
    task, _ = study
    found = discovered(task, [LinearSpring()], lambda *_: None)
    assert [stage.added for stage in found.stages] == ["baseline", "+ linear_spring"]
    for stage in found.stages:
        assert np.sqrt(np.mean(stage.residual**2)) == pytest.approx(stage.rmse, rel=0.01)
    text = page(found.task, found.comparison, found.diagnosis, found.stages)
    assert text.count('type="radio" name="step"') == 2
    assert re.search(r"<h1>With linear_spring added: .*</h1>", text)


def test_steps_whose_models_are_unknown_have_bars_alone(study):
    text = page(*study, None, [Stage("a", 5.0, 6.0), Stage("b", 0.3, 0.31)])
    assert 'name="step"' not in text
    assert text.count('class="row"') == 2


@pytest.mark.parametrize(
    ("last", "said"),
    [("nothing detectable", "With it added: linear_spring is missing."),
     ("", "Before it added: linear_spring is missing.")],
)  # fmt: skip
def test_the_title_says_which_model_the_verdict_is_of(study, diagnosis, last, said):
    stages = [Stage("baseline", 5.0, 6.0, "missing"), Stage("+ it", 0.3, 0.31, last)]
    assert f"<h1>{said}</h1>" in page(*study, diagnosis, stages)


def test_the_misfit_can_be_switched_from_branches_to_parity(study):
    text = page(*study)
    assert 'id="map-branch" checked' in text
    for words in ("contracting", "even: the same in both directions", "odd: changes its sign", "pressure [kPa]"):
        assert words in text


def test_terms_are_explained_and_likes_are_mapped(study, diagnosis):
    text = page(*study, diagnosis)
    for words in ("noticed from", "imitated", "4 of 5 recordings", "Which effects look alike here"):
        assert words in text
    rows = re.findall(r"<li>(.*?)</li>", text)
    assert rows == ["<b>linear_spring</b> <span>end_stop</span> <i>at least 0.95 alike</i>"]


def test_who_looks_like_whom_stands_in_groups(diagnosis):
    alike = {("a", "b"): 0.99, ("b", "c"): 0.95, ("a", "c"): 0.93, ("d", "e"): 1.0, ("c", "d"): 0.4}
    pairs = alike | {(b, a): value for (a, b), value in alike.items()}
    known = {n: Evidence(n, 0.5, alike={b: v for (a, b), v in pairs.items() if a == n}) for n in "abcde"}
    found = groups(dataclasses.replace(diagnosis, effects=known, explanations=(("d",),), leading=None))
    assert [(set(group.names), group.least) for group in found] == [({"d", "e"}, 1.0), ({"a", "b", "c"}, 0.93)]


def test_the_page_says_what_the_named_effect_is_and_how_to_add_it(study, diagnosis):
    text = page(*study, diagnosis)
    said = re.search(r'<p class="meaning"><b>linear_spring</b>: (.*?)</p>', text)[1]
    assert said == "A spring in parallel pulls back in proportion to the stroke: K l0 eps."
    assert f"mckibben add {study[0].experiments[0].folder} linear_spring" in text
    assert f"mckibben diagnose {study[0].experiments[0].folder}" in page(*study)


def test_what_was_added_is_no_longer_called_missing(study, diagnosis):
    task, c = study
    names = dataclasses.replace(diagnosis, explanations=(("coulomb_friction",),))
    text = page(task, c, names)
    assert "coulomb_friction was missing, and is in the model now." in text
    assert "mckibben add" not in text


def test_a_plan_and_a_posterior_stand_on_the_page(study):
    planned = SimpleNamespace(what="one loop at 50 kPa", why="the spring shows there", power=0.93)
    text = page(*study, planned=planned, posterior=[Section("Sampled", plain="tip.k   1.12")])
    assert "One loop at 50 kPa: the spring shows there." in text
    assert "93 %" in text
    assert "<pre>tip.k   1.12</pre>" in text


@pytest.mark.slow
def test_a_posterior_of_this_model_stands_on_the_report_and_no_other(tmp_path):
    folder = write(tmp_path / "small", loops(repeats=2))
    run = lambda *words: CliRunner().invoke(main, [words[0], str(folder), *words[1:], "--seed", "3"])  # noqa: E731
    sampled = run("posterior", "--steps", "400", "--json", str(tmp_path / "p.json"))
    assert sampled.exit_code in (0, 3), sampled.output  # three: so short a chain has not settled
    page_of = lambda *words: run("report", "--no-diagnosis", "--html", str(tmp_path / "r.html"), *words)  # noqa: E731
    shown = page_of()
    assert shown.exit_code == 0, shown.output
    text = (tmp_path / "r.html").read_text(encoding="utf-8")
    median = json.loads((tmp_path / "p.json").read_text())["parameters"]["coulomb_friction.f_s"]["median"]
    assert "What is known" in text
    assert f"{median:.3g}" in text
    other = page_of("--effects", "ideal_cylinder", "textile_friction")
    assert "holds no posterior of this model" in " ".join(other.output.split())
    assert "What is known" not in (tmp_path / "r.html").read_text(encoding="utf-8")


def test_measured_points_lie_where_their_axes_say(study):
    task, c = study
    panel = panels(task.experiments, c.fit.samples, c.fit.residual)[0]
    placed = frame(panel, 0, [c.fit.residual])
    x, y, width, height = placed.window.place
    at = np.array([[float(v) for v in point.split()] for point in re.findall(r"M([\d. -]+)h0", placed.opening)])
    assert np.all((at[:, 0] > x) & (at[:, 0] < x + width))
    assert np.all((at[:, 1] > y) & (at[:, 1] < y + height))
    top = np.argmin(at[:, 1])
    value = (at[top, 1] - placed.window.origin[1]) / placed.window.scale[1]
    assert panel.measured.max() == pytest.approx(value, rel=0.01)


def test_a_small_misfit_shows_in_a_strip_of_its_own(study):
    """Half a newton beside hundreds: on the axes of the force nobody sees it; the strip is scaled to it."""
    task, c = study
    panel = panels(task.experiments, c.fit.samples, c.fit.residual)[0]
    missed = 0.5 * np.sin(np.arange(len(c.fit.residual)))
    placed = frame(panel, 0, [missed])
    drawn = placed.misfit(panel.model(missed) - panel.measured)
    _, top, _, height = placed.strip.place
    at = np.array([float(v) for v in re.findall(r"M[\d.-]+ ([\d.-]+)h0", drawn)])
    assert np.all((at > top) & (at < top + height))
    assert np.ptp(at) > 0.8 * height
    assert "misfit, &#177; 0.5 N" in drawn
    band = float(re.search(r'class="noise" d=".*?v([\d.]+)h', drawn)[1])
    assert band == pytest.approx(height, abs=0.1)  # two standard deviations of 0.3 N are more than all of it


def test_runs_of_one_name_in_two_files_are_told_apart(tmp_path):
    extra = 'noise = "0.3 N"\n[[recording]]\nfile = "tuesday.csv"\ntest = "loop"'
    folder = write(tmp_path, loops(repeats=1), extra=extra)
    rows = loops(repeats=1, seed=1)
    write(tmp_path / "other", rows)
    (tmp_path / "other" / "loops.csv").rename(folder / "tuesday.csv")
    task = task_of(Asked(data=(str(folder),), starts=1))
    c = compare(fitted(task), task.experiments)
    labels = [panel.label for panel in panels(task.experiments, c.fit.samples, c.fit.residual)]
    assert labels[0] == "loops.csv, run 0, 100 kPa"
    assert labels[3] == "tuesday.csv, run 0, 100 kPa"
    assert len(set(labels)) == 6


def test_the_page_speaks_in_the_units_of_the_data(tmp_path):
    """Loops in psi, inches and pounds: the axes, tables and parameters too, and JSON in SI."""
    folder = write(tmp_path, [])
    head = "run,time [s],pressure [psi],displacement [in],force [lbf]"
    rows = [f"{r},{t:.3f},{p / 6894.757:.5f},{x / 0.0254:.7f},{f / 4.4482216:.6f}" for r, t, p, x, f in loops()]
    (folder / "loops.csv").write_text("\n".join([head, *rows]) + "\n", encoding="utf-8")
    result = CliRunner().invoke(main, ["compare", str(folder), "--html", str(tmp_path / "x.html"),
                                       "--json", str(tmp_path / "x.json")])  # fmt: skip
    assert result.exit_code == 0, result.output
    text = (tmp_path / "x.html").read_text(encoding="utf-8")
    for words in ("force [lbf]", "pressure [psi]", "rms [lbf]", "14.5 psi", " in</td>"):
        assert words in text, words
    for words in ("kPa", " mm<", "[N]", " N<"):
        assert words not in text, words
    assert "psi" in result.output
    assert "kPa" not in result.output
    found = json.loads((tmp_path / "x.json").read_text())
    full_scale = float(re.search(r"of full scale, ([\d.]+) lbf", text)[1])
    assert found["full_scale_N"] == pytest.approx(4.448 * full_scale, rel=0.01)
    assert units.show(1e5, "Pa") == "100 kPa"  # and nothing of it is left behind


def test_thinning_keeps_the_corners_of_every_loop():
    count = 200_000
    eps = 0.1 * (1 - np.cos(np.linspace(0, 4 * np.pi, count)))
    half = np.searchsorted([count // 4, count // 2, 3 * count // 4], np.arange(count), side="right")
    force = np.where(half % 2, 100.0, 50.0) - 200 * eps
    force[31_415] = 400.0  # a single spike
    panel = panel_of(eps, force, half)
    kept = panel.shown(force)
    assert sum(map(len, kept)) <= 400
    for part, branch in zip(kept, range(4), strict=True):
        mine = np.flatnonzero(half == branch)
        assert (part[0], part[-1]) == (mine[0], mine[-1])
    assert 31_415 in np.concatenate(kept)
    assert panel.is_thinned


def panel_of(eps, force, half):
    zero = np.zeros(len(eps))
    run = Run("1", np.arange(len(eps)) * 1e-3, zero + 1e5, eps, zero, zero, force, zero + 1, np.where(half % 2, -1, 1),
              half // 2, half, np.arange(len(eps)))  # fmt: skip
    place = np.arange(len(eps))
    return Panel("1", "100 kPa", run, place, place, "loop", "N", eps, "contraction", 1.0)


@pytest.mark.slow
def test_a_million_samples_make_a_page_below_ten_megabytes(tmp_path):
    folder = write(tmp_path, loops(points=10_000, pressures=tuple(np.linspace(1e5, 5e5, 10)), repeats=5))
    task = task_of(Asked(data=(str(folder),), starts=1))
    text = page(task, compare(fitted(task), task.experiments))
    assert sum(len(run) for run in task.experiments[0].recordings[0].runs) > 990_000
    assert len(text.encode()) < 10e6
    assert "Thinned for drawing" in text


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
        ("one of", (("tip",), ("dead_band", "weight")), "cannot tell which: tip; dead_band + weight."),
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
