"""Explanations that these data cannot tell apart, special cases of each other, and the one that leads."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fitting.diagnosis.candidate_fit import CandidateFit
from fitting.diagnosis.examine import Examiner
from fitting.diagnosis.record import Leading
from fitting.diagnosis.settings import VERDICT, VerdictSettings
from fitting.diagnosis.stated_sizes import believable
from fitting.diagnosis.universe import Universe
from fitting.full_names import owner_of
from fitting.least_squares import held_out
from fitting.threads import at_once


def contains(
    world: Universe, larger: CandidateFit, smaller: CandidateFit, noise: float, settings: VerdictSettings = VERDICT
) -> bool:
    """Whether one fitted set can predict all that another predicts."""
    followed = world.mimicking(smaller).fit(larger.effects, larger.vector, decide=False)
    return held_out.rms(followed.rows) < settings.followed * noise


def simplest(
    world: Universe,
    adequate: Sequence[frozenset[str]],
    fits: Mapping[frozenset[str], CandidateFit],
    noise: float,
    settings: VerdictSettings = VERDICT,
) -> tuple[list[frozenset[str]], tuple[tuple[tuple[str, ...], ...], ...], dict[frozenset[str], frozenset[str]]]:
    """Adequate sets without those that contain a simpler one, the classes of exact equals, and what contains what."""
    order = sorted(adequate, key=lambda added: (len(fits[added].free), fits[added].cost))
    kept: list[frozenset[str]] = []
    classes: dict[frozenset[str], list[frozenset[str]]] = {}
    wider: dict[frozenset[str], frozenset[str]] = {}
    for added in order:
        host = next((k for k in kept if contains(world, fits[added], fits[k], noise, settings)), None)
        if host is None:
            kept.append(added)
            classes[added] = [added]
        elif len(fits[added].free) == len(fits[host].free):
            classes[host].append(added)
        else:
            wider[added] = host
    equal = [members for members in classes.values() if len(members) > 1]
    named = sorted((member for members in classes.values() for member in members), key=order.index)
    return named, tuple(tuple(tuple(sorted(member)) for member in members) for members in equal), wider


def plausible(world: Universe, added: frozenset[str], fit: CandidateFit) -> bool:
    """Whether a fitted set denies no stated measurement and none of what was added ends at its bound."""
    ends = {owner_of(name) for name in fit.at_bound}
    return not (ends & added or world.contradicted(fit))


def best_predicting(
    adequate: Sequence[frozenset[str]],
    fits: Mapping[frozenset[str], CandidateFit],
    examiner: Examiner,
    settings: VerdictSettings = VERDICT,
) -> list[frozenset[str]]:
    """Adequate sets without those that predict runs left out clearly worse than the best of them."""
    rows = {added: examiner.beyond_instruments(fits[added]) for added in adequate}
    best = min(rows.values(), key=held_out.rms, default=None)
    return [added for added in adequate if best is None or not _worse(rows[added], best, examiner.groups, settings)]


def _worse(rows: np.ndarray, best: np.ndarray, groups: np.ndarray, settings: VerdictSettings) -> bool:
    """Whether rows are clearly larger than the best, and by more than one number too many would make them."""
    material = held_out.rms(rows) ** 2 > (1 + settings.worse_share) * held_out.rms(best) ** 2
    return material and _clearly(rows, best, groups, settings.worse)


def unrivalled(
    adequate: Sequence[frozenset[str]],
    fits: Mapping[frozenset[str], CandidateFit],
    examiner: Examiner,
    settings: VerdictSettings = VERDICT,
) -> list[frozenset[str]]:
    """Adequate sets without those in whose residual another of them is seen; all, if each is seen in some other's."""
    kept = []
    for added in adequate:
        rivals = [(other, fits[other]) for other in adequate if other != added]
        if not rivals or examiner.against(fits[added], rivals) >= settings.rivalled_p:
            kept.append(added)
    return kept or list(adequate)


def leading_of(
    world: Universe,
    base: CandidateFit,
    fits: Mapping[frozenset[str], CandidateFit],
    examiner: Examiner,
    settings: VerdictSettings = VERDICT,
) -> Leading | None:
    """The single effect, or rivals of one family, that lowers the left-out error by clearly more than any other.

    What denies a stated size is judged by what it does in a muscle of believable sizes.
    """
    best = _best_singles(world, base, fits, examiner, settings)
    if best is None:
        return None
    fewest = min(len(best.fits[added].free) for added in best.equals)
    named = [added for added in best.equals if len(best.fits[added].free) == fewest]
    if not _of_one_kind(world, best.equals, named[0], best.fits, settings):
        return None
    others = [added for added in best.order if added not in best.equals]
    whole, left = world.rmse(examiner.left_out(base)), best.shown(named[0])
    if not left**2 <= (1 - settings.leads) * whole**2:  # better only beyond what instruments explain, or hardly
        return None
    return Leading(
        tuple(min(added) for added in named),
        float(1 - (left / whole) ** 2),
        left,
        best.shown(others[0]) if others else whole,
    )


def plainly_there(
    world: Universe,
    base: CandidateFit,
    fits: Mapping[frozenset[str], CandidateFit],
    examiner: Examiner,
    share: float,
    settings: VerdictSettings = VERDICT,
) -> list[frozenset[str]]:
    """The single effects that lower the squared left-out error by so large a share, if none does by clearly more.

    Whatever their kinds: which of them is there is not known, but it is that or more than one.
    """
    best = _best_singles(world, base, fits, examiner, settings)
    most = (1 - share) * world.rmse(examiner.left_out(base)) ** 2
    return [] if best is None else [added for added in best.equals if best.shown(added) ** 2 <= most]


@dataclass(frozen=True, eq=False)
class _BestSingles:
    """Single effects by their left-out error, the least first; `equals` are those that none is clearly before.

    `fits` are those in a muscle of believable sizes; `shown` gives the left-out error of one that people read, N.
    """

    order: list[frozenset[str]]
    equals: list[frozenset[str]]
    fits: Mapping[frozenset[str], CandidateFit]
    shown: Callable[[frozenset[str]], float]


def _best_singles(
    world: Universe,
    base: CandidateFit,
    fits: Mapping[frozenset[str], CandidateFit],
    examiner: Examiner,
    settings: VerdictSettings,
) -> _BestSingles | None:
    """The single effects that lower the left-out error clearly; None where the best of all effects does not."""
    clearly = lambda worse, better: _clearly(worse, better, examiner.groups, settings.clearly)  # noqa: E731
    before = examiner.beyond_instruments(base)
    helps = lambda fit: clearly(before, examiner.beyond_instruments(fit))  # noqa: E731
    fits = _in_a_believable_muscle(world, fits, helps)
    singles = [added for added in fits if plausible(world, added, fits[added])] or list(fits)
    rows = {added: examiner.beyond_instruments(fits[added]) for added in singles}
    order = sorted(singles, key=lambda added: held_out.rms(rows[added]))
    helping = [added for added in order if clearly(before, rows[added])]
    if not helping or helping[0] != order[0]:
        return None
    best = rows[order[0]]
    behind = lambda left: clearly(left, best) or _clearly_by_group(left, best, examiner.groups, settings.clearly)  # noqa: E731
    equals = [added for added in helping if not behind(rows[added])]
    shown = lambda added: world.rmse(examiner.left_out(examiner.as_fitted(added, fits[added])))  # noqa: E731
    return _BestSingles(order, equals, fits, shown)


def _in_a_believable_muscle(
    world: Universe, fits: Mapping[frozenset[str], CandidateFit], helps: Callable[[CandidateFit], bool]
) -> dict[frozenset[str], CandidateFit]:
    """Every single effect; those that help are fitted with the stated sizes confined, if they deny any."""
    singles = {added: fit for added, fit in fits.items() if len(added) == 1}
    believed = lambda fit: believable(world, fit) if helps(fit) else fit  # noqa: E731
    return dict(zip(singles, at_once(world.settings.workers, believed, singles.values()), strict=True))


def _of_one_kind(
    world: Universe,
    equals: Sequence[frozenset[str]],
    first: frozenset[str],
    fits: Mapping[frozenset[str], CandidateFit],
    settings: VerdictSettings,
) -> bool:
    """Whether equals are rivals of one family, or hold the first of them as a special case."""
    family = world.effects[min(first)].family
    others = [added for added in equals if added != first]
    return all(
        (family is not None and world.effects[min(other)].family == family)
        or contains(world, fits[other], fits[first], held_out.rms(fits[first].rows), settings)
        for other in others
    )


def _clearly_by_group(worse: np.ndarray, better: np.ndarray, groups: np.ndarray, errors: float) -> bool:
    """The same in the logarithm, where a group that errs most does not outweigh all others; only if the sum agrees."""
    fall, error = held_out.log_difference(worse, better, groups)
    return fall > errors * error and held_out.rms(worse) > held_out.rms(better)


def _clearly(worse: np.ndarray, better: np.ndarray, groups: np.ndarray, errors: float) -> bool:
    fall, error = held_out.difference(worse, better, groups)
    return fall > errors * error
