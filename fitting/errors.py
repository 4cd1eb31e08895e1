"""Bad input is reported once, completely: where it stands, the value met, what is wrong and what to do about it."""

import difflib
import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any


@dataclass
class InputError(Exception):
    """Something the user gave cannot be used.

    `row` is the line of the file as an editor counts it (the header of a CSV is line 1); `cure` is something to type
    or paste. The message is one sentence on what is wrong and one on the cure. `key` is the option that a wrong value
    was given for, where the file of the option is known only to a caller (see `concerning` and `located`).
    """

    problem: str
    file: str | Path | None = None
    row: int | None = None
    column: str | None = None
    value: Any = None
    cure: str = ""
    key: str | None = field(default=None, init=False)

    def located(self, file: str | Path, row: int | None = None, column: str | None = None) -> "InputError":
        """The same error at a place that only the caller knows."""
        return InputError(self.problem, file, row, column, self.value, self.cure)

    def of(self, what: str) -> "InputError":
        """The same error, its problem said to be that of `what`."""
        return InputError(f"{what}: {self.problem}", self.file, self.row, self.column, self.value, self.cure)

    def __str__(self) -> str:
        where = self._where()
        met = "" if self.value is None else f" (found: {_shown(_text(self.value))!r})"
        cure = f" Cure: {_shown(self.cure, 600)}" if self.cure else ""
        return f"{where}{': ' if where else ''}{_shown(self.problem, 300)}{met}.{cure}"

    def _where(self) -> str:
        parts = (
            _shown(str(self.file), 1000) if self.file is not None else "",
            f"row {self.row}" if self.row is not None else "",
            f"column '{_shown(self.column)}'" if self.column is not None else "",
        )
        return ", ".join(part for part in parts if part)

    def as_dict(self) -> dict[str, Any]:
        """The same, field by field, for `--json`."""
        return {
            "problem": self.problem,
            "file": None if self.file is None else str(self.file),
            "row": self.row,
            "column": self.column,
            "value": None if self.value is None else _text(self.value),
            "cure": self.cure,
        }


@contextmanager
def concerning(key: str) -> Iterator[None]:
    """Within this block an `InputError` is one about the option `key`."""
    try:
        yield
    except InputError as error:
        error.key = key
        raise


def _text(value: Any) -> str:
    try:
        return str(value)
    except RecursionError:
        return "lists in lists in lists ..."


def _shown(text: str, longest: int = 160) -> str:
    """Text of a user's for one line of a terminal: not endless, and without the characters that steer the screen."""
    short = text if len(text) <= longest else f"{text[: longest - 4]} ..."
    return "".join(letter if letter.isprintable() else ascii(letter)[1:-1] for letter in short)


NAMED = 3  # rows that a message names where a problem concerns more


def alike(rows: Iterable[int]) -> str:
    """How many rows a problem concerns, and which, to stand behind it; nothing where it is one alone."""
    found = [int(row) for row in rows]
    first = [str(row) for row in found[:NAMED]]
    if len(found) > NAMED:
        return f" ({len(found):,} rows, the first are {', '.join(first)})"
    return f" (rows {', '.join(first[:-1])} and {first[-1]})" if len(found) > 1 else ""


def nearest(name: str, known: Iterable[str], alike: float = 0.6) -> str | None:
    """The known name that a misspelt one most likely means; None if none is like it."""
    by_folded = {k.lower(): k for k in known}
    match = difflib.get_close_matches(name.lower(), by_folded, n=1, cutoff=alike)
    return by_folded[match[0]] if match else None


def unknown_name(
    what: str, name: str, known: Iterable[str], file: str | Path | None = None, **place: Any
) -> InputError:
    """The error for a name that nothing answers to: with the nearest known name, or all of them."""
    name, known = str(name), tuple(map(str, known))
    several = re.split(r"[,;]\s*", name)
    if len(several) > 1 and {*several} <= {*known}:
        return InputError(f"unknown {what} '{name}'", file, cure=f"write spaces between: {' '.join(several)}", **place)
    like, inside = nearest(name, known), [k for k in known if name.lower() in k.lower()]
    meant = inside if len(inside) > 1 and len(name) > 2 else [like] if like else []
    cure = f"did you mean {' or '.join(repr(k) for k in meant)}?" if meant else f"known: {', '.join(known)}"
    return InputError(f"unknown {what} '{name}'", file, cure=cure, **place)
