"""The live picture as parts of a page."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from html import escape

from fitting.report.page.live import code
from fitting.report.page.live.chosen import chosen_readings, thinned_text
from fitting.report.page.live.payload import payload
from fitting.report.page.models import ShownModel, short_name
from fitting.report.pictures.panels import every_panel
from fitting.study.task import Task

HOW = (
    "The upper picture shows the readings as grey dots and the model as lines. The lower one shows model minus "
    "measured, as dots, and as lines that are averages over short parts of the axis. Point at a reading to see its "
    "values. Drag over a part to enlarge it, and press twice quickly to see all again. Point at a cell of the map to "
    "mark its readings here, and press it to keep the mark. Point at a model on the switch, or at its bar, to see as a "
    "dotted line what it would give. With the keyboard, the arrow keys go from reading to reading and from run to run "
    "(with the shift key in larger steps), plus and minus enlarge and reduce, and Escape shows all again."
)


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
    names = [called(short_name(model, len(models))) for model in models]
    thinned = thinned_text(chosen, panels)
    return LivePicture(
        html=code.skeleton().replace("HOW", escape(HOW)),
        words=f'<p class="note with-live" hidden>{escape(thinned)}</p>' if thinned else "",
        data=payload(models, chosen, names),
        code=code.code(),
        style=code.style(),
        allowed=code.allowed(),
    )
