"""What adding, dropping and discovering did to the error, in sentences and for machines."""

from typing import Any

from fitting.hill.settings import MOTION
from fitting.report.results import comparison_result, fit_result
from fitting.report.text.amounts import amount, percent
from fitting.report.text.stages import stage_text
from fitting.study.changing import Change
from fitting.study.discovering import OnMotions


def change_text(found: Change, unit: str) -> str:
    """What the change did to the error, in sample and on held-out runs."""
    first, last = found.stages[-2:]
    words = f"{stage_text(last)}: error {amount(first.rmse, unit)} -> {amount(last.rmse, unit)}, "
    words += f"on held-out runs {amount(first.held_out_rmse, unit)} -> {amount(last.held_out_rmse, unit)}."
    gain = 1 - (last.held_out_rmse / first.held_out_rmse) ** 2 if first.held_out_rmse and last.held_out_rmse else 0.0
    if gain > 0.02:
        return f"{words} This removes {percent(gain)} of the squared error there."
    return f"{words} The error on held-out runs does not fall: these data do not support the larger model."


def change_result(found: Change) -> dict[str, Any]:
    """The change for machines."""
    force = found.comparison.unit
    steps = [
        {"effect": stage_text(s), f"rmse_{force}": s.rmse, f"held_out_rmse_{force}": s.held_out_rmse}
        for s in found.stages
    ]
    return {
        **fit_result(found.after),
        f"held_out_rmse_{force}": found.held_out_rmse,
        "before": fit_result(found.before) | {f"held_out_rmse_{force}": found.stages[-2].held_out_rmse},
        "steps": steps,
        "comparison": comparison_result(found.comparison),
    }


def on_motions_text(motions: OnMotions) -> str:
    """What the equation of motion says of the model that was found."""
    before, after = (amount(fit.rmse, "m") for fit in (motions.before, motions.after))
    if motions.after is motions.before:
        return f"On the positions themselves (equation of motion) the model errs by {after}."
    sizes = ", with the sizes of the muscle as measured" if motions.held else ""
    told = f"On the positions themselves (equation of motion{sizes}): {before} -> {after}"
    if motions.confirmed and motions.after.over_noise > MOTION.far:
        missed = f"the model misses them by {motions.after.over_noise:.1f} times their noise"
        return f"{told}. They confirm what was added, but {missed}."
    if motions.confirmed:
        return f"{told}. They confirm the model."
    return f"{told}. They do not confirm the model, which holds only as far as motions can be read as force."


def on_motions_result(motions: OnMotions | None) -> dict[str, Any]:
    """The same for machines; nothing where force was measured."""
    if motions is None:
        return {}
    told = {"rmse_before_m": motions.before.rmse, "confirmed": motions.confirmed}
    return {"motion": fit_result(motions.after) | told}
