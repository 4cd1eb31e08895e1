"""What the workbench says, as HTML and as text."""

import html
from collections.abc import Mapping
from importlib import resources
from itertools import groupby
from typing import Any

from fitting.diagnosis.record import Diagnosis
from fitting.errors import InputError
from fitting.report.page.diagnosis import ABSORBED, DETECTABLE, TERMS, UNEXPLAINED, UNIT, meanings
from fitting.report.page.names import PageNames
from fitting.report.page.parts import pictures_style
from fitting.report.page.similar_groups import named_by
from fitting.report.pictures.fall import fall_html
from fitting.report.pictures.muscle_drawing import DRAWN, model_html
from fitting.report.text.amounts import amount
from fitting.report.text.citations import citations
from fitting.report.text.diagnosis import (
    effect_set,
    leading_text,
    most_similar,
    p_value_text,
    remark,
    samples_text,
    substitutes_text,
)
from fitting.report.text.evidence import sort_evidence
from fitting.report.text.fit import fit_warnings
from fitting.report.text.instrument_answers import instrument_texts
from fitting.report.text.limits import open_text
from fitting.report.text.names import Names, mark, marked
from fitting.report.text.side_by_side import side_by_side
from fitting.report.text.stages import stage_text
from fitting.report.text.study import data_text
from fitting.report.text.untried import untried_texts
from fitting.workbench.session import Answer, Session, Step, in_own_units, where_we_are
from fitting.workbench.settings import WORKBENCH

WELCOME = """Open a data set. You then see the ideal muscle with dry friction beside what was measured. **Run the
diagnosis** to learn which effect is missing, **add** it with a click, and watch the error fall. To try it first, choose
`muscle_b` from the data that come with the program: something is hidden in it."""
STAYS = '<span class="stays"></span>'  # tells the style sheet which cell stays in view on a wide screen
JOINT = " + "  # between the effects of a set that is offered as one
GAP = "   "  # between the columns of a table
DESIGN = """\
[muscle]
length = "300 mm"
wall_thickness = "1 mm"
shear_modulus = "0.54 MPa"
radius = "8 mm"
braid_angle = "20 deg"

[variables]
braid_angle = ["12 deg", "40 deg"]
radius = ["4 mm", "12 mm"]

[objective]
maximise = "force"
at = { contraction = 0.1, pressure = "5 bar" }

[[constraint]]
quantity = "stroke"
at = { pressure = "5 bar" }
min = "20 %"
"""


def style() -> str:
    """The looks of everything that is no element of the user interface."""
    own = resources.files("fitting.workbench").joinpath("workbench.css").read_text(encoding="utf-8")
    return f"<style>{pictures_style()}{own}</style>"


def heading(text: str, level: int = 2) -> str:
    """A heading of the workbench."""
    return f'<div class="bench"><h{level}>{html.escape(text)}</h{level}></div>'


def answer_html(answer: Answer) -> str:
    """What the terminal would say, under a heading, and the pictures."""
    drawn = "".join(
        f'<figure class="answer">{picture}<figcaption>{html.escape(caption)}</figcaption></figure>'
        for caption, picture in answer.pictures
    )
    return f'{heading(answer.title)}<div class="bench">{_told(answer.text)}{drawn}</div>'


def _told(text: str) -> str:
    """Words of the terminal: sentences longer than its lines are paragraphs here, all else keeps its columns."""

    def is_sentence(line: str) -> bool:
        return len(line) > WORKBENCH.columns and GAP not in line.strip()

    parts = []
    for of_sentences, lines in groupby(text.splitlines(), is_sentence):
        if of_sentences:
            parts += [f"<p>{html.escape(each)}</p>" for each in lines]
        else:
            parts.append(f'<pre tabindex="0">{html.escape(chr(10).join(lines))}</pre>')
    return "".join(parts)


@in_own_units
def drawn_muscle(step: Step) -> str:
    """The muscle of the step's model to scale, beside what was measured."""
    laid = step.laid_out
    drawn = model_html(step.task.experiments, laid.layout, laid.vector, laid.switches)
    return f'<figure class="bench answer">{drawn}<figcaption>{DRAWN}</figcaption></figure>'


def progress(words: str, share: float) -> str:
    """What is under way."""
    said = html.escape(words)
    bar = f'<progress aria-label="{said}" max="1" value="{share:.3f}"></progress>'
    return f'<div class="bench" role="status"><p>{said} ...</p>{bar}</div>'


@in_own_units
def headline(session: Session) -> str:
    """Where the session stands, and what there is to be wary of."""
    step = session.last
    about = f"{data_text(step.task.experiments)}. Model: {effect_set(step.task.names)}."
    named = PageNames(step.task.library).html
    lines = [f'<p class="about">{named(about)}</p>']
    lines.append(f'<p class="verdict">{named(where_we_are(session))}</p>')
    if step.diagnosis is not None:
        told = meanings(named_by(step.diagnosis), step.task)
        lines += [
            f"<p><b>{named(each.name)}</b>: {html.escape(each.words)}{_law(each.law)}{each.drawing}</p>"
            for each in told
        ]
    if step.diagnosis is not None and step.comparison is not None:
        found = step.diagnosis
        still = open_text(found, UNIT)
        causes = (leading_text(found), *untried_texts(found), *instrument_texts(found))
        said = (*causes, p_value_text(found), *substitutes_text(found))
        said += (f"Still open: {still}",) if still else ()
        lines += [f"<p>{named(text)}</p>" for text in said if text]
    elif step.before is not None:
        lines.append("<p>Whether something is still missing is not tested yet: run the diagnosis again.</p>")
    if step.fit is not None:
        lines += [f"<p>{named(text)}</p>" for text in fit_warnings(step.fit)]
    return f'<div class="bench" role="status">{"".join(lines)}</div>'


def _law(drawn: str) -> str:
    return f'<span class="law" tabindex="0">{drawn}</span>' if drawn else ""


@in_own_units
def fall(session: Session) -> str:
    """How the error fell so far; empty before the first fit."""
    compared, named = session.last.comparison, PageNames(session.last.task.library).html
    return "" if compared is None else fall_html(session.stages, compared.floor, compared.unit, named)


@in_own_units
def models(session: Session) -> str:
    """Errors and parameters of all models of the session, side by side, folded; empty while there is one."""
    if len(session.stages) < 2:
        return ""
    named = PageNames(session.last.task.library).html
    called = [stage_text(stage) for stage in session.stages]
    heads, rows = side_by_side(called, session.stages)
    head = "<td></td>" + "".join(f'<th scope="col">{named(text)}</th>' for text in heads[1:])
    body = "".join(f"<tr>{''.join(f'<td>{named(cell)}</td>' for cell in row)}</tr>" for row in rows)
    rows_html = f"<thead><tr>{head}</tr></thead><tbody>{body}</tbody>"
    table = f'<div class="scroll" tabindex="0"><table class="models">{rows_html}</table></div>'
    return f'<div class="bench"><details><summary>All models side by side</summary>{table}</details></div>'


def offers(step: Step | None) -> list[str]:
    """What can be added with a click, the most promising first: explanations of several effects, then single ones."""
    if step is None or step.diagnosis is None:
        return []
    helping, idle, _ = sort_evidence(step.diagnosis)
    sets = [JOINT.join(names) for names in step.diagnosis.explanations if len(names) > 1]
    return list(dict.fromkeys([*sets, *(e.name for e in (*helping, *idle))]))[: WORKBENCH.offered]


def called(step: Step, offer: str) -> str:
    """What a button calls an effect or a set of them that is offered: the names for readers."""
    return Names(step.task.library).plain(marked(offer.split(JOINT), JOINT))


def citing(step: Step) -> str:
    """Whom to cite, as `mckibben cite` prints it."""
    named = PageNames(step.task.library).html
    found = citations(step.task.effects, step.task.experiments)
    told = "".join(
        f"<dt>{label}</dt><dd>{'<br>'.join(map(named, texts))}</dd>" for label, texts in found.items() if texts
    )
    return f'<div class="bench"><dl class="citing">{told}</dl></div>'


def known_effects(step: Step) -> dict[str, str]:
    """Every effect of the library by what a list for choosing calls it: 'Tip correction (tip)'."""
    names = Names(step.task.library)
    return {names.spoken(mark(name)): name for name in sorted(step.task.library, key=names.called)}


@in_own_units
def evidence(step: Step, buttons: Mapping[str, Any]) -> str:
    """What each effect would do, with the button that adds it."""
    assert step.diagnosis is not None  # the caller has looked
    found, named, rows = step.diagnosis, PageNames(step.task.library).html, []
    for name, button in buttons.items():
        *cells, note = _cells(found, name)
        said = f'<div class="note">{named(note)}</div>' if note else ""
        adder = f'<td>{button}<br><small class="id">{html.escape(name)}</small>{said}</td>'
        told = "".join(f"<td>{named(cell)}</td>" for cell in cells)
        rows.append(f"<tr>{adder}{told}</tr>")
    heads = ("effect", UNEXPLAINED, "error with it", "on held-out runs", DETECTABLE, "most similar effect")
    head = "".join(f'<th scope="col">{text}</th>' for text in heads)
    _, _, blind = sort_evidence(found)
    unseen = "; ".join(f"{marked(names)}: {why}" for why, names in blind.items())
    table = f'<div class="scroll"><table><thead><tr>{head}</tr></thead><tbody>{"".join(rows)}</tbody></table></div>'
    tail = f"<p class='about'>Cannot be seen here: {named(unseen)}</p>" if unseen else ""
    seen = "".join(f"<p class='about'>{text}</p>" for text in samples_text(found, step.comparison))
    return f'<div class="bench"><h2>Which effects could explain it</h2>{seen}{table}{_terms()}{tail}</div>'


def _terms() -> str:
    words = "".join(f"<div><dt>{term}</dt><dd>{text}</dd></div>" for term, text in TERMS if term != ABSORBED)
    return f'<dl class="terms">{words}</dl>'


def _cells(found: Diagnosis, name: str) -> tuple[str, ...]:
    """One row behind the button, which says the name: errors, detection limit, what is most alike, and a note."""
    e = found.effects.get(name)
    if e is None:  # a set of several
        tried = next(t for t in found.tried if JOINT.join(t.effects) == name)
        values = (amount(value, UNIT) for value in (tried.unexplained, tried.rmse, tried.held_out_rmse))
        return *values, "", "", "explains the data"
    values = (amount(value, UNIT) for value in (e.unexplained, e.rmse, e.held_out_rmse, e.detection_limit))
    alike = most_similar(e)
    return *values, mark(alike) if alike else "", remark(e)


@in_own_units
def error_now(step: Step, error: float, moved: Mapping[str, float]) -> str:
    """The error at the values of the sliders, beside that of the model before."""
    unit = "N" if step.comparison is None else step.comparison.unit
    if step.comparison is None:
        return f'<p class="now" role="status">At the starting values: {amount(error, unit)}.</p>'
    if not moved:
        before = "" if step.before is None else f" (the model before: {amount(step.before, unit)})"
        words = f"As fitted: {amount(error, unit)}{before}. Move a parameter and the model follows."
        return f'<p class="now" role="status">{words}</p>'
    fitted, named = amount(step.comparison.rmse, unit), PageNames(step.task.library).html
    return (
        f'<p class="now" role="status">With {named(marked(moved))} moved: {amount(error, unit)} (fitted: {fitted}).</p>'
    )


def as_script(dataset: str | None) -> str:
    """What the notebook prints when it is run as a script: the comparison of one data set, or how to open one."""
    if dataset is None:
        return "mckibben workbench [DATASET] serves this notebook; python workbench.py DATASET compares."
    from fitting.study.request import Request
    from fitting.workbench.serving import data_folder
    from fitting.workbench.session import fit_first, open_session

    try:
        session = fit_first(open_session(Request(data=(str(data_folder(dataset)),))), lambda *_: None)
    except InputError as error:
        return str(error)
    return Names(session.last.task.library).spoken(where_we_are(session))
