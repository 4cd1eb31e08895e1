"""Results as one HTML page that opens from disk, needs no network, and prints."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from fitting.comparison.compare import Comparison
from fitting.comparison.compare import Table as ErrorTable
from fitting.diagnosis.outcomes import NOTHING_MISSING
from fitting.diagnosis.record import Diagnosis
from fitting.least_squares.record import Fit
from fitting.report.page import top
from fitting.report.page.diagnosis import alike, effects, errors_grid, limits, meanings, tried_table
from fitting.report.page.parts import Grid, Line, Section, pictures_style, render_page
from fitting.report.pictures import figures, maps
from fitting.report.pictures.fall import fall_html
from fitting.report.pictures.loops import frame, key, loops_html, thinning_text
from fitting.report.pictures.overview import overview_html
from fitting.report.pictures.panels import panels
from fitting.report.pictures.readings import estimated_channels, readings_picture
from fitting.report.results import provenance, shown_names
from fitting.report.text.amounts import amount
from fitting.report.text.attempts import held_text, why_not_kept
from fitting.report.text.comparison import error_cells, error_text, kind_text, worst_text
from fitting.report.text.diagnosis import effect_set, measurement_text
from fitting.report.text.fit import fit_warnings, range_cells, value_cells
from fitting.report.text.instruments import HEADS, channel_cells, channel_lines
from fitting.report.text.search import search_text
from fitting.report.text.stages import stage_text
from fitting.report.text.stated_sizes import measured_cells, rests_on_texts
from fitting.report.text.study import data_text
from fitting.report.text.warnings import comparison_warnings
from fitting.study.practice import ENOUGH
from fitting.study.stages import Stage
from fitting.study.task import Task
from fitting.writing import write_text

if TYPE_CHECKING:
    from fitting.planning.next_measurement import NextMeasurement


def write_page(
    path: str,
    task: Task,
    c: Comparison,
    d: Diagnosis | None = None,
    stages: Sequence[Stage] = (),
    *,
    planned: "NextMeasurement | None" = None,
    posterior: Sequence[Section] = (),
    enough: float = ENOUGH,
) -> None:
    """Write the page of a comparison, with what else there is: diagnosis, steps, next measurement, posterior."""
    write_text(path, page(task, c, d, stages, planned=planned, posterior=posterior, enough=enough))


def page(
    task: Task,
    c: Comparison,
    d: Diagnosis | None = None,
    stages: Sequence[Stage] = (),
    *,
    planned: "NextMeasurement | None" = None,
    posterior: Sequence[Section] = (),
    enough: float = ENOUGH,
) -> str:
    """The page as text; `posterior` holds the sections that show one, `enough` is the share that may be left."""
    headline = top.verdict(c, d, task, stages)
    steps = steps_with_models(c, stages)
    sections = [
        _fall(c, d, stages, chosen=len(steps) > 1),
        _overview(c, task, steps),
        _loops(c, task, steps),
        _where(c),
        *([] if d is None else [limits(d), effects(d, c), alike(d)]),
        _parameters(c.fit),
        _instruments(c, d),
        _estimates(task),
        *([] if planned is None else [_planned(planned)]),
        *posterior,
        _provenance(task, c, d),
    ]
    return render_page(
        title=f"{', '.join(e.name for e in task.experiments)}: {headline}",
        about=f"{data_text(task.experiments)}. Model: {' + '.join(task.names)}.",
        verdict=headline,
        meanings=[] if d is None else meanings(d, task),
        lead=top.lead(c, d, stages, enough),
        typed=top.next_command(c, d, task),
        cards=top.cards(c, d),
        warnings=[*fit_warnings(c.fit), *comparison_warnings(c)],
        sections=[section for section in sections if section is not None],
        style=pictures_style(),
        steps=len(steps),
    )


def _fall(c: Comparison, d: Diagnosis | None, stages: Sequence[Stage], chosen: bool) -> Section:
    shown = stages or _stages(c, d)
    bars = fall_html(shown, c.floor, c.unit, choose="step" if chosen else "")
    rows = tuple(
        Line((stage_text(s), amount(s.rmse, c.unit), amount(s.held_out_rmse, c.unit), s.verdict)) for s in shown
    )
    judged_ones = len(shown) > 1 and any(s.verdict for s in shown)
    tables = (Grid(("added", "RMS", "on held-out runs", "verdict then"), rows, words=(3,)),) if judged_ones else ()
    words = ("Choose a bar: the loops below show the model with the effects up to there.",) if chosen else ()
    words += tuple(line for s in shown for line in held_text(s.held))
    folded = tuple(_attempts(stage, c.unit) for stage in shown if stage.attempts)
    title = "Larger models that were tried and not kept" if folded else ""
    return Section(
        "The error, down to the noise", sentences=words, picture=bars, tables=tables, folded=folded, folded_title=title
    )


def _attempts(stage: Stage, unit: str) -> Grid:
    """The larger models that were tried after one step of a discovery."""
    rows = tuple(
        Line((" + ".join(a.effects), amount(a.rmse, unit), amount(a.held_out_rmse, unit), why_not_kept(a)))
        for a in stage.attempts
    )
    heads = ("tried", "RMS", "on held-out runs", "why it is not kept")
    return Grid(heads, rows, title=f"After {stage_text(stage)}", words=(0, 3))


def steps_with_models(c: Comparison, stages: Sequence[Stage]) -> list[np.ndarray]:
    """The residual of every step, if each is known on the same samples; else that of the last model alone."""
    known = [stage.residual for stage in stages if stage.residual is not None]
    if stages and len(known) == len(stages) and all(len(r) == len(c.fit.residual) for r in known):
        return known
    return [c.fit.residual]


def _overview(c: Comparison, task: Task, steps: Sequence[np.ndarray]) -> Section | None:
    """The misfit of the runs on one pair of axes; None where they have no axis in common."""
    picture = overview_html(panels(task.experiments, c.fit.samples, steps[0]), steps)
    if not picture:
        return None
    pale = (
        " The lines of the model that is chosen above are strong, those of the others pale." if len(steps) > 1 else ""
    )
    words = f"Model minus measured, run by run, each line averaged over short parts of the axis.{pale}"
    return Section("The misfit of all runs at once", sentences=(words,), picture=picture)


def _loops(c: Comparison, task: Task, steps: Sequence[np.ndarray]) -> Section:
    shown = panels(task.experiments, c.fit.samples, steps[0])
    frames = [frame(panel, k, steps) for k, panel in enumerate(shown)]
    runs = sum(len(recording.runs) for e in task.experiments for recording in e.recordings)
    picture = key(frames) + loops_html(frames, steps)
    return Section("Measured and model", picture=picture, caption=thinning_text(frames, runs))


def _stages(c: Comparison, d: Diagnosis | None) -> list[Stage]:
    """Without a study: the model as it is, and what would explain it."""
    first = Stage("model", c.rmse, None if d is None else d.held_out_rmse)
    if d is None:
        return [first]
    best = [e for e in d.tried if set(e.effects) in [set(names) for names in d.explanations]] or list(d.nearest)
    return [first, *(Stage(f"with {effect_set(e.effects)}", e.rmse, e.held_out_rmse) for e in best[:5])]


def _where(c: Comparison) -> Section:
    return Section(
        "Where it fails",
        sentences=(worst_text(c), _sentence(kind_text(c))),
        picture="" if c.cells is None else _switched_maps(c),
        folded=tuple(_errors_by(table, c.unit) for table in c.tables),
        folded_title="Tables by pressure, contraction, branch, speed and run",
    )


def _switched_maps(c: Comparison) -> str:
    """The misfit over contraction and pressure, by branch or by parity, as the reader switches."""
    pairs = [("branch", maps.branch_maps(c)), ("parity", maps.parity_maps(c))]
    pairs = [(name, drawn) for name, drawn in pairs if drawn]
    words = {"branch": "by branch", "parity": "even and odd in the direction"}
    buttons = "".join(
        f'<label><input type="radio" name="map" id="map-{name}"{" checked" if not k else ""}> {words[name]}</label>'
        for k, (name, _) in enumerate(pairs)
    )
    shown = "".join(
        f'<div class="maps {name}">'
        + "".join(f"<figure>{figures.as_svg(f, f'{name}{k}')}</figure>" for k, f in enumerate(drawn))
        + "</div>"
        for name, drawn in pairs
    )
    return (f'<fieldset class="switch">{buttons}</fieldset>' if len(pairs) > 1 else "") + shown


def _sentence(text: str) -> str:
    return text[:1].upper() + text[1:] + "."


def _errors_by(table: ErrorTable, unit: str) -> Grid:
    heads, cells = error_cells(table.rows, unit)
    return Grid((table.title, *heads), tuple(Line(words) for words in cells))


def _planned(planned: "NextMeasurement") -> Section:
    told = measurement_text(planned)
    return Section("What to measure next", sentences=tuple(_sentence(text.rstrip(".")) for text in told))


def _parameters(fit: Fit) -> Section:
    heads = ("parameter", "value", "± robust", "± if independent", "measured", "how far", "range", "state", "tied with")
    rows = tuple(Line(_parameter(fit, name)) for name in shown_names(fit))
    words = (
        "Believe the robust error: it lets neighbouring samples err together. The one beside it takes every sample for "
        "independent of the others, and is too small.",
        *rests_on_texts(fit),
    )
    return Section("Parameters", sentences=words, tables=(Grid(heads, rows, words=(7, 8)),))


def _instruments(c: Comparison, d: Diagnosis | None) -> Section:
    """What each channel may err by, each in a sentence; and folded, each error and each recording."""
    words = "What is presumed is that of common instruments: state yours below [recording.accuracy] in muscle.toml."
    by_recording = tuple(Line(channel_cells(each)) for each in c.channels)
    errors = [errors_grid(d)] if d is not None and d.instruments else []
    explain = ", and what would explain the misfit" if d is not None and d.verdict not in NOTHING_MISSING else ""
    return Section(
        f"Instruments: what each may err by{explain if errors else ''}",
        sentences=(*(_sentence(text) for text in channel_lines(c.channels)), words),
        folded=(*errors, Grid(HEADS, by_recording, "Every recording", words=(0, 1, 3, 6, 7))),
        folded_title="Every error, recording and channel, one standard deviation each",
    )


def _estimates(task: Task) -> Section | None:
    """Readings beside the signals estimated from them; None where all readings enter the model as they are."""
    pairs = estimated_channels(task.experiments)
    if not pairs:
        return None
    words = "Where their error is felt in newtons, readings enter the model as a signal that is estimated from them."
    picture = figures.as_svg(readings_picture(pairs), "readings")
    return Section("Read and estimated", sentences=(words,), folded_picture=picture, folded_title="Show the readings")


def _parameter(fit: Fit, name: str) -> tuple[str, ...]:
    state = "at its bound" if name in fit.at_bound else fit.state(name)
    known = *value_cells(fit, name), *measured_cells(fit, name), " to ".join(range_cells(fit, name))
    return name, *known, state, ", ".join(fit.tied.get(name, ()))


def _provenance(task: Task, c: Comparison, d: Diagnosis | None) -> Section:
    known = provenance(task)
    rows = [("command", known["command"]), ("model from", task.origin), ("seed", str(task.seed))]
    rows += [(f"data: {name}", f"{data['folder']}, sha256 {data['sha256']}") for name, data in known["data"].items()]
    rows += [(f"source: {e.name}", e.source["citation"]) for e in task.experiments if e.source.get("citation")]
    rows += [(name, version) for name, version in known["versions"].items()]
    rows += [("search", search_text(c.fit)), *(("note", note) for note in c.notes)]
    grid = Grid(("", ""), tuple(Line(row) for row in rows), words=(1,))
    return Section(
        "Where this comes from",
        sentences=(error_text(c),),
        tables=(grid,),
        folded=() if d is None else (tried_table(d),),
        folded_title="" if d is None else f"All {len(d.tried)} sets of effects that were tried",
    )
