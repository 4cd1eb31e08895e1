"""Results for machines: plain dictionaries in SI units, with the keys that scripts rely on."""

import json
import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from fitting.comparison.compare import Comparison
from fitting.comparison.fingerprint import Fingerprint
from fitting.diagnosis.flip_groups import rests_on_in_words
from fitting.diagnosis.record import Diagnosis, Evidence, Explanation
from fitting.instruments.sources import Source
from fitting.least_squares.one_sided import one_sided
from fitting.least_squares.record import Fit
from fitting.least_squares.rests_on import rests_on, rests_on_instruments
from fitting.report.text.attempts import attempts_result
from fitting.report.text.bands import bands_result
from fitting.report.text.comparison import place_text
from fitting.report.text.instrument_answers import instruments_result, odd_runs_result
from fitting.report.text.instruments import channels_result
from fitting.report.text.likelier import likelier_result
from fitting.report.text.measurement import needs_text, purpose_text, what_text
from fitting.report.text.names import identifiers
from fitting.report.text.noise import NOISE_TEXT
from fitting.report.text.reasons import notes_of, why_text
from fitting.report.text.search import failure_texts, search_text
from fitting.study.stages import Stage
from fitting.study.task import Task
from fitting.version import command_line, versions
from fitting.writing import write_text

if TYPE_CHECKING:
    from fitting.planning.next_measurement import NextMeasurement


def comparison_result(c: Comparison) -> dict[str, Any]:
    """`compare`: nothing is tested, so the verdict and its company are null."""
    return {
        "verdict": None,
        "negligible": c.negligible,
        "leading": None,
        "explanations": None,
        **_errors(c),
        "p_value": None,
        "by_recording": recordings_result(c),
        "fingerprint": fingerprint_result(c.fingerprint),
        "worst": place_text(c),
        "bands": bands_result(c.bands),
        **{f"by_{table.title}": [_row(row, c.unit) for row in table.rows] for table in c.tables},
        "channels": channels_result(c.channels),
        "notes": list(c.notes),
    }


def _errors(c: Comparison) -> dict[str, Any]:
    force = c.unit == "N"
    named = {"rmse": c.rmse, "largest": c.largest, "noise": c.noise, "noise_floor": c.noise_floor,
             "full_scale": c.full_scale}  # fmt: skip
    newtons = {f"{key}_N": value if force else None for key, value in named.items()}
    return newtons if force else newtons | {f"{key}_m": value for key, value in named.items()}


def _row(row: Any, unit: str) -> dict[str, Any]:
    values = {"rmse": row.rmse, "bias": row.bias, "largest": row.largest}
    return {"group": row.label, "count": row.count} | {f"{key}_{unit}": value for key, value in values.items()}


def recordings_result(c: Comparison) -> list[dict[str, Any]]:
    """The error of each recording in its own unit."""
    return [
        {"dataset": s.dataset, "file": s.file, "test": s.test, "unit": s.unit, "count": s.count, "rmse": s.rmse,
         "largest": s.largest, "full_scale": s.full_scale, "noise": s.noise, "noise_from": NOISE_TEXT[s.noise_source]}
        for s in c.by_recording
    ]  # fmt: skip


def fingerprint_result(traces: Fingerprint) -> dict[str, Any]:
    """What kind of thing is missing."""
    return dict(vars(traces))


def fit_result(fit: Fit) -> dict[str, Any]:
    """`fit`, and the fitted part of every other command."""
    force, on = any(block.of_force for block in fit.problem.blocks), rests_on(fit)
    instruments = {name: _by_error(shares) for name, shares in rests_on_instruments(fit).items()}
    return {
        "parameters": {
            name: _parameter(fit, name)
            | {"rests_on": on.get(name, {}), "rests_on_instruments": instruments.get(name, {})}
            | {"through_instruments": likelier_result(fit, name)}
            for name in shown_names(fit)
        },
        "rmse_N": fit.rmse if force else None,
        **({} if force else {"rmse_m": fit.rmse}),
        "rmse_through_instruments_N": fit.through.rmse if force and fit.through else None,
        "converged": fit.converged,
        "starts": search_text(fit),
        "failures": failure_texts(fit),
    }


def _by_error(shares: Mapping[Source, float]) -> dict[str, float]:
    """Shares by channel and kind, as muscle.toml names them: "pressure.gain"."""
    found: dict[str, float] = {}
    for source, share in shares.items():
        name = f"{source.channel or 'muscle'}.{source.kind}"
        found[name] = min(found.get(name, 0.0) + share, 1.0)
    return found


def shown_names(fit: Fit) -> tuple[str, ...]:
    """What a table of parameters lists: all of the effects', of the muscle what varies or has a stated error."""
    stated = (entry.name for entry in fit.layout.entries if entry.prior is not None)
    asked = {*fit.free, *fit.held, *stated}
    return tuple(name for name in fit.layout.names if name in asked or not name.startswith("muscle."))


def _parameter(fit: Fit, name: str) -> dict[str, Any]:
    entry = fit.layout.entry(name)
    return {
        "value": fit.values[name],
        "robust_error": fit.error(name),
        "iid_error": fit.error(name, robust=False),
        "unit": entry.unit,
        "lower": entry.lower,
        "upper": entry.upper,
        "state": str(fit.state(name)),
        "at_bound": name in fit.at_bound,
        **_one_sided(fit, name),
        "held": name in fit.held,
        "tied_with": list(fit.tied.get(name, ())),
    }


def _one_sided(fit: Fit, name: str) -> dict[str, float | None]:
    """The least or the largest value that the data allow of a parameter at its bound, SI, at a level of 95 %."""
    found = one_sided(fit).get(name)
    return {
        "at_least": found.limit if found is not None and found.is_least else None,
        "at_most": found.limit if found is not None and not found.is_least else None,
    }


def diagnosis_result(d: Diagnosis, c: Comparison, planned: "NextMeasurement | None" = None) -> dict[str, Any]:
    """`diagnose`: the verdict with its evidence; `c` compares the same baseline; `planned` is what to measure next."""
    lead = d.leading
    return {
        "verdict": d.verdict,
        "negligible": bool(d.negligible),
        "leading": None
        if lead is None
        else {
            "effects": list(lead.effects),
            "share": lead.share,
            "held_out_rmse_N": lead.held_out_rmse,
            "runner_up_rmse_N": lead.runner_up_rmse,
        },
        "explanations": [list(names) for names in d.explanations],
        "classes": [["+".join(names) for names in group] for group in d.classes],
        "stand_ins": [{"effect": mine, "instead": other} for mine, other in d.substitutes],
        "rmse_N": c.rmse,  # over all samples; the diagnosis itself may have looked at fewer
        "held_out_rmse_N": d.held_out_rmse,
        "unexplained_N": d.unexplained,
        "noise_floor_N": d.noise_floor if c.noise_floor is None else c.noise_floor,
        "full_scale_N": c.full_scale,
        "instruments": instruments_result(d.instruments),
        "p_value": d.p_value,
        "level": d.level,
        "odd_runs": odd_runs_result(d),
        "rests_on": rests_on_in_words(d.rests_on),
        "by_recording": recordings_result(c),
        "channels": channels_result(c.channels),
        "effects": {name: _evidence(evidence) for name, evidence in d.effects.items()},
        "fingerprint": fingerprint_result(c.fingerprint),
        "next_measurement": measurement_result(planned),
        "nearest": [_explanation(explanation) for explanation in d.nearest],
        "tried": [_explanation(explanation) for explanation in d.tried],
        "notes": notes_of(d),
    }


def measurement_result(m: "NextMeasurement | None") -> dict[str, Any] | None:
    """One recording to make, in SI units; null where none is proposed."""
    if m is None:
        return None
    isometric = m.protocol.test == "isometric"
    return {
        "what": what_text(m),
        "separates": [list(names) for names in m.separates],
        "power": m.power,
        "why": purpose_text(m),
        "test": m.protocol.test,
        "pressures_Pa": list(m.protocol.pressures),
        "contractions": list(m.protocol.contractions),
        "speed_m_per_s": None if isometric else m.speed,
        "pressure_rate_Pa_per_s": m.speed if isometric else None,
        "hold_s": m.protocol.hold,
        "repeats": m.repeats,
        "duration_s": m.seconds,
        "largest_force_N": m.pull or None,
        "needs": needs_text(m.protocol),
        "pairs": [
            {"pair": [list(p.one), list(p.other)], "power": p.power, "discrepancy": p.discrepancy} for p in m.pairs
        ],
        "tied": [[list(a), list(b)] for a, b in m.tied],
    }


def _evidence(e: Evidence) -> dict[str, Any]:
    return {
        "p_value": e.p_value,
        "rmse_N": e.rmse,
        "held_out_rmse_N": e.held_out_rmse,
        "unexplained_N": e.unexplained,
        "detection_limit_N": e.detection_limit,
        "absorbed_share": e.absorbed_share,
        "alike": dict(e.similar),
        "estimate": {name: [value, error] for name, (value, error, _) in e.estimate.items()},
        "adequate": e.adequate,
        "reason": why_text(e.why),
    }


def _explanation(e: Explanation) -> dict[str, Any]:
    return {
        "effects": list(e.effects),
        "rmse_N": e.rmse,
        "held_out_rmse_N": e.held_out_rmse,
        "unexplained_N": e.unexplained,
        "p_value": e.p_value,
        "adequate": e.adequate,
        "reason": why_text(e.why),
        "estimate": {
            name: {"value": value, "robust_error": error, "unit": unit}
            for name, (value, error, unit) in e.estimate.items()
        },
    }


def steps_result(stages: Sequence[Stage]) -> dict[str, Any]:
    """`discover`: one step per effect added; the first is the model that it began with.

    `dropped` names what gave way to the effect. At the end stand the steps that drop what is not needed any more: their
    `effect` is empty.
    `held` are stated sizes of the muscle that are held from there on, for a free fit denies them; `not_kept` are the
    larger models that were tried after a step, in their order, each with the reasons against it.
    """
    return {"steps": [_step(stage) for stage in stages]}


def _step(stage: Stage) -> dict[str, Any]:
    return {
        "effect": stage.label or "+".join(stage.added),
        "dropped": list(stage.dropped),
        "rmse_N": stage.rmse,
        "held_out_rmse_N": stage.held_out_rmse,
        "verdict": stage.verdict,
        "p_value": stage.p_value,
        "held": list(stage.held),
        "not_kept": attempts_result(stage.attempts),
    }


def provenance(task: Task) -> dict[str, Any]:
    """What it takes to get the same result again."""
    return {
        "command": command_line(),
        "model": list(task.names),
        "origin": task.origin,
        "confined": list(task.held),
        "seed": task.seed,
        "data": {e.name: {"folder": str(e.folder), "sha256": e.sha256} for e in task.experiments},
        "versions": versions(),
    }


# ------------------------------------------------------------------------------------------------------------ writing


def write_json(path: str, result: dict[str, Any]) -> None:
    """Write a result; numbers that are none are null, and names are those that commands take."""
    write_text(path, json.dumps(_plain(result), indent=1, ensure_ascii=False, allow_nan=False) + "\n")


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {identifiers(str(key)): _plain(entry) for key, entry in value.items()}
    if isinstance(value, str):
        return identifiers(value)
    if isinstance(value, Sequence):
        return [_plain(entry) for entry in value]
    if isinstance(value, (bool, np.bool_)):
        return bool(value)
    if isinstance(value, (float, np.floating)):
        return float(value) if math.isfinite(value) else None
    return int(value) if isinstance(value, np.integer) else value
