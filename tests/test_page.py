"""The page: it needs no network, can be read by everybody, and holds every part."""

import dataclasses
import html
import json
import re
import shlex
from pathlib import Path

import numpy as np
import pytest
from browser import Watched, browser, violations
from click.testing import CliRunner
from small_muscle import loops, write
from studied import EVIL, as_read, headings, nothing_missing, proposed, seen_through, two_steps, without_code

from fitting import showing
from fitting.cli.main import main
from fitting.diagnosis.findings import Attempt, Fault, Objection
from fitting.diagnosis.outcomes import Verdict
from fitting.diagnosis.record import Evidence
from fitting.least_squares.force_band import ForceBand
from fitting.report.page.names import PageNames
from fitting.report.page.page import page
from fitting.report.page.parts import Section
from fitting.report.page.similar_groups import groups
from fitting.report.results import shown_names
from fitting.report.text.amounts import amount
from fitting.report.text.attempts import attempt_text
from fitting.report.text.diagnosis import verdict_text
from fitting.report.text.next_step import HOLD
from fitting.report.text.stages import stage_text
from fitting.study.discovering import discover_task
from fitting.study.stages import Stage
from mckibben_jax.effects import LinearSpring


def test_the_page_needs_no_network(study, diagnosis):
    """Of scripts it holds its own alone: tests/test_page_live.py."""
    task, c = study
    text = without_code(page(
        task, c, diagnosis, [Stage("baseline", 5.0, 6.0, "missing"), Stage("", 0.3, 0.31, added=("linear_spring",))]
    ))  # fmt: skip
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
    assert headings(text) == ["Spring in parallel linear_spring is missing."]
    assert "10.1177/1045389X11435435" in text
    titles = re.findall(r"<h2>(.*?)</h2>", text)
    assert [title for title in titles if not title.startswith("Instruments")] == [
        "The misfit of all runs at once", "Where it fails", "The error, down to the noise",
        "Measured and model, run by run", "Which effects could explain the misfit",
        "Which effects are similar in these data", "Parameters", "How to cite", "Where this comes from",
    ]  # fmt: skip
    assert study[0].experiments[0].sha256 in text
    assert "K = 1.600 +/- 0.020 N/mm" in text


def test_the_page_says_how_far_readings_of_a_new_run_lie(study):
    task, c = study
    scores = tuple(0.05 * np.arange(1, 51) for _ in range(10))
    band = ForceBand("loop", 10, True, scores, np.zeros((10, 1)))
    text = page(task, dataclasses.replace(c, bands=(band,)))
    assert "± 2.25 N" in text  # the 45th of 50 readings of every run
    assert "holds 9 readings of 10 of a new loop run" in text
    assert "Record another loop run like these 10: 9 readings of 10 will lie within +/-2.25 N" in text
    few = page(task, dataclasses.replace(c, bands=(dataclasses.replace(band, runs=8, scores=scores[:8]),)))
    assert "9 runs are needed, and there are 8" in few
    assert "of a new loop run</" not in few


def test_a_size_that_the_caliper_denies_is_warned_of_and_stands_beside_the_measured_one(study, diagnosis):
    task, c = study
    name = next(n for n in c.fit.free if n in shown_names(c.fit))
    value = c.fit.values[name]

    def stated(errors: float) -> str:
        prior = (value * 0.9, abs(value) * 0.1 / errors)
        entries = tuple(dataclasses.replace(e, prior=prior if e.name == name else None) for e in c.fit.layout.entries)
        layout = dataclasses.replace(c.fit.layout, entries=entries)
        return page(task, dataclasses.replace(c, fit=dataclasses.replace(c.fit, layout=layout)), diagnosis)

    assert "was measured, 20 errors apart). A model that needs this is wrong somewhere (--fix" in stated(20.0)
    assert "errors apart" not in stated(2.9)
    assert "2.9 errors</td>" in stated(2.9)


def test_the_command_on_the_page_can_be_pasted(study, diagnosis):
    """Quoted once, whatever the folder is called; where nothing is to be added, the measured sizes are held."""
    task, c = study
    folder = Path("my muscle №1")
    named = dataclasses.replace(task, experiments=[dataclasses.replace(task.experiments[0], folder=folder)])
    unsure = dataclasses.replace(diagnosis, verdict="inconclusive", explanations=(), leading=None)
    nobodys = dataclasses.replace(diagnosis, verdict="not in the library", explanations=(), leading=None)
    told = [
        re.search(r"<p>([^<]*:|[^<]*\?) <code>(mckibben [^<]*)</code></p>", page(named, c, d))
        for d in (diagnosis, nobodys, unsure, None)
    ]
    assert [shlex.split(html.unescape(one[2])) for one in told if one] == [
        ["mckibben", "add", str(folder), "linear_spring"],
        *[["mckibben", "diagnose", str(folder), "--fix", "muscle.radius", "muscle.braid_angle"]] * 2,
        ["mckibben", "diagnose", str(folder)],
    ]
    assert [one[1] for one in told if one] == [
        "Put it into the model:", HOLD, HOLD, "Which effect is missing?",
    ]  # fmt: skip


def test_each_step_has_its_bar_and_its_model_and_shows_without_a_script(study, diagnosis):
    task, c = study
    text = page(task, c, diagnosis, two_steps(c, diagnosis))
    assert text.count('type="radio" name="step"') == 2
    assert text.count('<label class="row step') == 3  # two steps, and the model as it is beside what would explain it
    assert "main:has(#step0:checked) .model:not(.m0) { display: none; }" in text
    lines = re.findall(r'<g class="model m([01])">(.*?)</g>', text)
    assert [number for number, _ in lines] == ["0", "1"] * 5  # of all runs at once in two shapes, and of three runs
    assert all(first != last for (_, first), (_, last) in zip(lines[::2], lines[1::2], strict=True))


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_page_can_be_read_by_everybody_and_follows_a_click(study, diagnosis, tmp_path, scheme):
    """In a browser: an accessibility check of all of it; a bar shows its model; at 390 px nothing sticks out."""
    task, c = study
    stages = two_steps(c, diagnosis)
    place = tmp_path / "page.html"
    place.write_text(page(task, c, diagnosis, stages), encoding="utf-8")
    with browser() as chromium:
        from playwright.sync_api import expect  # not everybody has a browser

        watched = Watched(chromium.new_page(viewport={"width": 1280, "height": 900}, color_scheme=scheme))
        shown = watched.page
        shown.goto(place.as_uri())
        shown.evaluate("document.querySelectorAll('details').forEach(part => { part.open = true; })")
        assert violations(shown) == []
        shows_only(shown, 1)
        shown.get_by_role("radio", name="after").focus()
        assert shown.evaluate("getComputedStyle(document.activeElement).outlineStyle") == "solid"
        shown.keyboard.press("ArrowUp")  # from the last model to the first and back, without a mouse
        shows_only(shown, 0)
        shown.keyboard.press("ArrowDown")
        shows_only(shown, 1)
        shown.locator(".fall label").first.click()
        shows_only(shown, 0)
        assert violations(shown) == []
        expect(shown.locator(".overview .broad g.m1")).to_have_css("opacity", "0.3")  # pale, once it has faded
        expect(shown.locator(".overview .broad g.m0")).to_have_css("opacity", "1")
        shown.set_viewport_size({"width": 390, "height": 844})
        shown.wait_for_function("document.documentElement.scrollWidth <= 390")  # pictures follow a frame later
        assert shown.evaluate(WIDER_THAN_SHOWN) == []
        small = shown.evaluate(SMALL_LABELS)
        assert small == []
        watched.check()


PARTS = (".loops g.m{}", ".stack.branch > .m{}", "h1", ".cards", ".loops b.m{}", "section.m{}")


def shows_only(shown, number):
    """Every part of the page shows this model and not the other one."""
    from playwright.sync_api import expect

    assert shown.locator(f"#step{number}").is_checked()
    for part in PARTS:
        for k in (0, 1):
            one = shown.locator(part.format(k) if "{}" in part else f".m{k} {part}").first
            expect(one).to_be_visible() if k == number else expect(one).to_be_hidden()


# words in pictures that are too small to read: letters below 7 px on this screen
WIDER_THAN_SHOWN = """() => [...document.querySelectorAll(".overview, .loops, .maps, .fall")].filter(part =>
  part.scrollWidth > part.clientWidth || part.getBoundingClientRect().right > innerWidth
).map(part => part.className)"""
SMALL_LABELS = """() => [...document.querySelectorAll("svg text")].filter(word => {
  const drawn = word.getScreenCTM();
  const letters = parseFloat(getComputedStyle(word).fontSize) * Math.hypot(drawn.a, drawn.b);
  return word.getBoundingClientRect().width > 0 && letters < 7;
}).map(word => word.textContent)"""


def test_every_step_of_a_discovery_can_be_chosen(study):
    task, _ = study
    found = discover_task(task, [LinearSpring()], lambda *_: None)
    assert [stage_text(stage) for stage in found.stages] == ["baseline", "+ ⟦linear_spring⟧"]
    for stage in found.stages:
        assert np.sqrt(np.mean(stage.residual**2)) == pytest.approx(stage.rmse, rel=0.01)
    text = page(found.task, found.comparison, found.diagnosis, found.stages)
    assert text.count('type="radio" name="step"') == 2
    before, after = headings(text)
    assert before.startswith("Spring in parallel linear_spring is missing")
    assert re.fullmatch(r"Spring in parallel linear_spring explains all but [\d.]+ % of full scale\.", after)
    last = as_read(re.search(r'<div class="model m1">(.*?)\n</div>', text, flags=re.DOTALL)[1])
    assert "What is left is below 1 %" in last  # and below it what the test says of the rest
    assert PageNames().plain(verdict_text(found.stages[1].diagnosis)) in last
    for stage in found.stages:  # the p-value and the errors of a model stand on one card each, and nowhere mixed
        number = found.stages.index(stage)
        top = as_read(re.search(rf'<div class="model m{number}">(.*?)\n</div>', text, flags=re.DOTALL)[1])
        assert f"{stage.diagnosis.p_value:.2g}p in the test that nothing is missing" in top
        assert f"{amount(stage.comparison.rmse, 'N')}error, root mean square" in top


def test_the_page_says_why_what_the_verdict_names_was_not_added(study):
    """Beside the verdict: a reader who asks for it finds nothing in a fold far below."""
    task, _ = study
    first, *_ = discover_task(task, [LinearSpring()], lambda *_: None).stages
    refused = Attempt(("linear_spring",), 1.5, 1.6, (Objection(Fault.BOUND, "linear_spring.K"),))
    other = dataclasses.replace(refused, effects=("weight",))
    stages = [
        dataclasses.replace(first, rmse=50.0, diagnosis=None),
        dataclasses.replace(first, added=("tip",), attempts=(refused, other)),
    ]
    text = page(task, first.comparison, first.diagnosis, stages)
    top = as_read(re.search(r'<div class="model m1">(.*?)\n</div>', text, flags=re.DOTALL)[1])
    why = "was tried (1.5 N, on held-out runs 1.6 N) and is not kept: stiffness in parallel linear_spring.K ends at its"
    assert f"Spring in parallel linear_spring {why}" in top
    assert "weight was tried" not in top
    held = attempt_text(dataclasses.replace(refused, confined=True), "N")
    assert "(1.5 N, on held-out runs 1.6 N, with the sizes of the muscle kept to what was measured)" in held


def test_steps_whose_models_are_unknown_have_bars_alone(study):
    text = without_code(page(*study, None, [Stage("a", 5.0, 6.0), Stage("b", 0.3, 0.31)]))
    assert 'name="step"' not in text
    assert text.count('class="row"') == 2


@pytest.mark.parametrize(
    ("last", "said"),
    [("nothing detectable", "With it added: Spring in parallel linear_spring is missing."),
     ("", "Before it added: Spring in parallel linear_spring is missing.")],
)  # fmt: skip
def test_the_title_says_which_model_the_verdict_is_of(study, diagnosis, last, said):
    stages = [Stage("baseline", 5.0, 6.0, "missing"), Stage("", 0.3, 0.31, last, added=("it",))]
    assert headings(page(*study, diagnosis, stages)) == [said]


def test_the_misfit_can_be_switched_from_branches_to_parity(study):
    text = page(*study)
    assert 'id="map-branch" checked' in text
    for words in ("contracting", "even: the same in both directions", "odd: changes its sign", "pressure [kPa]"):
        assert words in text


def test_terms_are_explained_and_likes_are_mapped(study, diagnosis):
    text = page(*study, diagnosis)
    heads = ("smallest detectable size", "absorbed by other parameters", "4 of 5 recordings")
    for words in (*heads, "Which effects are similar"):
        assert words in text
    rows = re.findall(r"<li>(.*?)</li>", text)
    assert [as_read(row) for row in rows] == [
        "Spring in parallel linear_spring End stop end_stop similarity of at least 0.95"
    ]
    assert rows[0].startswith("<b>Spring in parallel")


def test_who_looks_like_whom_stands_in_groups(diagnosis):
    alike = {("a", "b"): 0.99, ("b", "c"): 0.95, ("a", "c"): 0.93, ("d", "e"): 1.0, ("c", "d"): 0.4}
    pairs = alike | {(b, a): value for (a, b), value in alike.items()}
    known = {n: Evidence(n, 0.5, similar={b: v for (a, b), v in pairs.items() if a == n}) for n in "abcde"}
    found = groups(dataclasses.replace(diagnosis, effects=known, explanations=(("d",),), leading=None))
    assert [(set(group.names), group.least) for group in found] == [({"d", "e"}, 1.0), ({"a", "b", "c"}, 0.93)]


def test_the_page_says_what_the_named_effect_is_and_how_to_add_it(study, diagnosis):
    text = page(*study, diagnosis)
    told = re.search(r'<p class="meaning">(.*?)</p>', text)[1]
    before, law = told.split(' <span class="law"')
    said = as_read(before)
    meaning = "A spring in parallel pulls back in proportion to the stroke: K l0 eps."
    assert said == f"Spring in parallel linear_spring: {meaning}"
    assert "<mfrac><mi>K</mi><mn>2</mn></mfrac>" in law  # of the energy, drawn
    assert f"mckibben add {study[0].experiments[0].folder} linear_spring" in text
    assert f"mckibben diagnose {study[0].experiments[0].folder}" in page(*study)


def test_what_was_added_is_no_longer_called_missing(study, diagnosis):
    task, c = study
    names = dataclasses.replace(diagnosis, explanations=(("coulomb_friction",),))
    text = page(task, c, names)
    assert headings(text) == ["Coulomb friction of the strands coulomb_friction was missing, and is in the model now."]
    assert "mckibben add" not in text


def test_instruments_that_would_explain_it_stand_under_the_verdict_and_in_the_grid(study, diagnosis):
    text = page(*study, seen_through(diagnosis, Verdict.MISSING))
    lead = re.findall(r'<p class="lead">(.*?)</p>', text)
    assert [words.startswith("An instrument could also explain it only if the gain of") for words in lead[1:3]] == [
        True
    ] * 2
    assert "Instruments: what each may err by, and what would explain the misfit</h2>" in text
    rows = re.findall(r"<tr([^>]*)>(.*?)</tr>", text)
    told = [(tags, re.findall(r"<td[^>]*>(.*?)</td>", row)) for tags, row in rows]
    assert any('class="good"' in tags and cells[0] == "load cell" and "1.5 %" in cells and "0.1 %" in cells
               for tags, cells in told if cells)  # fmt: skip
    assert any(
        "good" not in tags and cells[0] == "pressure gauge" and cells[-1] == "no" for tags, cells in told if cells
    )


@pytest.mark.parametrize("verdict", [Verdict.NOTHING, Verdict.WITHIN_INSTRUMENTS])
def test_where_nothing_is_missing_the_page_says_what_would_have_been_seen(study, diagnosis, verdict):
    text = page(*study, nothing_missing(diagnosis, verdict))
    seen = as_read(text.split("What would have been seen</h2>")[1])
    assert "End stop end_stop" in seen
    assert "Still open: Spring in parallel linear_spring below 6.1 N." in seen
    assert "Instruments: what each may err by</h2>" in text
    assert "would explain the misfit" not in text
    assert "What would have been seen" not in page(*study, diagnosis)


def test_a_plan_and_a_posterior_stand_on_the_page(study):
    text = page(*study, planned=proposed(0.93), more=[Section("Sampled", plain="tip.k   1.12")])
    loop = "1 loop at 50 kPa, contraction 0 to 0.2, 30 mm/s"
    both = "Spring in parallel linear_spring and End stop end_stop"
    assert f"{loop}: {both} predict different forces there." in as_read(text)
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
    assert "How well the values are known" in text
    assert f"{median:.3g}" in text
    other = page_of("--effects", "ideal_cylinder", "textile_friction")
    assert "holds no posterior of this model" in " ".join(other.output.split())
    assert "How well the values are known" not in (tmp_path / "r.html").read_text(encoding="utf-8")


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
    assert showing.show(1e5, "Pa") == "100 kPa"  # and nothing of it is left behind
