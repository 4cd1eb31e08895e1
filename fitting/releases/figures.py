"""Speed over load: the readings, Hill's curve, and what inertia and dry friction give without any viscosity."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from fitting.figures import BLUE, GREY, VERMILION, panel_axes
from fitting.releases.hill import Curves
from fitting.units import show

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def speed_over_load(curves: Sequence[Curves]) -> "Figure":
    """The review's figure 18 for these data."""
    figure, axes = panel_axes(5.2, 3.2, "load [N]", "steady speed [m/s]")
    for number, one in enumerate(curves):
        style = ("-", "--", ":", "-.")[number % 4]
        load = np.array([reading.load for reading in one.hill.readings])
        speed = [reading.speed for reading in one.hill.readings]
        fine = np.linspace(0.6 * load.min(), one.hill.isometric, 300)
        axes.plot(load, speed, "o", color=GREY, markersize=5)
        words = f"Hill, a/F0 = {one.hill.curvature:.2f}, {show(one.hill.pressure, 'Pa')}"
        axes.plot(fine, one.hill.speed(fine), style, color=BLUE, linewidth=1.4, label=words)
        dry = fine[fine < one.dry.heaviest]
        axes.plot(dry, one.dry.speed(dry), style, color=VERMILION, linewidth=1.1,
                  label=f"inertia, dry friction (47): {100 * one.dry.misfit:.1f} % off")  # fmt: skip
    axes.set_ylim(0, 1.3 * max(reading.speed for one in curves for reading in one.hill.readings))
    axes.set_xlim(0, None)
    axes.legend(fontsize=8.5, frameon=False)
    return figure
