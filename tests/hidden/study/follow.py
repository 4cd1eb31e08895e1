"""After a verdict "one of": is it unique once the proposed recording has been made, or one drawn at random?

The simulator makes both recordings, on the same muscle or on another of the same make where that is what is proposed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from ..simulator import EVERY_NOISE, Muscle, Recording, Truth, dataset, isometric, loops, write
from .cases import Case
from .protocols import PROTOCOLS

MOST_SAMPLES = 6000
OTHER_MUSCLES = {
    "half as long": lambda m: replace(m, length=m.length / 2),
    "twice as long": lambda m: replace(m, length=m.length * 2),
    "wall twice as thick": lambda m: replace(m, wall_thickness=m.wall_thickness * 2),
}


def open_tie(found: Any) -> bool:
    """Whether a diagnosis leaves several explanations that are not exact likes."""
    named = {*found.explanations}
    return found.verdict == "one of" and not any(named <= set(alike) for alike in found.classes)


def followed(case: Case, found: Any, experiment: Any, truth: Truth, folder: Path, base: Sequence[Any]) -> dict:
    """Verdicts after the proposed recording and after one drawn at random from what the rig has shown it can do."""
    from fitting.planning.candidates import grid, shown
    from fitting.planning.next_measurement import next_measurement

    if not open_tie(found):
        return {}
    step = next_measurement(found, [experiment])
    if step is None:
        return {"proposed": None}
    repeats = step.repeats
    mine = after(case, step.protocol, repeats, truth, folder, base)
    drawable = [p for p in grid(shown(experiment)) if not p.beyond and not p.hold and p.test != "static"]
    drawn = drawable[int(case.random.integers(len(drawable)))]
    random = after(case, drawn, repeats, truth, folder, base)
    said = {"what": step.what, "needs": step.needs, "power": step.power}
    return {"proposed": mine and mine | said, "random": random}


def after(case: Case, p: Any, repeats: int, truth: Truth, folder: Path, base: Sequence[Any]) -> dict | None:
    """The verdict with one more recording, in a file of its own; None where the simulator cannot make it."""
    from fitting.diagnosis.diagnose import diagnose
    from fitting.recordings.experiment import read_experiment

    from .judge import verdict_of

    if p.hold or p.test == "static":
        return None
    plan, noise, seed = PROTOCOLS[case.protocol], EVERY_NOISE[case.noise], case.recording_seed()
    other = replace(truth, muscle=other_muscle(truth.muscle, p.specimen))
    before = plan.recordings(truth, noise, seed)
    more = recording(other, p, repeats, interval(before[0]), noise, seed + len(before))
    first = () if p.specimen else before
    where = folder / f"with {p.test} {p.pressures} {p.contractions} {p.rate:.3g} {p.specimen}".replace("/", " ")
    added = write(dataset(other, [*first, more], "Next", noise, seed + bool(p.specimen), **plan.errors), where)
    sets = [read_experiment(folder / "data")] if p.specimen else []
    return verdict_of(diagnose([*sets, read_experiment(added)], list(base)))


def other_muscle(muscle: Muscle, specimen: str) -> Muscle:
    """A muscle of the same make, named in words."""
    change = next((change for words, change in OTHER_MUSCLES.items() if words in specimen), None)
    return change(muscle) if change else muscle


def interval(made: Recording) -> float:
    """Seconds from one reading to the next."""
    time = made.columns["time"]
    return float(time[1] - time[0])


def recording(truth: Truth, p: Any, repeats: int, step: float, noise: Any, seed: int) -> Recording:
    """Closed cycles between the turning points, read as often as before (within reason)."""
    count = int(min(2 * repeats * p.branch_time / step, MOST_SAMPLES)) + 1
    given = {"samples": max(count, 60 * repeats), "noise": noise, "seed": seed, "file": "next.csv"}
    low, high = p.pressures if p.test == "isometric" else p.contractions
    turns = (low, *(high, low) * repeats)
    if p.test == "isometric":
        return isometric(truth, contractions=p.contractions[:1], turns=turns, ramps=(p.rate,), **given)
    return loops(truth, pressures=p.pressures[:1], speeds=(p.rate * truth.muscle.length,), turns=turns, **given)
