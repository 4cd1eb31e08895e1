"""Warnings and notes of a posterior: a model, a noise or a prior that is wrong, however good the chains are."""

from collections.abc import Sequence

from fitting import showing
from fitting.instruments.sources import Source
from fitting.least_squares.record import Fit
from fitting.posterior.instruments import visible
from fitting.posterior.record import Missing, Quantity
from fitting.posterior.settings import LIMITS
from fitting.posterior.target import PosteriorProblem
from fitting.recordings.accuracy import Channel

INSTRUMENTS = {
    Channel.PRESSURE: "the pressure gauge", Channel.POSITION: "the position reading", Channel.FORCE: "the load cell",
    Channel.TIME: "the clock", None: "friction from run to run",
}  # fmt: skip


def find_warnings(
    fit: Fit,
    found: dict[str, Quantity],
    setup: PosteriorProblem,
    missing: Missing | None,
    asked: tuple[Source | None, float] = (None, 0.0),
) -> tuple[str, ...]:
    """Reasons not to trust the quantiles although the chains may be perfect.

    `asked` is the error of an instrument that these values ask most of, in its accuracies.
    """
    messages = [] if fit.converged else ["the fit that the walkers start from did not converge"]
    if missing is not None and missing.rejected:
        messages.append(
            f"something is missing from the model (p = {missing.p_value:.2g}, {missing.rests_on}): the sampler does "
            "not know of it, and these intervals are not calibrated; mckibben diagnose says what it may be"
        )
    for label, one, stated in zip(setup.labels, setup.noise, setup.stated, strict=True):
        if one.values[0] > (LIMITS.stated_excess if stated else LIMITS.misfit_excess):
            messages.append(
                f"the misfit in {label} is {one.values[0]:.1f} times the {'stated ' if stated else ''}noise of a "
                "reading: the model misses more than noise, and these intervals are not calibrated"
            )
    messages += _asked_too_much(*asked)
    messages += conflicts_with_priors(found, setup)
    wide = {name: found[name].robust_error / found[name].sd for name in fit.free if found[name].sd > 0}
    wide = {name: times for name, times in wide.items() if times > LIMITS.robust_excess}
    if wide:
        each = ", ".join(f"{name} {times:.1f}" for name, times in wide.items())
        messages.append(
            f"the intervals would be wider, were the readings of a loop taken to err together: {each} times as wide"
        )
    return tuple(messages)


def _asked_too_much(source: Source | None, times: float) -> list[str]:
    """That these values need an error of an instrument that is so many times what it may be, if it is too many."""
    if source is None or times <= LIMITS.asked:
        return []
    need = "friction to differ from run to run" if source.channel is None else f"{INSTRUMENTS[source.channel]} to err"
    return [
        f"these values need {need} by {times:.0f} times what is allowed: the model is wrong somewhere, and these "
        "intervals are not calibrated"
    ]


def conflicts_with_priors(found: dict[str, Quantity], setup: PosteriorProblem) -> list[str]:
    """Conflicts between data and prior: the prior is wrong, or the model is. Empty unless the chains roughly agree."""
    if not all(q.rhat < LIMITS.roughly for q in found.values()):
        return []
    away = {name: prior.away(found[name].median) for name, prior in setup.priors.items()}
    far = [f"{name} {away[name]:.1f} ({found[name].prior})" for name in away if away[name] > LIMITS.conflict]
    messages = []
    if far:
        messages.append(
            f"the data move these so many standard deviations away from their priors: {', '.join(far)}; prior or model "
            "is wrong, and these intervals are not calibrated"
        )
    for label, one in zip(setup.labels, setup.noise, strict=True):
        size = found[f"noise.size@{label}"]
        if size.q05 > LIMITS.kept_away * one.values[0]:
            messages.append(
                f"the priors keep the model away from what fits {label} best: its misfit is "
                f"{size.median / one.values[0]:.1f} times as large, and these intervals are not calibrated"
            )
    return messages


def notes(
    fit: Fit, setup: PosteriorProblem, cut: tuple[str, ...], missing: Missing | None, loops: int
) -> tuple[str, ...]:
    """What a reader should know and is no warning; `loops` are the clusters that the robust error rests on."""
    messages = _noise_notes(setup)
    if setup.target.instruments is not None:
        messages.append(f"errors within the accuracy of {_instruments(setup)} are allowed for in the intervals")
    if missing is None:
        messages.append("no force was measured: whether anything is missing from the model was not tested here")
    if len(setup.samples) < len(fit.samples):
        messages.append(
            f"thinned from {len(fit.samples)} to {len(setup.samples)} readings: where errors are independent this "
            "widens the intervals"
        )
    if setup.integration:
        messages.append(setup.integration)
    if loops < LIMITS.few_loops:
        messages.append(f"{loops} loops only: the robust error says little")
    if cut:
        messages.append(f"an end of the range cuts off: {', '.join(cut)}")
    if setup.idle:
        messages.append(f"a prior is stated of what does not vary (--free lets it): {', '.join(setup.idle)}")
    if fit.held:
        messages.append(f"these data cannot see, and nothing was sampled of: {', '.join(fit.held)}")
    return tuple(messages)


def _noise_notes(setup: PosteriorProblem) -> list[str]:
    """What noise each recording has; those that are alike are said together."""
    alike: dict[str, list[str]] = {}
    for label, one in zip(setup.labels, setup.noise, strict=True):
        alike.setdefault(one.text, []).append(label)
    every = [text for text, labels in alike.items() if len(labels) == len(setup.labels) > 1]
    if every:
        return [f"noise of every recording: {every[0]}"]
    return [f"noise of {_in_a_row(labels)}: {text}" for text, labels in alike.items()]


def _in_a_row(words: Sequence[str]) -> str:
    return " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)


def bent_notes(fit: Fit, found: dict[str, Quantity]) -> list[str]:
    """A note of parameters that are elsewhere once instruments may err: the fit bent them to what instruments made."""
    far = [
        f"{name} {showing.show(found[name].median, (unit := fit.layout.entry(name).unit))} "
        f"(fit {showing.show(fit.values[name], unit)})"
        for name in fit.free
        if abs(found[name].median - fit.values[name]) > LIMITS.bent * max(found[name].sd, fit.error(name, robust=False))
        and abs(found[name].median - fit.values[name]) > fit.error(name)
    ]
    if not far:
        return []
    return [
        "the fit trusts every reading, and bends to what instruments may have made; with their errors allowed for, "
        f"these values are elsewhere: {', '.join(far)}"
    ]


def _instruments(setup: PosteriorProblem) -> str:
    """The instruments whose errors are felt, in words."""
    channels = {source.channel for source in visible(setup.errors).sources}
    names = [words for channel, words in INSTRUMENTS.items() if channel in channels]
    return _in_a_row(names)
