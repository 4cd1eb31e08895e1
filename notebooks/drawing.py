"""What the numbered notebooks draw: force over contraction, measured and model, a colour for each pressure."""

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from fitting import Experiment, Fit
from fitting.report import BLUE, GREEN, GREY, ORANGE, SKY, VERMILION, Panel, panels

COLOURS = (BLUE, SKY, GREEN, ORANGE, VERMILION)


def slowest(experiment: Experiment, fit: Fit) -> list[Panel]:
    """One run for each pressure: the first recorded, lowest pressure first."""
    first: dict[float, Panel] = {}
    for panel in panels([experiment], fit.samples, fit.residual):
        first.setdefault(round(float(np.median(panel.run.pressure)), -3), panel)
    return [first[pressure] for pressure in sorted(first)]


def loops(experiment: Experiment, *fits: tuple[str, Fit]) -> Figure:
    """Measured loops (grey) and a model's (lines), a panel for each titled fit; force in N."""
    figure, row = plt.subplots(1, len(fits), figsize=(4.6 * len(fits) + 0.6, 3.8), sharey=True, squeeze=False)
    for axes, (title, fit) in zip(row[0], fits, strict=True):
        for panel, colour in zip(slowest(experiment, fit), COLOURS, strict=False):
            axes.plot(panel.along, panel.measured, ".", color=GREY, markersize=2.5, alpha=0.6)
            axes.plot(panel.along, panel.model(fit.residual), color=colour, linewidth=1.3, label=panel.held)
        axes.set(title=f"{title}: off by {fit.rmse:.3g} N", xlabel="contraction (1 = the whole length)")
        axes.spines[["top", "right"]].set_visible(False)
    row[0][0].set_ylabel("force [N]")
    row[0][-1].legend(fontsize=8, frameon=False, title="model, at", title_fontsize=8)
    figure.tight_layout()
    return figure


def errors(experiment: Experiment, *fits: tuple[str, Fit]) -> Figure:
    """Model minus measured over contraction, a panel for each titled fit: what shape is missing; N."""
    figure, row = plt.subplots(1, len(fits), figsize=(4.6 * len(fits) + 0.6, 2.9), sharey=True, squeeze=False)
    for axes, (title, fit) in zip(row[0], fits, strict=True):
        for panel, colour in zip(slowest(experiment, fit), COLOURS, strict=False):
            axes.plot(panel.along, panel.model(fit.residual) - panel.measured, ".", color=colour, markersize=2.5,
                      label=panel.held)  # fmt: skip
        axes.axhline(0, color="black", linewidth=0.7)
        axes.set(title=title, xlabel="contraction (1 = the whole length)")
        axes.spines[["top", "right"]].set_visible(False)
    row[0][0].set_ylabel("model minus measured [N]")
    row[0][-1].legend(fontsize=8, frameon=False, markerscale=4, loc="upper left", bbox_to_anchor=(1, 1))
    figure.tight_layout()
    return figure
