"""Effects of a user's own: single lines, and classes in a Python file, which is named on the command line only."""

import hashlib
import importlib.util
import inspect
import sys
import traceback
from collections.abc import Sequence
from pathlib import Path

from fitting.errors import InputError, unknown_name
from fitting.library.line import Defined, effect_from_line
from mckibben_jax.effect import Effect, Energy, Felt, Lost, Pulling, Read, name_of
from mckibben_jax.effects import LIBRARY, SUPPLIES

KINDS = (Effect, Felt, Energy, Pulling, Lost, Read)


def library(effect_file: str | None = None, define: Sequence[str] = ()) -> dict[str, type[Effect]]:
    """Every effect by its name: the program's, those of a user's file, and those that a line each defines."""
    known = {name_of(kind): kind for kind in (*LIBRARY, *SUPPLIES)}
    for kind in read_effects(effect_file) if effect_file else ():
        if name_of(kind) in known:
            raise InputError(f"the library has an effect '{name_of(kind)}' already", effect_file, cure="rename yours")
        known[name_of(kind)] = kind
    for line in define:
        known = with_line(known, line, "--define")
    return known


def with_line(
    known: dict[str, type[Effect]], line: str, file: str | Path, row: int | None = None
) -> dict[str, type[Effect]]:
    """The known effects and the one that a line defines, which stands in this place."""
    try:
        kind = effect_from_line(line)
    except InputError as error:
        raise error.located(file, row) from None
    name = name_of(kind)
    if known.get(name, kind) is not kind:
        before = known[name]
        also = f"as '{before.line}'" if issubclass(before, Defined) else "in a file of effects"
        raise InputError(f"'{name}' is defined already, {also}", file, row, value=line, cure="give one another name")
    return {**known, name: kind}


def effects_named(names: Sequence[str], known: dict[str, type[Effect]] | None = None) -> tuple[type[Effect], ...]:
    """The effects of these names, among the program's own unless others are known; a misspelt one gets the nearest."""
    known = library() if known is None else known
    for name in names:
        if name not in known:
            raise unknown_name("effect", name, known)
    return tuple(known[name] for name in dict.fromkeys(names))


def read_effects(path: str) -> tuple[type[Effect], ...]:
    """The effect classes that a Python file defines. The file is run: name only files that you trust."""
    file = Path(path)
    if not file.is_file():
        raise InputError("no such file", file, cure="name a Python file with classes like those of the library")
    name = "effects_of_" + hashlib.sha256(str(file.resolve()).encode()).hexdigest()[:12]
    spec = importlib.util.spec_from_file_location(name, file)
    if spec is None or spec.loader is None:
        raise InputError("this is not a Python file", file, cure="its name ends in .py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        raise InputError(_what(error), file, _row(error, file), cure="run it with python to see more") from None
    found = tuple(kind for kind in vars(module).values() if _is_effect(kind) and kind.__module__ == name)
    if not found:
        raise InputError("there is no effect in it", file, cure="write a class like: class Tip(Felt): ...")
    return found


def _is_effect(kind: object) -> bool:
    return inspect.isclass(kind) and issubclass(kind, Effect) and kind not in KINDS


def _what(error: Exception) -> str:
    return f"the file cannot be run: {type(error).__name__}: {error.msg if isinstance(error, SyntaxError) else error}"


def _row(error: Exception, file: Path) -> int | None:
    if isinstance(error, SyntaxError):
        return error.lineno
    rows = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == str(file)]
    return rows[-1] if rows else None
