"""The picture that follows the sliders: the readings are sent once, then only the model, four bytes a reading.

It needs the package anywidget; where that is not installed the workbench draws still pictures.
"""

import functools
import importlib.util
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from fitting.report.page.live import code
from fitting.report.page.live.candidates import Candidate, beside
from fitting.report.page.live.chosen import Chosen, chosen_readings, thinned_text
from fitting.report.page.live.payload import Curve, payload, values_of
from fitting.report.page.parts import pictures_style
from fitting.report.pictures.panels import every_panel
from fitting.report.text.names import Names
from fitting.workbench.session import Step, error_of, in_own_units
from fitting.workbench.text import error_now


class Live:
    """The picture of one step in an element: how a moved model gets into it, and what it leaves out."""

    def __init__(
        self,
        element: Any,
        chosen: Sequence[Chosen],
        residual: np.ndarray,
        left_out: str,
        candidates: Sequence[Candidate] = (),
    ):
        self.element, self._chosen, self.left_out = element, chosen, left_out
        element.content = payload([Curve("the model", 100.0, residual)], chosen, candidates=candidates)

    def show(self, residual: np.ndarray, said: str) -> None:
        """Draw the model with this misfit (model minus measured of all samples, SI) below these words, as HTML."""
        with self.element.hold_sync():
            self.element.values = values_of(residual, self._chosen).astype("<f4").tobytes()
            self.element.said = said


def live_element() -> Any | None:
    """An empty element for the pictures of all steps of a session, None where anywidget is not installed.

    One for all: marimo takes the code of an element away with it, and a browser that is slow then asks in vain.
    """
    return None if importlib.util.find_spec("anywidget") is None else _kind()()


@in_own_units
def live_of(step: Step, element: Any) -> Live:
    """The picture of a step, in this element."""
    residual = step.laid_out.residual()
    panels = every_panel(step.task.experiments, step.laid_out.samples, residual)
    chosen = chosen_readings(panels, residual)
    live = Live(element, chosen, residual, thinned_text(chosen, panels), _candidates(step, residual))
    follow(step, live, {})
    return live


@in_own_units
def follow(step: Step, live: Live, shown: Mapping[str, float]) -> None:
    """Move the model of the picture to the values that sliders show, by the names of their parameters."""
    moved = step.laid_out.moved(dict(shown))
    residual = step.laid_out.residual(moved)
    live.show(residual, error_now(step, error_of(step, residual), moved))


def _candidates(step: Step, residual: np.ndarray) -> list[Candidate]:
    """What effects would give beside the step's model, as fitted, if it was diagnosed."""
    if step.diagnosis is None:
        return []
    return beside(residual, step.diagnosis, step.laid_out.samples, Names(step.task.library).plain)


@functools.cache
def _kind() -> Any:
    """The kind of element; anywidget is imported late, because it takes half a second."""
    import anywidget  # pyright: ignore[reportMissingImports]
    import traitlets

    class LivePicture(anywidget.AnyWidget):
        _esm = code.widget_code()
        _css = pictures_style() + code.widget_style()
        content = traitlets.Unicode("").tag(sync=True)
        values = traitlets.Bytes(b"").tag(sync=True)
        said = traitlets.Unicode("").tag(sync=True)

    return LivePicture
