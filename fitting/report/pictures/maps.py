"""Maps: where the model pulls too much or too little, and which effects look alike. One function for each figure."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from fitting import showing
from fitting.comparison.compare import PRESSURE_LED, Comparison, branch_name
from fitting.diagnosis.record import Diagnosis
from fitting.report.page.similar_groups import cosines
from fitting.report.pictures.figures import BLUE, GREY, VERMILION, blank, settings
from fitting.report.settings import FIGURE
from fitting.report.text.amounts import places

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Scale:
    """The colours of the maps of all models on a page: steps of the misfit in multiples of the noise (N)."""

    noise: float
    steps: tuple[float, ...]

    @property
    def ends(self) -> np.ndarray:
        """Where one colour ends and the next begins, in N."""
        above = np.array(self.steps)
        return self.noise * np.concatenate([-above[::-1], above])


def scale_of(compared: Sequence[Comparison]) -> Scale:
    """One scale for these models: from twice the noise up to the largest mean misfit of a cell."""
    noise = max(compared[-1].floor, FIGURE.least_noise)
    cells = [c.cells.mean[b] for c in compared if c.cells is not None for b in c.cells.mean]
    largest = max((float(np.nanmax(np.abs(each))) for each in cells if np.isfinite(each).any()), default=0.0)
    needed = 1 + sum(step < largest / noise for step in FIGURE.noise_steps)
    return Scale(noise, FIGURE.noise_steps[: max(needed, 2)])


@dataclass(frozen=True)
class CellMap:
    """What one small map shows: values (pressure, contraction) in N, and of which branches they are the misfit."""

    kind: str  # "branch" or "parity"
    title: str
    branches: tuple[int, ...]
    values: np.ndarray


def cell_maps(c: Comparison) -> list[CellMap]:
    """The misfit over contraction and pressure: of each direction; what is the same in both, and what changes sign."""
    if c.cells is None:
        return []
    seen = [b for b in (1, -1, 0) if c.cells.count[b].any()]
    names = [branch_name(b, _led_by(c)) for b in seen] if len(seen) > 1 else ["all points"]
    found = [CellMap("branch", name, (b,), c.cells.mean[b]) for name, b in zip(names, seen, strict=True)]
    if c.cells.odd_share is not None:
        found.append(CellMap("parity", "even: the same in both directions", (1, -1), c.cells.even))
        found.append(CellMap("parity", "odd: changes its sign", (1, -1), c.cells.odd))
    return found


def branch_maps(c: Comparison, scale: Scale | None = None) -> list["Figure"]:
    """The misfit over contraction and pressure, a small figure for each direction."""
    return _small_maps(c, "branch", scale)


def parity_maps(c: Comparison, scale: Scale | None = None) -> list["Figure"]:
    """What of the misfit is the same in both directions (even), and what changes its sign (odd)."""
    return _small_maps(c, "parity", scale)


def _small_maps(c: Comparison, kind: str, scale: Scale | None) -> list["Figure"]:
    scale = scale or scale_of([c])
    drawn = []
    for one in cell_maps(c):
        if one.kind != kind or c.cells is None:
            continue
        figure = blank(3.9, 0.95 + 0.22 * max(len(c.cells.pressure), 5))
        figure.set_layout_engine("constrained")
        with settings():
            axes = figure.add_subplot()
            mesh = axes.pcolormesh(np.ma.masked_invalid(one.values), **_colours(scale), edgecolors="none")
            mesh.set_gid("cells")
            _label_cells(axes, c, True)
            axes.set_title(one.title, loc="left")
            _colour_bar(figure, axes, mesh, scale)
        drawn.append(figure)
    return drawn


def _colour_bar(figure: "Figure", axes: "Axes", mesh: Any, scale: Scale) -> None:
    """The colours, with the misfit in multiples of the noise beside them."""
    bar = figure.colorbar(mesh, ax=axes, shrink=0.9, aspect=18, pad=0.02, spacing="uniform", ticks=scale.ends)
    every = 1 + len(scale.steps) // FIGURE.steps_labelled  # of many steps every second has room for its number
    numbers = [f"{end / scale.noise:+.0f}" for end in scale.ends]
    bar.ax.set_yticklabels([text if not k % every else "" for k, text in enumerate(numbers)])
    bar.ax.tick_params(length=0)
    bar.outline.set_visible(False)  # type: ignore[operator]
    bar.set_label("misfit over noise")


def alike_names(d: Diagnosis) -> list[str]:
    """Effects that look like another in these data, the most alike first."""
    strongest = {e.name: max(e.similar.values(), default=0.0) for e in d.effects.values() if e.similar}
    return sorted(strongest, key=lambda name: -strongest[name])[: FIGURE.similar]


def alike_map(d: Diagnosis, called: Callable[[str], str] = str) -> "Figure":
    """How alike effects look in these data: the cosine between what each changes, once the model has given way.

    `called` gives the name for readers of an effect.
    """
    names = alike_names(d)
    values = cosines(d, names)
    size = 0.27 * len(names)
    words = [called(name) for name in names]
    figure = blank(size + 3.9, size + 2.2)
    figure.set_layout_engine("constrained")
    with settings():
        axes = figure.add_subplot()
        shown = np.ma.masked_invalid(values)
        mesh = axes.pcolormesh(shown, cmap=_rising(), vmin=0, vmax=1, edgecolors="face", linewidth=0.2)
        at = np.arange(len(names)) + 0.5
        axes.set_yticks(at, words)
        axes.set_xticks(at, words, rotation=60, ha="right", rotation_mode="anchor")
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
    name, size = showing.shown_in("Pa", float(np.max(pressure.centre)))
    after = places(pressure.centre / size)
    axes.set_yticks(np.arange(len(pressure)) + 0.5, [f"{p / size:.{after}f}" * first for p in pressure.centre])
    if first:
        axes.set_ylabel(f"pressure [{name}]")
    for side in axes.spines.values():
        side.set_visible(False)


def _colours(scale: Scale) -> dict[str, Any]:
    """Blue where the model pulls too little, vermilion where too much, the stronger the more; grey within the noise."""
    from matplotlib.colors import BoundaryNorm, ListedColormap, to_rgba

    coloured = ListedColormap([to_rgba(*shade) for shade in shades(scale)]).with_extremes(bad="none")
    return {"cmap": coloured, "norm": BoundaryNorm(scale.ends, coloured.N, extend="both")}


def shades(scale: Scale) -> list[tuple[str, float]]:
    """Colour and opacity of every step, from the model that pulls least to the one that pulls most."""
    strengths = [float(s) for s in np.linspace(0.35, 1.0, len(scale.steps))]  # opacity: weak on a dark page too
    return [*((BLUE, s) for s in strengths[::-1]), (GREY, 0.25), *((VERMILION, s) for s in strengths)]


def _rising() -> Any:
    from matplotlib.colors import LinearSegmentedColormap

    return LinearSegmentedColormap.from_list("alike", ["#f2f2f2", BLUE], N=21).with_extremes(bad="none")
