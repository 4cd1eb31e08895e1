"""The library of effects in words."""

import inspect
from collections.abc import Sequence
from typing import Any

from rich.console import RenderableType
from rich.padding import Padding
from rich.text import Text

from fitting import showing
from fitting.report.formula import names_in, statements
from fitting.report.text.layout import line, lines
from mckibben_jax.effect import SYMBOLS, Effect, name_of, title_of
from mckibben_jax.memory import Memory
from mckibben_jax.parameter import Declaration, parameters

STAGES = {
    "felt": "what the braid feels of what the rig says",
    "stored": "what energy is stored, and what the pressure does",
    "lost": "what is lost to motion",
    "read": "what reaches the instrument, and what it makes of it",
}

BEGINS = (
    "begins fresh with the first sample of each run, as if the muscle had stood there for long; it is not fitted. "
    'Where it had just moved, give the first cycle no weight: valid = { time = ["20 s", "999 s"] } in muscle.toml'
)


def meaning(kind: type[Effect]) -> str:
    """What an effect is, in its own words."""
    return " ".join((inspect.getdoc(kind) or "").split())


def effects_report(kinds: Sequence[type[Effect]]) -> list[RenderableType]:
    """All effects by stage: the name for readers, the one to type, the parameters, and below them what it is."""
    shown: list[RenderableType] = []
    for stage, question in STAGES.items():
        mine = [kind for kind in kinds if kind.stage == stage]
        if mine:
            shown.append(Text(f"{stage}: {question}", style="bold underline"))
            shown += [part for kind in mine for part in _entry(kind)]
            shown.append(Text())
    return [*shown, Text("'mckibben effects NAME' explains one; 'mckibben add DATASET NAME' puts it into the model.")]


def _entry(kind: type[Effect]) -> tuple[RenderableType, RenderableType]:
    own = ", ".join(p.name for p in parameters(kind))
    heading = Text.assemble("  ", (title_of(kind), "bold"), f" ({name_of(kind)})  ", (own, "cyan"))
    return heading, Padding(Text(first_sentence(meaning(kind))), (0, 0, 0, 6))


def effect_report(kind: type[Effect]) -> list[RenderableType]:
    """One effect in full: meaning, parameters, when to suspect it, source."""
    heading = Text.assemble((title_of(kind), "bold"), f" ({name_of(kind)})")
    shown: list[RenderableType] = [heading, line("", meaning(kind))]
    shown += lines("LAW", statements(kind.formula))
    shown += lines("WHERE", ["; ".join(symbols(kind))] if kind.formula else [])
    shown += lines("SUSPECT", [kind.suspect] if kind.suspect else [])
    shown.append(line("STAGE", f"{kind.stage}: {STAGES[kind.stage]}"))
    shown += lines("MEMORY", [BEGINS] if issubclass(kind, Memory) else [])
    shown += lines("RIVALS", [f"replaces any other effect of the family '{kind.family}'"] if kind.family else [])
    shown += lines("NEEDS", [", ".join(kind.needs).replace("_", " ")] if kind.needs else [])
    shown += lines("RIVAL", ["a printed law that is unsound: a candidate only on request"] if kind.rival else [])
    shown += lines("TESTED", [kind.on_request] if kind.on_request else [])
    shown += lines("CONSTANT", [", ".join(kind.fixed)] if kind.fixed else [])
    shown += lines("VALUES", (_parameter(p) for p in parameters(kind)))
    return [*shown, *lines("SOURCE", [kind.source] if kind.source else []), Text()]


def symbols(kind: type[Effect]) -> list[str]:
    """What stands in an effect's formula beside its parameters: "P gauge pressure"."""
    own = {p.name for p in parameters(kind)}
    return [f"{name} {SYMBOLS[name]}" for name in names_in(kind.formula) if name not in own and name in SYMBOLS]


def _parameter(p: Declaration) -> str:
    ends = f"{showing.show(p.lower, p.unit)} to {showing.show(p.upper, p.unit)}"
    return f"{p.name}: {p.meaning}; {showing.show(p.default, p.unit)} unless fitted, range {ends}"


def first_sentence(text: str) -> str:
    """The first sentence, for lists."""
    return text.split(". ")[0].rstrip(".")


def effects_result(kinds: Sequence[type[Effect]]) -> dict[str, Any]:
    """The same for machines."""
    return {
        name_of(kind): {
            "title": title_of(kind),
            "stage": kind.stage,
            "meaning": meaning(kind),
            "formula": kind.formula,
            "suspect": kind.suspect,
            "source": kind.source,
            "family": kind.family,
            "needs": list(kind.needs),
            "rival": kind.rival,
            "parameters": {p.name: _declaration(p) for p in parameters(kind)},
        }
        for kind in kinds
    }


def _declaration(p: Declaration) -> dict[str, Any]:
    return {"default": p.default, "unit": p.unit, "meaning": p.meaning, "lower": p.lower, "upper": p.upper}
