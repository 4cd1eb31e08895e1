"""A design in words: what it is worth, which limits hold it and what they cost, how sure it is."""

import dataclasses
import math
from collections.abc import Sequence
from typing import Any

from fitting import showing
from fitting.designs.answer import Answer
from fitting.report.settings import ADVICE
from fitting.report.text.amounts import percent
from mckibben_jax.design.best import Design, Met, to_json
from mckibben_jax.design.merit import CONDITIONS
from mckibben_jax.design.pareto import Second
from mckibben_jax.design.scatter import Odds

# one more of what, as engineers say it: how much of the SI unit, by unit
ONE_MORE = {"Pa": ("bar", 1e5), "m": ("mm", 1e-3), "rad": ("degree", 0.017453292519943295), "N": ("newton", 1.0),
            "1": ("percentage point", 0.01), "J": ("joule", 1.0), "s": ("ms", 1e-3), "N/m": ("N/mm", 1e3),
            "m^3": ("millilitre", 1e-6), "kg": ("gram", 1e-3)}  # fmt: skip
COUNTS = {"fatigue_cycles": ("thousand cycles", 1e3)}


def answer_text(found: Answer) -> str:
    """For people: all that a design file asked for."""
    return "\n".join([_answer(found), *(f"note: {note}" for note in found.order.notes)])


def _answer(found: Answer) -> str:
    if found.order.second is not None:
        return _trade_off_text(found)
    if found.said:
        return f"{describe(found.first)}\n{models_text(found)}"
    if found.odds is None:
        return describe(found.first)
    chance = found.order.chance
    told = [describe(found.first), odds_text(found.first, found.odds, chance is not None)]
    if chance is not None:
        share = f"{100 * chance:g} % of the muscles made"
        told.insert(0, f"values of limits are those that {share} keep, if normally spread; the objective is the mean")
    return "\n".join(told)


def _trade_off_text(found: Answer) -> str:
    order, first = found.order, found.first
    assert order.second is not None
    if len(found.designs) > 1:
        return front_text(found.designs, order.second)
    if first.outcome == "infeasible":
        return describe(first)
    return (
        f"no trade-off: one design is best in {order.task.objective} and in {order.second.quantity}\n{describe(first)}"
    )


def answer_result(found: Answer) -> dict[str, Any]:
    """For machines: the design, and the trade-off or the odds that go with it."""
    result = to_json(found.first) | {"notes": list(found.order.notes)}
    if found.order.second is not None:
        return result | {"front": [to_json(one) for one in found.designs]}
    if found.said:
        return result | {"models": _models_result(found)}
    if found.odds is None:
        return result
    return result | {
        "uncertainty": dataclasses.asdict(found.odds) | {"chance": found.order.chance, "unit": found.first.unit}
    }


def describe(found: Design) -> str:
    """For people: the design, what it is worth, which limits hold it and what they cost."""
    lines = [_verdict(found), f"{quantity_text(found.objective, found.at)}: {showing.show(found.value, found.unit)}"]
    lines += [f"  {m.quantity:22} {showing.show(m.value, m.unit):>14}   {_limits(m)}{_price(m, found)}"
              for m in (*found.variables, *found.constraints)]  # fmt: skip
    lines += prices(found)
    lines += sensitivities(found)
    return "\n".join([*lines, found.starts])


def _verdict(found: Design) -> str:
    if found.outcome == "infeasible":
        fighting = _listed(found.fighting)
        return f"no design meets {fighting} together; the nearest one misses a limit by {percent(found.miss)} of it"
    if found.outcome == "optimal":
        return "optimal: no small change within the constraints is better"
    return f"not converged: {percent(found.stationarity)} of the objective's slope is left, within the constraints"


def _listed(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}" if names else "the constraints"


def quantity_text(quantity: str, at: dict[str, float]) -> str:
    told = ", ".join(f"{name} {showing.show(value, CONDITIONS[name])}" for name, value in at.items())
    return f"{quantity} at {told}" if told else quantity


def _limits(m: Met) -> str:
    ends = [f"{word} {showing.show(end, m.unit)}" for word, end in (("min", m.min), ("max", m.max)) if end is not None]
    return ", ".join(ends)


def _price(m: Met, found: Design) -> str:
    if not m.active:
        return ""
    if (m.min is not None and m.value < m.min * (1 - 1e-5)) or (m.max is not None and m.value > m.max * (1 + 1e-5)):
        return "   missed"
    worth = f"; 1 % of it is worth {showing.figures(m.relative)} % of the {found.objective}" if m.multiplier else ""
    return f"   at its limit{worth}"


def prices(found: Design) -> list[str]:
    """What a little more or less of each active limit costs or brings, in the units that people speak in."""
    return [_sentence(m, found, asked=True) for m in found.constraints if _matters(m, found)] + [
        _sentence(m, found, asked=False) for m in found.variables if _matters(m, found)
    ]


def _matters(m: Met, found: Design) -> bool:
    return m.active and abs(m.relative) > ADVICE.little


def _sentence(m: Met, found: Design, asked: bool) -> str:
    """Of a constraint what more of it costs; of a range what leaving it would bring."""
    lower = m.min is not None and (m.max is None or abs(m.value - m.min) < abs(m.value - m.max))
    name, size = COUNTS.get(m.quantity, ONE_MORE.get(m.unit, (m.unit, 1.0)))
    count = _how_many(abs(m.value) / size)
    worth = showing.show(m.multiplier * size * count, found.unit, digits=3)
    more = "more" if lower == asked else "less"
    does = "costs" if asked else "would bring"
    return f"{'one' if count == 1 else f'{count:g}'} {name} {more} of {m.quantity} {does} {worth} of {found.objective}"


def _how_many(units_in_limit: float) -> float:
    """One of a unit, or as small a part (0.1, 0.01, ...) as is a small part of the limit: a price holds for no more."""
    return 1.0 if units_in_limit <= 0 else 10.0 ** min(0, math.floor(math.log10(units_in_limit / ADVICE.few)))


def sensitivities(found: Design) -> list[str]:
    """A table: by how many per cent each quantity grows for one per cent more of each variable."""
    names = list(next(iter(found.sensitivity.values()), {}))
    if not names:
        return []
    widths = [max(len(name), 6) for name in names]
    heads = "  ".join(f"{name:>{width}}" for name, width in zip(names, widths, strict=True))
    lines = ["1 % more of ... changes, in %:", f"  {'':18}{heads}"]
    for variable, row in found.sensitivity.items():
        cells = "  ".join(f"{row[name]:>+{width}.2f}" for name, width in zip(names, widths, strict=True))
        lines.append(f"  {variable:18}{cells}")
    return lines


def odds_text(found: Design, fate: Odds, asked: bool = False) -> str:
    """How the design fares among the muscles that come of it. `asked` where a chance was asked for already."""
    mean, low, high = (showing.show(x, found.unit) for x in (fate.mean, fate.q05, fate.q95))
    lines = [f"as made: {found.objective} {mean} on average, {low} to {high} in nine of ten ({fate.draws} draws)"]
    lines += [f"  {100 * share:5.1f} % keep {m.quantity} ({_limits(m)})"
              for m, share in zip(found.constraints, fate.holds, strict=True)]  # fmt: skip
    if len(fate.holds) > 1:
        lines.append(f"  {100 * fate.all_hold:5.1f} % keep all of them")
    if fate.holds and fate.all_hold < 0.9 and not asked:
        lines.append('  for more, ask for it: [uncertainty] with chance = "95 %"')
    return "\n".join(lines)


def models_text(found: Answer) -> str:
    """What each of several models says of the design, as a table: the objective, then every constrained quantity."""
    design = found.first
    heads = [design.objective, *(m.quantity for m in design.constraints)]
    units = [design.unit, *(m.unit for m in design.constraints)]
    rows = [["", *heads], ["", "mean", *(_limits(m) for m in design.constraints)]]
    for name, says in zip(found.order.models, found.said, strict=True):
        values = zip((says.value, *says.constrained), units, strict=True)
        rows.append([name, *(showing.show(value, unit) for value, unit in values)])
    hold = "hold" if design.outcome != "infeasible" else "do not hold"
    intro = (
        f"the limits {hold} in all models; what each of them says of the design (above: the plain mean of the "
        "objective, and each limit as in the model that comes nearest to it):"
    )
    return "\n".join([intro, *_columns(rows)])


def _models_result(found: Answer) -> list[dict[str, Any]]:
    names = [m.quantity for m in found.first.constraints]
    return [
        {"model": name, "objective": says.value,
         "constraints": [{"quantity": q, "value": value} for q, value in zip(names, says.constrained, strict=True)]}
        for name, says in zip(found.order.models, found.said, strict=True)
    ]  # fmt: skip


def _columns(rows: Sequence[Sequence[str]]) -> list[str]:
    """Rows as lines, the first cell at the left of its column, the others at the right."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = [[f"{row[0]:<{widths[0]}}", *map(str.rjust, row[1:], widths[1:])] for row in rows]
    return ["  ".join(line).rstrip() for line in lines]


def front_text(found: Sequence[Design], second: Second) -> str:
    """A trade-off as a table, from the best of the objective to the best of the second quantity."""
    lines = [f"{found[0].objective} against {quantity_text(second.quantity, second.at)}: {len(found)} designs"]
    names = [m.quantity for m in found[0].variables]
    rows = [["", found[0].objective, second.quantity, *names, ""]]
    for number, one in enumerate(found, 1):
        values = [showing.show(one.value, one.unit), showing.show(one.constraints[-1].value, one.constraints[-1].unit)]
        values += [showing.show(m.value, m.unit) for m in one.variables]
        rows.append([str(number), *values, "" if one.outcome == "optimal" else one.outcome])
    return "\n".join([*lines, *_columns(rows)])
