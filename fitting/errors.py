"""Bad input is reported once, completely: where it stands, the value met, what is wrong and what to do about it."""

import difflib
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any


@dataclass
class InputError(Exception):
    """Something the user gave cannot be used.

    `row` is the line of the file as an editor counts it (the header of a CSV is line 1); `cure` is something to type
    or paste. The message is one sentence on what is wrong and one on the cure.
    """

    problem: str
    file: str | Path | None = None
    row: int | None = None
    column: str | None = None
    value: Any = None
    cure: str = ""

    def __str__(self) -> str:
        where = self._where()
        met = "" if self.value is None else f" (found: {str(self.value)!r})"
        cure = f" Cure: {self.cure}" if self.cure else ""
        return f"{where}{': ' if where else ''}{self.problem}{met}.{cure}"

    def _where(self) -> str:
        parts = (
            str(self.file) if self.file is not None else "",
            f"row {self.row}" if self.row is not None else "",
            f"column '{self.column}'" if self.column is not None else "",
        )
        return ", ".join(part for part in parts if part)

    def as_dict(self) -> dict[str, Any]:
        """The same, field by field, for `--json`."""
        return {
            "problem": self.problem,
            "file": None if self.file is None else str(self.file),
            "row": self.row,
            "column": self.column,
            "value": None if self.value is None else str(self.value),
            "cure": self.cure,
        }


def nearest(name: str, known: Iterable[str], alike: float = 0.6) -> str | None:
    """The known name that a misspelt one most likely means; None if none is like it."""
    by_folded = {k.lower(): k for k in known}
    match = difflib.get_close_matches(name.lower(), by_folded, n=1, cutoff=alike)
    return by_folded[match[0]] if match else None


def unknown_name(
    what: str, name: str, known: Iterable[str], file: str | Path | None = None, **place: Any
) -> InputError:
    """The error for a name that nothing answers to: with the nearest known name, or all of them."""
    known = tuple(known)
    like = nearest(name, known)
    cure = f"did you mean '{like}'?" if like else f"known: {', '.join(known)}"
    return InputError(f"unknown {what} '{name}'", file, cure=cure, **place)
