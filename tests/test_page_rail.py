"""The rail of the page leads to every part of it, and the picture of the misfit stays in view on a wide screen."""

import re

import pytest
from browser import Watched, browser, violations
from studied import two_steps

from fitting.report.page.page import page
from fitting.report.page.parts import Section, render_page

WORDS = ["Verdict", "Misfit", "Error", "Runs", "Effects", "Parameters", "Instruments", "Source"]
TOP_OF_PICTURE = "document.querySelector('figure.live').getBoundingClientRect().top"


@pytest.fixture(scope="module")
def text(study, diagnosis):
    """A page with two models, each with parts of its own."""
    return page(*study, diagnosis, two_steps(study[1], diagnosis))


@pytest.fixture(scope="module")
def chromium():
    with browser() as started:
        yield started


@pytest.fixture
def shown(chromium, text, tmp_path, request):
    """The page in a window of a given width, 900 high; nothing may have gone away or wrong at the end."""
    place = tmp_path / "page.html"
    place.write_text(text, encoding="utf-8")
    watched = Watched(chromium.new_page(viewport={"width": request.param, "height": 900}))
    watched.page.goto(place.as_uri())
    yield watched.page
    watched.check()
    watched.page.close()


wide, narrow = (pytest.mark.parametrize("shown", [width], indirect=True) for width in (1280, 800))


def test_every_word_of_the_rail_leads_to_one_place(text):
    rail = re.search(r'<nav class="rail".*?</nav>', text)[0]
    links = re.findall(r'<a href="#(\w+)">(\w+)</a>', rail)
    assert [word for _, word in links] == WORDS
    for place, _ in links:
        assert text.count(f'id="{place}"') == 1


def test_a_page_of_words_alone_has_no_rail():
    text = render_page(title="t", about="a", verdict="v", sections=[Section("", plain="words")])
    assert "<nav" not in text
    assert 'class="top"' not in text
    assert "<main>" in text


@wide
def test_a_word_of_the_rail_brings_its_part_to_the_top_whatever_model_is_shown(shown):
    for step in ("before", "after"):
        shown.get_by_role("radio", name=step).check()
        shown.locator('.rail a:text-is("Parameters")').click()
        title = shown.locator("h2:visible", has_text=re.compile("^Parameters$"))
        assert title.count() == 1
        bar = shown.locator(".top").bounding_box()
        below = title.bounding_box()["y"] - bar["y"] - bar["height"]
        assert 0 <= below < 120


@wide
def test_the_picture_stays_in_view_beside_everything_else(shown):
    verdict = shown.locator("h1:visible").bounding_box()
    picture = shown.locator("figure.live").bounding_box()
    assert picture["x"] + picture["width"] < verdict["x"]  # side by side: both are seen at once
    for word in WORDS[2:]:
        shown.locator(f'.rail a:text-is("{word}")').click()
        assert 0 < shown.evaluate(TOP_OF_PICTURE) < 200, word
        lower = shown.locator(".live .lower").bounding_box()
        assert lower["y"] + lower["height"] < 900
    assert violations(shown) == []
    assert shown.evaluate("document.documentElement.scrollWidth") <= 1280


@narrow
def test_on_a_narrow_screen_all_is_one_column(shown):
    verdict, picture = (shown.locator(part).first.bounding_box() for part in ("h1:visible", "figure.live"))
    assert picture["y"] > verdict["y"] + verdict["height"]
    shown.locator('.rail a:text-is("Parameters")').click()
    assert shown.evaluate(TOP_OF_PICTURE) < 0  # it has scrolled away
    assert shown.evaluate("document.documentElement.scrollWidth") <= 800


@wide
def test_on_paper_the_rail_is_gone_and_all_is_one_column(shown):
    shown.emulate_media(media="print")
    assert not shown.locator(".rail").is_visible()
    assert shown.locator("main").evaluate("e => getComputedStyle(e).display") == "block"
