"""What was compiled ahead, in words."""

from collections.abc import Mapping
from typing import Any

from rich.console import RenderableType

from fitting.compiled.store import Content
from fitting.report.text.layout import line, lines
from fitting.showing import counted

UNKEPT = "Nothing can be kept: no folder for compiled programs can be written to. Set MCKIBBEN_CACHE to one that can."


def warm_report(seconds: Mapping[str, float], kept: Content | None) -> list[RenderableType]:
    """How long each data set took, and what is kept where."""
    shown: list[RenderableType] = lines("READY", [f"{path}: {taken:.0f} s" for path, taken in seconds.items()])
    if kept is None:
        return [*shown, line("WARNING", UNKEPT, "yellow")]
    size = f"{kept.bytes / 1024**2:.0f} MiB"
    return [*shown, line("KEPT", f"{counted(kept.programs, 'compiled program')}, {size}, in {kept.folder}")]


def warm_result(seconds: Mapping[str, float], kept: Content | None) -> dict[str, Any]:
    """The same for machines."""
    told = None if kept is None else {"folder": str(kept.folder), "programs": kept.programs, "bytes": kept.bytes}
    return {"data": [{"path": path, "seconds": taken} for path, taken in seconds.items()], "store": told}
