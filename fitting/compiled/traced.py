"""Traced programs that the next process finds again.

jax keeps compiled code on disk, but looks it up by the program that Python makes when it runs through the model; for a
diagnosis with the whole library that was measured to take 16 of 23 CPU seconds. So the traced program is kept beside
the compiled one, as `jax.export` writes it. Its name is a digest of all that shapes it: the sources of this program
that it can call, the versions of what these call, the structure of the arguments. What Python made otherwise (a user's
own effect) is traced anew each time.
"""

import hashlib
import inspect
import sys
from collections.abc import Callable, Iterator
from functools import cache, update_wrapper
from importlib.metadata import version
from pathlib import Path
from threading import Lock
from typing import Any, Generic, ParamSpec, TypeVar

import equinox as eqx
import jax
from jax import export
from jax.core import Tracer

from fitting.compiled import store
from fitting.compiled.compiler import compiler_options
from fitting.compiled.held import UNWRITTEN, Programs

P = ParamSpec("P")
R = TypeVar("R")

PACKAGES = ("mckibben_jax", "fitting")
# What fits can call: the physics, and the rooms up to that of least squares, which know nothing of those above them
# (`tests/test_layers.py`). A change of a verdict, a page or a command traces no fit anew.
ROOMS = (
    "errors", "version", "full_names", "lazy", "precision", "progress", "threads", "units", "shipped", "writing",
    "showing", "recordings", "library", "compiled", "problem", "instruments", "least_squares",
)  # fmt: skip
OF_FITS = ("mckibben_jax", *(f"fitting.{room}" for room in ROOMS))
CALLED = ("jax", "jaxlib", "equinox", "optimistix", "lineax", "diffrax", "numpy")
PLAIN = (str, int, float, bool, bytes, type(None))
CHECK = hashlib.sha256
ARRAY = object()  # stands for an array among what is compiled in


class Unkept(Exception):
    """Something that has no name which means the same in another process."""


class Kept(Generic[P, R]):
    """A compiled function of pytrees whose traced programs are kept where jax keeps compiled code, if it does."""

    def __init__(self, function: Callable[P, R], like: Any):
        self.function: Callable[..., Any] = function
        self.called = f"{function.__module__}.{function.__qualname__}"
        self.covered = OF_FITS if _within(function.__module__, OF_FITS) else PACKAGES
        self.plain = eqx.filter_jit(function)
        self.result = jax.tree.structure(like)
        self.signature = inspect.signature(function)
        self.programs = Programs()
        self.lock = Lock()
        update_wrapper(self, function)

    def __call__(self, *args: P.args, **kwargs: P.kwargs) -> R:
        """The function's value."""
        folder = jax.config.jax_compilation_cache_dir  # type: ignore[attr-defined]
        bound = self.signature.bind(*args, **kwargs)
        bound.apply_defaults()
        leaves, tree = jax.tree.flatten(tuple(bound.arguments.values()))
        arrays = [leaf for leaf in leaves if eqx.is_array(leaf)]
        if any(isinstance(leaf, Tracer) for leaf in arrays):
            return self.plain(*args, **kwargs)
        with self.lock:  # what two workers ask for is traced once
            program = self._program(None if folder is None else Path(folder), leaves, tree)
        return jax.tree.unflatten(self.result, program(*arrays))

    def _program(self, folder: Path | None, leaves: list, tree: Any) -> Callable:
        """The program for arguments like these: that of an earlier call, of another process, or a new one."""
        rest = tuple(ARRAY if eqx.is_array(leaf) else leaf for leaf in leaves)
        shapes = tuple((leaf.shape, leaf.dtype) for leaf in leaves if eqx.is_array(leaf))
        asked = (folder, tree, shapes, rest)
        program = self.programs.get(asked)
        if program is None:
            traced, size = self._read_or_traced(folder, leaves, tree, rest)
            program = jax.jit(traced, compiler_options=compiler_options())
            self.programs.put(asked, program, size)
        return program

    def _read_or_traced(self, folder: Path | None, leaves: list, tree: Any, rest: tuple) -> tuple[Callable, int]:
        """What is to be compiled, and its size as jax writes it, bytes."""
        arrays = [leaf for leaf in leaves if eqx.is_array(leaf)]

        def flat(*arrays: Any) -> list:
            given = iter(arrays)
            whole = [next(given) if leaf is ARRAY else leaf for leaf in rest]
            return jax.tree.leaves(self.function(*jax.tree.unflatten(tree, whole)))

        if folder is None:
            return flat, UNWRITTEN
        try:
            place = folder / f"{self._name(arrays, tree, rest)}.program"
            found = _read(place)
            if found is None:
                found = export.export(jax.jit(flat))(*arrays)
                _write(place, found)
        except (Unkept, ValueError, NotImplementedError):  # or a part that jax cannot write
            return flat, UNWRITTEN
        return found.call, len(found.mlir_module_serialized)

    def _name(self, arrays: list, tree: Any, rest: tuple) -> str:
        """What the program is called on disk."""
        words = [
            self.called,
            _sources(self.covered),
            jax.default_backend(),
            str(jax.config.jax_enable_x64),  # type: ignore[attr-defined]
            repr([(leaf.shape, str(leaf.dtype)) for leaf in arrays]),
            *_described(tree, self.covered),
            *("*" if leaf is ARRAY else _plain(leaf, self.covered) for leaf in rest),
        ]
        return CHECK("\n".join(words).encode()).hexdigest()


def kept(like: Any) -> Callable[[Callable[P, R]], Kept[P, R]]:
    """Compile a function of pytrees, and keep what is traced; its value has the structure of `like`."""
    return lambda function: Kept(function, like)


# Names that mean the same in every process --------------------------------------------------------------------------


@cache
def _sources(covered: tuple[str, ...]) -> str:
    """A digest of all that could change what is traced: the modules that are covered, and the versions they rest on."""
    digest = CHECK(" ".join(f"{name} {version(name)}" for name in CALLED).encode())
    digest.update(sys.version.encode())
    for package in PACKAGES:
        home = Path(inspect.getfile(sys.modules[package])).parent
        for file in sorted(home.rglob("*.py")):
            place = file.relative_to(home)
            if _within(".".join((package, *place.with_suffix("").parts)), covered):
                digest.update(str(place).encode() + b"\0" + file.read_bytes() + b"\0")
    return digest.hexdigest()


def _within(module: str, covered: tuple[str, ...]) -> bool:
    """Whether a module is one of these, or lies in one of them."""
    return any(module == one or module.startswith(f"{one}.") for one in covered)


def _described(tree: Any, covered: tuple[str, ...]) -> Iterator[str]:
    """The structure of a pytree in words."""
    node = tree.node_data()
    if node is None:
        yield "*" if tree.num_leaves else "none"
        return
    yield f"{_plain(node[0], covered)} {_plain(node[1], covered)} {len(tree.children())}"
    for child in tree.children():
        yield from _described(child, covered)


def _plain(value: Any, covered: tuple[str, ...]) -> str:
    """A value in words; Unkept where they could mean something else tomorrow."""
    if isinstance(value, PLAIN) or value is type(None):
        return repr(value)
    if isinstance(value, tuple | list):
        return f"({', '.join(_plain(each, covered) for each in value)})"
    if isinstance(value, dict):
        words = (f"{_plain(key, covered)}: {_plain(each, covered)}" for key, each in value.items())
        return f"{{{', '.join(words)}}}"
    named = value if isinstance(value, type) else type(value)
    known = getattr(sys.modules.get(named.__module__), named.__qualname__, None) is named
    known = known and _within(named.__module__, (*covered, *CALLED, "builtins"))
    if not known or not (named is value or _stateless(value)):
        raise Unkept(f"{named.__module__}.{named.__qualname__}")
    return f"{named.__module__}.{named.__qualname__}"


def _stateless(value: Any) -> bool:
    """Whether an object is no more than its class, as equinox's mark of a missing field."""
    return not callable(value) and not getattr(value, "__dict__", None) and not hasattr(value, "__slots__")


# On disk --------------------------------------------------------------------------------------------------------------


def _read(place: Path) -> export.Exported | None:
    """The program there; None where there is none, a torn one, or one that this jax cannot read."""
    written = store.read(place)
    try:
        return None if written is None else export.deserialize(bytearray(written))
    except ValueError:
        return None


def _write(place: Path, program: export.Exported) -> None:
    """Keep a program; where that cannot be, the next process traces again."""
    store.write(place, bytes(program.serialize()))
