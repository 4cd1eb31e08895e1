"""In which line of a muscle.toml something of one [[recording]] stands: keys of several recordings are alike."""

import re

ENTRY = re.compile(r"\s*\[\[\s*recording\s*\]\]")
ACCURACY = re.compile(r"\s*(\[\s*recording\s*\.\s*accuracy\s*\]|accuracy\s*=)")
OTHER = re.compile(r"\s*\[(?!\s*recording\s*\.)")  # the head of what belongs to no recording


def row_in_recording(raw: bytes, number: int, key: str | None) -> int | None:
    """Line, as an editor counts, that sets `key` in the `number`-th (from 0) [[recording]]; else where that begins.

    A key "accuracy.force" is one of its [recording.accuracy]. None where the file writes its recordings another way.
    """
    lines = raw.decode("utf-8-sig", "replace").split("\n")
    entries = [row for row, line in enumerate(lines) if ENTRY.match(line)]
    if number >= len(entries):
        return None
    first = entries[number]
    end = next((row for row in range(first + 1, len(lines)) if OTHER.match(lines[row])), len(lines))
    table = next((row for row in range(first, end) if ACCURACY.match(lines[row])), end)
    name, _, column = (key or "").partition(".")
    if name == "accuracy":
        return 1 + _row(lines, table, end, column, table if table < end else first)
    return 1 + _row(lines, first, table, name, first)


def row_in_table(raw: bytes, table: str, key: str) -> int | None:
    """Line, as an editor counts, that sets a key of a [table]; else where that begins; None where it stands nowhere."""
    lines = raw.decode("utf-8-sig", "replace").split("\n")
    head = re.compile(rf"\s*\[\s*{re.escape(table)}\s*\]")
    first = next((row for row, line in enumerate(lines) if head.match(line)), None)
    if first is None:
        return None
    end = next((row for row in range(first + 1, len(lines)) if lines[row].lstrip().startswith("[")), len(lines))
    return 1 + _row(lines, first, end, key, first)


def _row(lines: list[str], first: int, end: int, key: str, otherwise: int) -> int:
    """The one line from `first` on and before `end` that sets the key or heads its table."""
    called = rf"[\"']?{re.escape(key)}[\"']?\s*"
    setting = re.compile(rf"\s*({called}(=|\.|$)|\[\s*recording\s*\.\s*accuracy\s*\.\s*{called}\])")
    found = [row for row in range(first, end) if key and setting.match(lines[row])]
    return found[0] if len(found) == 1 else otherwise
