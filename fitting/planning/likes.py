"""A model whose effects have likes, as a tie: what was added may be one of several that do the same to these data."""

from collections.abc import Sequence
from dataclasses import replace

from fitting.diagnosis.outcomes import Verdict
from fitting.diagnosis.record import Diagnosis, Evidence
from fitting.full_names import owner_of
from fitting.least_squares.evaluate import evaluate
from fitting.problem.estimate import Estimate
from fitting.problem.varying import Varying
from fitting.recordings.records import Experiment
from mckibben_jax.effect import name_of


def with_likes_apart(diagnosis: Diagnosis, experiments: Sequence[Experiment], varying: Varying) -> Diagnosis:
    """The diagnosis of the model without what has likes, each of which explains what is missing then.

    The same diagnosis where the model has none. The explanations are what the model has of these effects, and
    that with one of them exchanged.
    """
    likes = dict.fromkeys(mine for mine, _ in diagnosis.substitutes)
    if not likes:
        return diagnosis
    fit = diagnosis.baseline
    left = [effect for effect in fit.layout.templates[0].effects if name_of(effect) not in likes]
    exchanged = [{*likes} - {mine} | {other} for mine, other in diagnosis.substitutes]
    known = {name: Evidence(name, estimate=_values(diagnosis, name)) for name in likes}
    free = [name for name in varying.names(fit.layout) if owner_of(name) not in likes]
    return replace(
        diagnosis,
        verdict=Verdict.ONE_OF,
        explanations=tuple(tuple(sorted(names)) for names in ({*likes}, *exchanged)),
        effects=diagnosis.effects | known,
        tried=(),
        baseline=evaluate(experiments, left, fit.values, free, varying.own),
    )


def _values(diagnosis: Diagnosis, effect: str) -> dict[str, Estimate]:
    fit = diagnosis.baseline
    return {name.split(".", 1)[1]: fit.estimate(name) for name in fit.layout.of_effect(effect)}
