"""Results as one HTML page that opens from disk, needs no network, and prints."""

import functools
import io
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from importlib import resources
from typing import Any

import numpy as np

from fitting import figures, units
from fitting.compare import Comparison
from fitting.compare import Table as ErrorTable
from fitting.diagnosis import Diagnosis, Evidence
from fitting.figures import Stage
from fitting.least_squares import Fit
from fitting.model_file import state_of
from fitting.report import sorted_evidence
from fitting.results import provenance, shown_names, write_text
from fitting.sentences import (
    NEAR_FLOOR,
    amount,
    data_in_words,
    effect_set,
    error_in_words,
    fit_in_words,
    judged,
    kind_in_words,
    leading_in_words,
    p_in_words,
    percent,
    places,
    rounded,
    verdict_in_words,
    with_error,
)
from fitting.task import Task
from mckibben_jax.effect import Effect
from mckibben_jax.parameter import parameters


@dataclass(frozen=True)
class Line:
    """One row of a table; a good one stands out."""

    cells: tuple[str, ...]
    good: bool = False


@dataclass(frozen=True)
class Grid:
    """A table: its heads, and which columns are words rather than numbers."""

    heads: tuple[str, ...]
    rows: tuple[Line, ...]
    title: str = ""
    words: tuple[int, ...] = ()


@dataclass(frozen=True)
class Section:
    """A part of the page."""

    title: str
    sentences: tuple[str, ...] = ()
    picture: str = ""
    caption: str = ""
    tables: tuple[Grid, ...] = ()
    folded: tuple[Grid, ...] = ()
    folded_title: str = ""
    plain: str = ""


def write_page(
    path: str, task: Task, c: Comparison, d: Diagnosis | None = None, stages: Sequence[Stage] = ()
) -> None:
    """Write the page of a comparison, with the diagnosis and the steps of the study if there are any."""
    write_text(path, page(task, c, d, stages))


def write_words(path: str, title: str, shown: Iterable[Any]) -> None:
    """Write a page that says what the terminal says."""
    words = Section("", plain=_text(shown))
    write_text(path, _rendered(title=title, about="mckibben", verdict=title, sections=[words]))


def page(task: Task, c: Comparison, d: Diagnosis | None = None, stages: Sequence[Stage] = ()) -> str:
    """The page as text."""
    verdict = judged(c) if d is None else verdict_in_words(d)
    lead = [] if d is None else [text for text in (leading_in_words(d, c.unit), judged(c)) if text]
    if len(stages) > 1:
        first, last = stages[0].rmse, stages[-1].rmse
        lead.append(f"The error fell from {amount(first, c.unit)} to {amount(last, c.unit)}.")
    sections = [
        _fall(c, d, stages),
        Section("Measured and model", picture=figures.as_svg(figures.traces(c, task.experiments), "runs")),
        _where(c),
        *([] if d is None else [_effects(d, c, task)]),
        _parameters(c.fit),
        _provenance(task, c, d),
    ]
    return _rendered(
        title=f"{', '.join(e.name for e in task.experiments)}: {verdict}",
        about=f"{data_in_words(task.experiments)}. Model: {' + '.join(task.names)}.",
        verdict=verdict,
        lead=lead,
        cards=_cards(c, d),
        warnings=fit_in_words(c.fit),
        sections=sections,
    )


def _rendered(**content: Any) -> str:
    return _template().render({"lead": (), "cards": (), "warnings": (), **content})


@functools.cache
def _template() -> Any:
    from jinja2 import Environment

    source = resources.files("fitting").joinpath("page.html").read_text(encoding="utf-8")
    return Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True).from_string(source)


def _text(shown: Iterable[Any]) -> str:
    from rich.console import Console

    console = Console(record=True, width=100, file=io.StringIO(), highlight=False, markup=False)
    for thing in shown:
        console.print(thing)
    return console.export_text()


# ----------------------------------------------------------------------------------------------------------- sections


def _cards(c: Comparison, d: Diagnosis | None) -> list[tuple[str, str]]:
    cards = [
        (amount(c.rmse, c.unit), "error, root mean square"),
        (percent(c.share), f"of full scale, {amount(c.full_scale, c.unit)}"),
        (amount(c.floor, c.unit), "noise, " + ("one reading" if c.noise_floor is None else "repeated loops")),
    ]
    if c.fingerprint.odd_share is not None and c.rmse > NEAR_FLOOR * c.floor:
        cards.append((percent(c.fingerprint.odd_share), "of the misfit is odd: changes sign with the direction"))
    return cards if d is None else [*cards, (f"{d.p_value:.2g}", "p in the test that nothing is missing")]


def _fall(c: Comparison, d: Diagnosis | None, stages: Sequence[Stage]) -> Section:
    stages = stages or _stages(c, d)
    picture = figures.as_svg(figures.waterfall(stages, c.floor, c.unit), "fall")
    rows = tuple(Line((s.added, amount(s.rmse, c.unit), amount(s.left_out, c.unit), s.verdict)) for s in stages)
    judged_ones = any(s.verdict for s in stages)
    steps = (Grid(("added", "rms", "on runs left out", "verdict then"), rows, words=(3,)),) if judged_ones else ()
    return Section("The error, down to the noise", picture=picture, tables=steps)


def _stages(c: Comparison, d: Diagnosis | None) -> list[Stage]:
    """Without a study: the model as it is, and what would explain it."""
    first = Stage("model", c.rmse, None if d is None else d.held_out_rmse)
    if d is None:
        return [first]
    best = [e for e in d.tried if set(e.effects) in [set(names) for names in d.explanations]] or list(d.nearest)
    return [first, *(Stage(f"with {effect_set(e.effects)}", e.rmse, e.held_out_rmse) for e in best[:5])]


def _where(c: Comparison) -> Section:
    picture = "" if c.cells is None else figures.as_svg(figures.residual_map(c), "map")
    return Section(
        "Where it fails",
        sentences=(f"Worst at {c.worst}.", _sentence(kind_in_words(c))),
        picture=picture,
        folded=tuple(_errors_by(table, c.unit) for table in c.tables),
        folded_title="Tables by pressure, contraction, branch, speed and run",
    )


def _sentence(text: str) -> str:
    return text[:1].upper() + text[1:] + "."


def _errors_by(table: ErrorTable, unit: str) -> Grid:
    name, size = units.shown_in(unit, max(row.rmse for row in table.rows))
    after = places(row.rmse / size for row in table.rows)
    rows = tuple(
        Line((row.label, str(row.count), *(f"{v / size:.{after}f}" for v in (row.rmse, row.bias, row.largest))))
        for row in table.rows
    )
    return Grid((table.title, "samples", f"rms [{name}]", f"mean [{name}]", f"largest [{name}]"), rows)


def _effects(d: Diagnosis, c: Comparison, task: Task) -> Section:
    unit, known = c.unit, task.library
    helping, idle, blind = sorted_evidence(d)
    heads = ("effect added", "note", "rms", "on runs left out", "seen from", "absorbed", "estimate", "most alike")
    grid, others = (Grid(heads, tuple(Line(_evidence(e, unit, known), e.adequate) for e in some), words=(1, 6, 7))
                    for some in (helping, idle))  # fmt: skip
    unseen = Grid(("cannot be seen", "why"), tuple(Line((", ".join(v), k)) for k, v in blind.items()), words=(1,))
    return Section(
        "Which effects could explain it",
        sentences=(p_in_words(d),),
        picture=figures.as_svg(figures.effects_picture(d, c.floor, unit), "effects") if helping or idle else "",
        tables=(grid,) if helping else (),
        folded=tuple(table for table in (others, unseen) if table.rows),
        folded_title=f"{len(idle)} that do not help, and {sum(map(len, blind.values()))} that cannot be seen here",
    )


def _evidence(e: Evidence, unit: str, known: dict[str, type[Effect]]) -> tuple[str, ...]:
    alike = max(e.alike, key=lambda name: e.alike[name], default="")
    declared = {p.name: p.unit for p in parameters(known[e.name])} if e.name in known else {}
    estimate = "; ".join(
        f"{name} = {units.show(value, declared.get(name, '1'), error)}" for name, (value, error) in e.estimate.items()
    )
    return (
        e.name,
        "explains the data" if e.adequate else e.reason,
        amount(e.rmse, unit),
        amount(e.held_out_rmse, unit),
        amount(e.detection_limit, unit),
        "-" if e.absorbed_share is None else f"{100 * e.absorbed_share:.0f} %",
        estimate,
        f"{alike} {e.alike[alike]:.2f}" if alike else "",
    )


def _p(value: float) -> str:
    return "" if np.isnan(value) else f"{value:.2g}"


def _parameters(fit: Fit) -> Section:
    heads = ("parameter", "value", "± robust", "± i.i.d.", "range", "state", "tied with")
    rows = tuple(Line(_parameter(fit, name)) for name in shown_names(fit))
    words = ("The robust error lets neighbouring samples err together; the i.i.d. error does not, and is too small.",)
    return Section("Parameters", sentences=words, tables=(Grid(heads, rows, words=(5, 6)),))


def _parameter(fit: Fit, name: str) -> tuple[str, ...]:
    entry = fit.layout.entries[fit.layout.names.index(name)]
    value, robust = with_error(fit.values[name], fit.error(name), entry.unit)
    iid = rounded(fit.error(name, robust=False), entry.unit, 2) if name in fit.free else ""
    ends = f"{rounded(entry.lower, entry.unit)} to {rounded(entry.upper, entry.unit)}"
    state = "at its bound" if name in fit.at_bound else state_of(fit, name)
    return name, value, robust, iid, ends, state, ", ".join(fit.tied.get(name, ()))


def _provenance(task: Task, c: Comparison, d: Diagnosis | None) -> Section:
    known = provenance(task)
    rows = [("command", known["command"]), ("model from", task.origin), ("seed", str(task.seed))]
    rows += [(f"data: {name}", f"{data['folder']}, sha256 {data['sha256']}") for name, data in known["data"].items()]
    rows += [(f"source: {e.name}", e.source["citation"]) for e in task.experiments if e.source.get("citation")]
    rows += [(name, version) for name, version in known["versions"].items()]
    rows += [("search", c.fit.starts), *(("note", note) for note in c.notes)]
    grid = Grid(("", ""), tuple(Line(row) for row in rows), words=(1,))
    return Section(
        "Where this comes from",
        sentences=(error_in_words(c),),
        tables=(grid,),
        folded=() if d is None else (_tried(d, c.unit),),
        folded_title="" if d is None else f"All {len(d.tried)} sets of effects that were tried",
    )


def _tried(d: Diagnosis, unit: str) -> Grid:
    rows = tuple(
        Line((effect_set(e.effects), amount(e.rmse, unit), amount(e.held_out_rmse, unit), _p(e.p_value), e.reason))
        for e in d.tried
    )
    return Grid(("effects", "rms", "on runs left out", "p", "note"), rows, words=(4,))
