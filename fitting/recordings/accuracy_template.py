"""The lines of [recording.accuracy] that `mckibben init` leaves to fill in: what is presumed, in the file's units."""

from collections.abc import Collection, Iterator

import numpy as np

from fitting import showing
from fitting.recordings.accuracy_table import POSITIONS
from fitting.recordings.presumed import PRESUMED
from fitting.recordings.records import FORCE_TESTS
from fitting.recordings.settings import ACCURACY
from fitting.recordings.tables import Table


def accuracy_lines(
    table: Table | None, test: str, names: Collection[str], head: str = "[recording.accuracy]"
) -> Iterator[str]:
    """Comments that become a table when their signs are taken away; `names` are the columns that the file has.

    `table` holds the readings, or is None where they cannot be read yet.
    """
    yield f"# {head:<23}# what the data sheets of your instruments say, one standard deviation each;"
    yield "#                        # what is not stated is presumed as it stands here, and the noise is estimated"
    yield f'# pressure = {{ zero = "{_pressure_zero(table)}", gain = "{_share(PRESUMED.pressure_gain)}" }}'
    if test in FORCE_TESTS:
        shares = _share(PRESUMED.force_gain_per_run), _share(PRESUMED.force_hysteresis)
        yield f'# force = {{ gain_per_run = "{shares[0]}", hysteresis = "{shares[1]}" }}'
    ruler = ', noise = "0 mm"' if test == "static" else ""  # which nothing in the readings shows
    for position in (name for name in POSITIONS if name in names):
        read_off = ruler if POSITIONS[position] == "m" else ""
        yield f'# {position} = {{ zero_per_run = "{_held(table, position, test)}"{read_off} }}'
    if test != "static":
        yield f'# time = {{ skew = "{_skew(table)}" }}'
    yield f'# friction = {{ per_run = "{_share(PRESUMED.friction_per_run)}" }}   # by which it differs from run to run'
    yield '# more of the same: noise = "150 Pa", resolution = "0.1 kPa", zero_per_run = "1 N", drift = "5 N/h"'


def _share(size: float) -> str:
    return showing.show(size, "1", unit="%", digits=ACCURACY.figures)


def _pressure_zero(table: Table | None) -> str:
    """What is presumed of the gauge's zero: a share of the largest reading."""
    scale = ACCURACY.pressure
    if table is not None and "pressure" in table:
        scale = float(np.nanmax(np.abs(table["pressure"]))) or ACCURACY.pressure
    return _shown(table, "pressure", "Pa", PRESUMED.pressure_zero * scale)


def _held(table: Table | None, position: str, test: str) -> str:
    """What is presumed of a length from run to run; as a share it needs the muscle's length, which is not known yet."""
    if POSITIONS[position] == "1":
        return "? %" if test == "isometric" else "0 %"
    return _shown(table, position, "m", PRESUMED.held_length if test == "isometric" else 0.0)


def _skew(table: Table | None) -> str:
    """What is presumed of the time between channels."""
    steps = np.diff(table["time"]) if table is not None and "time" in table else np.array([])
    steps = steps[np.isfinite(steps) & (steps > 0)]
    step = float(np.median(steps)) if steps.size else ACCURACY.step
    return showing.show(PRESUMED.skew_steps * step, "s", digits=ACCURACY.figures)


def _shown(table: Table | None, column: str, si: str, size: float) -> str:
    """A size in the unit of its column."""
    return showing.show(size, si, unit=None if table is None else table.units.get(column), digits=ACCURACY.figures)
