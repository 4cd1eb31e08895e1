"""Evidence against each model, growing from session to session."""

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from fitting.evidence.sessions import GrowingEvidence, Weighed
from fitting.report.pictures.figures import BLUE, GREEN, GREY, INK, blank, settings

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LOW, HIGH = 1e-2, 1e6  # to one: what is beyond is drawn at the edge
TICKS = (1e-2, 1.0, 1e2, 1e4, 1e6)
LABELLED = 3  # excluded models that have their names beside their lines


def evidence_picture(found: GrowingEvidence, named: Callable[[str], str] = str) -> "Figure":
    """One line a model, from 1 before the first session; above the dashed line a model is excluded."""
    figure = blank(6.8, 3.4)
    places = np.arange(len(found.sessions) + 1)
    with settings():
        axes = figure.add_axes((0.14, 0.13, 0.51, 0.84))
        axes.set_yscale("log")
        axes.axhline(found.enough, color=INK, linestyle=(0, (3, 2)), linewidth=1)
        axes.text(0, found.enough * 1.25, f"excluded: {found.enough:.0f} to 1", fontsize=8)
        standing = [each for each in found.singles if each in found.standing]
        excluded = [each for each in found.singles if each not in found.standing]
        for each in excluded:
            axes.plot(places, _drawn(each), color=GREY, linewidth=0.8)
        for each in standing if found.is_lacking else ():
            axes.plot(places, _drawn(each), color=GREEN, linewidth=1.6, marker="o", markersize=3)
        axes.plot(places, _drawn(found.as_it_is), color=BLUE, linewidth=2.2, marker="o", markersize=4)
        labels = [("the model as it is", found.as_it_is, BLUE)]
        labels += [(_called(each, named), each, GREEN) for each in standing] if found.is_lacking else []
        labels += [(_called(each, named), each, GREY) for each in excluded[:LABELLED]]
        for words, height, colour in _spread(labels):
            axes.annotate(words, (places[-1], height), (8, 0), textcoords="offset points", color=colour, fontsize=8,
                          va="center", annotation_clip=False)  # fmt: skip
        axes.set_ylim(LOW, HIGH)
        axes.set_yticks(TICKS, [f"{tick:,g}" if tick < 1e5 else "1,000,000" for tick in TICKS])
        axes.yaxis.minorticks_off()
        axes.set_xticks(places, ["", *found.sessions])
        axes.set_xlabel("after session")
        axes.set_ylabel("evidence against the model, to 1")
    return figure


def _drawn(each: Weighed) -> np.ndarray:
    return np.clip([1.0, *each.evidence], LOW, HIGH)


def _called(each: Weighed, named: Callable[[str], str]) -> str:
    return "with " + " + ".join(named(name) for name in each.added)


def _spread(labels: list[tuple[str, Weighed, str]]) -> list[tuple[str, float, str]]:
    """Each label with a height at which no two of them cover each other."""
    step = (np.log10(HIGH) - np.log10(LOW)) / 18
    order = sorted(labels, key=lambda each: _drawn(each[1])[-1])
    heights, low = [], np.log10(LOW)
    for _, each, _ in order:
        low = max(low, float(np.log10(_drawn(each)[-1])))
        heights.append(low)
        low += step
    room = [min(height, np.log10(HIGH) - (len(heights) - 1 - k) * step) for k, height in enumerate(heights)]
    return [(words, 10**height, colour) for (words, _, colour), height in zip(order, room, strict=True)]
