"""The parts of the page that show the steps of a study: the switch between its models, and how the error fell."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from fitting.comparison.compare import Comparison
from fitting.diagnosis.record import Diagnosis
from fitting.least_squares.record import Fit
from fitting.report.page.models import ShownModel, bar_width, short_name
from fitting.report.page.names import PageNames
from fitting.report.page.parts import Grid, Line, Section
from fitting.report.pictures.fall import fall_html
from fitting.report.text.amounts import amount
from fitting.report.text.attempts import freed_text, held_text, why_not_kept
from fitting.report.text.diagnosis import effect_set
from fitting.report.text.path import blamed_on_the_way, path_texts
from fitting.report.text.side_by_side import MEASURED
from fitting.report.text.stages import dropped_text, stage_text, stage_verdict, tested_text
from fitting.report.text.stated_sizes import measured_cells
from fitting.report.text.values import value_cells
from fitting.study.stages import Stage

BARS = "Choose a bar, or a model at the top of the page: the whole page then shows that model."


@dataclass(frozen=True)
class Choice:
    """One model on the switch: its name, its error as text, and how long its bar is, in %."""

    name: str
    error: str
    width: float
    is_chosen: bool


def choices(models: Sequence[ShownModel], called: Callable[[str], str]) -> list[Choice]:
    """The models on the switch; none where there is nothing to choose. `called` gives the names for readers."""
    if len(models) < 2:
        return []
    chosen = chosen_of(models).number
    return [
        Choice(
            called(short_name(m, len(models))),
            amount(m.stage.rmse, m.comparison.unit),
            bar_width(m, models),
            m.number == chosen,
        )
        for m in models
    ]


def noise_mark(models: Sequence[ShownModel]) -> float:
    """Where the noise lies on the bar of the switch, in % of its length."""
    return 100 * models[-1].comparison.floor / max(*(model.stage.rmse for model in models), 1e-300)


def chosen_of(models: Sequence[ShownModel]) -> ShownModel:
    """The model that the page is of: the last one that is no preview."""
    return [model for model in models if not model.is_preview][-1]


def fall(
    models: Sequence[ShownModel], c: Comparison, d: Diagnosis | None, stages: Sequence[Stage], names: PageNames
) -> Section:
    """How the error fell from model to model, as bars and as a table."""
    switched = len(models) > 1
    shown = models[-1].stages if switched else stages or _explained(c, d)
    words = (BARS,) if switched else ()
    words += (
        *blamed_on_the_way(stages),
        *path_texts(stages),
        *(line for s in shown for line in (*held_text(s.held), *dropped_text(s), *freed_text(s.freed))),
    )
    folded = tuple(_attempts(stage, c.unit) for stage in shown if stage.attempts)
    return Section(
        "The error, down to the noise",
        sentences=words,
        picture=fall_html(shown, c.floor, c.unit, names.html, "step" if switched else ""),
        tables=_table(shown, models, c.unit, names),
        folded=folded,
        folded_title="Larger models that were tried and not kept" if folded else "",
        rail="Error",
    )


def _explained(c: Comparison, d: Diagnosis | None) -> list[Stage]:
    """Without a study: the model as it is, and what would explain it."""
    first = Stage("model", c.rmse, None if d is None else d.held_out_rmse)
    if d is None:
        return [first]
    best = [e for e in d.tried if set(e.effects) in [set(names) for names in d.explanations]] or list(d.nearest)
    return [first, *(Stage(f"with {effect_set(e.effects)}", e.rmse, e.held_out_rmse) for e in best[:5])]


def _table(shown: Sequence[Stage], models: Sequence[ShownModel], unit: str, names: PageNames) -> tuple[Grid, ...]:
    """Errors, test and verdict of every step; where each is a model of the page, with what it makes of the sizes."""
    judged = any(stage.verdict for stage in shown)
    if len(shown) < 2 or not (judged or len(models) > 1):
        return ()
    told = {"RMS": [amount(s.rmse, unit) for s in shown]}
    told["on held-out runs"] = [amount(s.held_out_rmse, unit) for s in shown]
    told["p"] = [tested_text(s.p_value) for s in shown]
    then = {"verdict then": [stage_verdict(s) for s in shown]} if judged else {}
    if len(models) == len(shown):
        return (_by_model(models, told, then, names),)
    columns = [[stage_text(s) for s in shown], *(told | then).values()]
    rows = tuple(Line(row) for row in zip(*columns, strict=True))
    return (Grid(("model", *told, *then), rows, words=(0, 4)),)


def _by_model(
    models: Sequence[ShownModel], told: dict[str, list[str]], then: dict[str, list[str]], names: PageNames
) -> Grid:
    """The same with one column a model, and one row for each size of the muscle that any of them fits."""
    fits = [model.comparison.fit for model in models]
    called = [names.plain(short_name(model, len(models))) for model in models]
    sizes = {name: [_size(fit, name) for fit in fits] for name in _sizes(fits)}
    measured = {name: measured_cells(fits[0], name)[0] for name in sizes}
    rows = [Line((what, "", *cells)) for what, cells in told.items()]
    rows += [Line((_size_text(name), measured[name], *cells)) for name, cells in sizes.items()]
    rows += [Line((what, "", *cells)) for what, cells in then.items()]
    return Grid(("", MEASURED, *called), tuple(rows), words=tuple(range(2 + len(models))))


def _sizes(fits: Sequence[Fit]) -> tuple[str, ...]:
    """The sizes of the muscle that any of the models fits."""
    return tuple(dict.fromkeys(name for fit in fits for name in fit.free if name.startswith("muscle.")))


def _size_text(name: str) -> str:
    return name.removeprefix("muscle.").replace("_", " ")


def _size(fit: Fit, name: str) -> str:
    """The value of a size in one model, and how many stated errors it is away from what was measured."""
    far = measured_cells(fit, name)[1]
    return value_cells(fit, name)[0] + (f", {far} away" if far else "")


def _attempts(stage: Stage, unit: str) -> Grid:
    """The larger models that were tried after one step of a discovery."""
    rows = tuple(
        Line((effect_set(a.effects), amount(a.rmse, unit), amount(a.held_out_rmse, unit), why_not_kept(a)))
        for a in stage.attempts
    )
    heads = ("tried", "RMS", "on held-out runs", "why it is not kept")
    return Grid(heads, rows, title=f"After {stage_text(stage)}", words=(0, 3))
