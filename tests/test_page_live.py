"""The live picture of the page: it shows what was measured and modelled, follows the reader, and moves to the end."""

import hashlib
import json
import re
from base64 import b64decode, b64encode
from dataclasses import replace
from importlib import resources

import numpy as np
import pytest
from browser import Watched, browser
from studied import EVIL, off_by, two_steps, without_code

from fitting.report.page.live import chosen, packed
from fitting.report.page.page import page
from fitting.report.pictures.panels import every_panel
from fitting.report.settings import LiveSettings

UPLOT = {
    "LICENSE": "8f989229699b4fe2f1a0432d0e9edc338a8a911e250e2d1b01ecd770a5f5b1bd",
    "uPlot.iife.min.js": "19c8d4c6ad88929a79f4ae49d6f7161566dfd0ba3d15cc495e974f787eb78f1f",
    "uPlot.min.css": "df630c6a8d6f8eeaff264b50f73ce5b114f646ffd9a0bb74f049b0a00135fa04",
}  # of the files in the package `uplot` 1.6.32


def three_steps(c, diagnosis):
    """Two models and a third, so that one can step over the second; the map of the first one is orange."""
    before, after = two_steps(c, diagnosis)
    cells = replace(c.cells, mean={branch: mean + 4 for branch, mean in c.cells.mean.items()})
    before = replace(before, comparison=replace(before.comparison, cells=cells))
    last = off_by(c, -2)
    return [before, after, replace(after, comparison=last, rmse=last.rmse, added=("end_stop",))]


@pytest.fixture(scope="module")
def written(study, diagnosis, tmp_path_factory):
    """A page of three models, on disk, with its address and its data."""
    task, c = study
    text = page(task, c, diagnosis, three_steps(c, diagnosis))
    place = tmp_path_factory.mktemp("live") / "page.html"
    place.write_text(text, encoding="utf-8")
    return place.as_uri(), sent(text)


def sent(text):
    """What the page gives to its script."""
    return json.loads(re.search(r'<script type="application/json" id="live-data">(.*?)</script>', text)[1])


def unpacked(one):
    return np.frombuffer(b64decode(one["bytes"]), "<" + one["type"])


@pytest.fixture(scope="module")
def chromium():
    with browser() as started:
        yield started


@pytest.fixture
def shown(written, chromium):
    """The page in a browser, with its pictures in sight; nothing may have gone away or wrong at the end."""
    watched = Watched(chromium.new_page(viewport={"width": 1280, "height": 1000}))
    opened(watched.page, written)
    yield watched.page
    watched.check()
    watched.page.close()


def opened(tab, written):
    tab.goto(written[0])
    tab.evaluate("scrollTo(0, document.querySelector('.live').getBoundingClientRect().top + scrollY - 90)")
    return tab


def at_rest(tab, model):
    """Wait until this model is shown and nothing moves."""
    tab.wait_for_selector(f'.live[data-model="{model}"][data-moving="false"]')


def values(tab):
    """What the curves show at this moment."""
    return np.array(tab.evaluate("[...document.querySelector('.live').live.state.values]"), "f4")


def place_of(tab, k, pane=0):
    """Where on the screen a reading is drawn."""
    return tab.evaluate("""([k, pane]) => {
      const { state, panes } = document.querySelector('.live').live, { data } = state, u = panes.pair()[pane];
      const box = u.over.getBoundingClientRect(), height = pane ? state.values[k] - data.measured[k] : data.measured[k];
      return [box.left + u.valToPos(data.runs[data.run[k]].along[k], 'x'), box.top + u.valToPos(height, 'y')];
    }""", [k, pane])  # fmt: skip


def readout(tab):
    return tab.locator(".live .readout").inner_text().replace("\n", " ")


def picture(tab, pane="upper"):
    return tab.locator(f".live .{pane} canvas").evaluate("canvas => canvas.toDataURL()")


# ------------------------------------------------------------------------------------------------------ what is sent


def test_uplot_is_what_its_authors_gave_out():
    folder = resources.files("fitting.report.page.live") / "uplot"
    assert {name: hashlib.sha256((folder / name).read_bytes()).hexdigest() for name in UPLOT} == UPLOT


def test_the_page_lets_its_own_script_run_and_no_other(study, diagnosis):
    task, c = study
    text = page(task, c, diagnosis)
    scripts = re.findall(r"<script([^>]*)>(.*?)</script>", text, flags=re.DOTALL)
    assert [kind for kind, _ in scripts] == [' type="application/json" id="live-data"', ""]
    allowed = b64encode(hashlib.sha256(scripts[1][1].encode()).digest()).decode()
    assert f"default-src 'none'; style-src 'unsafe-inline'; script-src 'sha256-{allowed}'\"" in text
    assert "Permission is hereby granted" in scripts[1][1]  # the licence goes with every copy
    assert not re.search(r"\bon\w+=|javascript:", without_code(text))


def test_text_of_a_file_stays_text(study, diagnosis, chromium, tmp_path):
    """A run with a nasty name: it is in the data, and no part of it is ever an element or code."""
    task, c = study
    (e,) = task.experiments
    (recording,) = e.recordings
    runs = tuple(replace(run, name=EVIL + "</script>") for run in recording.runs)
    named = replace(task, experiments=[replace(e, recordings=(replace(recording, runs=runs),))])
    text = page(named, c, diagnosis)
    assert EVIL in sent(text)["runs"][0]["label"]
    assert EVIL not in text
    assert not re.search(r"[<>&]", text.split('id="live-data">')[1].split("</script>")[0])
    place = tmp_path / "page.html"
    place.write_text(text, encoding="utf-8")
    watched = Watched(chromium.new_page())
    dialogs = []
    watched.page.on("dialog", lambda dialog: (dialogs.append(dialog.message), dialog.dismiss()))
    watched.page.goto(place.as_uri())
    watched.page.locator(".live .panes").focus()
    watched.page.keyboard.press("ArrowRight")
    assert "<script>alert(1)</script>" in readout(watched.page)
    assert dialogs == []
    watched.check()


def test_every_reading_is_sent_once_and_every_model_as_floats(study, diagnosis, written):
    task, c = study
    data = written[1]
    of_all = np.concatenate([p.mine for p in every_panel(task.experiments, c.fit.samples, c.fit.residual)])
    assert np.array_equal(unpacked(data["readings"]["measured"]), c.fit.samples.measured[of_all].astype("f4"))
    assert np.array_equal(unpacked(data["readings"]["row"]), c.fit.samples.row[of_all])
    for stage, model in zip(three_steps(c, diagnosis), data["models"], strict=True):
        expected = (c.fit.samples.measured + stage.comparison.fit.residual)[of_all].astype("f4")
        assert model["values"]["type"] == "f4"
        assert np.array_equal(unpacked(model["values"]), expected)


def test_what_is_read_off_keeps_four_digits_and_unknown_values():
    pressures = np.linspace(0.0, 800.0, 1001)
    one = packed.read_off(pressures)
    assert one["type"] == "u2"
    assert np.max(np.abs(unpacked(one) * one["step"] + one["low"] - pressures)) < 0.01
    some = packed.read_off(np.array([1.0, np.nan]))
    assert np.array_equal(unpacked(some), np.array([1, np.nan], "f4"), equal_nan=True)
    assert packed.read_off(np.array([np.nan])) is None
    assert unpacked(packed.counts(np.array([3, 70_000]))).tolist() == [3, 70_000]


def test_of_a_large_set_a_part_is_sent_and_the_page_says_so(study, diagnosis, monkeypatch):
    task, c = study
    monkeypatch.setattr(chosen, "LIVE", LiveSettings(readings=150, fewest=24))
    panels = every_panel(task.experiments, c.fit.samples, c.fit.residual)
    kept = chosen.chosen_readings(panels, c.fit.residual)
    held = sum(len(one.at) for one in kept)
    assert 100 < held <= 150
    for one in kept:
        turns = np.flatnonzero(np.diff(one.panel.run.half[one.panel.position]))
        assert {*one.panel.mine[[0, -1]], *one.panel.mine[turns], *one.panel.mine[turns + 1]} <= set(one.at)
        worst = one.panel.mine[np.argmax(c.fit.residual[one.panel.mine])]
        assert np.min(np.abs(one.at - worst)) <= 4  # its like is there
    text = page(task, c, diagnosis)
    assert f"this picture holds {held} of {len(c.fit.samples):,} readings" in text
    assert len(unpacked(sent(text)["readings"]["measured"])) == held
    monkeypatch.setattr(chosen, "LIVE", LiveSettings(readings=50, fewest=24))
    assert len(chosen.chosen_readings(panels, c.fit.residual)) == 2
    assert "of the 2 runs with the largest errors" in page(task, c, diagnosis)


# ---------------------------------------------------------------------------------------------------- under a pointer


@pytest.mark.parametrize("pane", [0, 1])
def test_the_reading_under_the_pointer_is_told_with_units(shown, written, pane):
    at_rest(shown, 2)
    data = written[1]
    measured, model = unpacked(data["readings"]["measured"]), unpacked(data["models"][2]["values"])
    for k in (40, 300, 600):
        shown.mouse.move(*place_of(shown, k, pane))
        found = shown.evaluate("document.querySelector('.live').live.state.hovered")
        assert np.hypot(*np.subtract(place_of(shown, found, pane), place_of(shown, k, pane))) < 3  # or one on top of it
        said = readout(shown)
        line = unpacked(data["readings"]["row"])[found]
        run = next(r for r, run in enumerate(np.cumsum([r["count"] for r in data["runs"]])) if found < run)
        assert said.startswith(f"{data['runs'][run]['label']}, ")
        assert f"(line {line} of its file)" in said
        for name, value in (
            ("force measured", measured[found]),
            ("force of the model", model[found]),
            ("difference", model[found] - measured[found]),
        ):
            told = float(re.search(rf"{name} ([+−]?[\d.]+) N", said)[1].replace("−", "-"))
            assert told == pytest.approx(value, abs=0.006)
        assert re.search(r"contraction 0\.\d{4}pressure [124]00\.0 kPa", said.replace(" pressure", "pressure"))
    shown.mouse.move(5, 5)
    assert readout(shown).startswith("Point at a reading")


def test_dragging_enlarges_both_axes_together_and_two_presses_show_all(shown):
    spans = "document.querySelector('.live').live.panes.pair().map(u => [u.scales.x.min, u.scales.x.max])"
    (before, below) = shown.evaluate(spans)
    assert before == below
    box = shown.locator(".live .lower .u-over").bounding_box()
    assert shown.locator(".live .reset").is_disabled()
    shown.mouse.move(box["x"] + 0.25 * box["width"], box["y"] + 0.5 * box["height"])
    shown.mouse.down()
    shown.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"], steps=8)
    shown.mouse.up()
    after, below = shown.evaluate(spans)
    assert after == below
    wide = before[1] - before[0]
    assert after == pytest.approx([before[0] + 0.25 * wide, before[0] + 0.5 * wide], abs=0.01 * wide)
    assert shown.locator(".live .reset").is_enabled()
    shown.mouse.dblclick(box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"])
    assert shown.evaluate(spans) == [before, before]
    assert shown.locator(".live .reset").is_disabled()


def test_one_run_alone_can_be_shown(shown, written):
    data = written[1]
    before = picture(shown)
    shown.locator(".live select:not(.with)").select_option(label=data["runs"][1]["label"])
    assert shown.evaluate("document.querySelector('.live').live.state.shown") == [1]
    assert picture(shown) != before
    assert shown.locator(".live .key").inner_text().count("kPa") == 1


def test_a_bar_shows_what_its_model_would_give(shown):
    at_rest(shown, 2)
    before = picture(shown)
    shown.locator(".fall label").first.hover()
    shown.wait_for_function("document.querySelector('.live').live.state.preview !== null")
    settle(shown)
    dashed = picture(shown)
    assert dashed != before
    shown.mouse.move(5, 300)
    settle(shown)
    assert picture(shown) == before


def settle(tab):
    tab.evaluate("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")


# --------------------------------------------------------------------------------------------------- map and picture


def test_a_cell_of_the_map_marks_its_readings(study, shown):
    _, c = study
    at_rest(shown, 2)
    before = picture(shown)
    cell = shown.locator('.stack.branch > .m2 [id$="-cells"] [role="option"]').nth(7)
    cell.hover()
    settle(shown)
    known = [(r, k) for r in range(len(c.cells.pressure)) for k in range(len(c.cells.contraction))
             if np.isfinite(c.cells.mean[1][r, k])]  # fmt: skip
    row, column = known[7]
    marked = shown.evaluate("""() => {
      const { state } = document.querySelector('.live').live;
      return [...Array(state.data.count).keys()].filter(k => state.picked.holds(k)).length; }""")  # fmt: skip
    assert marked == c.cells.count[1][row, column] > 0
    inside = (c.cells.pressure.of == row) & (c.cells.contraction.of == column) & (c.fit.samples.branch == 1)
    told = float(re.search(r"mean misfit ([+−]?[\d.]+) N", readout(shown))[1].replace("−", "-"))
    assert c.cells.pressure.label(row, "Pa") in readout(shown)
    assert told == pytest.approx(c.cells.mean[1][row, column], abs=0.01)
    assert np.count_nonzero(inside) == marked
    assert picture(shown) != before
    frame = shown.locator(".stack.branch > .m2 figure").first.locator(".cell-mark")
    assert frame.is_visible()
    shown.mouse.move(5, 5)
    settle(shown)
    assert not frame.is_visible()
    cell.click()  # pressed, it stays
    shown.mouse.move(5, 5)
    settle(shown)
    assert frame.is_visible()
    cell.click()
    shown.mouse.move(5, 5)
    settle(shown)
    assert picture(shown) == before


def test_a_reading_marks_its_cell_and_row_on_the_map_of_its_branch(shown, written):
    data = written[1]
    at_rest(shown, 2)
    shown.mouse.move(*place_of(shown, 40))
    found = shown.evaluate("document.querySelector('.live').live.state.hovered")
    branch, cell = (unpacked(data["readings"][name])[found] for name in ("branch", "cell"))
    drawn = [one for one in data["maps"]["drawn"] if one["kind"] == "branch"]
    for n, one in enumerate(drawn):
        figure = shown.locator(".stack.branch > .m2 figure").nth(n)
        assert figure.locator(".row-mark").is_visible() is (branch in one["branches"])
        assert figure.locator(".cell-mark").is_visible() is (branch in one["branches"])
        if branch in one["branches"]:
            inner, outer = (figure.locator(f".{name}-mark").bounding_box() for name in ("cell", "row"))
            path = figure.locator('[id$="-cells"] > path').nth(int(cell)).bounding_box()
            assert abs(inner["x"] + inner["width"] / 2 - path["x"] - path["width"] / 2) < 2
            assert outer["width"] > 5 * inner["width"]


def test_cells_can_be_reached_by_keyboard(shown):
    at_rest(shown, 2)
    cells = shown.locator('.stack.branch > .m2 [role="listbox"]').first
    cells.focus()
    shown.keyboard.press("ArrowRight")
    first = readout(shown)
    assert "mean misfit" in first
    shown.keyboard.press("ArrowRight")
    assert readout(shown) != first
    assert cells.locator('[aria-selected="true"]').count() == 1
    assert shown.locator(".live .readout").get_attribute("aria-live") == "polite"
    shown.keyboard.press("Escape")
    assert readout(shown).startswith("Point at")


# ------------------------------------------------------------------------------------------------- from model to model

WATCH = """() => { window.seen = []; const live = document.querySelector('.live'); const look = () => {
  const bar = parseFloat(getComputedStyle(document.querySelector('.steps .bar')).width);
  const cell = document.querySelector('.stack.branch > .m0 [id$="-cells"] > path').style.cssText;
  seen.push([live.dataset.moving, live.live.state.values[100], bar, cell]);
  if (seen.length < 2000) requestAnimationFrame(look); }; look(); }"""


# Where the picture came to rest. It is written down in the page: who asks from outside now and then may miss a rest.
RESTS = """() => { window.rests = []; const live = document.querySelector('.live');
  live.addEventListener('rested', () => rests.push(live.dataset.model)); }"""


def test_curves_map_and_bar_fall_together_and_end_at_the_values_sent(shown, written):
    data = written[1]
    at_rest(shown, 2)
    paths = '.stack.branch > .m0 [id$="-cells"] > path'
    printed = shown.locator(paths).evaluate_all("all => all.map(path => path.getAttribute('style'))")
    shown.clock.install(time=0)
    shown.clock.pause_at(1000)  # the test turns the page's clock: a busy machine may draw no frame for half a second
    shown.evaluate(WATCH)
    shown.locator("#step0").check()
    shown.clock.run_for(1000)
    at_rest(shown, 0)
    seen = [one for one in shown.evaluate("seen") if one[0] == "true"]
    first, last = (float(unpacked(data["models"][k]["values"])[100]) for k in (2, 0))
    between = [one[1] for one in seen if first + 0.02 < one[1] < last - 0.02]
    assert len(between) >= 20  # in half a second at 60 frames each
    assert np.all(np.diff([one[1] for one in seen]) >= 0)
    assert len({one[2] for one in seen}) >= 2  # the bar grows with it
    assert len({one[3] for one in seen}) >= 2  # and the map changes its colours
    assert np.array_equal(values(shown), unpacked(data["models"][0]["values"]))
    assert shown.locator(paths).evaluate_all("all => all.map(path => path.getAttribute('style'))") == printed
    assert shown.locator(".steps .bar").get_attribute("style") in (None, "")


def test_who_changes_his_mind_half_way_ends_at_the_last_choice(shown, written):
    at_rest(shown, 2)
    for number in (0, 1, 0, 1):
        shown.locator(f"#step{number}").check()
        shown.wait_for_timeout(60)
    at_rest(shown, 1)
    assert np.array_equal(values(shown), unpacked(written[1]["models"][1]["values"]))


def test_steps_can_be_gone_back_and_forth_by_keyboard_and_played(shown):
    at_rest(shown, 2)
    back, forward, play = (shown.locator(f".live .{name}") for name in ("back", "forward", "play"))
    assert forward.is_disabled()
    back.focus()
    shown.keyboard.press("Enter")
    at_rest(shown, 1)
    shown.keyboard.press("Enter")
    at_rest(shown, 0)
    assert shown.locator("#step0").is_checked()
    assert shown.locator("div.m0 h1").is_visible()  # the whole page follows
    forward.focus()
    shown.keyboard.press("Enter")
    at_rest(shown, 1)
    shown.evaluate(RESTS)
    play.click()
    assert play.inner_text() == "Stop"
    shown.wait_for_selector('.live .play[aria-pressed="false"]')
    assert play.inner_text() == "Watch the error fall"
    assert shown.evaluate("rests") == ["0", "1", "2"]


def test_the_keyboard_reads_every_value_and_enlarges(shown, written):
    panes = shown.locator(".live .panes")
    panes.focus()
    assert "arrow keys" in panes.get_attribute("aria-label")
    shown.keyboard.press("ArrowRight")
    shown.keyboard.press("ArrowRight")
    data = written[1]
    assert f"(line {unpacked(data['readings']['row'])[1]} of its file)" in readout(shown)
    assert shown.locator(".live .readout").get_attribute("aria-live") == "polite"
    shown.keyboard.press("ArrowUp")
    assert data["runs"][1]["label"] in readout(shown)
    shown.keyboard.press("+")
    assert shown.locator(".live .reset").is_enabled()
    shown.keyboard.press("Escape")
    assert shown.locator(".live .reset").is_disabled()
    assert readout(shown).startswith("Point at")


def test_nothing_moves_for_who_wants_no_motion(written, chromium):
    watched = Watched(chromium.new_page(reduced_motion="reduce"))
    tab = opened(watched.page, written)
    assert not tab.locator(".live .play").is_visible()
    tab.evaluate(WATCH)
    tab.locator("#step0").check()
    assert tab.locator(".live").get_attribute("data-moving") == "false"
    assert np.array_equal(values(tab), unpacked(written[1]["models"][0]["values"]))
    tab.wait_for_timeout(200)
    assert {one[0] for one in tab.evaluate("seen")} == {"false"}
    watched.check()
    tab.close()


# ---------------------------------------------------------------------------------------- without a script, on paper


def test_without_a_script_and_on_paper_the_still_picture_stands(written, chromium):
    silent = chromium.new_context(java_script_enabled=False).new_page()
    silent.goto(written[0])
    assert not silent.locator(".live").is_visible()
    assert silent.locator(".overview svg.broad").is_visible()
    assert not silent.get_by_text("How to use this picture").is_visible()
    silent.locator("#step0").check()
    assert silent.locator("div.m0 h1").is_visible()
    silent.close()
    tab = opened(chromium.new_page(), written)
    assert tab.locator(".live").is_visible()
    assert not tab.locator(".overview svg.broad").is_visible()
    tab.emulate_media(media="print")
    assert not tab.locator(".live").is_visible()
    assert tab.locator(".overview svg.broad").is_visible()
    tab.close()


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_nothing_sticks_out_on_a_telephone_and_the_lines_are_seen(written, chromium, scheme):
    watched = Watched(chromium.new_page(viewport={"width": 390, "height": 844}, color_scheme=scheme))
    tab = opened(watched.page, written)
    assert tab.evaluate("document.documentElement.scrollWidth") <= 390
    at_rest(tab, 2)
    dark = tab.locator(".live .upper canvas").evaluate("""canvas => {
      const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
      const strong = [];
      for (let k = 0; k < data.length; k += 4) if (data[k + 3] > 200) strong.push(data[k] + data[k + 1] + data[k + 2]);
      return Math.min(...strong.slice(0, 50000)); }""")  # fmt: skip
    assert (dark > 150) is (scheme == "dark")  # the darkest line, of 765: no line is as dark as the page itself
    watched.check()
    tab.close()


DRAWN = """() => {
  const ELONGATING = 0, said = [];
  let dash = [];
  const ctx = { beginPath() {}, setLineDash: d => { dash = d; }, moveTo: (x, y) => said.push([x, y]),
                lineTo: (x, y) => said.push([x, y]), stroke: () => said.push(dash.length ? "dashed" : "solid") };
  FUNCTION
  const run = { first: 0, end: 4, along: [0, 0, 1, 1], few: true, group: 0 };
  const data = { branch: [2, 0, 2, 0], groups: [{ along: AXIS }] };
  modelLine(ctx, x => x, y => y, 1, data, run, [10, 20, 11, 21], 1);
  return said;
}"""


@pytest.mark.parametrize(
    ("axis", "drawn"),
    [
        ("contraction", [[0, 20], [0, 20], [1, 21], "dashed", "solid", [0, 10], [0, 10], [1, 11], "solid"]),
        ("time", [[0, 10], [0, 10], [0, 20], [1, 11], [1, 21], "solid"]),  # a short motion
    ],
)
def test_the_line_through_the_points_of_a_map_follows_each_branch(chromium, axis, drawn):
    """It went from branch to branch at every contraction: a zigzag."""
    code = resources.files("fitting.report.page.live").joinpath("canvas.js").read_text(encoding="utf-8")
    function = re.search(r"function modelLine.*?\n}\n", code, flags=re.DOTALL)[0]
    said = chromium.new_page().evaluate(DRAWN.replace("FUNCTION", function).replace("AXIS", f'"{axis}"'))
    assert said == drawn
