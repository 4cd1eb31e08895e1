"""A sweep in words, and for machines."""

from typing import Any

import numpy as np

from fitting import showing
from fitting.designs.sweep import Swept
from fitting.report.settings import SHOWN
from mckibben_jax.design.merit import QUANTITIES
from mckibben_jax.muscle import quantities as muscle_quantities


def describe(found: Swept) -> str:
    """For people: how many, how many feasible, the best, where the files are."""
    lines = [f"{found.designs:,} designs, {_feasible(found)}; {found.computed:,} computed in {found.seconds:.1f} s"]
    if found.tally.undefined:
        lines.append(f"{int(found.tally.undefined):,} designs have no value: the laws end before them")
    if found.rows:
        lines += _best(found)
    where = found.files[0] if len(found.files) == 1 else f"{found.files[0]} ... {found.files[-1]}"
    return "\n".join([*lines, f"written: {found.folder}/{where}"])


def _feasible(found: Swept) -> str:
    if not found.batch.limits:
        return "no constraints"
    return f"{int(found.tally.feasible):,} meet all constraints ({100 * found.tally.feasible / found.designs:.3g} %)"


def _best(found: Swept) -> list[str]:
    batch = found.batch
    if not len(found.tally.numbers):
        return ["no design meets all constraints: 'mckibben design' says which of them fight"]
    known = muscle_quantities()
    kinds = [known[name][0] for name in batch.space.ranges] + [QUANTITIES[name].unit for name, _ in batch.outputs]
    heads = [*batch.space.ranges, *(name for name, _ in batch.outputs)]
    columns = list(found.rows.values())[1:-1]
    cells = [[showing.show(column[i], unit) for column, unit in zip(columns, kinds, strict=True)]
             for i in range(min(SHOWN.designs, len(found.tally.numbers)))]  # fmt: skip
    widths = [max(map(len, column)) for column in zip(heads, *cells, strict=True)]
    size = "largest" if batch.largest else "smallest"
    told = [f"the {len(found.tally.numbers):,} with the {size} {batch.outputs[batch.by][0]}; first of them:"]
    table = [[f"{cell:>{width}}" for cell, width in zip(row, widths, strict=True)] for row in [heads, *cells]]
    return told + ["  ".join(["", *row]) for row in table]


def to_json(found: Swept) -> dict[str, Any]:
    """For machines: SI, the unit in the key."""
    count = min(SHOWN.listed_designs, len(found.tally.numbers))
    best = [{name: column[i].item() for name, column in found.rows.items()} for i in range(count)]
    return {
        "designs": found.designs,
        "feasible": int(found.tally.feasible),
        "undefined": int(found.tally.undefined),
        "by": found.batch.outputs[found.batch.by][0],
        "best": best,
        "histogram": _histogram(found),
        "folder": str(found.folder),
        "files": list(found.files),
        "computed": found.computed,
        "seconds": round(found.seconds, 3),
    }


def _histogram(found: Swept) -> dict[str, Any] | None:
    drawn = found.batch.histogram
    if drawn is None:
        return None
    counts = np.asarray(found.tally.counts).tolist()
    name = found.batch.outputs[drawn.output][0]
    return {
        "of": name,
        "unit": QUANTITIES[name].unit,
        "edges": np.linspace(drawn.low, drawn.high, drawn.bins + 1).tolist(),
        "counts": counts[1:-1],
        "below": counts[0],
        "above": counts[-1],
    }
