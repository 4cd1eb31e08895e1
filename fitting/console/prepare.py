"""What every command that computes needs: 64 bits, and compiled code kept from one call to the next."""

import os
import sys
import warnings
from pathlib import Path

CACHE_BYTES = 512 * 1024**2


def prepare() -> None:
    """Switch on 64 bits and the store of compiled code."""
    import jax

    if not sys.warnoptions:
        warnings.simplefilter("ignore")  # what matters is said in the report
    jax.config.update("jax_enable_x64", True)
    keep_compiled()


def keep_compiled() -> None:
    """Switch on the store of compiled code, which other processes use too."""
    import jax

    place = cache_folder()
    if place is None:
        return
    prune(place)
    jax.config.update("jax_compilation_cache_dir", str(place))
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0)
    jax.config.update("jax_persistent_cache_min_entry_size_bytes", -1)


def cache_folder() -> Path | None:
    """Where compiled code is kept; None where nothing can be written."""
    base = os.environ.get("XDG_CACHE_HOME") or (Path.home() / ".cache")
    place = Path(os.environ.get("MCKIBBEN_CACHE") or Path(base) / "mckibben")
    try:
        place.mkdir(parents=True, exist_ok=True)
    except OSError:
        return None
    return place if os.access(place, os.W_OK) else None


def prune(place: Path, most: int = CACHE_BYTES) -> None:
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
