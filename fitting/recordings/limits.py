"""What recordings cannot say whatever the model, and what in them few models say: notes for whoever fits them."""

import numpy as np

from fitting import showing
from fitting.recordings.readings import FEWEST_SAMPLES
from fitting.recordings.records import FORCE_TESTS, Run

TURNED_BY = {"loop": "length", "isometric": "pressure", "isotonic": "pressure"}
ONE_PRESSURE = 0.05  # share by which pressures differ that are one
LITTLE_PULL, PRESSED = 0.01, 0.1  # of the largest force and pressure: it should pull, and hardly does; chosen
MANY = 0.02  # of the samples: of fewer no word is said; chosen


def limits_of(runs: tuple[Run, ...], test: str) -> list[str]:
    """What these data cannot say whatever the model: one direction, one pressure."""
    notes = []
    signs = {int(sign) for run in runs for sign in np.unique(run.branch[run.weight > 0])} - {0}
    if test in TURNED_BY and len(signs) == 1:
        way = "inflating" if test != "loop" else "contracting"
        back = "deflating" if test != "loop" else "elongating"
        notes.append(
            f"only {way if 1 in signs else back} was recorded: friction cannot be told from a force that does not "
            "depend on the direction; record the way back too"
        )
    pressures = np.concatenate([run.pressure[run.weight > 0] for run in runs])
    if len(pressures) < FEWEST_SAMPLES:
        notes.append(f"only {len(pressures)} readings count: any model with that many parameters meets them")
    lowest, highest = float(pressures.min()), float(pressures.max())
    if test in ("loop", "static") and highest - lowest < ONE_PRESSURE * abs(highest):
        notes.append(
            f"one pressure only, {showing.show(float(np.median(pressures)), 'Pa')}: how anything depends on the "
            "pressure is the model's word; record a second one"
        )
    return [*notes, *_slack(runs, test)]


def _slack(runs: tuple[Run, ...], test: str) -> list[str]:
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
