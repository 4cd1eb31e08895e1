"""What a discovery may add after a diagnosis, and in which order it is asked for."""

from collections.abc import Sequence

from fitting.comparison.compare import NEGLIGIBLE
from fitting.diagnosis.outcomes import NOTHING_MISSING, Reason, Verdict, Why
from fitting.diagnosis.record import Diagnosis
from fitting.diagnosis.step_rules import RULES, StepRules

WORTH_IT = 0.99  # of an error: what changes it by less changes it by a rounding error

Tier = list[tuple[str, ...]]


def proposals(found: Diagnosis, rules: StepRules = RULES) -> list[Tier]:
    """What may be added after a diagnosis: the best of the first tier that has something sound.

    First what the verdict names, and at last all three of a set that it names; then what leads; then, where something
    is missing for certain, every other effect. Two at once come after all that stand alone. Each tier is in the order
    of its held-out errors.
    Where something is missing for certain, and it is small, only what the verdict names: piece by piece the rest would
    be laid on effects that are not there. Where it is more than a user can live with, all are asked.
    Where instruments had to err by far more than their accuracy, or where the test sees nothing missing though an
    added effect lowers the error, every effect alone is asked.
    """
    if found.verdict in NOTHING_MISSING:
        return [[e.effects for e in found.tried if len(e.effects) == 1]] if found.is_strained else []
    named = set(found.explanations)
    order = [e.effects for e in found.tried]  # by held-out error
    singles = [names for names in order if len(names) == 1]
    pairs = [names for names in order if len(names) == 2]
    inside = [names for names in order if any(set(names) <= set(group) for group in named)]
    leading = [] if found.leading is None else [names for names in singles if names[0] in found.leading.effects]
    tiers = [
        [names for names in singles if names in named],
        [names for names in singles if names in inside],
        [names for names in pairs if names in inside],
        [names for names in order if len(names) == 3 and names in named],
    ]
    if found.verdict == Verdict.INCONCLUSIVE:
        others = [leading, singles] if found.why in (Why(Reason.TEST_BLIND), Why(Reason.FEW_LOOPS)) else [leading]
    else:
        others = [] if is_left(found, rules) else [leading, singles, pairs[: rules.pairs]]
    return _without_repeats([*tiers, *others])


def _without_repeats(tiers: Sequence[Tier]) -> list[Tier]:
    """Each proposal in the first tier that has it; no empty tiers."""
    seen: set[tuple[str, ...]] = set()
    kept = []
    for tier in tiers:
        kept.append([names for names in tier if names not in seen])
        seen.update(tier)
    return [tier for tier in kept if tier]


def is_left(found: Diagnosis, rules: StepRules = RULES) -> bool:
    """Whether what is missing is so small that it is left as it is, unless a verdict names it."""
    can_live_with_it = rules.enough >= NEGLIGIBLE or found.beyond_noise < rules.enough * found.full_scale
    return found.negligible and can_live_with_it


def worth_judging(found: Diagnosis, rules: StepRules = RULES) -> list[Tier]:
    """The proposals that at first sight lower the held-out error enough.

    Whether they do so by more than its standard error is seen when they are judged, by fits that trust every reading:
    beyond the instruments a tip that takes a quarter of a hose's error falls by less.
    """
    by_name = {e.effects: e for e in found.tried}

    def pays(names: tuple[str, ...]) -> bool:
        one = by_name[names]
        share = WORTH_IT if one.adequate else 1 - rules.share
        return one.held_out_rmse < share * found.held_out_rmse

    return _without_repeats([[names for names in tier if pays(names)] for tier in proposals(found, rules)])
