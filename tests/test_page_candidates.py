"""What an effect would give, as the diagnosis fitted it, can be tried as a dotted line in the live picture."""

import json
import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from browser import Watched, browser
from small_muscle import loops, write
from studied import two_steps

from fitting.diagnosis.diagnose import diagnose
from fitting.recordings.experiment import read_experiment
from fitting.report.page.live.candidates import changes
from fitting.report.page.page import page
from mckibben_jax.effects import CoulombFriction, IdealCylinder, LinearSpring, Tip

SPRING = frozenset({"linear_spring"})


def test_a_change_is_what_makes_the_error_that_is_told(tmp_path):
    """With the change of an effect the residual has the error that the table gives for it."""
    rows = loops(lambda eps, *_: 400 * eps)
    experiment = read_experiment(write(tmp_path / "data", rows))
    d = diagnose([experiment], [IdealCylinder(), CoulombFriction()], candidates=[LinearSpring(), Tip()])
    assert set(d.changes) >= {SPRING, frozenset({"tip"})}
    for e in d.tried:
        change = d.changes.get(frozenset(e.effects))
        if change is not None:
            assert np.sqrt(np.mean((d.residual + change) ** 2)) == pytest.approx(e.rmse, rel=1e-9)


def some(row, run):
    """Samples of these rows and runs, as far as they are looked at."""

    class Some(SimpleNamespace):
        def __len__(self):
            return len(self.row)

    return Some(row=np.asarray(row), run=np.asarray(run), measured=0.5 * np.asarray(row))


def test_a_change_is_spread_over_all_readings_of_its_run(diagnosis):
    known = some([2, 4, 8, 2, 6], [0, 0, 0, 1, 1])
    wanted = some([2, 3, 4, 6, 8, 2, 4, 6], [0, 0, 0, 0, 0, 1, 1, 1])
    change = np.array([0.0, 2.0, 10.0, 5.0, 1.0])
    d = replace(diagnosis, changes={SPRING: change}, baseline=SimpleNamespace(samples=known))
    ((name, spread),) = changes(d, wanted)
    assert "linear_spring" in name
    assert "0.31 N" in name
    np.testing.assert_allclose(spread, [0.0, 1.0, 2.0, 6.0, 10.0, 5.0, 3.0, 1.0])
    assert not changes(d, some([2, 4], [0, 2]))  # another run
    assert not changes(replace(d, changes={}), wanted)
    wanted.measured = 1e-3 * wanted.measured  # the positions of a motion that was read as a force
    assert not changes(d, wanted)


@pytest.fixture(scope="module")
def written(study, diagnosis, tmp_path_factory):
    """A page of two models; the first was diagnosed, and a spring takes half of its misfit away."""
    task, c = study
    d = replace(diagnosis, changes={SPRING: -0.5 * diagnosis.residual})
    place = tmp_path_factory.mktemp("candidates") / "page.html"
    place.write_text(page(task, c, d, two_steps(c, d)), encoding="utf-8")
    return place


def test_the_page_holds_what_may_be_tried(written):
    text = written.read_text(encoding="utf-8")
    content = json.loads(re.search(r'<script type="application/json" id="live-data">(.*?)</script>', text)[1])
    (one,) = content["candidates"]
    assert one["model"] == 0
    assert one["name"].startswith("Spring in parallel")


def test_the_reader_tries_an_effect_beside_the_model_that_was_diagnosed(written, diagnosis):
    with browser() as started:
        watched = Watched(started.new_page(viewport={"width": 1280, "height": 1000}))
        tab = watched.page
        tab.goto(written.as_uri())
        tab.locator(".live").scroll_into_view_if_needed()
        tab.wait_for_selector('.live[data-model="0"][data-moving="false"], .live[data-model="1"][data-moving="false"]')
        tab.locator('input[name="step"]').nth(0).check(force=True)
        tab.wait_for_selector('.live[data-model="0"][data-moving="false"]')
        drawn = lambda: tab.locator(".live .lower canvas").evaluate("canvas => canvas.toDataURL()")  # noqa: E731
        before = drawn()
        tab.get_by_label("Dotted line, with:").select_option(index=1)
        assert drawn() != before
        change = tab.evaluate("""() => {
          const { candidate, values } = document.querySelector('.live').live.state;
          return [...values.keys()].map(k => candidate.values[k] - values[k]);
        }""")
        # the values are sent in 65,535 steps of some hundred newtons
        np.testing.assert_allclose(np.sort(change), np.sort(-0.5 * diagnosis.residual), atol=0.02)
        tab.get_by_label("Dotted line, with:").select_option(index=0)
        assert drawn() == before
        tab.locator('input[name="step"]').nth(1).check(force=True)
        tab.wait_for_selector('.live[data-model="1"][data-moving="false"]')
        assert not tab.get_by_label("Dotted line, with:").is_visible()
        watched.check()
        tab.close()
