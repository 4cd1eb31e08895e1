"""One case from its plan to its record: simulate, write, read, diagnose, and note what was said."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from ..simulator import EVERY_NOISE, Dataset, Noise, Truth, write
from .cases import ERRING, Case
from .changes import changed
from .erring import RIGS
from .follow import followed
from .mimicry import mimic
from .protocols import PROTOCOLS
from .scores import holds, sets
from .sizes import ALL_TYPICAL, base_of, hiding, sized

OUTSIDE = "outside"
NEXT = "next"


def judged(case: Case, limits: dict[str, float], rivals: bool = False) -> dict[str, Any]:
    """The record of one case. `limits`: printed detection limits (N) for this noise, protocol and instruments."""
    began = time.perf_counter()
    noise = EVERY_NOISE[case.noise]
    hidden, target = hidden_of(case, limits)
    record: dict[str, Any] = {"id": case.id, **vars(case), "misfit": target}
    if hidden is None:
        return record | {"visible": False, "seconds": time.perf_counter() - began}
    truth = hiding(base_of(hidden), hidden)
    data = PROTOCOLS[case.protocol].data(truth, noise, case.recording_seed(), RIGS[case.instruments])
    record |= {"visible": True, "parameters": hidden, "floor": true_floor(case, data)}
    with TemporaryDirectory() as folder:
        changed(write(data, Path(folder) / "data", say_accuracy=case.stated), case.change, case.random)
        record |= said(case, Path(folder) / "data", list(base_of(hidden)), rivals, truth)
    return record | mimicked(case, hidden, record)


def hidden_of(case: Case, limits: dict[str, float]) -> tuple[dict[str, dict[str, float]] | None, float]:
    """What is hidden, with its parameters (None where these data could not show it), and the least misfit of one, N."""
    shapes, sigma = case.shapes(), noise_sd(EVERY_NOISE[case.noise])
    if not case.hidden:
        return {}, case.size * sigma
    targets = {name: case.size * (sigma if case.unit == "sigma" else limits.get(name, np.nan)) for name in case.hidden}
    least, found = min(targets.values()), {}
    for name, target in targets.items():
        given = sized(case.protocol, name, target, shapes[name], sigma, case.hidden) if np.isfinite(target) else None
        if given is None:
            return None, least
        found[name] = given
    return found, least


def mimicked(case: Case, hidden: dict[str, dict[str, float]], record: dict[str, Any]) -> dict[str, float]:
    """Where others were named than what was hidden: how closely the best of those can follow it, N.

    Nothing of sets that hold an effect which the simulator does not know.
    """
    known = [names for names in sets(record) if set(names) <= set(ALL_TYPICAL)]
    if not hidden or not known or holds(record):
        return {}
    sigma = noise_sd(EVERY_NOISE[case.noise])
    return {"mimic": min(mimic(case.protocol, hidden, names, sigma) for names in known)}


def noise_sd(noise: Noise) -> float:
    """Standard deviation of one reading, all that it errs by included, N."""
    return float(np.sqrt(noise.sd**2 * (1 + noise.drift**2 + noise.zero**2) + noise.step**2 / 12))


def true_floor(case: Case, data: Dataset) -> float:
    """Rms of what no model could foretell: the readings' noise, and the muscle's spread from run to run, N.

    What instruments err by all along a run could be foretold by who knew it, and is left out.
    """
    silent = replace(EVERY_NOISE[case.noise], sd=0.0, step=0.0, spread=0.0)
    rig, seed = RIGS[case.instruments], case.recording_seed()
    predicted = PROTOCOLS[case.protocol].recordings(data.truth, silent, seed, instruments=rig)
    left = [
        read.columns["force"] - mean.columns["force"] for read, mean in zip(data.recordings, predicted, strict=True)
    ]
    return float(np.sqrt(np.mean(np.concatenate(left) ** 2)))


def said(case: Case, folder: Path, base: list[str], rivals: bool, truth: Truth) -> dict[str, Any]:
    """What the program says of a folder, as plain numbers and words."""
    from fitting.diagnosis.diagnose import concluded, searched
    from fitting.diagnosis.search import Search
    from fitting.recordings.experiment import read_experiment
    from fitting.report.text.reasons import why_text
    from mckibben_jax.effect import name_of
    from mckibben_jax.effects import LIBRARY

    from .likelier import outdone, standing
    from .rivals import answers

    known = {name_of(kind): kind for kind in LIBRARY}
    began = time.perf_counter()
    experiment = read_experiment(folder)
    effects = [known[name]() for name in base]
    search = searched([experiment], effects)
    found = concluded(search)
    seconds = time.perf_counter() - began
    record = verdict_of(found) | {"seconds": seconds, "standing": standing(search), "outdone": outdone(search)}
    if case.group in ("none", ERRING) and not case.hidden:
        record["limits"] = {n: e.detection_limit for n, e in found.effects.items() if e.detection_limit is not None}
    if case.group == OUTSIDE:
        record["fingerprint"] = fingerprint(found, experiment)
    if case.group == NEXT:
        record |= followed(case, found, experiment, truth, folder.parent, effects)
    if rivals:
        began = time.perf_counter()
        record["rivals"] = answers(Search.resumed(search))
        record["rival_seconds"] = time.perf_counter() - began
    if len(case.hidden) == 1 and case.hidden[0] in found.effects:
        record["limit"] = found.effects[case.hidden[0]].detection_limit
        record["reason"] = why_text(found.effects[case.hidden[0]].why)
    return record


def verdict_of(found: Any) -> dict[str, Any]:
    """Verdict, sets and errors of a diagnosis."""
    from fitting.diagnosis.flip_groups import rests_on_in_words
    from fitting.report.text.reasons import notes_of

    after = [e.held_out_rmse for e in found.tried if tuple(sorted(e.effects)) in found.explanations]
    leading = found.leading.effects if found.leading else ()
    return {
        "verdict": found.verdict,
        "negligible": bool(found.negligible),
        "explanations": [list(names) for names in found.explanations],
        "classes": [["+".join(names) for names in group] for group in found.classes],
        "nearest": [list(e.effects) for e in found.nearest],
        "leading": list(leading),
        "p": found.p_value,
        "rests_on": rests_on_in_words(found.rests_on),
        "rmse": found.rmse,
        "noise_floor": found.noise_floor,
        "left_out_before": found.held_out_rmse,
        "left_out_after": min(after) if after else found.held_out_rmse,
        "notes": notes_of(found),
    }


def fingerprint(found: Any, experiment: Any) -> dict[str, float | None]:
    """What the comparison says of the kind of misfit."""
    from fitting.comparison.compare import compare
    from fitting.diagnosis.settings import DIAGNOSIS
    from fitting.problem.thinning import thinned

    traces = compare(found.baseline, [thinned(experiment, DIAGNOSIS.samples)]).fingerprint
    return {"odd": traces.odd_share, "even_P": traces.pressure_exponent_even, "odd_P": traces.pressure_exponent_odd}
