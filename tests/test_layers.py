"""Who may know whom: physics knows no data and no pictures, nobody but the library knows effects by name."""

import ast
import importlib
import json
import subprocess
import sys
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

from fitting.compiled.traced import ROOMS
from mckibben_jax.effect import name_of
from mckibben_jax.effects import LIBRARY

ROOT = Path(__file__).parent.parent
PHYSICS, FITTING = "mckibben_jax", "fitting"
# Rooms from the ground up: a module imports from its own room and from the floors below its own.
FLOORS = {
    PHYSICS: (
        ("parameter",),
        ("muscle", "state"),
        ("laws",),
        ("effect", "memory"),
        ("effects",),
        ("model",),
        ("motion",),
        ("design",),
    ),
    FITTING: (
        ("errors", "version", "full_names", "lazy", "precision", "progress", "threads"),
        ("units", "shipped", "writing"),
        ("showing",),
        ("recordings",),
        ("library",),
        ("compiled",),
        ("problem",),
        ("instruments",),
        ("least_squares",),
        ("model_files",),
        ("comparison",),
        ("diagnosis",),
        ("planning",),
        ("posterior",),
        ("designs",),
        ("evidence",),
        ("study",),
        ("hill", "exporting"),
        ("identified", "selftest"),
        ("report",),
        ("workbench",),
        ("cli",),
    ),
}
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


def imports(path: Path) -> set[str]:
    """Dotted names that a file imports; of `from a import b` both a and a.b."""
    found = set()
    for node in ast.walk(tree(path)):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: import by full name"
            found |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    return found


def room(dotted: str) -> str:
    """The room of a module: the folder or file right below its package."""
    return dotted.split(".")[1]


def floor(dotted: str) -> int:
    """The floor of a module, from 0 at the ground."""
    floors = FLOORS[dotted.split(".")[0]]
    return next(i for i, rooms in enumerate(floors) if room(dotted) in rooms)


def rises(path: Path) -> set[str]:
    """What a file imports, at its top, inside a function or for types alone, that is not below it or in its room."""
    own = name(path)
    package = own.split(".")[0]
    known = {name(other) for other in modules(package)} - {package}
    others = {other for other in imports(path) & known if room(other) != room(own)}
    return {f"{own} -> {other}" for other in others if floor(other) >= floor(own)}


def test_every_room_has_a_floor():
    rooms = {package: {room(name(path)) for path in modules(package) if name(path) != package} for package in FLOORS}
    assert rooms == {package: {each for rooms in floors for each in rooms} for package, floors in FLOORS.items()}


def test_programs_of_fits_are_found_by_all_that_fits_can_call():
    """What is left out of their digest could change without their being traced anew."""
    below = [rooms for rooms in FLOORS[FITTING] if floor(f"fitting.{rooms[0]}") <= floor("fitting.least_squares")]
    assert tuple(room for rooms in below for room in rooms) == ROOMS


@pytest.mark.parametrize("package", [PHYSICS, FITTING])
def test_imports_lead_downwards(package):
    # the front door, `__init__.py`, looks into every room
    assert not set().union(*(rises(path) for path in modules(package) if name(path) != package))


@pytest.mark.parametrize("path", modules(PHYSICS), ids=name)
def test_physics_knows_no_files_fits_or_pictures(path):
    assert not {other.split(".")[0] for other in imports(path)} & set(FOREIGN)


@pytest.mark.parametrize("package", [PHYSICS, FITTING])
def test_no_two_modules_import_each_other(package):
    known = {name(path) for path in modules(package)}
    graph = {name(path): (imports(path) & known) - {name(path), package} for path in modules(package)}
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
BASELINES = {"fitting.study.baseline": "BASELINE", "mckibben_jax.design.best": "DESIGN_BASELINE"}
OUTSIDERS = [p for p in modules(PHYSICS) + modules(FITTING) if (ROOT / PHYSICS / "effects") not in p.parents]


class Knowledge(ast.NodeVisitor):
    """Where a file knows an effect: by its class, by a name that can be nothing else, or by comparing with a name.

    Assignments to the one constant that is `allowed` are the only place where it may.
    """

    def __init__(self, allowed: str | None = None):
        self.found: list[str] = []
        self.allowed = allowed

    def visit_Assign(self, node):
        if [ast.unparse(target) for target in node.targets] != [self.allowed]:
            self.generic_visit(node)

    def visit_AnnAssign(self, node):
        if ast.unparse(node.target) != self.allowed:
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


def knowledge(source: ast.AST, allowed: str | None = None) -> list[str]:
    """Every place where a syntax tree knows an effect by name, but for one constant that is allowed to."""
    visitor = Knowledge(allowed)
    visitor.visit(source)
    return visitor.found


@pytest.mark.parametrize("path", OUTSIDERS, ids=name)
def test_nobody_outside_the_library_knows_an_effect_by_name(path):
    assert not knowledge(tree(path), BASELINES.get(name(path)))


@pytest.mark.parametrize(
    "source", ["if name == 'tip': pass", "x = ['coulomb_friction']", "isinstance(e, Tip)", "effects.Hill()"]
)
def test_knowledge_of_a_name_is_noticed(source):
    assert knowledge(ast.parse(source))


@pytest.mark.parametrize(("allowed", "noticed"), [("BASELINE", False), ("OTHER_BASELINE", True), (None, True)])
def test_only_a_declared_baseline_is_allowed(allowed, noticed):
    assert bool(knowledge(ast.parse("BASELINE = (IdealCylinder, CoulombFriction)"), allowed)) == noticed


def test_the_baselines_that_are_allowed_are_there():
    for module, constant in BASELINES.items():
        assert hasattr(importlib.import_module(module), constant)
