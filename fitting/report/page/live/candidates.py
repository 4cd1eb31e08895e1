"""What the model would give with an effect that a diagnosis has fitted, at the readings of the live picture."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from fitting.diagnosis.record import Diagnosis
from fitting.problem.residuals import Samples
from fitting.report.page.models import ShownModel
from fitting.report.settings import LIVE
from fitting.report.text.amounts import amount
from fitting.report.text.diagnosis import effect_set
from fitting.report.text.evidence import named_sets, sort_evidence


@dataclass(frozen=True)
class Candidate:
    """A set of effects beside the model with this number: its name with its error, and model minus measured then."""

    model: int
    name: str
    residual: np.ndarray  # of all samples, N


def candidates_of(models: Sequence[ShownModel], called: Callable[[str], str]) -> list[Candidate]:
    """The sets of effects that help each diagnosed model most; `called` gives the names for readers."""
    return [
        candidate
        for model in models
        if model.diagnosis is not None
        for candidate in beside(
            model.residual, model.diagnosis, model.comparison.fit.samples, called, number=model.number
        )
    ]


def beside(
    residual: np.ndarray, d: Diagnosis, samples: Samples, called: Callable[[str], str], number: int = 0
) -> list[Candidate]:
    """The sets of effects that help one diagnosed model most; `residual` is its own, of all samples."""
    return [Candidate(number, called(name), residual + change) for name, change in changes(d, samples)]


def changes(d: Diagnosis, samples: Samples) -> list[tuple[str, np.ndarray]]:
    """By the names of effects and their error: by how much they change the prediction of every sample (samples,), N.

    A diagnosis may have looked at every k-th reading: between those the change is interpolated along each run.
    """
    errors = {frozenset(e.effects): e.rmse for e in d.tried}
    found = []
    for names in _shown(d):
        change = d.changes.get(frozenset(names))
        spread = None if change is None else _spread(change, d.baseline.samples, samples)
        if spread is not None:
            found.append((f"{effect_set(names)}: {amount(errors.get(frozenset(names)), 'N', 2)}", spread))
    return found


def _shown(d: Diagnosis) -> list[tuple[str, ...]]:
    """What is named, then what helps most."""
    helping = [(e.name,) for e in sort_evidence(d)[0]]
    alone = [names for names in d.explanations if len(names) == 1]
    order = dict.fromkeys([*(e.effects for e in named_sets(d)), *alone, *helping])
    return list(order)[: LIVE.candidates]


def _spread(change: np.ndarray, known: Samples, wanted: Samples) -> np.ndarray | None:
    """Values at some samples, for all samples of the same runs.

    None where the runs are not the same, or what was measured: a motion may have been read as a force.
    """
    if len(change) != len(known) or set(known.run) != set(wanted.run):
        return None
    spread = np.empty(len(wanted))
    for run in np.unique(wanted.run):
        mine, there = wanted.run == run, known.run == run
        measured = np.interp(known.row[there], wanted.row[mine], wanted.measured[mine])
        if not np.allclose(measured, known.measured[there], rtol=1e-9, atol=0):
            return None
        spread[mine] = np.interp(wanted.row[mine], known.row[there], change[there])
    return spread
