"""What the live picture draws, as text: the readings once, and of every model one value for each of them."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fitting import showing
from fitting.comparison.compare import Comparison
from fitting.report.page.live import packed
from fitting.report.page.live.candidates import Candidate
from fitting.report.page.live.chosen import Chosen
from fitting.report.pictures import maps
from fitting.report.pictures.overview import held_ranks
from fitting.report.pictures.panels import Panel
from fitting.report.settings import FIGURE
from fitting.report.text.amounts import amount

NO_CELL = 255


@dataclass(frozen=True)
class Curve:
    """A model as it is drawn: its name, its bar in % of the longest, model minus measured of all samples."""

    name: str
    width: float
    residual: np.ndarray


def payload(
    curves: Sequence[Curve],
    chosen: Sequence[Chosen],
    compared: Sequence[Comparison] = (),
    candidates: Sequence[Candidate] = (),
) -> str:
    """JSON for the script; `compared` are the comparisons whose maps stand beside the picture, one for each curve.

    `candidates` are what may be tried beside them, as dotted lines.
    It holds no character that HTML gives a meaning. Quantities are in the unit that the axes show.
    """
    groups = list(dict.fromkeys((one.panel.xlabel, one.panel.ylabel) for one in chosen))
    panels = [one.panel for one in chosen]
    ranks = [held_ranks([p for p in panels if (p.xlabel, p.ylabel) == group]) for group in groups]
    content = {
        "groups": [_group(group, panels) for group in groups],
        "runs": [_run(one, groups, ranks) for one in chosen],
        "readings": _readings(chosen, compared[0] if compared else None),
        "pressure_unit": showing.shown_in("Pa")[0],
        "models": [
            {"name": curve.name, "width": curve.width, "values": packed.floats(values_of(curve.residual, chosen))}
            for curve in curves
        ],
        "candidates": [
            {"model": one.model, "name": one.name, "values": packed.read_off(values_of(one.residual, chosen))}
            for one in candidates
        ],
        "maps": _maps(compared),
        "parts": FIGURE.parts,
    }
    text = json.dumps(content, allow_nan=False, separators=(",", ":"))
    return text.replace("&", "\\u0026").replace("<", "\\u003c").replace(">", "\\u003e")


def _group(labels: tuple[str, str], panels: Sequence[Panel]) -> dict[str, Any]:
    """Axes that some runs share: their labels, and the band of noise (half its width) on the strip of misfit."""
    mine = [panel for panel in panels if (panel.xlabel, panel.ylabel) == labels]
    noise = float(np.median([panel.noise / panel.size for panel in mine]))
    name, unit = labels[1].removesuffix("]").split(" [")
    return {"along": labels[0].split(" [")[0], "xlabel": labels[0], "ylabel": labels[1], "measured": name,
            "unit": unit, "band": FIGURE.sigmas * noise, "decimals": _decimals(noise)}  # fmt: skip


def _decimals(noise: float) -> int:
    """Digits behind the point with which the noise is still seen."""
    return int(np.clip(1 - np.floor(np.log10(noise)), 0, 6)) if noise > 0 else 3


def _run(one: Chosen, groups: Sequence[tuple[str, str]], ranks: Sequence[dict[str, int]]) -> dict[str, Any]:
    panel = one.panel
    group = groups.index((panel.xlabel, panel.ylabel))
    return {"label": panel.label, "held": panel.held, "count": len(one.at), "group": group,
            "rank": ranks[group][panel.held], "few": panel.is_few}  # fmt: skip


def values_of(residual: np.ndarray, chosen: Sequence[Chosen]) -> np.ndarray:
    """The model at every reading of the picture, from model minus measured of all samples."""
    return _joined([_model(one, residual) for one in chosen])


def _model(one: Chosen, residual: np.ndarray) -> np.ndarray:
    return (one.panel.run.measured[one.position] + residual[one.at]) / one.panel.size


def _readings(chosen: Sequence[Chosen], c: Comparison | None) -> dict[str, Any]:
    """Of every reading: where it was taken, what was measured, its line in the file, its branch and its cell.

    `branch` is 0 while elongating, 1 where it cannot be told, 2 while contracting.
    """
    runs = [(one.panel.run, one.position) for one in chosen]
    pressure = _joined([run.pressure[at] for run, at in runs]) / showing.shown_in("Pa")[1]
    return {
        "contraction": packed.read_off(_joined([run.contraction[at] for run, at in runs])),
        "pressure": packed.read_off(pressure),
        "time": _times(chosen),
        "measured": packed.floats(_joined([one.panel.measured[one.position] for one in chosen])),
        "row": packed.counts(_joined([run.row[at] for run, at in runs])),
        "branch": packed.counts(_joined([run.branch[at] for run, at in runs]) + 1),
        "cell": packed.counts(
            _joined([np.full(len(one.at), NO_CELL) if c is None else _cells(c)[one.at] for one in chosen])
        ),
    }


def _times(chosen: Sequence[Chosen]) -> dict[str, Any] | None:
    """The times (s), where they are an axis."""
    if not any(one.panel.xlabel.startswith("time") for one in chosen):
        return None
    return packed.read_off(_joined([one.panel.run.time[one.position] for one in chosen]))


def _cells(c: Comparison) -> np.ndarray:
    """The cell of the map that every sample is in, row by row."""
    known = np.full(len(c.fit.samples), NO_CELL)
    if c.cells is not None and len(c.cells.pressure) * len(c.cells.contraction) < NO_CELL:
        seen = np.array([c.by_recording[k].unit == c.unit for k in c.fit.samples.recording])
        known[seen] = c.cells.pressure.of * len(c.cells.contraction) + c.cells.contraction.of
    return known


def _maps(compared: Sequence[Comparison]) -> dict[str, Any] | None:
    """The values of the cells of every map and model, and the colours that they have."""
    cells = compared[0].cells if compared else None
    if cells is None or len({tuple(m.branches for m in maps.cell_maps(c)) for c in compared}) > 1:
        return None
    scale = maps.scale_of(compared)
    drawn = zip(*(maps.cell_maps(c) for c in compared), strict=True)
    rows = [cells.pressure.label(k, "Pa") for k in range(len(cells.pressure))]
    columns = [cells.contraction.label(k, "") for k in range(len(cells.contraction))]
    return {
        "rows": rows, "columns": columns, "ends": list(scale.ends), "shades": maps.shades(scale), "noise": scale.noise,
        "noise_text": amount(scale.noise, "N"),
        "drawn": [{"kind": same[0].kind, "title": same[0].title, "branches": [b + 1 for b in same[0].branches],
                   "values": [packed.floats(one.values.ravel()) for one in same]} for same in drawn],
    }  # fmt: skip


def _joined(parts: Sequence[np.ndarray]) -> np.ndarray:
    return np.concatenate(parts) if parts else np.zeros(0)
