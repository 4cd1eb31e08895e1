"""What is handed out: the same bytes every time, with its data, its types and no more dependencies than it uses."""

import ast
import importlib.util
import json
import os
import re
import subprocess
import sys
import time
import tomllib
import zipfile
from pathlib import Path

import pytest

from fitting.cli.main import COMMANDS

ROOT = Path(__file__).parents[1]
PACKAGES = ("mckibben_jax", "fitting")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
EXTRAS = PROJECT["project"]["optional-dependencies"]
CALLED = {"sklearn": "scikit-learn", "mcap_ros2": "mcap-ros2-support"}  # imported by one name, installed by another
FOR_OTHERS = {"flatbuffers"}  # jax writes exported programs with it, and does not bring it
COME_ALONG = {"cloudpickle": "distributed", "uvicorn": "marimo", "traitlets": "anywidget"}  # what brings it


def plain(requirement: str) -> str:
    return re.split(r"[\[<>=!~; ]", requirement, maxsplit=1)[0].lower()


CORE = {plain(one) for one in PROJECT["project"]["dependencies"]}
EXTRA = {plain(one) for name, some in EXTRAS.items() if name not in ("test", "docs") for one in some}


def imported() -> dict[str, bool]:
    """Packages of others that ours import; whether every place does so late, within a function."""
    found: dict[str, bool] = {}
    for path in (p for package in PACKAGES for p in (ROOT / package).rglob("*.py")):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        for node in ast.walk(tree):
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            for root in {name.split(".")[0] for name in names} - {*sys.stdlib_module_names, *PACKAGES}:
                found[root] = found.get(root, True) and node not in tree.body
    return found


# --------------------------------------------------------------------------------------------------------- start-up


def loaded_by(*arguments: str) -> set[str]:
    """Modules that a command has loaded when it ends."""
    script = (
        "import json, sys\nfrom fitting.cli.main import main\n"
        f"try: main({list(arguments)!r})\nfinally: print(json.dumps(sorted(sys.modules)), file=sys.stderr)"
    )
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, cwd=ROOT, timeout=120)
    return set(json.loads(run.stderr.splitlines()[-1]))


@pytest.mark.parametrize("arguments", [("--help",), ("--version",), ("demo", "--help"), ("sweep", "--help")])
def test_help_loads_no_numerics(arguments):
    assert not loaded_by(*arguments) & {"jax", "numpy", "scipy", "pandas", "matplotlib", "rich", "arviz", "emcee"}


def test_help_is_there_at_once():
    """Goal: 0.3 s on a quiet machine; compared with the bare interpreter, because this one may be busy."""

    def seconds(*command: str) -> float:
        begun = time.perf_counter()
        subprocess.run([sys.executable, *command], capture_output=True, check=True, cwd=ROOT, timeout=60)
        return time.perf_counter() - begun

    bare = min(seconds("-c", "pass") for _ in range(5))
    ours = min(seconds("-m", "fitting.cli", "--help") for _ in range(5))
    assert ours < max(0.3, 12 * bare), f"{ours:.2f} s, the bare interpreter takes {bare:.2f} s"


# ----------------------------------------------------------------------------------------------------- dependencies


def test_every_core_dependency_is_imported():
    used = {CALLED.get(name, name) for name in imported()}
    assert CORE - used == FOR_OTHERS


def test_nothing_is_imported_that_is_not_declared():
    undeclared = {CALLED.get(n, n) for n in imported()} - CORE - EXTRA - set(COME_ALONG)
    assert not undeclared
    assert {COME_ALONG[name] for name in imported() if name in COME_ALONG} <= EXTRA


def test_what_only_extras_bring_is_imported_late():
    early = {name for name, late in imported().items() if not late}
    assert early <= CORE


def test_tests_have_every_extra_that_they_need():
    """`make test` installs `test` and `notebooks`; without BlackJAX or the site's generator some tests say so."""
    both = {plain(one) for name in ("test", "notebooks") for one in EXTRAS[name]}
    assert EXTRA - both <= {"blackjax"}


def test_pinned_versions_are_allowed_ones():
    pins = dict(line.split("==") for line in (ROOT / "constraints.txt").read_text().split() if "==" in line)
    pins = {name.lower(): version for name, version in pins.items()}
    asked = [one for some in (PROJECT["project"]["dependencies"], *EXTRAS.values()) for one in some]
    packaging = pytest.importorskip("packaging.requirements")
    for one in map(packaging.Requirement, asked):
        assert one.specifier.contains(pins[one.name.lower()]), f"{one} against {pins[one.name.lower()]}"


def test_extras_that_messages_name_exist():
    named = set()
    for path in (ROOT / "fitting").rglob("*.py"):
        named |= set(re.findall(r"mckibben-jax\[(\w+)\]", path.read_text(encoding="utf-8")))
    assert named
    assert named <= set(EXTRAS)


# ------------------------------------------------------------------------------------------------------------ wheel


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """Wheel and source archive, built twice; the second time under another clock and file mask."""
    if importlib.util.find_spec("hatchling") is None:
        pytest.skip("hatchling is not installed: nothing is built")
    folders = []
    for mask in (0o022, 0o077):
        folder = tmp_path_factory.mktemp("dist")
        before = os.umask(mask)
        try:
            run = subprocess.run(
                [sys.executable, "-m", "hatchling", "build", "-d", str(folder)],
                cwd=ROOT, capture_output=True, text=True, timeout=300,
                env={**os.environ, "SOURCE_DATE_EPOCH": "1700000000"},
            )  # fmt: skip
        finally:
            os.umask(before)
        assert run.returncode == 0, run.stderr
        folders.append({path.name: path for path in folder.iterdir()})
    return folders


def test_the_same_bytes_twice(built):
    first, second = built
    assert len(first) == 2
    assert {n: p.read_bytes() for n, p in first.items()} == {n: p.read_bytes() for n, p in second.items()}


def test_the_wheel_holds_what_the_commands_need(built):
    wheel = next(path for name, path in built[0].items() if name.endswith(".whl"))
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
        listed = next(archive.read(name).decode() for name in names if name.endswith("METADATA"))
    commands = {f"fitting/cli/commands/{name}.py" for name in COMMANDS}
    assert {*commands, "mckibben_jax/py.typed", "fitting/py.typed"} <= names
    live = (
        "live.html",
        "live.css",
        "start.js",
        "widget.js",
        "uplot/uPlot.iife.min.js",
        "uplot/uPlot.min.css",
        "uplot/LICENSE",
    )
    page = {f"fitting/report/page/{name}" for name in ("page.html", "pictures.css", *(f"live/{one}" for one in live))}
    assert {*page, "fitting/workbench/workbench.css"} <= names
    assert {"fitting/_data/muscle_a/loops.csv", "fitting/_data/sealed/muscle_a.json"} <= names
    assert "fitting/_notebooks/workbench.py" in names
    assert not {name for name in names if name.startswith(("tests/", "notebooks/")) or "__pycache__" in name}
    assert "License-Expression: MIT" in listed
