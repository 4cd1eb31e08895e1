"""The kinds of file that hold a recording, and which reader opens each."""

import re
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

from fitting.errors import InputError
from fitting.recordings.cells import NUMBER
from fitting.recordings.source import Source
from fitting.recordings.table_cells import NO_ROW, cells_of, heads_of, lines_of, separator_of, split
from fitting.recordings.table_text import text_of
from fitting.recordings.units_row import with_units

MATLAB, SHEETS, BAGS, LABVIEW = (".mat",), (".xlsx", ".xlsm"), (".mcap",), (".tdms",)
TEXTS = (".txt", ".tsv", ".dat", ".asc", ".lvm")  # tables as loggers write them, or anything else in words
ENDINGS = (".csv", *TEXTS, *MATLAB, *SHEETS, *BAGS, *LABVIEW)
FEWEST_NUMBERS, LOOKED_AT = 3, 8192  # in a row of readings; bytes of a text in which one is looked for: chosen
# options that say which part of a file is meant, the endings that have them, and what such a file is called
INSIDE = {"sheet": SHEETS, "variable": MATLAB, "topic": BAGS, "group": LABVIEW}
OWNERS = {"sheet": "an Excel file", "variable": "a MATLAB file", "topic": "a ROS 2 bag", "group": "a TDMS file"}


def is_recording(path: Path) -> bool:
    """Whether a file's name says that it holds a recording. Excel's own lock files (~$name) hold none."""
    return path.suffix.lower() in ENDINGS and not path.name.startswith("~$")


def recordings_in(folder: Path) -> list[Path]:
    """The files of a folder that may hold recordings, by name; of texts those that hold a table of numbers."""
    found = (path for path in folder.iterdir() if is_recording(path))
    return sorted(path for path in found if path.suffix.lower() not in TEXTS or _holds_readings(path))


def _holds_readings(path: Path) -> bool:
    """Whether a row of numbers stands near the beginning of a text: one that explains something has none."""
    try:
        with path.open("rb") as file:
            text = file.read(LOOKED_AT).decode("utf-8", "replace").replace("\0", "")  # of UTF-16 what is ASCII
    except OSError:
        return False
    cells = (re.split("[;\t]", line) if re.search("[;\t]", line) else line.split(",") for line in text.splitlines())
    return any(sum(bool(NUMBER.fullmatch(cell.strip())) for cell in row) >= FEWEST_NUMBERS for row in cells)


def open_source(path: Path, inside: Mapping[str, str], is_head: Callable[[str], bool]) -> Source:
    """Open a recording; `inside` may hold an option of `INSIDE`, `is_head` says whether a head is one of ours."""
    ending = path.suffix.lower()
    _check_inside(inside, ending, path)
    if ending in SHEETS:
        from fitting.recordings.workbook import sheet_source

        return sheet_source(path, inside.get("sheet"), is_head)
    if ending in MATLAB:
        from fitting.recordings.mat_file import mat_source

        return mat_source(path, inside.get("variable"))
    if ending in BAGS:
        from fitting.recordings.bag import bag_source

        return bag_source(path, inside.get("topic"))
    if ending in LABVIEW:
        from fitting.recordings.tdms_file import tdms_source

        return tdms_source(path, inside.get("group"))
    return _csv_source(path, is_head)


def parts_of(path: Path) -> list[dict[str, str]]:
    """What `inside` may be for each recording that a file holds; one empty choice where there is nothing to choose."""
    if path.suffix.lower() in SHEETS:
        from fitting.recordings.workbook import sheet_names

        return _choices("sheet", sheet_names(path))
    if path.suffix.lower() in MATLAB:
        from fitting.recordings.mat_file import struct_names

        return _choices("variable", struct_names(path))
    if path.suffix.lower() in BAGS:
        from fitting.recordings.bag import measured_topic

        return [{"topic": name} for name in measured_topic(path)] or [{}]
    if path.suffix.lower() in LABVIEW:
        from fitting.recordings.tdms_file import group_names

        return _choices("group", group_names(path))
    return [{}]


def _choices(option: str, names: Iterable[str]) -> list[dict[str, str]]:
    found = [{option: name} for name in names]
    return found if len(found) > 1 else [{}]


def _check_inside(inside: Mapping[str, str], ending: str, path: Path) -> None:
    for option in inside:
        if ending not in INSIDE[option]:
            raise InputError(
                f"only {OWNERS[option]} has a {option}", path, value=inside[option], cure=f"leave {option} out"
            )


def _csv_source(path: Path, is_head: Callable[[str], bool]) -> Source:
    text, raw = text_of(path)
    header_row, header, lines, rows = lines_of(text, path, is_head)
    separator = separator_of(header, path)
    heads = heads_of(header, separator, path)
    named = with_units(heads, split(lines[0], separator, path))
    if named is not None:
        heads, lines, rows = named, lines[1:], rows[1:]
        if not lines:
            raise InputError(NO_ROW, path, header_row, cure="export the readings too")
    return Source(heads, header_row, rows, raw, lambda: cells_of(lines, rows, heads, separator, path))
