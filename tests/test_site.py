"""The documentation is complete: every effect, equation and command, and nothing that the program does not have."""

import importlib.util
import json
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import click
import pytest
from browser import Watched, browser

from fitting.cli.main import COMMANDS, main
from mckibben_jax.effect import name_of
from mckibben_jax.effects import LIBRARY, SUPPLIES
from mckibben_jax.laws.review import EQUATIONS
from mckibben_jax.parameter import parameters

ROOT = Path(__file__).parents[1]
SITE = ROOT / "notebooks" / "site"
WRITTEN = sorted((SITE / "pages").glob("*.md"))


def script(name):
    """A script of the site as a module."""
    place = importlib.util.spec_from_file_location(name, SITE / f"{name}.py")
    module = importlib.util.module_from_spec(place)
    place.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def pages():
    return dict(script("generated").pages())


@pytest.mark.parametrize("kind", [*LIBRARY, *SUPPLIES], ids=name_of)
def test_every_effect_has_a_page_that_says_what_it_declares(pages, kind):
    page = pages[f"effects/{name_of(kind)}.md"]
    for p in parameters(kind):
        assert re.search(rf"^\| `{p.name}` \| .+ \| .+ \| .+ to .+ \|$", page, re.MULTILINE), p.name
    assert f"]({name_of(kind)}.md)" in pages["effects/index.md"]
    assert not kind.source or "**Source:**" in page
    assert not kind.suspect or "**When to suspect it:**" in page


FELL = re.compile(r"error ([\d.]+) N -> ([\d.]+) N")


@pytest.mark.parametrize("kind", [*LIBRARY, *SUPPLIES], ids=name_of)
def test_in_the_example_of_every_effect_the_error_falls_to_the_noise(pages, kind):
    """The two effects of the first model have no example: they cannot be missing from it."""
    kept = json.loads((SITE / "examples.json").read_text(encoding="utf-8"))[name_of(kind)]
    assert (kept is None) == (name_of(kind) in ("ideal_cylinder", "coulomb_friction"))
    if kept is not None:
        before, after = map(float, FELL.search(kept["said"][-1][1]).groups())
        assert after == pytest.approx(0.5, rel=0.02)
        assert before > 1.05 * after
        page = pages[f"effects/{name_of(kind)}.md"].replace(" \\\n  ", " ")
        assert all(command in page for command, _ in kept["said"])


def test_an_example_says_today_what_its_page_says():
    kept = json.loads((SITE / "examples.json").read_text(encoding="utf-8"))["weight"]
    kind = next(kind for kind in LIBRARY if name_of(kind) == "weight")
    now = script("examples").example(kind)
    assert (now["model"], now["said"]) == (kept["model"], [tuple(each) for each in kept["said"]])


def test_every_equation_is_there_with_its_erratum(pages):
    page = " ".join(pages["errata.md"].split())
    for e in EQUATIONS:
        assert f"## {e.number}: " in page
        assert " ".join(e.correction.split()).replace("|", "\\|").replace("<", "&lt;") in page


def test_every_command_is_there_with_its_options(pages):
    for name in COMMANDS:
        command = main.get_command(click.Context(main), name)
        section = pages["commands.md"].split(f"## mckibben {name}\n")[1].split("\n## ")[0]
        for p in command.params:
            if isinstance(p, click.Option) and not p.hidden:
                assert p.opts[0] in section, f"{name} {p.opts[0]}"


def test_a_function_that_a_module_is_named_after_is_documented_itself(pages):
    page = pages["python.md"]
    assert "::: mckibben_jax.model.model\n    options:\n      heading: mckibben_jax.model\n" in page
    assert "::: mckibben_jax.parameter.parameter\n" in page
    assert page.count("## fitting\n") == page.count("## mckibben_jax\n") == 1


def test_every_numbered_notebook_is_named(pages):
    for path in (ROOT / "notebooks").glob("[0-9]_*.py"):
        assert f"`notebooks/{path.name}`" in pages["notebooks.md"]


def lines_to_type():
    """Every command line of the pages that are written by hand."""
    for page in WRITTEN:
        for block in re.findall(r"```sh\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL):
            for line in block.splitlines():
                if line.startswith("mckibben "):
                    yield pytest.param(line, id=line[:60])


@pytest.mark.parametrize("line", list(lines_to_type()))
def test_a_command_of_the_documentation_would_be_understood(line):
    name, *rest = shlex.split(line)[1:]
    command = main.get_command(click.Context(main), name)
    assert command is not None
    command.make_context(name, rest)  # parses, and raises at an unknown option or a missing argument


def test_effects_that_the_pages_name_exist():
    known = {name_of(kind) for kind in (*LIBRARY, *SUPPLIES)}
    for page in WRITTEN:
        text = page.read_text(encoding="utf-8")
        assert set(re.findall(r"\(effects/(?!index)(\w+)\.md\)", text)) <= known
        assert {effect for effect in re.findall(r"([a-z_]+)\.[a-zA-Z]\w*=", text) if "_" in effect} <= known


def test_links_of_pages_that_stand_elsewhere_in_the_project_lead_to_pages(pages):
    """What a builder of the site would refuse, where none is installed."""
    known = set(pages) | {page.name for page in WRITTEN}
    for name, text in pages.items():
        if "/" not in name:
            found = re.findall(r"\]\((?!https?:|#|notebooks/)([^)#]+)", text)
            assert [link for link in found if link not in known] == [], name


def test_a_notebook_that_was_run_becomes_a_page_with_its_results(tmp_path):
    pytest.importorskip("latex2mathml", reason="the extra 'docs' is not installed")
    place = importlib.util.spec_from_file_location("worked", SITE / "worked.py")
    worked = importlib.util.module_from_spec(place)
    place.loader.exec_module(worked)
    drawn = {"data": {"image/png": "aGVsbG8="}, "output_type": "display_data"}
    told = {"data": {"text/markdown": ["It is **12 N** at $P_0$."]}, "output_type": "display_data"}
    cells = [
        {"cell_type": "markdown", "source": ["# One\n", "costs 5 $ and $a/b$\n", "$$F = P$$"]},
        {"cell_type": "code", "source": "plot()", "outputs": [drawn]},
        {"cell_type": "code", "source": 'mo.md(f"It is")', "outputs": [told]},
        {"cell_type": "code", "source": "print(1)", "outputs": [{"data": {"text/plain": "1\n"}}]},
    ]
    (tmp_path / "1_one.ipynb").write_text(json.dumps({"cells": cells}), encoding="utf-8")
    pages = dict(worked.worked_notebooks(tmp_path))
    assert pages["notebooks/1_one_1_0.png"] == b"hello"
    page = pages["notebooks/1_one.md"]
    assert "# One\ncosts 5 $ and <math" in page
    assert '<div class="formula"><math' in page
    assert "```python\nplot()\n```\n\n![What the code above draws](1_one_1_0.png)" in page
    assert "mo.md" not in page
    assert "It is **12 N** at <math" in page
    assert "```text\n1\n```" in page
    assert "`notebooks/1_one.py`" in page


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """The site, every link checked."""
    if not all(importlib.util.find_spec(name) for name in ("mkdocs", "material", "mkdocstrings")):
        pytest.skip("the extra 'docs' is not installed: the site is not built")
    folder = tmp_path_factory.mktemp("site")
    run = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "-f", str(SITE / "mkdocs.yml"), "-d", str(folder)],
        capture_output=True, text=True, timeout=300, env={**os.environ, "PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    assert run.returncode == 0, run.stderr[-3000:]
    return folder


def test_the_site_builds_with_every_link_checked_and_fetches_nothing(built):
    for page in built.rglob("*.html"):
        text = page.read_text(encoding="utf-8")
        assert not re.search(r"<(script|img|iframe)[^>]+src=[\"']?(https?:)?//", text), page
        assert not re.search(r"<link[^>]+stylesheet[^>]+https?:", text), page
    for sheet in built.rglob("*.css"):
        assert not re.search(r"(@import|url\()\s*[\"']?(https?:)?//", sheet.read_text(encoding="utf-8")), sheet


def test_the_search_works_from_disk(built):
    """A click on what it finds first leads to the effect's page; nothing is asked of a server."""
    with browser() as chromium:
        watched = Watched(chromium.new_page(viewport={"width": 1280, "height": 900}))
        watched.page.set_default_timeout(30_000)
        watched.page.goto((built / "index.html").as_uri())
        watched.page.locator(".md-search").wait_for()
        watched.page.keyboard.press("/")
        watched.page.keyboard.type("textile friction")
        watched.page.locator(".md-search-result__link").first.click()
        watched.page.locator("h1", has_text="Textile friction of the strands").last.wait_for()
        assert watched.page.url.endswith("effects/textile_friction.html")
        watched.check()
