"""The parts of the page that show the misfit: all runs at once, where the model fails, and run by run."""

from collections.abc import Sequence

from fitting.comparison.compare import Comparison
from fitting.comparison.compare import Table as ErrorTable
from fitting.report.page.live.picture import LivePicture
from fitting.report.page.models import ShownModel
from fitting.report.page.parts import Grid, Line, Section, as_sentence
from fitting.report.pictures import figures, maps
from fitting.report.pictures.loops import frame, key, loops_html, thinning_text
from fitting.report.pictures.overview import overview_html
from fitting.report.pictures.panels import panels
from fitting.report.text.amounts import amount
from fitting.report.text.bands import band_lines
from fitting.report.text.comparison import error_cells, fails, kind_text, place_text, worst_text
from fitting.study.task import Task

COLOURS = (
    "Orange cells: the model pulls more than the muscle did. Blue cells: it pulls less. Grey cells: the mean misfit is "
    "below twice the noise, {noise}."
)


def overview(models: Sequence[ShownModel], task: Task) -> Section | None:
    """The misfit of the runs on one pair of axes; None where they have no axis in common."""
    steps = [model.residual for model in models]
    picture = overview_html(panels(task.experiments, models[0].comparison.fit.samples, steps[0]), steps)
    if not picture:
        return None
    pale = " The lines of the chosen model are strong, those of the others pale." if len(models) > 1 else ""
    words = f"Model minus measured, run by run, each line averaged over short parts of the axis.{pale}"
    return Section("The misfit of all runs at once", sentences=(words,), picture=picture, is_still=True)


def loops(models: Sequence[ShownModel], task: Task) -> Section:
    """Measured and model, run by run."""
    steps = [model.residual for model in models]
    shown = panels(task.experiments, models[0].comparison.fit.samples, steps[0])
    frames = [frame(panel, k, steps) for k, panel in enumerate(shown)]
    runs = sum(len(recording.runs) for e in task.experiments for recording in e.recordings)
    picture = key(frames) + loops_html(frames, steps)
    return Section("Measured and model, run by run", picture=picture, caption=thinning_text(frames, runs), rail="Runs")


def where(models: Sequence[ShownModel], live: LivePicture) -> Section:
    """Where each model fails: sentences, and the live picture above maps on one scale of colours."""
    compared = [model.comparison for model in models]
    scale = maps.scale_of(compared)
    drawn = compared[0].cells is not None
    colours = COLOURS.format(noise=amount(scale.noise, "N"))
    return Section(
        "Where it fails",
        said=tuple((model.number, text) for model in models for text in _where_texts(model, compared[0])),
        picture=live.html + (_switched_maps(compared, scale) if drawn else "") + live.words,
        caption=colours if drawn else "",
        rail="Misfit",
        stays=True,
    )


def _where_texts(model: ShownModel, first: Comparison) -> list[str]:
    """Where the model fails; of one that does not, where the first one did."""
    c, kind = model.comparison, as_sentence(kind_text(model.comparison))
    if fails(c) or not model.number or not fails(first):
        return [worst_text(c), kind, *band_lines(c.bands)]
    return [kind, f"The model 'before' failed most at {place_text(first)}.", *band_lines(c.bands)]


def tables(model: ShownModel, count: int) -> Section:
    """The errors of one of `count` models by pressure, contraction, branch, speed and run, folded."""
    c = model.comparison
    return Section(
        "",
        folded=tuple(_errors_by(table, c.unit) for table in c.tables),
        folded_title="Tables by pressure, contraction, branch, speed and run",
        model=model.number if count > 1 else None,
    )


def _errors_by(table: ErrorTable, unit: str) -> Grid:
    heads, cells = error_cells(table.rows, unit)
    return Grid((table.title, *heads), tuple(Line(words) for words in cells))


def _switched_maps(compared: Sequence[Comparison], scale: maps.Scale) -> str:
    """The misfit over contraction and pressure, by branch or by parity, as the reader switches."""
    words = {"branch": "by branch", "parity": "even and odd in the direction"}
    drawn = {"branch": [maps.branch_maps(c, scale) for c in compared]}
    drawn["parity"] = [maps.parity_maps(c, scale) for c in compared]
    drawn = {name: each for name, each in drawn.items() if any(each)}
    buttons = "".join(
        f'<label><input type="radio" name="map" id="map-{name}"{" checked" if not k else ""}> {words[name]}</label>'
        for k, name in enumerate(drawn)
    )
    shown = "".join(f'<div class="stack {name}">{_stacked(name, each)}</div>' for name, each in drawn.items())
    legend = '<legend class="hidden">How the maps are divided</legend>'
    return (f'<fieldset class="switch">{legend}{buttons}</fieldset>' if len(drawn) > 1 else "") + shown


def _stacked(name: str, each: Sequence[Sequence["figures.Figure"]]) -> str:
    """The maps of all models in one place."""
    return "".join(
        f'<div class="maps model m{k}">'
        + "".join(f"<figure>{figures.as_svg(f, f'{name}{k}-{n}')}</figure>" for n, f in enumerate(some))
        + "</div>"
        for k, some in enumerate(each)
    )
