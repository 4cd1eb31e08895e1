"""The picture of the workbench that follows the sliders, in a browser: the right values, and nothing from elsewhere."""

import numpy as np
import pytest
from browser import SLOW, Watched, browser
from served import Served
from small_muscle import loops, write

from fitting.study.request import Request
from fitting.workbench import session as bench

pytest.importorskip("marimo")
pytest.importorskip("anywidget", reason="anywidget is not installed: the workbench draws still pictures")

STATE = (
    "figure => { const { state } = figure.live; return [...state.values].map((v, k) => v - state.data.measured[k]); }"
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return write(tmp_path_factory.mktemp("follow"), loops(points=40, repeats=2), name="Follow <b>me</b>")


@pytest.fixture(scope="module")
def page(folder):
    """A workbench in which the data have been fitted; at the end nothing has gone away, and nothing wrong."""
    served = Served()
    try:
        with browser() as chromium:
            watched = Watched(chromium.new_page(viewport={"width": 1280, "height": 1600}))
            watched.page.goto(served.address)
            files = watched.page.locator("input[type=file]").first
            files.wait_for(state="attached")
            files.set_input_files([folder / "muscle.toml", folder / "loops.csv"])
            watched.page.locator(".now", has_text="As fitted").wait_for()
            watched.page.locator(".live canvas").first.wait_for()
            yield watched.page
            watched.check()
    finally:
        served.end()


def rms(page):
    """The error of what is drawn."""
    return float(np.sqrt(np.mean(np.square(page.locator(".live").evaluate(STATE)))))


def told(page):
    return float(page.locator(".now").inner_text().split(":")[1].split("N")[0])


def press(page, key):
    """Press a key on the slider that has the focus, and wait until the words follow: a slow kernel draws late."""
    from playwright.sync_api import expect

    words = page.locator(".now")
    before = words.text_content()
    page.keyboard.press(key)
    expect(words).not_to_have_text(before, timeout=SLOW)


def test_the_picture_follows_a_slider_and_comes_back(page):
    fitted = rms(page)
    assert fitted == pytest.approx(told(page), rel=0.01)
    page.get_by_role("slider").nth(1).focus()
    for _ in range(3):
        press(page, "ArrowRight")
    assert "moved" in page.locator(".now").inner_text()
    assert told(page) > 3 * fitted
    assert rms(page) == pytest.approx(told(page), rel=0.01)
    lower = page.locator(".live").evaluate("figure => figure.live.panes.pair()[1].scales.y.max")
    assert lower > told(page)  # the axes have made room
    for _ in range(3):
        press(page, "ArrowLeft")
    assert "As fitted" in page.locator(".now").inner_text()
    assert rms(page) == pytest.approx(fitted, rel=1e-5)


def test_the_reading_under_the_keys_is_told(page):
    page.locator(".live .panes").focus()
    page.keyboard.press("ArrowRight")
    words = page.locator(".live .readout").inner_text()
    assert "force measured" in words
    assert "100 kPa" in words
    page.keyboard.press("Escape")


def test_it_fits_on_a_telephone_and_has_the_colours_of_the_page(page):
    page.set_viewport_size({"width": 390, "height": 844})
    page.wait_for_timeout(500)
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    inks = []
    for scheme in ("light", "dark"):
        page.emulate_media(color_scheme=scheme)
        page.wait_for_timeout(300)
        inks.append(page.locator(".live").evaluate("figure => figure.live.state.colours.ink"))
    assert inks == ["#1c1c1e", "#e8e8ea"]


def test_only_four_bytes_a_reading_are_sent_with_a_move(folder):
    from fitting.workbench.live import follow, live_element, live_of

    step = bench.open_session(Request(data=(str(folder),))).last
    live = live_of(step, live_element())
    slider = step.laid_out.sliders[0]
    follow(step, live, {slider.name: slider.places[0]})
    sent = np.frombuffer(live.element.values, "<f4")
    moved = step.laid_out.residual(step.laid_out.moved({slider.name: slider.places[0]}))
    assert np.array_equal(sent, (step.laid_out.samples.measured + moved).astype("f4"))
    assert "At the starting values" in live.element.said
