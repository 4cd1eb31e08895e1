"""A CSV file as text: whatever encoding a logger or spreadsheet wrote it in, and nothing that is no text."""

import re
from pathlib import Path

from fitting.errors import InputError
from fitting.recordings.heads import known_words
from fitting.recordings.settings import TABLES

OTHER_KINDS = {
    b"PK\x03\x04": ("this is a spreadsheet, not a CSV", "save the sheet as CSV (UTF-8), or name the file .xlsx"),
    b"\xd0\xcf\x11\xe0": ("this is a spreadsheet, not a CSV", "save the sheet as CSV (UTF-8)"),
    b"SQLite format 3": ("this is a ROS 2 bag of the older kind", "write it as MCAP with 'ros2 bag convert'"),
    b"\x1f\x8b": ("this is a packed file, not a CSV", "unpack it first, for example with gunzip"),
}  # by their first bytes
# as Windows writes texts in Western Europe, Japan, China and Korea, that of the West first: it may hold no word we know
ENCODINGS = ("cp1252", "cp932", "gb18030", "cp949")
LOOKED_AT = 20_000  # bytes, for words; chosen
_CONTROL = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x84\x86-\x9f]")  # an escape sequence would reach the screen


def text_of(path: Path) -> tuple[str, bytes]:
    """The file's text and its bytes; InputError where it is missing, too large or no text."""
    raw = bytes_of(path)
    for begins, (problem, cure) in OTHER_KINDS.items():
        if raw.startswith(begins):
            raise InputError(problem, path, cure=cure)
    text = _decoded(raw, path).removesuffix("\x1a")  # the end of a file as DOS programs mark it
    control = _CONTROL.search(text)
    if control:
        row = re.sub(r"\r\n?", "\n", text[: control.start()]).count("\n") + 1
        problem = "this is not a text file: a character in it cannot be printed"
        raise InputError(problem, path, row, value=ascii(control[0])[1:-1], cure="export the recording as CSV")
    return text, raw


def bytes_of(path: Path, fewer: str = "") -> bytes:
    """The bytes of a recording; InputError where it is missing or too large: `fewer` says how to make it smaller."""
    try:
        if not path.is_file():  # a folder, or a device that never ends
            raise OSError
        size = path.stat().st_size
        if size > TABLES.csv_bytes:
            every = -(-size // TABLES.csv_bytes)
            cure = (
                fewer
                or f"keep every {every}th row, leave out columns that are not needed, or cut it into several recordings"
            )
            problem = f"the file is larger than {TABLES.csv_bytes / 1e6:g} MB"
            raise InputError(problem, path, value=f"{size / 1e6:.0f} MB", cure=cure)
        return path.read_bytes()
    except (OSError, ValueError):  # ValueError: a name with a zero byte
        raise InputError("no such file, or it cannot be read", path, cure="check `file` in muscle.toml") from None


def _decoded(raw: bytes, path: Path) -> str:
    encoding = "utf-16" if raw[:2] in (b"\xff\xfe", b"\xfe\xff") else _unmarked(raw)
    try:
        return raw.decode(encoding)
    except UnicodeDecodeError:
        if encoding.startswith("utf-16"):
            cure = "export the recording again, as CSV (UTF-8)"
            raise InputError("the file is UTF-16 text that breaks off or is damaged", path, cure=cure) from None
        return raw.decode(_of_a_country(raw), "replace")


def _of_a_country(raw: bytes) -> str:
    """Encoding of text that is no Unicode: that in which the most words of the first lines are known, else Windows'."""
    first = raw[:LOOKED_AT].rpartition(b"\n")[0]  # no character is cut
    known = {encoding: known_words(first.decode(encoding, "replace")) for encoding in ENCODINGS}
    return max(ENCODINGS, key=known.__getitem__)


def _unmarked(raw: bytes) -> str:
    """Encoding of a file without a byte-order mark: in UTF-16 every other byte of a plain header is zero."""
    head = raw[:200]
    if len(head) >= 8 and b"\x00" not in head[::2] and not any(head[1::2]):
        return "utf-16-le"
    if len(head) >= 8 and b"\x00" not in head[1::2] and not any(head[::2]):
        return "utf-16-be"
    return "utf-8-sig"
