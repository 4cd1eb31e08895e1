"""Sizes that muscle.toml states with an error beside what the fit made of them, and what the fit's errors rest on."""

from collections.abc import Iterable, Mapping, Sequence

from fitting import full_names, showing
from fitting.instruments.sources import ErrorKind, Source
from fitting.least_squares.record import Fit
from fitting.least_squares.rests_on import rests_on, rests_on_instruments, shown_by_runs
from fitting.problem.unknowns import BELIEVED
from fitting.recordings.accuracy import Channel
from fitting.report.settings import SHOWN, STATED, WARNING_TEXT
from fitting.report.text.amounts import amount, percent
from fitting.report.text.instrument_answers import error_text, known_to_text, size_text
from fitting.report.text.names import mark, marked


def measured_cells(fit: Fit, name: str) -> tuple[str, str]:
    """What was measured, with its error, and how many of these errors the value is away; empty if not stated."""
    entry = fit.layout.entry(name)
    if entry.prior is None:
        return "", ""
    mean, error = entry.prior
    return showing.show(mean, entry.unit, error), f"{_apart(fit, name):.1f} errors"


def denied_texts(fit: Fit) -> list[str]:
    """A warning of the stated sizes that the fit denies, the farthest first, and one of all that it is kept from."""
    return [*_denied_texts(fit), *_too_long_texts(fit), *_kept_texts(fit)]


def stated_and_free(fit: Fit) -> tuple[str, ...]:
    """The stated sizes that vary in a fit."""
    return tuple(name for name in fit.free if fit.layout.entry(name).prior is not None)


def denied(fit: Fit) -> list[str]:
    """The stated sizes that a fit denies, the farthest first."""
    far = (name for name in stated_and_free(fit) if _apart(fit, name) > WARNING_TEXT.apart)
    return sorted(far, key=lambda name: -_apart(fit, name))


def absurd_texts(fit: Fit) -> list[str]:
    """That a fit, however small its error, is of another muscle than was measured; nothing where it is not."""
    far = denied(fit)[:1]
    if not far or _apart(fit, far[0]) < WARNING_TEXT.absurd:
        return []
    off = showing.figures(_apart(fit, far[0]))
    return [f"But its muscle is not the one that was measured: {mark(far[0])} lies {off} standard errors off."]


def _denied_texts(fit: Fit) -> list[str]:
    far = denied(fit)
    sizes = [
        f"{mark(name)} = {amount(fit.values[name], fit.layout.entry(name).unit)} "
        f"({measured_cells(fit, name)[0]} was measured, {showing.figures(_apart(fit, name))} errors apart)"
        for name in far[: SHOWN.denied]
    ]
    more = f", and {len(far) - len(sizes)} more sizes that were measured" * (len(far) > len(sizes))
    cure = f"(--fix {' '.join(dict.fromkeys(map(full_names.common, far)))} would hold them)"
    wrong = f"A model that needs this is wrong somewhere {cure}."
    return [f"The fit asks for {', '.join(sizes)}{more}. {wrong}"] if far else []


def _too_long_texts(fit: Fit) -> list[str]:
    """What is wrong with the lengths, where every muscle of several is shorter for the fit than it was measured."""
    lengths = [name for name in stated_and_free(fit) if full_names.common(name) == "muscle.length"]
    if len(lengths) < 2 or not set(lengths) <= set(denied(fit)):
        return []
    short = [fit.layout.entry(name).start - fit.values[name] for name in lengths]
    if min(short) < 0:
        return []
    least, most = amount(min(short), "m", 2), amount(max(short), "m", 2)
    return [
        f"Every muscle would be shorter than it was measured, by {least} to {most}, or by more: the stated errors "
        "hold the fit back. Perhaps part of what was measured does not contract, as what lies in the fittings: state "
        "the length of the braid between their inner edges."
    ]


def kept_from(fit: Fit) -> tuple[str, ...]:
    """The stated sizes at the end of what was stated: left free, the model would deny them."""
    stated = [entry.name for entry in fit.layout.entries if entry.prior is not None]
    kept = [name for name in stated if name not in fit.free or name in fit.at_bound]
    return tuple(name for name in kept if abs(_apart(fit, name) - BELIEVED) < STATED.at_end)


def _kept_texts(fit: Fit) -> list[str]:
    sizes = [
        f"{mark(name)} = {amount(fit.values[name], fit.layout.entry(name).unit)} ({measured_cells(fit, name)[0]} was "
        "measured)"
        for name in kept_from(fit)
    ]
    if not sizes:
        return []
    return [
        f"As far from what was measured as a fit may take it, {BELIEVED:.0f} standard errors: {', '.join(sizes)}. Left "
        "free, this model would deny what was measured. The model is wrong somewhere, or the measurement is: repeat it."
    ]


def kept_texts(kept: Sequence[str]) -> list[str]:
    """That stated sizes do not vary, for the model file holds them, and how they are let go."""
    if not kept:
        return []
    names = tuple(dict.fromkeys(map(full_names.common, kept)))
    return [f"The model file holds {marked(names)} fixed (--free {' '.join(names)} lets what is named vary)."]


def confined_texts(held: Sequence[str]) -> list[str]:
    """That stated sizes are confined, for the model file holds these, and how they are let go."""
    if not held:
        return []
    names = tuple(dict.fromkeys(map(full_names.common, held)))
    return [
        f"No size of the muscle may lie further than {BELIEVED:.0f} standard errors from what was measured, for the "
        f"model file holds {marked(names)} fixed (--free {' '.join(names)} lets all sizes go)."
    ]


Parts = list[tuple[float, str]]  # shares of an uncertainty, and what each comes from, the largest first


def rests_on_texts(fit: Fit) -> list[str]:
    """A sentence for the parameters that are mostly as uncertain as the same sizes and instruments, the most first."""
    own = {entry.name for entry in fit.layout.entries if entry.prior is not None}
    instruments = rests_on_instruments(fit)
    found: dict[frozenset[str], dict[str, Parts]] = {}
    for name, sizes in rests_on(fit).items():
        parts = [(share, mark(size)) for size, share in sizes.items() if name not in own]
        parts += [(share, known_to_text(source)) for source, share in by_kind(instruments[name])]
        parts = sorted((part for part in parts if part[0] > STATED.part), reverse=True)
        if _whole(parts) > STATED.most:
            found.setdefault(frozenset(text for _, text in parts[: STATED.named]), {})[name] = parts
    most_first = sorted(found.values(), key=lambda alike: -max(map(_whole, alike.values())))
    said = [rests_on_text(alike) for alike in most_first]
    cure = "To know these values better, measure better what is named; more recordings of the same kind hardly help."
    return [*said, cure] if said else []


def runs_agree_texts(fit: Fit) -> list[str]:
    """A sentence for each error that was presumed of runs and that these runs do not show."""
    names, several = fit.layout.datasets, len(fit.layout.templates) > 1
    return [
        f"Presumed, for nobody stated it: {error_text(source, source.allowed)}. The runs"
        f"{f' of data set {names[number]}' if several else ''} show at most {size_text(source, size)}, and the robust "
        "errors of the parameters use this."
        for (source, number), size in shown_by_runs(fit).items()
        if size < STATED.agree * source.allowed
    ]


def by_kind(shares: Mapping[Source, float]) -> list[tuple[Source, float]]:
    """One source of each channel and kind, the widest, with the share of them all: a drift may have several sizes."""
    found: dict[tuple[Channel | None, ErrorKind], tuple[Source, float]] = {}
    for source, share in shares.items():
        kind = source.channel, source.kind
        widest, so_far = found.get(kind, (source, 0.0))
        found[kind] = max(widest, source, key=lambda each: each.allowed), min(so_far + share, 1.0)
    return list(found.values())


def rests_on_text(alike: Mapping[str, Parts]) -> str:
    """The sentence on parameters whose uncertainty comes from the same causes: those named are the largest of each."""
    causes = list(dict.fromkeys(text for parts in alike.values() for _, text in parts[: STATED.named]))
    named = [f"{text} ({_shares(alike.values(), text)} of it)" for text in causes]
    others = max(len(parts) for parts in alike.values()) - len(named)
    if others:
        named.append("one other" if others == 1 else f"{others} others")
    joined = " and ".join(filter(None, (", ".join(named[:-1]), named[-1])))
    return f"Most of the uncertainty of {marked(alike)} comes from {joined}."


def _shares(parts: Iterable[Parts], cause: str) -> str:
    shares = [share for each in parts for share, text in each if text == cause]
    least, most = percent(min(shares)), percent(max(shares))
    return most if least == most else f"{least} to {most}"


def _whole(parts: Parts) -> float:
    return sum(share for share, _ in parts)


def _apart(fit: Fit, name: str) -> float:
    prior = fit.layout.entry(name).prior
    assert prior is not None  # the callers have looked
    return abs(fit.values[name] - prior[0]) / prior[1]
