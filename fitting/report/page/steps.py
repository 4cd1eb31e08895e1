"""The parts of the page that show the steps of a study: the switch between its models, and how the error fell."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from fitting.comparison.compare import Comparison
from fitting.diagnosis.record import Diagnosis
from fitting.least_squares.record import Fit
from fitting.report.page.models import ShownModel, bar_width, short_name
from fitting.report.page.parts import Grid, Line, Named, Section
from fitting.report.pictures.fall import fall_html
from fitting.report.text.amounts import amount
from fitting.report.text.attempts import held_text, why_not_kept
from fitting.report.text.diagnosis import effect_set
from fitting.report.text.fit import value_cells
from fitting.report.text.path import path_texts
from fitting.report.text.stages import dropped_text, stage_text, tested_text
from fitting.report.text.stated_sizes import measured_cells
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
    models: Sequence[ShownModel], c: Comparison, d: Diagnosis | None, stages: Sequence[Stage], named: Named
) -> Section:
    """How the error fell from model to model, as bars and as a table; `named` makes HTML of the names of effects."""
    switched = len(models) > 1
    shown = models[-1].stages if switched else stages or _explained(c, d)
    words = (BARS,) if switched else ()
    words += (*path_texts(stages), *(line for s in shown for line in (*held_text(s.held), *dropped_text(s))))
    folded = tuple(_attempts(stage, c.unit) for stage in shown if stage.attempts)
    return Section(
        "The error, down to the noise",
        sentences=words,
        picture=fall_html(shown, c.floor, c.unit, named, "step" if switched else ""),
        tables=_table(shown, models, c.unit),
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


def _table(shown: Sequence[Stage], models: Sequence[ShownModel], unit: str) -> tuple[Grid, ...]:
    """The steps, one a row: errors, test, verdict, and what each model makes of the sizes of the muscle."""
    judged = any(stage.verdict for stage in shown)
    if len(shown) < 2 or not (judged or len(models) > 1):
        return ()
    fits = [model.comparison.fit for model in models] if len(models) == len(shown) else []
    sizes = _sizes(fits)
    values = [tuple(_size(fit, name) for name in sizes) for fit in fits] or [()] * len(shown)
    rows = tuple(
        Line(
            (
                stage_text(s),
                amount(s.rmse, unit),
                amount(s.held_out_rmse, unit),
                tested_text(s.p_value),
                *own,
                *([s.verdict] if judged else []),
            )
        )
        for s, own in zip(shown, values, strict=True)
    )
    heads = ("model", "RMS", "on held-out runs", "p", *(_size_head(fits[0], name) for name in sizes))
    heads += ("verdict then",) if judged else ()
    return (Grid(heads, rows, words=(0, *range(4, len(heads)))),)


def _sizes(fits: Sequence[Fit]) -> tuple[str, ...]:
    """The sizes of the muscle that any of the models fits."""
    return tuple(dict.fromkeys(name for fit in fits for name in fit.free if name.startswith("muscle.")))


def _size_head(fit: Fit, name: str) -> str:
    measured = measured_cells(fit, name)[0]
    return f"{name.removeprefix('muscle.').replace('_', ' ')}{f' (measured {measured})' if measured else ''}"


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
