"""Results as one HTML page that opens from disk, needs no network, and prints."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from fitting.comparison.compare import Comparison
from fitting.diagnosis.outcomes import NOTHING_MISSING
from fitting.diagnosis.record import Diagnosis
from fitting.least_squares.record import Fit
from fitting.recordings.records import Experiment
from fitting.report.page import misfit, steps, top
from fitting.report.page.diagnosed import of_diagnoses
from fitting.report.page.diagnosis import errors_grid, tried_table
from fitting.report.page.live.picture import live_picture
from fitting.report.page.models import ShownModel, models_of, short_name
from fitting.report.page.names import PageNames
from fitting.report.page.parts import Grid, Line, Section, as_sentence, pictures_style, render_page
from fitting.report.pictures import figures
from fitting.report.pictures.muscle_drawing import DRAWN, model_html
from fitting.report.pictures.readings import estimated_channels, readings_picture
from fitting.report.results import provenance, shown_names
from fitting.report.text.bounds import allowed_note
from fitting.report.text.citations import citations
from fitting.report.text.comparison import error_text
from fitting.report.text.diagnosis import measurement_text
from fitting.report.text.instruments import HEADS, channel_cells, channel_lines
from fitting.report.text.likelier import likelier_rows, likelier_text
from fitting.report.text.names import mark, marked
from fitting.report.text.search import search_text
from fitting.report.text.side_by_side import side_by_side
from fitting.report.text.stated_sizes import measured_cells, rests_on_texts, runs_agree_texts
from fitting.report.text.study import data_text
from fitting.report.text.values import range_cells, value_cells
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
    chosen: int = -1,
    planned: "NextMeasurement | None" = None,
    more: Sequence[Section] = (),
    enough: float = ENOUGH,
    following: tuple[str, str] | None = None,
) -> None:
    """Write the page of a comparison, with what else there is: diagnosis, steps, next measurement, and `more`."""
    options = {"chosen": chosen, "planned": planned, "more": more, "enough": enough, "following": following}
    write_text(path, page(task, c, d, stages, **options))


def page(
    task: Task,
    c: Comparison,
    d: Diagnosis | None = None,
    stages: Sequence[Stage] = (),
    *,
    chosen: int = -1,
    planned: "NextMeasurement | None" = None,
    more: Sequence[Section] = (),
    enough: float = ENOUGH,
    following: tuple[str, str] | None = None,
) -> str:
    """The page as text.

    `stages` are the models that it shows, of which the reader chooses one at a time; `chosen` is the one that the page
    is of, counted as in a list: later ones show what would come of it. `more` holds sections that other parts of the
    program made of the same fit, `enough` is the share of full scale that may be left, `following` what to do next and
    the command for it, where the caller knows better than the results say.
    """
    models, names = models_of(c, d, stages, chosen), PageNames(task.library)
    here = steps.chosen_of(models)
    live = live_picture(models, task, names.plain)
    sections = [
        misfit.overview(models, task),
        misfit.where(models, live),
        steps.fall(models, c, d, stages, names),
        misfit.loops(models, task),
        *(misfit.tables(model, len(models)) for model in models),
        *of_diagnoses(models, names),
        *_of_each(models, lambda m: _parameters(m.comparison.fit, task.experiments)),
        *_side_by_side(models, names),
        *_of_each(models, lambda m: _instruments(m.comparison, m.diagnosis)),
        _estimates(task),
        *([] if planned is None else [_planned(planned)]),
        *more,
        _citing(task),
        _provenance(task, models, d),
    ]
    return render_page(
        title=names.plain(f"{', '.join(e.name for e in task.experiments)}: {top.verdict(here, models, enough)}"),
        about=f"{data_text(task.experiments)}.",
        heads=[top.head(model, models, task, enough) for model in models],
        choices=steps.choices(models, names.plain),
        noise=steps.noise_mark(models),
        typed=following or top.next_command(here, models, task),
        sections=[section for section in sections if section is not None],
        style=pictures_style(),
        live=live,
        named=names.html,
        headline=names.headline,
    )


def _of_each(models: Sequence[ShownModel], made: Callable[[ShownModel], Section]) -> list[Section]:
    """The same part for every model; it shows when its model is chosen."""
    if len(models) == 1:
        return [made(models[0])]
    return [replace(made(model), model=model.number) for model in models]


def _planned(planned: "NextMeasurement") -> Section:
    told = measurement_text(planned)
    sentences = tuple(as_sentence(text.rstrip(".")) for text in told)
    return Section("What to measure next", sentences=sentences, rail="Next")


def _parameters(fit: Fit, experiments: Sequence[Experiment]) -> Section:
    heads = ("parameter", "value", "± robust", "± if independent", "measured", "how far", "range", "state", "tied with")
    rows = tuple(Line(_parameter(fit, name)) for name in shown_names(fit))
    words = (
        "Believe the robust error: it lets neighbouring samples err together, and instruments as far as their accuracy "
        "goes. The one beside it takes every sample for independent of the others, and is too small.",
        *rests_on_texts(fit),
        *runs_agree_texts(fit),
    )
    grids = [Grid(heads, rows, words=(0, 7, 8))]
    if likelier := likelier_text(fit):
        words, values = (*words, likelier), tuple(map(Line, likelier_rows(fit)))
        heads = ("parameter", "likelier value", "± robust")
        grids.append(Grid(heads, values, "The likelier values, where instruments may err", words=(0,)))
    drawn = model_html(experiments, fit.layout, fit.vector, fit.switches)
    return Section("Parameters", sentences=words, picture=drawn, caption=DRAWN, tables=tuple(grids), rail="Parameters")


def _side_by_side(models: Sequence[ShownModel], names: PageNames) -> list[Section]:
    """Errors and parameters of every model in one table, where there are several."""
    if len(models) < 2:
        return []
    called = [names.plain(short_name(model, len(models))) for model in models]
    heads, rows = side_by_side(called, [model.stage for model in models])
    grid = Grid(heads, tuple(Line(row) for row in rows), words=(0,))
    return [Section("All models side by side", tables=(grid,), rail="Parameters")]


def _instruments(c: Comparison, d: Diagnosis | None) -> Section:
    """What each channel may err by, each in a sentence; and folded, each error and each recording."""
    words = "What is presumed is that of common instruments: state yours below [accuracy] in muscle.toml."
    by_recording = tuple(Line(channel_cells(each)) for each in c.channels)
    errors = [errors_grid(d)] if d is not None and d.instruments else []
    explain = ", and what would explain the misfit" if d is not None and d.verdict not in NOTHING_MISSING else ""
    return Section(
        f"Instruments: what each may err by{explain if errors else ''}",
        sentences=(*(as_sentence(text) for text in channel_lines(c.channels)), words),
        folded=(*errors, Grid(HEADS, by_recording, "Every recording", words=(0, 1, 3, 6, 7))),
        folded_title="Every error, recording and channel, one standard deviation each",
        rail="Instruments",
    )


def _estimates(task: Task) -> Section | None:
    """Readings beside the signals estimated from them; None where all readings enter the model as they are."""
    pairs = estimated_channels(task.experiments)
    if not pairs:
        return None
    words = "Where their error is felt in newtons, readings enter the model as a signal that is estimated from them."
    picture = figures.as_svg(readings_picture(pairs), "readings")
    return Section(
        "Read and estimated",
        sentences=(words,),
        folded_picture=picture,
        folded_title="Show the readings",
        rail="Instruments",
    )


def _parameter(fit: Fit, name: str) -> tuple[str, ...]:
    state = allowed_note(fit, name) or fit.state(name)
    known = *value_cells(fit, name), *measured_cells(fit, name), " to ".join(range_cells(fit, name))
    return mark(name), *known, state, marked(fit.tied.get(name, ()))


def _citing(task: Task) -> Section:
    """Whom to cite, as `mckibben cite` prints it."""
    rows = [(label, text) for label, texts in citations(task.effects, task.experiments).items() for text in texts]
    return Section("How to cite", tables=(Grid(("", ""), tuple(map(Line, rows)), words=(0, 1)),), rail="Source")


def _provenance(task: Task, models: Sequence[ShownModel], d: Diagnosis | None) -> Section:
    known = provenance(task)
    c = steps.chosen_of(models).comparison
    rows = [("command", known["command"]), ("model from", task.origin), ("seed", str(task.seed))]
    rows += [(f"data: {name}", f"{data['folder']}, sha256 {data['sha256']}") for name, data in known["data"].items()]
    rows += [(f"source: {e.name}", e.source["citation"]) for e in task.experiments if e.source.get("citation")]
    rows += [(name, version) for name, version in known["versions"].items()]
    rows += [("search", search_text(c.fit)), *(("note", note) for note in c.notes)]
    grid = Grid(("", ""), tuple(Line(row) for row in rows), words=(1,))
    return Section(
        "Where this comes from",
        said=tuple((model.number, error_text(model.comparison)) for model in models),
        tables=(grid,),
        folded=() if d is None else (tried_table(d),),
        folded_title="" if d is None else f"All {len(d.tried)} sets of effects that were tried",
        rail="Source",
    )
