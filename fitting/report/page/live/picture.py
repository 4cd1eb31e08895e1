"""The live picture as parts of a page."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from html import escape

from fitting.report.page.live import code
from fitting.report.page.live.candidates import candidates_of
from fitting.report.page.live.chosen import chosen_readings, thinned_text
from fitting.report.page.live.payload import Curve, payload
from fitting.report.page.models import ShownModel, bar_width, short_name
from fitting.report.pictures.panels import every_panel
from fitting.study.task import Task


@dataclass(frozen=True)
class LivePicture:
    """What the page needs for it: HTML that is hidden until the script fills it, its data, code, style and sum."""

    html: str
    words: str
    data: str
    code: str
    style: str
    allowed: str


def live_picture(models: Sequence[ShownModel], task: Task, called: Callable[[str], str]) -> LivePicture:
    """The picture of all runs and models; `called` gives the names for readers."""
    first = models[0]
    panels = every_panel(task.experiments, first.comparison.fit.samples, first.residual)
    chosen = chosen_readings(panels, first.residual)
    curves = [Curve(called(short_name(m, len(models))), bar_width(m, models), m.residual) for m in models]
    thinned = thinned_text(chosen, panels)
    return LivePicture(
        html=code.skeleton(),
        words=f'<p class="note with-live" hidden>{escape(thinned)}</p>' if thinned else "",
        data=payload(curves, chosen, [model.comparison for model in models], candidates_of(models, called)),
        code=code.code(),
        style=code.style(),
        allowed=code.allowed(),
    )
