"""What speaks against a posterior although its chains may be perfect, and what else there is to know of it."""

from fitting.least_squares.record import Fit
from fitting.posterior.record import Missing, Quantity
from fitting.posterior.target import Posed

ROBUST_EXCESS = 1.5  # times the posterior's standard deviation: the model leaves errors that loops share
MISFIT_EXCESS = 2.0  # times the noise of a reading: something is missing from the model
STATED_EXCESS = 1.5  # the same where the noise is stated, not read from data whose errors may be alike
CONFLICT = 3.5  # standard deviations of its prior that the data move a parameter: one of both is wrong
KEPT_AWAY = 1.5  # times the misfit of the fit, which knows no stated priors
ROUGHLY = 1.1  # R-hat above which chains have not arrived, and what they say of priors means nothing
FEW_LOOPS = 8  # fewer say little about what loops share


def doubts(fit: Fit, found: dict[str, Quantity], what: Posed, missing: Missing | None) -> tuple[str, ...]:
    """What speaks against the quantiles although the chains may be perfect."""
    told = [] if fit.converged else ["the fit that the walkers start from did not converge"]
    if missing is not None and missing.rejected:
        told.append(
            f"something is missing from the model (p = {missing.p_value:.2g}, {missing.rests_on}): the sampler does "
            "not know of it, and these intervals are not calibrated; mckibben diagnose says what it may be"
        )
    for label, one, stated in zip(what.labels, what.noise, what.stated, strict=True):
        if one.values[0] > (STATED_EXCESS if stated else MISFIT_EXCESS):
            told.append(
                f"the misfit in {label} is {one.values[0]:.1f} times the {'stated ' if stated else ''}noise of a "
                "reading: the model misses more than noise, and these intervals are not calibrated"
            )
    told += against_priors(found, what)
    wide = {name: found[name].robust_error / found[name].sd for name in fit.free if found[name].sd > 0}
    wide = {name: times for name, times in wide.items() if times > ROBUST_EXCESS}
    if wide:
        each = ", ".join(f"{name} {times:.1f}" for name, times in wide.items())
        told.append(f"errors that loops share would make the intervals wider than they are: {each} times as wide")
    return tuple(told)


def against_priors(found: dict[str, Quantity], what: Posed) -> list[str]:
    """Where data and prior speak against each other: the one is wrong, or the model is. Chains must roughly agree."""
    if not all(q.rhat < ROUGHLY for q in found.values()):
        return []
    away = {name: prior.away(found[name].median) for name, prior in what.priors.items()}
    far = [f"{name} {away[name]:.1f} ({found[name].prior})" for name in away if away[name] > CONFLICT]
    told = []
    if far:
        told.append(
            f"the data move these so many standard deviations away from their priors: {', '.join(far)}; prior or model "
            "is wrong, and these intervals are not calibrated"
        )
    for label, one in zip(what.labels, what.noise, strict=True):
        size = found[f"noise.size@{label}"]
        if size.q05 > KEPT_AWAY * one.values[0]:
            told.append(
                f"the priors keep the model away from what fits {label} best: its misfit is "
                f"{size.median / one.values[0]:.1f} times as large, and these intervals are not calibrated"
            )
    return told


def notes(fit: Fit, what: Posed, cut: tuple[str, ...], missing: Missing | None, loops: int) -> tuple[str, ...]:
    """What to know, without doubt in it; `loops` are those that the robust error goes by."""
    told = [one.told(label) for label, one in zip(what.labels, what.noise, strict=True)]
    if missing is None:
        told.append("no force was measured: whether anything is missing from the model was not tested here")
    if len(what.samples) < len(fit.samples):
        told.append(
            f"thinned from {len(fit.samples)} to {len(what.samples)} readings: where errors are independent this "
            "widens the intervals"
        )
    if what.integration:
        told.append(what.integration)
    if loops < FEW_LOOPS:
        told.append(f"{loops} loops only: the robust error says little")
    if cut:
        told.append(f"an end of the range cuts off: {', '.join(cut)}")
    if what.idle:
        told.append(f"a prior is stated of what does not vary (--free lets it): {', '.join(what.idle)}")
    if fit.held:
        told.append(f"these data cannot see, and nothing was sampled of: {', '.join(fit.held)}")
    return tuple(told)
