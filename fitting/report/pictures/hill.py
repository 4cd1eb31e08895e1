"""Speed over load: the readings, Hill's curve, and what inertia and dry friction give without any viscosity."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from fitting import showing
from fitting.hill.hill import Curves
from fitting.report.pictures.figures import BLUE, GREY, VERMILION, panel_axes

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def speed_over_load(curves: Sequence[Curves]) -> "Figure":
    """The review's figure 18 for these data."""
    fastest = max(reading.speed for one in curves for reading in one.hill.readings)
    (force, newtons), (pace, metres) = showing.shown_in("N"), showing.shown_in("m/s", fastest)
    figure, axes = panel_axes(5.2, 3.2, f"load [{force}]", f"steady speed [{pace}]")
    for number, one in enumerate(curves):
        style = ("-", "--", ":", "-.")[number % 4]
        load = np.array([reading.load for reading in one.hill.readings])
        speed = np.array([reading.speed for reading in one.hill.readings])
        fine = np.linspace(0.6 * load.min(), one.hill.isometric, 300)
        axes.plot(load / newtons, speed / metres, "o", color=GREY, markersize=5)
        words = f"Hill, a/F0 = {one.hill.curvature:.2f}, {showing.show(one.hill.pressure, 'Pa')}"
        axes.plot(fine / newtons, one.hill.speed(fine) / metres, style, color=BLUE, linewidth=1.4, label=words)
        dry = fine[fine < one.dry.heaviest]
        axes.plot(dry / newtons, one.dry.speed(dry) / metres, style, color=VERMILION, linewidth=1.1,
                  label=f"inertia, dry friction (47): {100 * one.dry.misfit:.1f} % off")  # fmt: skip
    axes.set_ylim(0, 1.3 * fastest / metres)
    axes.set_xlim(0, None)
    axes.legend(fontsize=8.5, frameon=False)
    return figure
