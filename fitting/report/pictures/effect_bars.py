"""What the error would be with each effect added, as bars in HTML: they stay readable on a narrow screen."""

from collections.abc import Callable, Mapping, Sequence

from fitting import showing
from fitting.diagnosis.record import Diagnosis, Evidence
from fitting.report.text.amounts import amount
from fitting.report.text.diagnosis import effect_set
from fitting.report.text.evidence import named_sets, sort_evidence

MOST_HELPING, MOST_IDLE = 8, 2
NONE: Mapping[frozenset[str], str] = {}


def effect_bars(
    d: Diagnosis, floor: float, unit: str, named: Callable[[str], str], models: Mapping[frozenset[str], str] = NONE
) -> str:
    """The model as it is, then the effects that help, best first, then the first of those that do not.

    `named` makes HTML of the names of effects. `models` holds the radio button of each set of added effects that is a
    model on the switch of the page: its row chooses it, and stands out while it is chosen.
    """
    helping, idle, _ = sort_evidence(d)
    shown = [*helping[:MOST_HELPING], *idle[:MOST_IDLE]]
    several = named_sets(d)[:MOST_HELPING]
    lacking = d.p_value < d.level  # what instruments can make then proves nothing, however much of the error it is
    size_of = lambda e: (e.unexplained if lacking else e.held_out_rmse) or 0.0  # noqa: E731
    floor = 0.0 if lacking else floor
    bars = [((), size_of(d), "now"), *((e.effects, size_of(e), "near") for e in several)]
    bars += [((e.name,), size_of(e), _kind(e, helping)) for e in shown]
    top = 1.25 * max([floor, *(value for _, value, _ in bars)]) or 1.0
    rows = [
        _row(named(_called(added)), value, kind, floor, top, unit, models.get(frozenset(added), ""))
        for added, value, kind in bars
    ]
    name, size = showing.shown_in(unit, floor)
    words = f"RMS error on held-out runs; dashed: the noise, {showing.figures(floor / size)} {name}"
    words = "RMS of what neither noise nor instruments within their accuracy can make" if lacking else words
    words += "; green: explains the data" if several or any(e.adequate for e in shown) else ""
    return f'<fieldset class="fall"><legend>{words}</legend>{"".join(rows)}</fieldset>'


def _called(added: Sequence[str]) -> str:
    return f"+ {effect_set(added)}" if added else "model as it is"


def _kind(e: Evidence, helping: list[Evidence]) -> str:
    return "near" if e.adequate else "" if e in helping else "idle"


def _row(name: str, value: float, kind: str, floor: float, top: float, unit: str, button: str) -> str:
    """One bar behind its name, which is HTML; the label of a `button` if there is one."""
    width = 100 * value / top
    line = f'<span class="floor" style="left:{100 * floor / top:.2f}%"></span>' if floor else ""
    row = (
        f'<span class="name">{name}</span>'
        f'<span class="track"><span class="bar {kind}" style="width:{width:.2f}%"></span>'
        f"{line}"
        f'<span class="value" style="left:{width:.2f}%">{amount(value, unit, 2)}</span></span>'
    )
    return f'<label class="row {button}" for="{button}">{row}</label>' if button else f'<div class="row">{row}</div>'
