"""Maps: where the model pulls too much or too little, and which effects look alike. One function for each figure."""

from typing import TYPE_CHECKING, Any

import numpy as np

from fitting import units
from fitting.comparison.compare import PRESSURE_LED, Comparison, branch_name
from fitting.diagnosis.record import Diagnosis
from fitting.report.page.similar_groups import cosines
from fitting.report.pictures.figures import BLUE, VERMILION, blank, settings
from fitting.report.settings import FIGURE
from fitting.report.text.amounts import places

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def branch_maps(c: Comparison) -> list["Figure"]:
    """The misfit over contraction and pressure, a small figure for each direction."""
    if c.cells is None:
        return []
    shown = {branch_name(b, _led_by(c)): c.cells.mean[b] for b in (1, -1, 0) if c.cells.count[b].any()}
    return _small_maps(c, shown if len(shown) > 1 else {"all points": next(iter(shown.values()))})


def parity_maps(c: Comparison) -> list["Figure"]:
    """What of the misfit is the same in both directions (even), and what changes its sign (odd)."""
    if c.cells is None or c.cells.odd_share is None:
        return []
    return _small_maps(c, {"even: the same in both directions": c.cells.even, "odd: changes its sign": c.cells.odd})


def _small_maps(c: Comparison, shown: dict[str, np.ndarray]) -> list["Figure"]:
    unit, size = units.shown_in("N")
    top = max(float(np.nanmax(np.abs(values))) for values in shown.values()) / size or 1.0
    assert c.cells is not None  # the callers have looked
    drawn = []
    for title, values in shown.items():
        figure = blank(3.9, 0.95 + 0.22 * max(len(c.cells.pressure), 5))
        figure.set_layout_engine("constrained")
        with settings():
            axes = figure.add_subplot()
            cells = np.ma.masked_invalid(values / size)
            mesh = axes.pcolormesh(cells, cmap=_diverging(), vmin=-top, vmax=top, edgecolors="face", linewidth=0.2)
            _label_cells(axes, c, True)
            axes.set_title(title, loc="left")
            bar = figure.colorbar(mesh, ax=axes, shrink=0.9, aspect=18, pad=0.02)
            bar.outline.set_visible(False)  # type: ignore[operator]
            bar.set_label(f"model minus measured [{unit}]")
        drawn.append(figure)
    return drawn


def alike_names(d: Diagnosis) -> list[str]:
    """Effects that look like another in these data, the most alike first."""
    strongest = {e.name: max(e.similar.values(), default=0.0) for e in d.effects.values() if e.similar}
    return sorted(strongest, key=lambda name: -strongest[name])[: FIGURE.similar]


def alike_map(d: Diagnosis) -> "Figure":
    """How alike effects look in these data: the cosine between what each changes, once the model has given way."""
    names = alike_names(d)
    values = cosines(d, names)
    size = 0.27 * len(names)
    figure = blank(size + 3.1, size + 1.5)
    figure.set_layout_engine("constrained")
    with settings():
        axes = figure.add_subplot()
        shown = np.ma.masked_invalid(values)
        mesh = axes.pcolormesh(shown, cmap=_rising(), vmin=0, vmax=1, edgecolors="face", linewidth=0.2)
        at = np.arange(len(names)) + 0.5
        axes.set_yticks(at, names)
        axes.set_xticks(at, names, rotation=60, ha="right", rotation_mode="anchor")
        axes.invert_yaxis()
        axes.tick_params(length=0)
        for side in axes.spines.values():
            side.set_visible(False)
        bar = figure.colorbar(mesh, ax=axes, shrink=0.7, aspect=18, pad=0.02)
        bar.outline.set_visible(False)  # type: ignore[operator]
        bar.set_label("similarity (cosine)")
    return figure


def _led_by(c: Comparison) -> str:
    tests = {score.test for score in c.by_recording if score.unit == c.unit}
    return next(iter(tests)) if len(tests) == 1 and tests <= set(PRESSURE_LED) else "loop"


def _label_cells(axes: "Axes", c: Comparison, first: bool) -> None:
    assert c.cells is not None  # the caller has looked
    pressure, contraction = c.cells.pressure, c.cells.contraction
    at = np.linspace(0, len(contraction) - 1, min(5, len(contraction))).round().astype(int)
    axes.set_xticks(at + 0.5, [f"{contraction.centre[k]:.2f}" for k in at])
    axes.set_xlabel("contraction")
    name, size = units.shown_in("Pa", float(np.max(pressure.centre)))
    after = places(pressure.centre / size)
    axes.set_yticks(np.arange(len(pressure)) + 0.5, [f"{p / size:.{after}f}" * first for p in pressure.centre])
    if first:
        axes.set_ylabel(f"pressure [{name}]")
    for side in axes.spines.values():
        side.set_visible(False)


def _diverging() -> Any:
    from matplotlib.colors import LinearSegmentedColormap

    colours = LinearSegmentedColormap.from_list("misfit", [BLUE, "#f2f2f2", VERMILION], N=41)  # few: no bitmap
    return colours.with_extremes(bad="none")


def _rising() -> Any:
    from matplotlib.colors import LinearSegmentedColormap

    return LinearSegmentedColormap.from_list("alike", ["#f2f2f2", BLUE], N=21).with_extremes(bad="none")
