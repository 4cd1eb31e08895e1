"""Results in words and tables, for the terminal."""

import os
import sys
from collections.abc import Iterable, Sequence

from rich.console import Console, RenderableType
from rich.table import Table
from rich.text import Text

from fitting.comparison.compare import Comparison
from fitting.comparison.compare import Table as ErrorTable
from fitting.diagnosis.record import HELPS, Diagnosis, Evidence, Explanation
from fitting.least_squares.fit import Fit
from fitting.report.cells import error_cells, range_cells, value_cells
from fitting.report.results import shown_names
from fitting.report.sentences import (
    amount,
    data_in_words,
    effect_set,
    error_in_words,
    fails,
    fit_in_words,
    judged,
    kind_in_words,
    leading_in_words,
    most_alike,
    p_in_words,
    remark,
    substitutes_in_words,
    values_in_words,
    verdict_in_words,
    worst_in_words,
)
from fitting.report.warnings import doubts
from fitting.study.stages import Stage
from fitting.study.task import Task

WIDTH = 110  # where the output is no terminal
BAR = 24
LABEL = 9
MOST_RUNS = 12
MOST_VALUED = 3  # explanations of which the values are shown


class Lasting(Console):
    """A console whose reader may leave (`| head`): what was computed is saved all the same."""

    def on_broken_pipe(self) -> None:
        """Say nothing any more."""
        self.quiet = True
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def console(quiet: bool = False) -> Console:
    """The terminal; a file or pipe is written to at a fixed width."""
    plain = Lasting(highlight=False, markup=False, quiet=quiet)
    return plain if plain.is_terminal else Lasting(highlight=False, markup=False, quiet=quiet, width=WIDTH)


def headed(label: str, text: str, style: str = "") -> RenderableType:
    """A line 'WHERE   ...' whose text stays to the right of its label."""
    grid = Table.grid(padding=(0, 1))
    grid.add_column(width=LABEL, no_wrap=True)
    grid.add_column(overflow="fold")
    grid.add_row(Text(label, style="bold"), Text(text, style=style))
    return grid


def to_type(label: str, command: str) -> Text:
    """A command behind its label, which no narrow terminal breaks: it can be pasted."""
    return Text.assemble((label.ljust(LABEL + 1), "bold"), command)


def lines(label: str, texts: Iterable[str], style: str = "") -> list[RenderableType]:
    """The label beside the first of several lines."""
    return [headed(label if not number else "", text, style) for number, text in enumerate(texts)]


def opening(task: Task) -> list[RenderableType]:
    """The first lines of every study: which model, which data."""
    return [
        headed("MODEL", f"{' + '.join(task.names)} ({task.origin})"),
        headed("DATA", data_in_words(task.experiments)),
    ]


def comparison_report(c: Comparison) -> list[RenderableType]:
    """Where the model fails."""
    shown: list[RenderableType] = [
        headed("RESULT", judged(c), "bold"),
        headed("ERROR", error_in_words(c)),
        *([headed("WHERE", worst_in_words(c))] if fails(c) else []),
        headed("KIND", kind_in_words(c)),
        *lines("WARNING", doubts(c), "yellow"),
    ]
    shown += lines("NOTE", c.notes)
    if len(c.by_recording) > 1:
        shown.append(_recordings(c))
    return [*shown, *(_errors_by(table, c.unit) for table in c.tables)]


def _plain_table(*heads: str, title: str | None = None) -> Table:
    table = Table(box=None, pad_edge=False, padding=(0, 2), title=title, title_justify="left", title_style="bold")
    for number, head in enumerate(heads):
        table.add_column(head, justify="left" if not number else "right", header_style="dim", overflow="fold")
    return table


def _errors_by(table: ErrorTable, unit: str) -> RenderableType:
    rows = table.rows
    left_out = len(rows) - MOST_RUNS if len(rows) > MOST_RUNS + 1 else 0
    if left_out:
        worst = sorted(rows, key=lambda row: -row.rmse)[:MOST_RUNS]
        rows = tuple(row for row in rows if row in worst)
    top = max(row.rmse for row in rows)
    name, cells = error_cells(rows, unit)
    shown = _plain_table(f"by {table.title}", "samples", *(f"{head} [{name}]" for head in ("rms", "mean", "largest")))
    shown.add_column("", justify="left")
    for row, words in zip(rows, cells, strict=True):
        shown.add_row(*words, Text("█" * max(1, round(BAR * row.rmse / top)) if top > 0 else "", style="cyan"))
    if left_out:
        shown.add_row(f"... and {left_out} with less error", "", "", "", "", "")
    return _spaced(shown)


def _spaced(table: Table) -> RenderableType:
    grid = Table.grid()
    grid.add_row("")
    grid.add_row(table)
    return grid


def _recordings(c: Comparison) -> RenderableType:
    table = _plain_table("by recording", "test", "samples", "rms", "largest", "full scale", "noise")
    several = len({score.dataset for score in c.by_recording}) > 1
    for s in c.by_recording:
        name = f"{s.dataset}, {s.file}" if several else s.file
        values = (amount(value, s.unit) for value in (s.rmse, s.largest, s.full_scale, s.noise))
        table.add_row(name, s.test, str(s.count), *values)
    return _spaced(table)


# ---------------------------------------------------------------------------------------------------------------- fit


def fit_report(fit: Fit) -> list[RenderableType]:
    """Values, errors, bounds, and what to be wary of."""
    table = _plain_table("parameter", "value", "+/- robust", "+/- i.i.d.", "range", "note")
    table.columns[0].overflow, table.columns[0].no_wrap = "ellipsis", True
    for name in shown_names(fit):
        table.add_row(name, *_parameter(fit, name))
    return [_spaced(table), Text(), *lines("WARNING", fit_in_words(fit), "yellow"), headed("SEARCH", fit.starts)]


def _parameter(fit: Fit, name: str) -> tuple[str, ...]:
    note = "at its bound" if name in fit.at_bound else "tied" if name in fit.tied else ""
    note = "held: not visible" if name in fit.held else note if name in fit.free else "fixed"
    return *value_cells(fit, name), " .. ".join(range_cells(fit, name)), note


# ---------------------------------------------------------------------------------------------------------- diagnosis


def diagnosis_report(d: Diagnosis, unit: str = "N") -> list[RenderableType]:
    """The verdict, what it rests on, and the evidence for each effect."""
    shown: list[RenderableType] = [headed("VERDICT", verdict_in_words(d), "bold")]
    leading = leading_in_words(d, unit)
    shown += [headed("LEADING", leading)] if leading else []
    shown.append(headed("SURE", p_in_words(d)))
    shown += lines("OR ELSE", substitutes_in_words(d))
    shown += lines("ALIKE", (f"{' = '.join(group)}: these data cannot tell them apart" for group in d.classes))
    shown += lines("VALUES", (values_in_words(e) for e in explained(d)[:MOST_VALUED] if e.estimate))
    shown += lines("NEAREST", (f"{effect_set(e.effects)}: {amount(e.rmse, unit)}" for e in d.nearest))
    return [*shown, *_evidence(d, unit)]


def _evidence(d: Diagnosis, unit: str) -> list[RenderableType]:
    """The effects that help, in a table; the others by name."""
    helping, idle, blind = sorted_evidence(d)
    table = _plain_table("effect added", "rms", "left out", "noticed from", "most alike", "")
    for column in (4, 5):
        table.columns[column].justify = "left"
    several = sets_named(d)
    for e in several:
        values = (amount(value, unit) for value in (e.rmse, e.held_out_rmse))
        table.add_row(effect_set(e.effects), *values, "", "", "explain the data", style="bold")
    for e in helping:
        table.add_row(e.name, *_evidence_cells(e, unit), style="bold" if e.adequate else "")
    shown = [_spaced(table), Text()] if helping or several else []
    named = {name for names in d.explanations for name in names}
    others = ", ".join(e.name for e in idle if e.name not in {*d.faint, *named})
    shown += [headed("NOT IT", f"{others}: hardly less error on runs left out with any of them")] if others else []
    return [*shown, *lines("NOT SEEN", (f"{', '.join(names)}: {why}" for why, names in blind.items()))]


def explained(d: Diagnosis) -> list[Explanation]:
    """The explanations that are named, with what was fitted, in the order of the verdict."""
    known = {frozenset(e.effects): e for e in d.tried}
    return [known[frozenset(names)] for names in d.explanations if frozenset(names) in known]


def sets_named(d: Diagnosis) -> list[Explanation]:
    """Explanations of more than one effect."""
    named = {frozenset(names) for names in d.explanations if len(names) > 1}
    return [e for e in d.tried if frozenset(e.effects) in named]


def sorted_evidence(d: Diagnosis) -> tuple[list[Evidence], list[Evidence], dict[str, list[str]]]:
    """Effects that lower the left-out error, best first; those that do not; and by reason those that cannot be seen."""
    seen = (e for e in d.effects.values() if e.detection_limit is not None or e.adequate)
    tested = [e for e in seen if e.held_out_rmse is not None]
    tested.sort(key=lambda e: e.held_out_rmse or 0.0)
    helping = [e for e in tested if e.adequate or (e.held_out_rmse or 0.0) < HELPS * d.held_out_rmse]
    blind: dict[str, list[str]] = {}
    named = {name for names in d.explanations for name in names}  # with others; alone it may lack what it needs
    for e in d.effects.values():
        if e not in tested and e.name not in named:
            fitted = e.rmse is not None  # and tested, in vain: what it would do, the model's own parameters do as well
            blind.setdefault("these data cannot see it" if fitted else e.reason, []).append(e.name)
    return helping, [e for e in tested if e not in helping], blind


def _evidence_cells(e: Evidence, unit: str) -> tuple[str, ...]:
    alike = most_alike(e)
    values = (amount(value, unit) for value in (e.rmse, e.held_out_rmse))
    return *values, amount(e.detection_limit, unit), f"{alike} {e.similar[alike]:.2f}" if alike else "", remark(e)


def steps_report(stages: Sequence[Stage], unit: str = "N") -> list[RenderableType]:
    """How the error fell, step by step."""
    said = any(stage.verdict for stage in stages)
    table = _plain_table("", "rms", "on runs left out", "", *(["verdict then"] if said else []))
    table.columns[3].justify = "left"
    top = max(stage.rmse for stage in stages) or 1.0
    for stage in stages:
        bar = Text("█" * max(1, round(BAR * stage.rmse / top)), style="cyan")
        verdict = [stage.verdict] if said else []
        table.add_row(stage.added, amount(stage.rmse, unit), amount(stage.left_out, unit), bar, *verdict)
    return [_spaced(table)]
