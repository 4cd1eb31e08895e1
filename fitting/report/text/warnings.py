"""What to look at before any effect: a misfit that a wrong unit, size or kind of pressure would make."""

from collections.abc import Sequence

import numpy as np

from fitting import showing
from fitting.comparison.compare import Comparison
from fitting.comparison.slips import Mended, Slip
from fitting.recordings.accuracy import Channel
from fitting.recordings.channel_errors import ChannelErrors
from fitting.report.settings import WARNING_TEXT
from fitting.report.text.amounts import amount
from fitting.report.text.instruments import CHANNEL_TEXT


def comparison_warnings(c: Comparison) -> list[str]:
    """Warnings for people; empty where nothing is suspicious."""
    return [*_size(c), *_pressure(c), *_one_way(c), *_noisier(c), *_fast(c)]


def _fast(c: Comparison) -> list[str]:
    """A hint where the muscle would move as fast as none does: its time is in another unit."""
    kinds = np.array([block.test for block in c.fit.problem.blocks])[c.fit.samples.recording]
    counted = np.abs(c.fit.samples.rate[kinds == "loop"])
    rate = float(np.median(counted)) if len(counted) else 0.0
    if not rate >= WARNING_TEXT.fastest:
        return []
    return [
        f"In half of the readings the muscle moves faster than {showing.figures(rate)} of its lengths in a second. "
        "Check the unit of the time: seconds under a head in milliseconds make it a thousand times as fast."
    ]


def _size(c: Comparison) -> list[str]:
    """A hint where the model misses so much that a unit or a size is likelier to be wrong than the physics."""
    ratio = unlikely_ratio(c)
    if ratio is None:
        return []
    return [
        f"The measured force is on average {showing.figures(ratio)} times the force of a muscle of these sizes. Check "
        f"units and sizes before any effect is looked for. {slips_text(c.slips)}"
    ]


SLIPS = {
    Slip.DIAMETER: "the stated radius is the diameter",
    Slip.HALF_RADIUS: "the stated radius is half the radius",
    Slip.ANGLE_FROM_HOOP: "the braid angle was measured from the circumference, not from the long axis",
    Slip.KILOGRAM_FORCE: "the forces are in kgf, read as N",
    Slip.POUND_FORCE: "the forces are in lbf, read as N",
    Slip.KILONEWTON: "the forces are in kN, read as N",
    Slip.NEWTON_AS_KILOGRAM_FORCE: "the forces are in N, read as kgf",
    Slip.NEWTON_AS_POUND_FORCE: "the forces are in N, read as lbf",
    Slip.NEWTON_AS_KILONEWTON: "the forces are in N, read as kN",
    Slip.TEN_TIMES_PRESSURE: "the pressures are ten times those that were read (kPa read as hPa or mbar)",
    Slip.TENTH_OF_PRESSURE: "the pressures are a tenth of those that were read (hPa or mbar read as kPa)",
    Slip.HUNDRED_TIMES_PRESSURE: "the pressures are 100 times those that were read (bar read as kPa)",
    Slip.HUNDREDTH_OF_PRESSURE: "the pressures are a hundredth of those that were read (kPa read as bar)",
    Slip.THOUSAND_TIMES_PRESSURE: "the pressures are 1000 times those that were read (kPa read as Pa)",
    Slip.THOUSANDTH_OF_PRESSURE: "the pressures are a thousandth of those that were read (Pa read as kPa)",
    Slip.PSI_AS_KILOPASCAL: "the pressures are in psi, read as kPa",
    Slip.KILOPASCAL_AS_PSI: "the pressures are in kPa, read as psi",
    Slip.PSI_AS_BAR: "the pressures are in psi, read as bar",
    Slip.BAR_AS_PSI: "the pressures are in bar, read as psi",
    Slip.SWAPPED: "the columns of force and pressure are swapped",
}


def slips_text(slips: Sequence[Mended]) -> str:
    """What would bring the force near that of the sizes, if any usual slip would."""
    if not slips:
        return "No usual slip explains it: a diameter, an angle from the circumference, kgf, lbf, psi, a prefix."
    said = [f"{showing.figures(each.ratio)} times if {SLIPS[each.slip]}" for each in slips]
    return f"It would be {'; or '.join(said)}."


def unlikely_ratio(c: Comparison) -> float | None:
    """Measured force over that of a muscle of the stated sizes, where no effect that is known would make it so.

    Over the fitted model where that misses much; over the ideal cylinder of these sizes where the fit takes others.
    """
    if c.over_stated is not None and not WARNING_TEXT.stated[0] < c.over_stated < WARNING_TEXT.stated[1]:
        return c.over_stated
    if c.unit != "N" or c.share < WARNING_TEXT.unlikely:
        return None
    rows = c.fit.problem.of_force(c.fit.samples)
    measured, model = c.fit.samples.measured[rows], (c.fit.samples.measured + c.fit.residual)[rows]
    ratio = float(model @ measured / (model @ model)) if np.any(model) else 1.0
    return None if WARNING_TEXT.likely[0] < ratio < WARNING_TEXT.likely[1] else ratio


def _one_way(c: Comparison) -> list[str]:
    """What to do where no loop repeats the one before."""
    if c.one_way is None:
        return []
    verb, more = "pulls" if c.unit == "N" else "shortens", "less" if c.one_way.shift > 0 else "more"
    return [
        f"Loops do not repeat: in all of {c.one_way.runs} runs a loop {verb} {amount(abs(c.one_way.shift), c.unit)} "
        f"{more} than the one before, on average. This is no noise. Run the muscle in before you record, or look "
        "for creep, softening of the rubber (mullins), warming, or a load cell that drifts."
    ]


def _pressure(c: Comparison) -> list[str]:
    """A hint where readings that begin at an atmosphere fit far better without it."""
    if c.if_absolute is None or c.if_absolute > WARNING_TEXT.half * c.rmse:
        return []
    return [
        f"Were these pressures absolute, the error would be {amount(c.if_absolute, c.unit)} instead of "
        f"{amount(c.rmse, c.unit)}. If the instrument shows about 1 bar when the muscle is vented, write "
        'pressure = "absolute" in its [[recording]] before any effect is looked for.'
    ]


def _noisier(c: Comparison) -> list[str]:
    """What to do where readings scatter by far more than muscle.toml states."""
    odd = [each for each in c.channels if _scatter(each) > WARNING_TEXT.noisier]
    return [
        _noisier_text([each for each in odd if each.channel is channel])
        for channel in dict.fromkeys(each.channel for each in odd)
    ]


def _scatter(channel: ChannelErrors) -> float:
    """By how many stated errors of one reading, that of rounding included, neighbouring readings scatter."""
    stated, found = channel.allowed, channel.found.noise
    if "noise" not in channel.stated or not stated.noise or found is None:
        return 0.0
    return found / float(np.hypot(stated.noise, (channel.resolution or 0.0) / np.sqrt(12)))


def _noisier_text(odd: Sequence[ChannelErrors]) -> str:
    worst = max(odd, key=_scatter)
    channel = worst.channel
    known = 'noise = "..."' if channel is Channel.FORCE else f"the noise of the {CHANNEL_TEXT[channel]}"
    found, stated = (amount(size, worst.unit) for size in (worst.found.noise or 0.0, worst.allowed.noise or 0.0))
    return (
        f"Neighbouring readings of the {CHANNEL_TEXT[channel]} scatter by {found} in {worst.file}, where one is stated "
        f"to err by {stated}. Correct {known} in muscle.toml, or leave it out: the readings then tell it."
    )
