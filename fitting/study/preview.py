"""What would come of a diagnosis: the model with the effect that it names, fitted, beside the model as it is."""

from dataclasses import replace

import numpy as np

from fitting.comparison.compare import Comparison, compare
from fitting.diagnosis.outcomes import Verdict
from fitting.diagnosis.record import Diagnosis
from fitting.least_squares.evaluate import held_out_rmse
from fitting.progress import Progress
from fitting.study.changing import with_added
from fitting.study.stages import Stage
from fitting.study.task import Task, fit_task

MOST = 0.5  # of the squared held-out error: what removes less is not added for its own sake


def suggested(d: Diagnosis) -> tuple[str, ...]:
    """The effects to add next: an explanation, the leading effect if it is one; else what removes most of the error."""
    leading = d.leading.effects if d.leading is not None else ()
    if d.verdict in (Verdict.MISSING, Verdict.ONE_OF) and d.explanations:
        return next((names for names in d.explanations if names == leading[:1]), d.explanations[0])
    return leading[:1] if d.leading is not None and d.leading.share > MOST else ()


def p_value_with(d: Diagnosis, added: tuple[str, ...]) -> float | None:
    """The p-value of the test that nothing is missing from the model with these effects; None where it was not made."""
    tried = next((e.p_value for e in d.tried if set(e.effects) == set(added)), np.nan)
    return None if np.isnan(tried) else tried


def before_and_after(task: Task, c: Comparison, d: Diagnosis, progress: Progress) -> tuple[Stage, ...]:
    """The diagnosed model, and the same with what the diagnosis suggests; empty where it suggests nothing.

    `task` and `c` are what was diagnosed: motions as force where no force was measured. The errors of both are of all
    samples; those of the diagnosis may be of fewer.
    """
    names = suggested(d)
    if not names:
        return ()
    progress("fitting the model with it, for the page", 0.97)
    changed, by = with_added(task, names)
    known = {name: value for name, value in d.baseline.values.items() if name in changed.layout.names}
    after = fit_task(replace(changed, known=known))
    return (
        Stage("model", c.rmse, held_out_rmse(c.fit), d.verdict, c, diagnosis=d, p_value=d.p_value),
        Stage("", after.rmse, held_out_rmse(after), comparison=compare(after, changed.experiments), added=by.added,
              dropped=by.dropped, p_value=p_value_with(d, names)),
    )  # fmt: skip
