"""Which readings the live picture holds: all of them, or of a large set those that shape the misfit most."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fitting.report.pictures.panels import Panel, largest_triangles
from fitting.report.settings import LIVE


@dataclass(frozen=True)
class Chosen:
    """The readings of one run that are in the picture.

    `at` are their places among all samples that carry weight, `position` those within the run.
    """

    panel: Panel
    at: np.ndarray
    position: np.ndarray


def chosen_readings(panels: Sequence[Panel], residual: np.ndarray) -> list[Chosen]:
    """Of every run its share of the readings that a page may hold; runs with small errors give way to the others.

    `residual` (N or m) is that of the model whose shape the readings are to keep.
    """
    most = LIVE.readings // LIVE.fewest
    kept = sorted(panels, key=lambda panel: -panel.rmse)[:most]
    kept = [panel for panel in panels if any(panel is one for one in kept)]
    share = min(LIVE.readings / max(sum(len(panel.mine) for panel in kept), 1), 1.0)
    return [_of_run(panel, residual[panel.mine], share) for panel in kept]


def _of_run(panel: Panel, residual: np.ndarray, share: float) -> Chosen:
    part = np.arange(len(residual)) if share >= 1.0 else _thinned(panel, residual, share)
    if panel.is_few:  # points of a map stand in no order of their own: so that lines run along the axis
        part = part[np.argsort(panel.along[panel.position[part]], kind="stable")]
    return Chosen(panel, panel.mine[part], panel.position[part])


def _thinned(panel: Panel, residual: np.ndarray, share: float) -> np.ndarray:
    """Of every branch its share with both ends, so that a loop keeps its corners; of many short ones, of all as one."""
    turns = np.flatnonzero(np.diff(panel.run.half[panel.position])) + 1
    if LIVE.fewest_on_a_branch * (len(turns) + 1) > share * len(residual):
        return largest_triangles(residual, max(int(share * len(residual)), LIVE.fewest))
    branches = np.split(np.arange(len(residual)), turns)
    counts = [max(int(share * len(branch)), LIVE.fewest_on_a_branch) for branch in branches]
    return np.concatenate([b[largest_triangles(residual[b], n)] for b, n in zip(branches, counts, strict=True)])


def thinned_text(chosen: Sequence[Chosen], panels: Sequence[Panel]) -> str:
    """What is left out of the picture; empty where nothing is."""
    held, known = sum(len(one.at) for one in chosen), sum(len(panel.mine) for panel in panels)
    if held == known:
        return ""
    runs = f" of the {len(chosen)} runs with the largest errors" if len(chosen) < len(panels) else ""
    return (
        f"To keep the page small, this picture holds {held:,} of {known:,} readings{runs}: the ends of every branch, "
        "and those that shape the misfit most. Every number elsewhere on the page is from all readings."
    )
