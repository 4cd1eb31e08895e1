"""Pictures of a posterior: parameters against each other, and how the readings lie in the band of their prediction."""

from typing import TYPE_CHECKING

import numpy as np

from fitting import showing
from fitting.posterior.predict import Band
from fitting.posterior.record import Posterior
from fitting.report.pictures.figures import BLUE, GREY, INK, SKY, VERMILION, blank, settings
from fitting.report.settings import FIGURE, POSTERIOR_PICTURE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

CELLS, SMOOTH = 40, 1.2


def pairs(posterior: Posterior) -> "Figure":
    """Every parameter's draws, and every two of them against each other: dark places hold half of them, all 90 %."""
    names = list(posterior.parameters)[: POSTERIOR_PICTURE.parameters]
    draws = [_shown(posterior, name) for name in names]
    count = len(names)
    figure = blank(0.6 + 1.35 * count, 0.5 + 1.25 * count)
    with settings():
        for row in range(count):
            for column in range(row + 1):
                axes = figure.add_subplot(count, count, row * count + column + 1)
                if row == column:
                    _alone(axes, draws[row][0], names[row])
                else:
                    _together(axes, draws[column][0], draws[row][0])
                _labelled(axes, draws[column][1], draws[row][1], row, column, count)
        figure.tight_layout(pad=0.4, h_pad=0.3, w_pad=0.3)
    return figure


def predicted(posterior: Posterior) -> "Figure":
    """Measured minus predicted, run by run, in the band that should hold 90 % of the readings."""
    shown = sorted(posterior.bands, key=lambda band: band.inside)[: POSTERIOR_PICTURE.bands]
    shown = sorted(shown, key=lambda band: band.run)
    columns = min(FIGURE.columns, len(shown))
    rows = -(-len(shown) // columns)
    figure = blank(1.9 * columns + 0.4, 1.45 * rows + 0.3)
    with settings():
        for number, band in enumerate(shown):
            axes = figure.add_subplot(rows, columns, number + 1)
            _band(axes, band, len({band.file for band in shown}) > 1)
            if number % columns == 0:
                axes.set_ylabel(f"misfit [{showing.shown_in(band.unit)[0]}]")
            if number >= len(shown) - columns:
                axes.set_xlabel("reading")
        figure.tight_layout(pad=0.4, h_pad=0.6, w_pad=0.6)
    return figure


def _band(axes: "Axes", band: Band, of_several: bool) -> None:
    _, size = showing.shown_in(band.unit)
    thin = slice(None, None, max(1, len(band.position) // FIGURE.points))
    at, middle = band.position[thin], band.middle[thin]
    low, high, measured = ((part[thin] - middle) / size for part in (band.low, band.high, band.measured))
    axes.fill_between(at, low, high, color=SKY, alpha=0.35, linewidth=0)
    out = (measured < low) | (measured > high)
    axes.plot(at, measured, ".", color=GREY, markersize=2.5, markeredgewidth=0)
    axes.plot(at[out], measured[out], ".", color=VERMILION, markersize=2.5, markeredgewidth=0)
    axes.axhline(0, color=INK, linewidth=0.5)
    name = band.name if band.name.startswith("run") else f"run {band.name}"
    name = f"{band.file.removesuffix('.csv')}, {name}" if of_several else name
    axes.set_title(f"{name}: {100 * band.inside:.0f} % inside", loc="left", fontsize=6.5 if of_several else 8.5, pad=3)
    axes.locator_params(nbins=4)


def _shown(posterior: Posterior, name: str) -> tuple[np.ndarray, str]:
    """The draws of a parameter in the unit that people read it in, and its label."""
    q = posterior.parameters[name]
    unit, size = showing.shown_in(q.unit, abs(q.median))
    values = posterior.draws.values[..., posterior.draws.names.index(name)].reshape(-1) / size
    plain = name.split(".", 1)[1]
    return values, f"{plain} [{unit}]" if unit else plain


def _alone(axes: "Axes", values: np.ndarray, name: str) -> None:
    axes.hist(values, bins=CELLS, color=BLUE, alpha=0.7, linewidth=0)
    low, high = np.quantile(values, (0.05, 0.95))
    axes.axvspan(low, high, color=SKY, alpha=0.25, linewidth=0)
    axes.set_title(name, fontsize=7.5, loc="left", pad=2)
    axes.set_yticks([])


def _together(axes: "Axes", x: np.ndarray, y: np.ndarray) -> None:
    from scipy.ndimage import gaussian_filter

    ends = [np.quantile(v, (0.001, 0.999)) for v in (x, y)]
    if any(low >= high for low, high in ends):
        axes.plot(x, y, ",", color=BLUE)
        return
    counts, across, up = np.histogram2d(x, y, bins=CELLS, range=ends)  # type: ignore[arg-type]
    density = gaussian_filter(counts, SMOOTH).T
    ordered = np.sort(density.ravel())[::-1]
    held = np.cumsum(ordered) / ordered.sum()
    levels = sorted({float(ordered[np.searchsorted(held, mass)]) for mass in POSTERIOR_PICTURE.mass})
    middles = [0.5 * (edge[1:] + edge[:-1]) for edge in (across, up)]
    axes.contourf(*middles, density, levels=[*levels, density.max() * 1.01], colors=[SKY, BLUE][-len(levels) :])


def _labelled(axes: "Axes", across: str, up: str, row: int, column: int, count: int) -> None:
    axes.locator_params(axis="x", nbins=POSTERIOR_PICTURE.ticks)
    axes.ticklabel_format(scilimits=(-2, 5))  # a friction of 0.00007 would run into its neighbours
    axes.xaxis.offsetText.set_fontsize(POSTERIOR_PICTURE.small)
    axes.yaxis.offsetText.set_fontsize(POSTERIOR_PICTURE.small)
    if row == count - 1:
        axes.set_xlabel(across)
    else:
        axes.set_xticklabels([])
    if column == 0 and row:
        axes.locator_params(axis="y", nbins=POSTERIOR_PICTURE.ticks)
        axes.set_ylabel(up)
    else:
        axes.set_yticklabels([])
