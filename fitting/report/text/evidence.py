"""Which effects help, which do not, and which cannot be seen."""

from fitting.diagnosis.outcomes import Reason, Why
from fitting.diagnosis.record import Diagnosis, Evidence, Explanation
from fitting.diagnosis.settings import VERDICT
from fitting.report.text.reasons import why_text


def named_explanations(d: Diagnosis) -> list[Explanation]:
    """The explanations that are named, with what was fitted, in the order of the verdict."""
    known = {frozenset(e.effects): e for e in d.tried}
    return [known[frozenset(names)] for names in d.explanations if frozenset(names) in known]


def named_sets(d: Diagnosis) -> list[Explanation]:
    """Explanations of more than one effect."""
    named = {frozenset(names) for names in d.explanations if len(names) > 1}
    return [e for e in d.tried if frozenset(e.effects) in named]


def sort_evidence(d: Diagnosis) -> tuple[list[Evidence], list[Evidence], dict[str, list[str]]]:
    """Effects that explain more than the model, best first; those that do not; by reason those not seen.

    An effect that helps is seen, though a small amount of it would not be.
    """
    tested = [e for e in d.effects.values() if e.held_out_rmse is not None and (_is_seen(e) or _helps(e, d))]
    tested.sort(key=lambda e: (e.unexplained or 0.0, e.held_out_rmse or 0.0))
    helping = [e for e in tested if e.adequate or _helps(e, d)]
    blind: dict[str, list[str]] = {}
    named = {name for names in d.explanations for name in names}  # with others; alone it may lack what it needs
    for e in d.effects.values():
        if e not in tested and e.name not in named:
            fitted = e.rmse is not None  # and tested, in vain: what it would do, the model's own parameters do as well
            blind.setdefault(why_text(Why(Reason.NOT_SEEN) if fitted else e.why), []).append(e.name)
    return helping, [e for e in tested if e not in helping], blind


def _is_seen(e: Evidence) -> bool:
    return e.detection_limit is not None or e.adequate


def _helps(e: Evidence, d: Diagnosis) -> bool:
    """Whether an effect explains a part of what neither noise nor instruments do, or lowers the left-out error."""
    if d.p_value < d.level:
        return (e.unexplained or 0.0) < VERDICT.explains * d.unexplained
    return (e.held_out_rmse or 0.0) < VERDICT.helps * d.held_out_rmse
