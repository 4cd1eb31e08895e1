"""The functions of the front door in the order in which a study takes them, on a muscle that was simulated here."""

import ast
import importlib.util
import re
from collections.abc import Iterator
from pathlib import Path
from textwrap import dedent
from typing import Any

import numpy as np
import pytest
from test_layers import FLOORS

from fitting import InputError, baseline, compare, diagnose, discover, export, fit, plan, read_experiment, simulate
from mckibben_jax import CoulombFriction, IdealCylinder, LinearSpring, Muscle, TextileFriction, Tip, model

MUSCLE = Muscle(0.3, 0.007, np.radians(20))
SPRING = LinearSpring(K=500.0)
NOISE = 0.5  # N


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """Loops of a muscle with a spring beside it, read back."""
    folder = tmp_path_factory.mktemp("simulated") / "muscle"
    truth = model(MUSCLE, IdealCylinder(), CoulombFriction(0.014), SPRING)
    turns = (0.0, 0.2, 0.0, 0.15, 0.02, 0.2)
    made = simulate(truth, folder, pressures=(1e5, 3e5, 5e5), turns=turns, speed=0.02, rate=10.0, noise=NOISE, seed=3)
    assert made.file == folder / "loop.csv"
    return read_experiment(folder)


@pytest.fixture(scope="module")
def fitted(recorded):
    return fit([recorded], [*baseline(), LinearSpring()])


@pytest.fixture(scope="module")
def diagnosis(recorded):
    return diagnose([recorded], baseline(), candidates=[LinearSpring(), TextileFriction(), Tip()])


def test_what_was_simulated_is_fitted_to_its_noise(recorded, fitted):
    assert fitted.values["linear_spring.K"] == pytest.approx(500, rel=0.02)
    assert fitted.rmse == pytest.approx(NOISE, rel=0.1)
    assert compare(fitted, [recorded]).fit is fitted


def test_what_is_missing_is_named_and_nothing_is_left_to_plan(recorded, diagnosis):
    assert (diagnosis.verdict, diagnosis.explanations) == ("missing", (("linear_spring",),))
    made = plan(diagnosis, [recorded])
    assert not made.separates
    assert made.rivals == (("linear_spring",),)


def test_a_discovery_looks_through_the_library_unless_candidates_are_named(recorded, monkeypatch):
    from fitting.diagnosis import discover as module

    looked_at = []
    monkeypatch.setattr(module, "prepared", lambda *_, candidates, **__: looked_at.extend(candidates) or 1 / 0)
    with pytest.raises(ZeroDivisionError):
        discover([recorded], baseline())
    assert {type(effect) for effect in looked_at} >= {LinearSpring, TextileFriction, Tip}


def test_a_fitted_muscle_is_exported_for_numpy_and_as_a_table(fitted, tmp_path):
    file = export(fitted.model(), tmp_path / "muscle.py")
    place = importlib.util.spec_from_file_location("muscle", file)
    assert place is not None
    assert place.loader is not None
    place.loader.exec_module(module := importlib.util.module_from_spec(place))
    table = export(
        fitted.model(), tmp_path / "muscle.csv", contractions=(0.0, 0.2), pressures=(1e5, 3e5), points=(3, 2)
    )
    rows = [line.split(",") for line in table.read_text(encoding="utf-8").splitlines()[2:]]
    assert len(rows) == 2 * 3 * 2
    pressure, contraction, branch, force = rows[1]
    direction = 1.0 if branch == "contraction" else -1.0
    assert module.force(float(contraction), 1e3 * float(pressure), direction) == pytest.approx(float(force), rel=1e-6)


def test_an_exported_file_that_is_there_is_left_alone(fitted, tmp_path):
    (tmp_path / "muscle.csv").write_text("mine", encoding="utf-8")
    with pytest.raises(InputError, match="left alone"):
        export(fitted.model(), tmp_path / "muscle.csv")


def test_a_kind_of_test_that_does_not_exist_is_refused(tmp_path):
    with pytest.raises(InputError, match="unknown test"):
        simulate(model(MUSCLE, *baseline()), tmp_path / "x", "loops and more")


# ------------------------------------------------------------------------------ what a newcomer reads

ROOT = Path(__file__).parents[1]
DOORS = ("fitting", "fitting.report", "mckibben_jax", "mckibben_jax.laws", "mckibben_jax.design", "mckibben_jax.motion")
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *(ROOT / "notebooks/site/pages").glob("*.md")]
NUMBERED = [ROOT / "notebooks/drawing.py", *sorted((ROOT / "notebooks").glob("[0-9]_*.py"))]


def imports(source: str) -> list[tuple[str, str]]:
    """Module and name of each import of the program's packages."""
    nodes = [node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.ImportFrom) and node.module]
    ours = [node for node in nodes if str(node.module).split(".")[0] in ("fitting", "mckibben_jax")]
    return [(str(node.module), alias.name) for node in ours for alias in node.names]


def read_sources() -> Iterator[Any]:
    """Every Python example of the pages, and every numbered notebook."""
    for page in PAGES:
        examples = re.findall(r"^ *```python\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)
        yield from (pytest.param(dedent(code), id=f"{page.name}{n}") for n, code in enumerate(examples))
    yield from (pytest.param(path.read_text(encoding="utf-8"), id=path.name) for path in NUMBERED)


EXPORTED = re.compile(
    r"^(?:import .*\bmuscle_mujoco|from muscle import |.*\"muscle\.fmu\")", re.MULTILINE
)  # what `export` writes


@pytest.mark.parametrize("source", list(read_sources()))
def test_what_a_newcomer_reads_imports_from_the_front_doors(source):
    assert imports(source) or EXPORTED.search(source)
    for module, name in imports(source):
        assert module in DOORS
        assert getattr(importlib.import_module(module), name, None) or importlib.import_module(f"{module}.{name}")


FILES = re.compile(r"`((?:fitting|mckibben_jax|tests|notebooks|data)/[\w./]*)`")


@pytest.mark.parametrize("page", ["README.md", "CONTRIBUTING.md"])
def test_files_that_a_newcomer_is_sent_to_exist(page):
    text = (ROOT / page).read_text(encoding="utf-8").replace("/NAME.py", "/")
    assert [name for name in FILES.findall(text) if not (ROOT / name).exists()] == []


def test_the_floors_that_a_newcomer_reads_are_those_that_are_tested():
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8").split("## Floors")[1].split("```")[1]
    for package, after in (("mckibben_jax", "fitting:"), ("fitting", "\n\n")):
        floors = text.split(f"{package}:")[1].split(after)[0].split("<")
        told = [{name.strip() for name in floor.split(",")} - {"..."} for floor in floors]
        tested = [set(floor) for floor in FLOORS[package]]
        assert all(few <= rooms for few, rooms in zip(told, tested, strict=True))
        assert told[1:] == tested[1:]


def test_the_rooms_that_a_newcomer_reads_are_those_that_there_are():
    tree = (ROOT / "README.md").read_text(encoding="utf-8").split("fitting/\n")[1].split("```")[0]
    named = re.findall(r"(\w+)/", "".join(line[:22] for line in tree.splitlines()))
    folders = [room for floor in FLOORS["fitting"] for room in floor if (ROOT / "fitting" / room).is_dir()]
    assert named == folders
