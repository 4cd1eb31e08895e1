"""A fit: values with their errors, and what to be wary of."""

from rich.console import RenderableType
from rich.text import Text

from fitting import full_names
from fitting.least_squares.record import Fit
from fitting.report.results import shown_names
from fitting.report.text.bounds import allowed_note, allowed_text, bound_text
from fitting.report.text.layout import columns, line, lines, spaced
from fitting.report.text.likelier import likelier_report
from fitting.report.text.names import mark, marked
from fitting.report.text.search import failure_texts, search_text
from fitting.report.text.stated_sizes import denied_texts, kept_from, rests_on_texts, runs_agree_texts
from fitting.report.text.values import range_cells, value_cells
from mckibben_jax.effect import Felt, name_of
from mckibben_jax.effects import LIBRARY


def fit_warnings(fit: Fit) -> list[str]:
    """What the user must know about a fit before trusting its numbers."""
    words = [] if fit.converged else ["The search did not converge: the values below are not to be trusted."]
    words += denied_texts(fit)
    ends = [name for name in fit.at_bound if name not in kept_from(fit)]
    words += [f"{mark(name)} lies at {bound_text(fit, name)}. {allowed_text(fit, name)}" for name in ends]
    words += [f"{marked(g, ' and ')} are strongly correlated, not separately identifiable." for g in tied_groups(fit)]
    if fit.held:
        words.append(f"Not constrained by these data, and held at their values: {marked(fit.held)}.")
    words += still_texts(fit)
    return words + [f"Search: {failure}" for failure in failure_texts(fit)]


def still_texts(fit: Fit) -> list[str]:
    """Why a friction is not seen where every length was held, and what lets a braid slide there."""
    effects = fit.layout.templates[0].effects
    friction = {name_of(effect) for effect in effects if "friction" in effect.gives}
    unseen = friction & {full_names.owner_of(full_names.common(name)) for name in fit.held}
    held = all(block.test == "isometric" for block in fit.problem.blocks)
    springs = [name_of(kind) for kind in LIBRARY if issubclass(kind, Felt) and kind.spring is not Felt.spring]
    if not unseen or not held or any(name_of(effect) in springs for effect in effects):
        return []
    return [
        "A muscle whose length is held does not slide in this model, so its friction is not seen. If its force differs "
        f"between rising and falling pressure, something gives way: try {marked(springs)}."
    ]


def tied_groups(fit: Fit) -> list[list[str]]:
    """Parameters that are tied, directly or through others."""
    groups: list[set[str]] = []
    for name, others in fit.tied.items():
        joined = {name, *others}
        for group in [group for group in groups if group & joined]:
            groups.remove(group)
            joined |= group
        groups.append(joined)
    return [sorted(group) for group in groups]


def fit_report(fit: Fit) -> list[RenderableType]:
    """Values, errors, bounds, and what to be wary of."""
    heads = ("parameter", "value", "+/- robust", "+/- i.i.d.", "range", "note")
    table = columns(*heads, words=(0, 5), spare=(4, 3))
    for name in shown_names(fit):
        table.add_row(mark(name), *_parameter(fit, name))
    warned, rests = lines("WARNING", fit_warnings(fit), "yellow"), lines("RESTS ON", rests_on_texts(fit))
    agree = lines("RUNS", runs_agree_texts(fit))
    return [spaced(table), Text(), *warned, *rests, *agree, *likelier_report(fit), line("SEARCH", search_text(fit))]


def _parameter(fit: Fit, name: str) -> tuple[str, ...]:
    note = allowed_note(fit, name) or ("correlated" if name in fit.tied else "")
    note = "held: not constrained" if name in fit.held else note if name in fit.free else "fixed"
    return *value_cells(fit, name), " .. ".join(range_cells(fit, name)), note
