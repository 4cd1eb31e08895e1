"""What a step of a study is called."""

from collections.abc import Sequence

import numpy as np

from fitting.library.library import library
from fitting.report.text.amounts import amount
from fitting.report.text.names import marked
from fitting.study.stages import Stage, begin_of_fall


def stage_text(stage: Stage) -> str:
    """'baseline', '+ tip', '+ textile_friction in place of coulomb_friction', '- tip', or that sizes are confined."""
    if stage.label:
        return stage.label
    if stage.confines_alone:
        return "sizes of the muscle kept to what was measured"
    return f"+ {added_text(stage)}" if stage.added else f"- {marked(stage.dropped, ' - ')}"


def fall_text(stages: Sequence[Stage], last: float, unit: str) -> str:
    """From where to where the error fell; of a model whose sizes alone were confined, what it was before."""
    at = begin_of_fall(stages)
    now, first = amount(last, unit), amount(stages[at].rmse, unit)
    if at == 0:
        return f"The error fell from {first} to {now}."
    before = f"With sizes that deny it, that model erred by {amount(stages[at - 1].rmse, unit)}."
    if at == len(stages) - 1:
        return f"With the sizes of the muscle kept to what was measured, the error is {now}. {before}"
    return f"The error fell from {first} to {now}, with the sizes of the muscle kept to what was measured. {before}"


def stage_verdict(stage: Stage) -> str:
    """The verdict on the model of a step; empty where none was asked for."""
    return verdict_words(stage.verdict, stage.strained)


def verdict_words(verdict: str, strained: bool) -> str:
    """A verdict in few words; `strained`: instruments explain the misfit only by errors far beyond their accuracy."""
    return "instruments, far beyond their accuracy" if strained else verdict


def dropped_text(stage: Stage) -> list[str]:
    """Why an effect is taken out again; nothing to say where none was, or where a relative took its place."""
    if stage.exchanged:
        return [
            f"Beside the other effects {marked(stage.added)} explains the readings better than "
            f"{marked(stage.dropped)}, if parameters are counted."
        ]
    if idle := _gave_way(stage):
        return [f"Beside {marked(stage.added, ' + ')} nothing is left for {marked(idle)}, which gave way."]
    if stage.added or not stage.dropped:
        return []
    them = "them" if len(stage.dropped) > 1 else "it"
    return [
        f"Beside what was added later, nothing in the data asks for {marked(stage.dropped)}: without {them} held-out "
        "runs are predicted as well, beyond what instruments can make of them, or worse by less than a step must gain."
    ]


def _gave_way(stage: Stage) -> list[str]:
    """What was dropped though nothing that was added is of its family."""
    known = library()
    families = {known[name].family for name in stage.added if name in known} - {None}
    return [n for n in stage.dropped if stage.added and not (n in known and known[n].family in families)]


def added_text(stage: Stage) -> str:
    """The effects that were added, and those whose place they took."""
    return marked(stage.added, " + ") + (f" in place of {marked(stage.dropped)}" if stage.dropped else "")


def tested_text(p_value: float | None) -> str:
    """The p-value of a step; NaN and None are models that were not tested."""
    return "not tested" if p_value is None or np.isnan(p_value) else f"{p_value:.2g}"
