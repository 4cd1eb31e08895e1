"""What recordings cannot say whatever the model, and what in them few models say: notes for whoever fits them."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fitting import showing
from fitting.recordings.readings import FEWEST_SAMPLES
from fitting.recordings.records import FORCE_TESTS, Experiment, Recording, Run
from fitting.recordings.settings import CUT_SHORT

TURNED_BY = {"loop": "length", "isometric": "pressure", "isotonic": "pressure"}
AT_ONE_PRESSURE = ("loop", "static")  # tests in which a pressure is set and kept
ONE_PRESSURE = 0.05  # share by which pressures differ that are one
LITTLE_PULL, PRESSED = 0.01, 0.1  # of the largest force and pressure: it should pull, and hardly does; chosen
MANY = 0.02  # of the samples: of fewer no word is said; chosen


def with_limits(experiment: Experiment) -> Experiment:
    """The data set with notes on what its recordings cannot say even together: one direction, one pressure."""
    with showing.spoken(showing.own_units(experiment.units)):
        return replace(experiment, notes=tuple(_limits_of(experiment.recordings)))


def _limits_of(recordings: Sequence[Recording]) -> list[str]:
    pressures = np.concatenate([run.pressure[run.usable] for each in recordings for run in each.runs])
    notes = _one_way(recordings)
    if len(pressures) < FEWEST_SAMPLES:
        notes.append(f"only {len(pressures)} readings count: any model with that many parameters meets them")
    lowest, highest = float(pressures.min()), float(pressures.max())
    kept = any(each.test in AT_ONE_PRESSURE for each in recordings)
    if kept and highest - lowest < ONE_PRESSURE * abs(highest):
        notes.append(
            f"one pressure only, {showing.show(float(np.median(pressures)), 'Pa')}: how anything depends on the "
            "pressure is the model's word; record a second one"
        )
    return [*notes, *_cut_short(recordings)]


def _cut_short(recordings: Sequence[Recording]) -> list[str]:
    """A note on each run that ends on its way, long before all others of its kind of test, which last equally long."""
    notes = []
    for test in TURNED_BY:
        runs = [(each, run) for each in recordings if each.test == test for run in each.runs]
        lasting = np.array([float(np.ptp(run.time)) for _, run in runs])
        if len(runs) < CUT_SHORT.fewest:
            continue
        usual = float(np.median(lasting))
        short = lasting < CUT_SHORT.short * usual
        if np.any(np.abs(lasting - usual) > CUT_SHORT.alike * usual, where=~short):
            continue  # durations differ by plan
        others = f"each of the others {showing.show(usual, 's', digits=2)}"
        notes += [
            f"{_called(*runs[at])} lasts {showing.show(float(lasting[at]), 's', digits=2)}, {others}: if it was cut "
            "off, record it again"
            for at in np.flatnonzero(short)
            if not _comes_back(runs[at][1], test)
        ]
    return notes


def _called(recording: Recording, run: Run) -> str:
    return f"run {run.name} of {recording.file}" if len(recording.runs) > 1 else recording.file


def _comes_back(run: Run, test: str) -> bool:
    """Whether a run ends near where it began: it is whole, and was faster."""
    way = run.contraction if TURNED_BY[test] == "length" else run.pressure
    return bool(abs(way[-1] - way[0]) < CUT_SHORT.back * np.ptp(way))


def _one_way(recordings: Sequence[Recording]) -> list[str]:
    """A note where no kind of test, in whatever files, went both ways."""
    signs: dict[str, set[int]] = {}
    for each in recordings:
        if each.test in TURNED_BY:
            ways = {int(sign) for run in each.runs for sign in np.unique(run.branch[run.usable])} - {0}
            signs.setdefault(each.test, set()).update(ways)
    if not signs or any(len(ways) != 1 for ways in signs.values()):
        return []
    ways = dict.fromkeys(_way(test, *sign) for test, sign in signs.items())
    return [
        f"only {' and '.join(ways)} was recorded: friction cannot be told from a force that does not depend on the "
        "direction; record the way back too"
    ]


def _way(test: str, sign: int) -> str:
    if TURNED_BY[test] == "pressure":
        return "inflating" if sign > 0 else "deflating"
    return "contracting" if sign > 0 else "elongating"


def slack_notes(runs: Sequence[Run], test: str) -> list[str]:
    """A note where a muscle under pressure hardly pulls in many readings."""
    if test not in FORCE_TESTS:
        return []
    weight, force, pressure = (np.concatenate([getattr(run, name) for run in runs])
                               for name in ("weight", "measured", "pressure"))  # fmt: skip
    little, pressed = LITTLE_PULL * float(force.max()), PRESSED * float(pressure.max())
    slack = int(np.count_nonzero((weight > 0) & (force < little) & (pressure > pressed)))
    counted = int(np.count_nonzero(weight))
    if slack < MANY * counted:
        return []
    return [
        f"{slack:,} of {counted:,} samples pull by less than {showing.show(little, 'N', digits=2)} above "
        f"{showing.show(pressed, 'Pa', digits=2)}: the muscle hangs slack there, or its rubber pushes; the effect "
        "'slack' describes it, and valid = { force = [...] } leaves such readings out"
    ]
