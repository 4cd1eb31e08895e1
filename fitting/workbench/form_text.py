"""What the form for dropped files says: its labels, the muscle that it describes, and what is wrong."""

import html
from collections.abc import Mapping

from fitting.recordings.muscle_file import REQUIRED
from fitting.report.pictures.muscle_drawing import muscle_html
from fitting.showing import counted
from fitting.workbench.form import LIKE, Size, meaning_of, muscle_of, spoken

AT_REST_LABEL = "what the position sensor reads where the muscle has its length at rest, with its unit (not 0 here)"
AT_REST_LIKE = "37.2 mm"


def size_fields(name: str) -> tuple[tuple[str, str, str], ...]:
    """Label, example and what stands there from the start, of the three fields of a measurement of the muscle."""
    like = LIKE[name]
    return (
        (f"{spoken(name)}: {meaning_of(name)}{'' if name in REQUIRED else ' (may be left empty)'}", like.value, ""),
        (f"± of {spoken(name)}", like.error, ""),
        (f"unit of {spoken(name)}", like.unit, like.unit),
    )


def sketch(sizes: Mapping[str, Size]) -> str:
    """The muscle that the form describes, to scale; until it can be drawn, why there is none."""
    found = muscle_of(sizes)
    if isinstance(found, str):
        why = f"cannot be drawn: {found}" if found else "is drawn here as soon as its sizes are filled in"
        return f'<p class="bench about">The muscle {html.escape(why)}.</p>'
    return muscle_html(found)


def wrong_field(said: str) -> str:
    """What is wrong with an entry of the form, shown below it."""
    return f'<div class="bench wrong" role="alert">{html.escape(said)}</div>'


def form_problem(count: int) -> str:
    """What is said of a form with this many wrong entries, for each of which the reason stands below it."""
    return f"There is something to mend in {counted(count, 'field')}: the reason stands with each." if count else ""
