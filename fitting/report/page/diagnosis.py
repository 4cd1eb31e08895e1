"""The parts of the page that show a diagnosis: what was named, the evidence for each effect, who looks like whom."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from fitting import showing
from fitting.comparison.compare import Comparison
from fitting.diagnosis.outcomes import NOTHING_MISSING
from fitting.diagnosis.record import Diagnosis, Evidence
from fitting.report.formula import formula_html
from fitting.report.page.names import PageNames
from fitting.report.page.parts import Grid, Line, Section
from fitting.report.page.similar_groups import groups, groups_html, named_by
from fitting.report.pictures import figures, maps
from fitting.report.pictures.effect_bars import effect_bars
from fitting.report.pictures.rig_drawing import rig_svg
from fitting.report.settings import ADVICE, SHOWN
from fitting.report.text.amounts import amount
from fitting.report.text.catalogue import first_sentence, meaning
from fitting.report.text.diagnosis import (
    classes_text,
    effect_set,
    most_similar,
    p_value_text,
    remark,
    samples_text,
    substitutes_text,
)
from fitting.report.text.evidence import sort_evidence
from fitting.report.text.instrument_answers import HEADS, NEVER, checklist
from fitting.report.text.limits import SEEN, open_text, would_have_shown
from fitting.report.text.names import mark, marked
from fitting.report.text.reasons import why_text
from fitting.study.task import Task
from mckibben_jax.effect import Effect
from mckibben_jax.parameter import parameters

DETECTABLE = "smallest detectable size"
ABSORBED = "absorbed by other parameters"
UNIT = "N"  # of all errors of a diagnosis, whatever was measured: motions are read as force
UNEXPLAINED = "left unexplained"
TERMS = (
    (UNEXPLAINED, "the size (RMS) of the misfit that neither noise nor instruments within their accuracy can make, "
     "with this effect in the model. An effect that lowers the error as a wrong gain would do proves nothing."),
    ("error with it", "RMS error that remains when this effect is in the model and everything is fitted again."),
    ("on held-out runs", "the same on runs that the fit has not seen: an effect that only adds freedom fails here."),
    (DETECTABLE, "if an effect of this kind were in the muscle and its mark on these data, after the fit, were this "
     "large (RMS), the test would detect it in 4 of 5 recordings like these. A smaller one can stay undetected."),
    (ABSORBED, "how much of the effect's mark the other fitted parameters (radius, angle, friction) absorb. At 100 % "
     "the effect cannot be seen in these data."),
    ("most similar effect", "the effect whose mark has the most similar shape; 1.00 is the same shape."),
)  # fmt: skip


class Meaning(NamedTuple):
    """What an effect is: its marked name, a sentence, and as HTML its law and the drawing of where it acts.

    Law and drawing are empty for an effect that does not state them.
    """

    name: str
    words: str
    law: str
    drawing: str


def meanings(names: Sequence[str], task: Task) -> list[Meaning]:
    """What the first of these effects are."""
    known = [name for name in names if name in task.library][: SHOWN.explained]
    return [_meaning(name, task.library[name]) for name in known]


def _meaning(name: str, kind: type[Effect]) -> Meaning:
    law = formula_html(kind.formula, [p.name for p in parameters(kind)]) if kind.formula else ""
    return Meaning(mark(name), f"{first_sentence(meaning(kind))}.", law, rig_svg(kind))


def effects(d: Diagnosis, c: Comparison, names: PageNames, models: Mapping[frozenset[str], str]) -> Section:
    """What each effect would do, as bars and as a table; `models`: the bars that are models on the switch."""
    unit = UNIT
    floor = c.floor if c.unit == unit else d.noise_floor
    helping, idle, blind = sort_evidence(d)
    heads = (
        "effect added",
        UNEXPLAINED,
        "error with it",
        "on held-out runs",
        DETECTABLE,
        ABSORBED,
        "its size",
        "most similar effect",
    )
    grid, others = (Grid(heads, tuple(Line(_evidence(e, unit), e.adequate) for e in some), words=(0, 6, 7))
                    for some in (helping, idle))  # fmt: skip
    unseen = Grid(("cannot be seen", "why"), tuple(Line((marked(v), k)) for k, v in blind.items()), words=(1,))
    return Section(
        "Which effects could explain the misfit",
        sentences=(p_value_text(d), *samples_text(d, c), *substitutes_text(d)),
        picture=effect_bars(d, floor, unit, names.html, models) if helping or idle else "",
        terms=TERMS,
        tables=(grid,) if helping else (),
        folded=tuple(table for table in (others, unseen) if table.rows),
        folded_title=f"{len(idle)} that do not help, and {sum(map(len, blind.values()))} that cannot be seen here",
        rail="Effects",
    )


def limits(d: Diagnosis) -> Section | None:
    """Where nothing is missing, or nothing is decided: what would have been seen, and what remains open."""
    rows = tuple(Line((f"from {step}", marked(names))) for step, names in would_have_shown(d, UNIT))
    still = open_text(d, UNIT)
    sentences = (*[f"{SEEN}."] * bool(rows), *([f"Still open: {still}"] if still else []))
    grid = Grid(("RMS error left", "effects that would have been seen"), rows, words=(1,))
    if not sentences:
        return None
    return Section("What would have been seen", sentences=sentences, tables=(grid,) * bool(rows), rail="Effects")


def errors_grid(d: Diagnosis) -> Grid:
    """Every error of the instruments; what would explain a misfit stands out, and only where there is one."""
    missing = d.verdict not in NOTHING_MISSING
    heads, rows = HEADS if missing else HEADS[:-1], checklist(d.instruments)
    lines = tuple(Line(cells[: len(heads)], missing and cells[-1] != NEVER) for cells in rows)
    return Grid(heads, lines, "Every error", words=(0, 1))


def _evidence(e: Evidence, unit: str) -> tuple[str, ...]:
    alike, note = most_similar(e), remark(e)
    estimate = "; ".join(
        f"{name} = {showing.show(value, unit, error)}" for name, (value, error, unit) in e.estimate.items()
    )
    return (
        f"{mark(e.name)}: {note}" if note else mark(e.name),
        amount(e.unexplained, unit, 2),
        amount(e.rmse, unit),
        amount(e.held_out_rmse, unit),
        amount(e.detection_limit, unit),
        "-" if e.absorbed_share is None else f"{100 * e.absorbed_share:.0f} %",
        estimate,
        f"{mark(alike)} {e.similar[alike]:.2f}" if alike else "",
    )


def alike(d: Diagnosis, names: PageNames, number: int = 0) -> Section | None:
    """Which effects leave nearly the same trace in these data; `number` is that of the model, and names the picture."""
    if not maps.alike_names(d):
        return None
    found = groups(d)
    words = (
        f"Effects in one row change these data in nearly the same way (cosine of {ADVICE.similar:g} or more): "
        "where one of them is named, another of its row could be meant. What the verdict names has a green frame.",
        *(f"{classes_text(group)}: these data cannot tell them apart." for group in d.classes),
    )
    return Section(
        "Which effects are similar in these data",
        sentences=words if found else ("Every effect that leaves a trace in these data leaves one of its own.",),
        picture=groups_html(found, named_by(d), names.html) if found else "",
        folded_picture=figures.as_svg(maps.alike_map(d, names.called), f"alike{number}"),
        folded_title="The same as a map, pair by pair: 1 is the same change, 0 has nothing in common",
        rail="Effects",
    )


def tried_table(d: Diagnosis) -> Grid:
    """Every set of effects that was tried."""
    rows = tuple(
        Line(
            (
                effect_set(e.effects),
                amount(e.unexplained, UNIT, 2),
                amount(e.rmse, UNIT),
                amount(e.held_out_rmse, UNIT),
                _shown(e.p_value),
                why_text(e.why, e.unexplained),
            )
        )
        for e in d.tried
    )
    return Grid(("effects", UNEXPLAINED, "RMS", "on held-out runs", "p", "note"), rows, words=(5,))


def _shown(value: float) -> str:
    return "" if np.isnan(value) else f"{value:.2g}"
