"""The store of compiled code: where it is, how large it may grow, and entries that are whole or not there.

jax writes an entry where others read it. A full disk or a kill then leaves a torn one, which jax never replaces: every
later process warned and compiled anew. So jax is given a store of ours, whose entries begin with a digest of the rest.
"""

import hashlib
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fitting.writing import write_replacing

MOST_BYTES = 512 * 1024**2
CHECK = hashlib.sha256
LENGTH = CHECK().digest_size


def keep_compiled() -> None:
    """Switch on the store of compiled code, which other processes use too."""
    import jax

    place = folder()
    if place is None:
        return
    prune(place)
    _entries_are_whole()
    jax.config.update("jax_compilation_cache_dir", str(place))
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0)
    jax.config.update("jax_persistent_cache_min_entry_size_bytes", -1)


def folder() -> Path | None:
    """Where compiled code is kept; None where nothing can be written."""
    base = os.environ.get("XDG_CACHE_HOME") or (Path.home() / ".cache")
    place = Path(os.environ.get("MCKIBBEN_CACHE") or Path(base) / "mckibben")
    try:
        place.mkdir(parents=True, exist_ok=True)
    except OSError:
        return None
    return place if os.access(place, os.W_OK) else None


@dataclass(frozen=True)
class Content:
    """How much a store keeps."""

    folder: Path
    programs: int
    bytes: int


def content(place: Path | None) -> Content | None:
    """What a store keeps; None where there is none."""
    if place is None:
        return None
    sizes = [entry.stat().st_size for entry in place.iterdir() if entry.is_file()]
    return Content(place, len(sizes), sum(sizes))


def prune(place: Path, most: int = MOST_BYTES) -> None:
    """Delete the oldest entries until half of what is allowed is left.

    jax can bound its store itself, but only with a further package for locking.
    """
    try:
        with os.scandir(place) as found:  # thousands of entries at every start: the quickest way to ask
            entries = [(entry.stat(), entry.path) for entry in found if entry.is_file()]
    except OSError:
        return  # another process is deleting: it does the work
    total = sum(stat.st_size for stat, _ in entries)
    if total <= most:
        return
    for stat, path in sorted(entries, key=lambda entry: entry[0].st_mtime):
        if total <= most / 2:
            return
        Path(path).unlink(missing_ok=True)
        total -= stat.st_size


# Entries --------------------------------------------------------------------------------------------------------------


def read(place: Path) -> bytes | None:
    """What was kept there; None where there is nothing, or something torn."""
    try:
        written = place.read_bytes()
        check, content = written[:LENGTH], written[LENGTH:]
        if CHECK(content).digest() != check:
            return None
        os.utime(place)  # what is used is deleted last
    except OSError:
        return None
    return content


def write(place: Path, content: bytes) -> None:
    """Keep a content; where that cannot be, the next process makes it again."""
    try:
        write_replacing(place, lambda new: new.write_bytes(CHECK(content).digest() + content))
    except OSError:
        return


def _entries_are_whole() -> None:
    """Give jax this store in place of its own; a jax that asks for it by another name goes on with its own."""
    from jax._src import compilation_cache

    if not hasattr(compilation_cache, "get_file_cache"):
        return
    from jax._src.compilation_cache_interface import CacheInterface

    class Whole(CacheInterface):
        """Compiled programs by their key."""

        def __init__(self, path: str):
            self._path = Path(path)

        def get(self, key: str) -> bytes | None:
            return read(self._path / f"{key}.compiled")

        def put(self, key: str, value: bytes) -> None:
            write(self._path / f"{key}.compiled", value)

    def whole(path: str) -> tuple[Any, str]:
        return Whole(path), path

    compilation_cache.get_file_cache = whole
