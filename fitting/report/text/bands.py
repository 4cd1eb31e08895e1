"""How far force readings of a new run will lie from the model: sentences, and JSON."""

import math
from collections.abc import Sequence
from typing import Any

from fitting.least_squares.force_band import ForceBand
from fitting.report.text.amounts import amount
from fitting.showing import counted
from fitting.study.simulated_band import SimulatedBand


def band_lines(bands: Sequence[ForceBand]) -> list[str]:
    """One sentence for each kind of test."""
    return [band_text(band) for band in bands]


def band_text(band: ForceBand) -> str:
    """What the band says of a new run, or how many runs it needs."""
    if not band.known:
        return (
            f"How far readings of a new {band.test} run lie from the model cannot be said: {band.needed} runs are "
            f"needed, and there {'is' if band.runs == 1 else 'are'} {band.runs}."
        )
    unseen = "" if band.fitted else " Its values were not fitted to these runs."
    return (
        f"Record another {band.test} run like these {band.runs}: {_share(band.level)} will lie within "
        f"+/-{amount(band.half_width, 'N')} of the model, even if the model is wrong; within "
        f"+/-{amount(band.cautious, 'N')} if that run may differ from these as much as it likes.{unseen}"
    )


def _share(level: float) -> str:
    """A share of readings in words."""
    tenths = round(10 * level)
    return f"{tenths} readings of 10" if math.isclose(tenths, 10 * level) else f"{100 * level:g} % of the readings"


def simulated_band_texts(written: SimulatedBand | None) -> list[str]:
    """What is said of the band of a simulated recording; nothing where positions were simulated."""
    if written is None:
        return []
    if written.band is None:
        return [f"none: {written.why}"]
    if written.file is None:
        return [band_text(written.band)]
    beyond = (
        f" It is empty in {written.outside:,} of {counted(written.samples, 'sample')}, which lie beyond the measured "
        "pressures and contractions."
    )
    return [f"{written.file}. {band_text(written.band)}{beyond if written.outside else ''}"]


def simulated_band_result(written: SimulatedBand | None) -> dict[str, Any] | None:
    """The same for machines."""
    if written is None:
        return None
    (band,) = bands_result([written.band]) if written.band else [{}]
    file = None if written.file is None else str(written.file)
    return band | {"file": file, "samples": written.samples, "samples_beyond": written.outside, "why": written.why}


def bands_result(bands: Sequence[ForceBand]) -> list[dict[str, Any]]:
    """The same for machines; widths are null where runs are too few."""
    return [
        {"test": band.test, "level": band.level, "runs": band.runs, "runs_needed": band.needed, "fitted": band.fitted,
         "half_width_N": _number(band.half_width), "cautious_half_width_N": _number(band.cautious)}
        for band in bands
    ]  # fmt: skip


def _number(newtons: float) -> float | None:
    return newtons if math.isfinite(newtons) else None
