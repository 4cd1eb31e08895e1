"""Files that are there whole or not at all: whatever ends the program, what was there before is not lost."""

import contextlib
import errno
import os
import secrets
import shutil
import stat
from collections.abc import Callable
from pathlib import Path
from typing import Any

from fitting.errors import InputError

FULL = (errno.ENOSPC, errno.EFBIG, errno.EDQUOT)
LONGEST = 60  # letters of a file's name in that of its half-written self: a name has 255 bytes at most


def write_replacing(path: Path | str, write: Callable[[Path], Any]) -> None:
    """Write a file, or a folder that is not there yet, beside its place, then move it there in one step.

    OSError where that cannot be; then all is as it was. A kill leaves at most a hidden file that nothing reads. A link
    is followed; a pipe or a device (and /dev/stdout, whatever it is) is written to as it is.
    """
    place = Path(path)
    if place.is_relative_to("/dev") or _is_special(place):
        write(place)
        return
    place = place.resolve()
    new = place.with_name(f".{place.name[:LONGEST]}.{secrets.token_hex(4)}")
    try:
        write(new)
        if place.is_file():
            shutil.copymode(place, new)
        os.replace(new, place)
    except BaseException:  # Ctrl+C too
        _removed(new)
        raise


def _is_special(place: Path) -> bool:
    """Whether a pipe or a device is there. One look decides: between two, another program may move a folder away."""
    try:
        mode = place.stat().st_mode
    except OSError:
        return False
    return not (stat.S_ISREG(mode) or stat.S_ISDIR(mode))


def text_replaced(path: Path | str, text: str) -> None:
    """Write a text whole, and not before the disk has it: after a power cut it is the old one or the new."""

    def write(new: Path) -> None:
        with new.open("w", encoding="utf-8") as file:
            file.write(text)
            file.flush()
            _settled(file.fileno())

    write_replacing(path, write)


def write_text(path: Path | str, text: str, cure: str = "") -> None:
    """Write a text whole, or say why that cannot be."""
    try:
        text_replaced(path, text)
    except OSError as error:
        raise refused(path, error, cure) from None


def write_whole(path: Path | str, write: Callable[[Path], Any], cure: str = "") -> None:
    """Let something else write a file whole, or say why that cannot be."""
    try:
        write_replacing(path, write)
    except OSError as error:
        raise refused(path, error, cure) from None


def refused(path: Path | str, error: OSError, cure: str = "") -> InputError:
    """Why a file could not be written, with a cure: that given, or what helps against such an error."""
    if not cure:
        elsewhere = "name a file in a folder that exists and may be written to"
        cure = "make room, then give the same command again" if error.errno in FULL else elsewhere
    return InputError(f"the file cannot be written: {error.strerror or error}", path, cure=cure)


def _settled(number: int) -> None:
    """Wait until the disk has a file, which may say only now that it is full; a pipe or a device cannot."""
    try:
        os.fsync(number)
    except OSError as error:
        if error.errno not in (errno.EINVAL, errno.ENOTSUP):
            raise


def _removed(new: Path) -> None:
    shutil.rmtree(new, ignore_errors=True)
    with contextlib.suppress(OSError):
        new.unlink()
