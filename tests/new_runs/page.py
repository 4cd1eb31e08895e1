"""What the records add up to, as a page in Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from ..calibration.page import table

Record = dict[str, Any]
BANDS = {"of fitted": "from the fitted readings themselves", "expected": "band", "edges": "band, each point on its own",
         "cautious": "cautious band"}  # fmt: skip


def page(records: Sequence[Record], command: str, about: str) -> str:
    """The page."""
    done = [r for r in records if "error" not in r]
    failed = [r for r in records if "error" in r]
    parts = ["# How many readings of new runs does the band of 90 % hold?", about, f"`{command}`"]
    parts += [f"{len(failed)} sessions ended in an error: {failed[0]['error']}"] if failed else []
    parts += ["## All together", shares(done, ("group", "order", "runs")), "## By effect that the model lacks",
              shares([r for r in done if r["hidden"]], ("hidden",))]  # fmt: skip
    return "\n\n".join(parts) + "\n"


def shares(records: Sequence[Record], keys: Sequence[str]) -> str:
    """The mean share that each band holds, with its standard error over sessions, for each kind of record."""
    kinds = sorted({tuple(r[key] for key in keys) for r in records})
    rows = [row(kind, [r for r in records if tuple(r[key] for key in keys) == kind]) for kind in kinds]
    heads = [*keys, "sessions", *BANDS.values(), "worst tenth of sessions: band holds less than", "cautious / band"]
    return table(heads, [*rows, row(("all", *[""] * (len(keys) - 1)), records)])


def row(kind: Iterable[Any], records: Sequence[Record]) -> list[str]:
    """One line of that table."""
    cells = [percent([r["held"][name] for r in records]) for name in BANDS]
    worst = np.quantile([r["held"]["expected"] for r in records], 0.1)
    wider = np.median([r["cautious"] / r["width"] for r in records])
    return [*map(str, kind), str(len(records)), *cells, f"{100 * worst:.0f} %", f"{wider:.2f}"]


def percent(values: Sequence[float]) -> str:
    """A mean share with its standard error."""
    return f"{100 * np.mean(values):.1f} +/- {100 * np.std(values) / max(len(values), 1) ** 0.5:.1f} %"
