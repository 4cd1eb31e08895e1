"""Identified muscles in words: which there are, one in full, and how two of them differ."""

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from rich.console import RenderableType

from fitting import showing
from fitting.identified.differences import Difference, differences
from fitting.identified.record import Behaviour, Identified, Known
from fitting.identified.shelf import Shelved
from fitting.report.text.amounts import amount, percent, with_error
from fitting.report.text.diagnosis import effect_set
from fitting.report.text.layout import columns, line, lines, spaced
from fitting.report.text.names import mark, marked

WORDS = {
    "behaviour.pull_at_rest": "pull at rest",
    "behaviour.pull_over_section": "pull / (pressure x section)",
    "behaviour.stroke": "stroke",
    "behaviour.loop_width": "width of the loop halfway",
    "behaviour.rubber": "force of the rubber halfway",
}


def shelf_report(found: Sequence[Shelved], own: str) -> list[RenderableType]:
    """Every identified muscle in a line; `own` is where a user's own are kept."""
    heads = ("muscle", "length", "radius", "angle", "pull at rest", "stroke", "RMS error", "model")
    table = columns(*heads, words=(0, 7), spare=(7, 3, 6))
    for each in found:
        table.add_row(*_row(each.muscle))
    shown: list[RenderableType] = [spaced(table), ""]
    shown += [line("PULL", "and stroke are at 3 bar, or at the highest pressure that was recorded, moved slowly.")]
    return [*shown, line("YOURS", f"are kept in {own}: 'mckibben library add FOLDER' puts one there.")]


def _row(muscle: Identified) -> tuple[str, ...]:
    sizes = (muscle.parameters[f"muscle.{name}"] for name in ("length", "radius", "braid_angle"))
    error = f"{percent(muscle.rmse / muscle.full_scale)}"
    return (
        muscle.name, *(amount(each.value, each.unit) for each in sizes),
        showing.show(muscle.behaviour.pull_at_rest, "N", digits=3), percent(muscle.behaviour.stroke), error,
        effect_set(muscle.effects),
    )  # fmt: skip


def muscle_report(each: Shelved) -> list[RenderableType]:
    """One muscle in full."""
    muscle = each.muscle
    table = columns("parameter", "value", "90 %", "state", words=(0, 3))
    for name, known in muscle.parameters.items():
        table.add_row(mark(name), _value(known), _range(known), known.state)
    warned = ["its ranges fail their own check: sample ('mckibben posterior') to know them"]
    source = [f"{key}: {text}" for key, text in muscle.source.items()]
    return [
        line("MUSCLE", f"{muscle.name}: {effect_set(muscle.effects)}", "bold"),
        line("ERROR", f"RMS {_newtons(muscle.rmse)}, {percent(muscle.rmse / muscle.full_scale)} of full scale, over "
                      f"{muscle.readings:,} readings; {_newtons(muscle.held_out_rmse)} on runs left out."),
        line("VERDICT", _verdict(muscle)),
        line("DOES", _does(muscle.behaviour)),
        spaced(table), "",
        *lines("WARNING", [] if muscle.is_trusted else warned, "yellow"),
        *lines("SOURCE", source),
        line("FOLDER", str(each.folder)),
    ]  # fmt: skip


def _verdict(muscle: Identified) -> str:
    named = " or ".join(effect_set(names) for names in muscle.explanations)
    return f"{muscle.verdict}: {named}" if named else muscle.verdict


def _does(b: Behaviour) -> str:
    at = showing.show(b.pressure, "Pa")
    return (
        f"At {at} it pulls {_newtons(b.pull_at_rest)} at rest, {b.pull_over_section:.3g} times pressure x section, and "
        f"shortens by {percent(b.stroke)}.{_halfway(b)}"
    )


def _halfway(b: Behaviour) -> str:
    """What is seen at half the stroke: of a model without rubber, or without measured friction, nothing."""
    said = [] if b.loop_width is None else [f"its loop is {_newtons(b.loop_width)} wide"]
    said += [f"its rubber opposes with {_newtons(b.rubber)}"] if b.rubber else []
    return f" Halfway {' and '.join(said)}." if said else ""


def comparison_of_muscles(mine: Identified, others: Sequence[Identified]) -> list[RenderableType]:
    """How a muscle differs from others: sentences first, then every number that both have."""
    shown: list[RenderableType] = []
    for theirs in others:
        found = differences(mine, theirs)
        large = sorted((each for each in found if each.is_large), key=lambda each: each.name.startswith("muscle."))
        said = [difference_text(each, theirs.name) for each in large]
        said = [*(said or [f"Nothing differs clearly from {theirs.name}."]), *_only(mine, theirs), *_only(theirs, mine)]
        table = columns("", mine.name, theirs.name, "ratio (95 %)", words=(0,))
        for each in found:
            table.add_row(
                _what(each),
                amount(each.mine, each.unit),
                amount(each.theirs, each.unit),
                _ratio(each),
            )
        shown += [*lines("AGAINST", [theirs.name, *said], "bold"), spaced(table), ""]
    return shown


def difference_text(each: Difference, name: str) -> str:
    """A difference in a sentence: 'bladder_neo_hookean.G is 1.9 times that of dmsp10 (1.8 to 2.1).'"""
    what = _what(each)
    if each.ratio is None:
        return f"{what} is {_mine(each)}, that of {name} is {_theirs(each)}."
    between = each.range
    sure = "" if between is None else f" ({_between(between)})"
    return f"{what} is {showing.figures(each.ratio)} times that of {name}{sure}."


def _what(each: Difference) -> str:
    return WORDS.get(each.name) or mark(each.name)


def _only(one: Identified, other: Identified) -> list[str]:
    """Effects that one of two has, in a sentence if there are any."""
    names = [name for name in one.effects if name not in other.effects]
    return [f"Only {one.name} has {marked(names)}."] if names else []


def _ratio(each: Difference) -> str:
    if each.ratio is None:
        return ""
    ratio = showing.figures(each.ratio)
    return ratio if each.range is None else f"{ratio} ({_between(each.range)})"


def _between(ends: tuple[float, float]) -> str:
    return " to ".join(map(showing.figures, ends))


def _mine(each: Difference) -> str:
    return _value(Known(each.mine, each.unit, "", each.my_error))


def _theirs(each: Difference) -> str:
    return _value(Known(each.theirs, each.unit, "", each.their_error))


def _value(known: Known) -> str:
    if known.error is None:
        return amount(known.value, known.unit)
    value, error = with_error(known.value, known.error, known.unit)
    return f"{value} +/- {error}"


def _range(known: Known) -> str:
    if known.q05 is None or known.q95 is None:
        return ""
    return f"{amount(known.q05, known.unit)} to {amount(known.q95, known.unit)}"


def _newtons(size: float) -> str:
    return showing.show(size, "N", digits=3)


def shelf_result(found: Sequence[Shelved]) -> dict[str, Any]:
    """For machines: every muscle in full, SI."""
    return {
        "muscles": [each.muscle.as_dict() | {"folder": str(each.folder), "shipped": each.is_shipped} for each in found]
    }


def differences_result(mine: Identified, others: Sequence[Identified]) -> dict[str, Any]:
    """For machines: every number that both have, and the ratio mine/theirs with its range."""
    against = {theirs.name: [_told(each) for each in differences(mine, theirs)] for theirs in others}
    return {"muscle": mine.name, "against": against}


def _told(each: Difference) -> dict[str, Any]:
    clear = each.is_large and each.error is not None
    return asdict(each) | {"ratio": each.ratio, "range_95": each.range, "clear": clear}
