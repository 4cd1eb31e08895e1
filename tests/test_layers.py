"""Who may know whom: physics knows no data and no pictures, nobody but the library knows effects by name."""

import ast
import json
import subprocess
import sys
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

from mckibben_jax.effect import name_of
from mckibben_jax.effects import LIBRARY

ROOT = Path(__file__).parent.parent
PHYSICS, FITTING = "mckibben_jax", "fitting"
# Rooms from the ground up: a module imports from its own floor and those below. One that is not listed stands on top.
FLOORS = (
    ("parameter",),
    ("muscle", "state"),
    ("braid",),
    ("rubber", "textile", "biology", "working_pressure", "valve", "shape"),
    ("effect", "memory"),
    ("effects",),
    ("model",),
)
FOREIGN = ("fitting", "pandas", "pint", "matplotlib", "rich", "click", "jinja2", "h5py", "emcee", "arviz", "tomlkit")


def modules(package: str) -> list[Path]:
    """Every source file of a package."""
    return sorted((ROOT / package).rglob("*.py"))


def name(path: Path) -> str:
    """Dotted name of a module."""
    return ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


@cache
def tree(path: Path) -> ast.Module:
    """The syntax tree of a file."""
    return ast.parse(path.read_text(), str(path))


def imports(path: Path, whole_file: bool = True) -> set[str]:
    """Dotted names that a file imports; of `from a import b` both a and a.b. Else those at its top level alone."""
    found = set()
    for node in ast.walk(tree(path)) if whole_file else tree(path).body:
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: import by full name"
            found |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    return found


def floor(dotted: str) -> int:
    """The floor of a module of the physics package."""
    room = dotted.split(".")[1] if "." in dotted else "model"
    return next((i for i, rooms in enumerate(FLOORS) if room in rooms), len(FLOORS))


@pytest.mark.parametrize("path", modules(PHYSICS), ids=name)
def test_physics_imports_downwards(path):
    known = {name(other) for other in modules(PHYSICS)} - {PHYSICS}
    above = {other for other in imports(path) & known if floor(other) > floor(name(path))}
    assert not above, f"{name(path)} must not know {above}"


@pytest.mark.parametrize("path", modules(PHYSICS), ids=name)
def test_physics_knows_no_files_fits_or_pictures(path):
    assert not {other.split(".")[0] for other in imports(path)} & set(FOREIGN)


@pytest.mark.parametrize("package", [PHYSICS, FITTING])
def test_no_two_modules_import_each_other(package):
    known = {name(path) for path in modules(package)}
    graph = {name(path): (imports(path, whole_file=False) & known) - {name(path), package} for path in modules(package)}
    graph = {one: {other for other in others if not one.startswith(f"{other}.")} for one, others in graph.items()}
    tuple(TopologicalSorter(graph).static_order())  # raises on a cycle


def test_importing_the_physics_changes_no_setting_of_jax():
    everything = [name(path) for path in modules(PHYSICS)]
    script = f"""
import importlib, json, jax
before = dict(jax.config.values)
for module in {everything}:
    importlib.import_module(module)
changed = [key for key, value in jax.config.values.items() if before.get(key) != value]
print(json.dumps([changed, bool(jax.config.jax_enable_x64)]))
"""
    ran = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, cwd=ROOT, check=True)
    assert json.loads(ran.stdout) == [[], False]


# Names of effects ----------------------------------------------------------------------------------------------------


NAMES = {name_of(kind) for kind in LIBRARY}
CLASSES = {kind.__name__ for kind in LIBRARY}
OUTSIDERS = [p for p in modules(PHYSICS) + modules(FITTING) if (ROOT / PHYSICS / "effects") not in p.parents]


class Knowledge(ast.NodeVisitor):
    """Where a file knows an effect: by its class, by a name that can be nothing else, or by comparing with a name.

    Assignments to a constant called BASELINE (or with it in its name) are the one place where it may.
    """

    def __init__(self):
        self.found: list[str] = []

    def visit_Assign(self, node):
        if not any("BASELINE" in ast.unparse(target) for target in node.targets):
            self.generic_visit(node)

    def visit_AnnAssign(self, node):
        if "BASELINE" not in ast.unparse(node.target):
            self.generic_visit(node)

    def visit_Name(self, node):
        if node.id in CLASSES:
            self._note(node, node.id)

    def visit_Attribute(self, node):
        if node.attr in CLASSES:
            self._note(node, node.attr)
        self.generic_visit(node)

    def visit_Constant(self, node):
        if isinstance(node.value, str) and node.value in NAMES and "_" in node.value:
            self._note(node, node.value)

    def visit_Compare(self, node):
        for part in ast.walk(node):
            if isinstance(part, ast.Constant) and part.value in NAMES:
                self._note(part, part.value)

    def _note(self, node, what):
        self.found.append(f"line {node.lineno}: {what}")


def knowledge(source: ast.AST) -> list[str]:
    """Every place where a syntax tree knows an effect by name."""
    visitor = Knowledge()
    visitor.visit(source)
    return visitor.found


@pytest.mark.parametrize("path", OUTSIDERS, ids=name)
def test_nobody_outside_the_library_knows_an_effect_by_name(path):
    assert not knowledge(tree(path))


@pytest.mark.parametrize(
    "source", ["if name == 'tip': pass", "x = ['coulomb_friction']", "isinstance(e, Tip)", "effects.Hill()"]
)
def test_knowledge_of_a_name_is_noticed(source):
    assert knowledge(ast.parse(source))


def test_a_declared_baseline_is_allowed():
    assert not knowledge(ast.parse("BASELINE = (IdealCylinder, CoulombFriction)"))
