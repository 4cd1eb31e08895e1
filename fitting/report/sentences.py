"""What was found, in sentences: the same words on the terminal and on the page."""

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from fitting import units
from fitting.comparison.compare import Comparison
from fitting.comparison.fingerprint import Fingerprint
from fitting.diagnosis.record import Diagnosis, Evidence, Explanation
from fitting.least_squares.fit import Fit
from fitting.recordings.records import FORCE_TESTS, MOVING_TESTS, OF_MOTION, Experiment

if TYPE_CHECKING:
    from fitting.planning.next_measurement import NextMeasurement

SLOW = 6.0  # times the scatter of neighbouring readings: so much may still be noise that changes slowly
NEAR_FLOOR = 1.5  # times the floor: what is left is hardly more than noise
MOSTLY = 0.8
HOPELESS = 0.1  # power of a recording that separates as good as nothing
FEWEST_RUNS = 4  # of which one can be called odd
ALONE = 3.0  # times the error of the next: one run alone is off
FLAT = 0.15  # an exponent that is none
SOME, MOST = 0.05, 0.5  # of the squared error: what takes away less is not told, not added for its own sake
FOUND = ("missing", "one of", "not in the library")


def amount(value: float | None, unit: str) -> str:
    """A value for people, three figures."""
    return "-" if value is None else rounded(value, unit)


def rounded(value: float, unit: str, digits: int = 3) -> str:
    """A value with this many figures, and never fewer than it has before the point: '1063 N', not '1.06e+03 N'."""
    if not math.isfinite(value):
        return "no number"
    _, size = units.shown_in(unit, abs(value))
    shown = abs(float(f"{value / size:.{digits}g}"))
    before = math.floor(math.log10(shown)) + 1 if shown else 0
    return units.show(value, unit, digits=before if digits < before <= 6 else digits)


def with_error(value: float, error: float, unit: str) -> tuple[str, str]:
    """A value as far as its error goes, and the error with two figures; each with its unit."""
    both = units.show(value, unit, error if math.isfinite(error) and error > 0 else None, digits=5)
    if "+/-" not in both:
        return both, ""
    number, _, rest = both.partition(" +/- ")
    return f"{number} {rest.partition(' ')[2]}".strip(), rest


def places(values: Iterable[float], figures: int = 3) -> int:
    """Digits behind the point that show the largest of these with so many figures."""
    top = max((abs(value) for value in values if math.isfinite(value)), default=0.0)
    return max(0, figures - 1 - math.floor(math.log10(top))) if top > 0 else 0


def percent(share: float) -> str:
    """A share for people."""
    if 0.99 < share < 1:
        return f"{min(100 * share, 99.9):.1f} %"  # "100 %" would say that nothing is left
    return f"{rounded(100 * share, '1', 2)} %"


def data_in_words(experiments: Sequence[Experiment]) -> str:
    """What the data are: names, runs, samples."""
    runs = [run for e in experiments for recording in e.recordings for run in recording.runs]
    weighted = sum(int(run.weight.sum()) for run in runs)
    tests = dict.fromkeys(
        "motions read as force" if recording.noise_from == OF_MOTION else recording.test
        for e in experiments
        for recording in e.recordings
    )
    names = " and ".join(e.name for e in experiments)
    return f"{names}: {', '.join(tests)}; {len(runs)} runs, {weighted:,} samples that count"


def worst_in_words(c: Comparison) -> str:
    """Where the error is largest; and which run it is, if one alone is off."""
    return " ".join([f"Worst at {c.worst}.", *_one_run(c)])


def _one_run(c: Comparison) -> list[str]:
    """What one run alone shows is seldom an effect: the recording, or what was done to the muscle in it."""
    runs = next((table.rows for table in c.tables if table.title == "run"), ())
    if len(runs) < FEWEST_RUNS or not fails(c):
        return []
    first, second = sorted(runs, key=lambda row: -row.rmse)[:2]
    if first.rmse < ALONE * second.rmse:
        return []
    most = f"no other run by more than {amount(second.rmse, c.unit)}"
    return [f"One run alone is off: {first.label} by {amount(first.rmse, c.unit)}, {most}. Look at that one first."]


def error_in_words(c: Comparison) -> str:
    """How large the error is, and how large it could be for nothing but noise."""
    of_full = f"{amount(c.rmse, c.unit)} rms, {percent(c.share)} of full scale ({amount(c.full_scale, c.unit)})"
    return f"{of_full}; the largest is {amount(c.largest, c.unit)}. {floor_in_words(c)}"


def floor_in_words(c: Comparison) -> str:
    """The noise, and where it is known from."""
    reading = f"One reading is good to {amount(c.noise, c.unit)} ({c.noise_from})"
    if c.noise_floor is None:
        return f"{reading}; no loop was repeated to tell more."
    return f"{reading}; repeated loops agree to {amount(c.noise_floor, c.unit)}."


def fails(c: Comparison) -> bool:
    """Whether the model leaves more than noise."""
    return c.rmse > NEAR_FLOOR * c.floor


def judged(c: Comparison) -> str:
    """One sentence on whether the model is good enough."""
    readings, numbers = sum(score.count for score in c.by_recording), len(c.fit.free)
    if readings <= numbers:
        return f"{readings} readings cannot judge a model with {numbers} fitted numbers: record more."
    if not fails(c) and OF_MOTION in c.noise_from:
        return (
            f"Read as force, the motions are described to their noise there, {amount(c.noise, c.unit)}. That is "
            "coarse: how far the motions themselves are missed is said by 'mckibben compare'."
        )
    if not fails(c) and c.noise_floor is None and "presumed" in c.noise_from:
        return (
            f"The model is within the noise that is presumed here, {amount(c.noise, c.unit)}: "
            f"{amount(c.rmse, c.unit)} of error left. State the noise in muscle.toml to have it judged."
        )
    if not fails(c):
        return f"The model describes these data nearly to their noise: {amount(c.rmse, c.unit)} of error left."
    times = f"{c.rmse / c.floor:.0f} times" if c.rmse > 2.5 * c.floor else f"{c.rmse / c.floor:.1f} times"
    size = " That is small: below half a per cent of full scale." if c.negligible else ""
    guessed = not c.noise_floor and "neighbouring" in c.noise_from and c.rmse < SLOW * c.floor
    doubt = " Slow noise does not show in neighbouring readings: if you know it, state noise in muscle.toml."
    return f"The model misses these data by {amount(c.rmse, c.unit)}, {times} their noise.{size}{doubt * guessed}"


def kind_in_words(c: Comparison) -> str:
    """What kind of thing is missing, as far as the misfit shows."""
    if not fails(c):
        return "what is left is mostly noise and has no kind to speak of"
    traces = c.fingerprint
    return "; ".join(part for part in (_parity(traces), *_even(traces), *_odd(traces), *_drift(traces)) if part)


def _parity(traces: Fingerprint) -> str:
    share = traces.odd_share
    if share is None:
        return "no place was reached in both directions, so hysteresis cannot be told from the rest"
    if share > MOSTLY:
        return f"{percent(share)} of the misfit changes sign with the direction of motion (odd: hysteresis)"
    if share < 1 - MOSTLY:
        return f"{percent(1 - share)} of the misfit is the same in both directions (even: not hysteresis)"
    return f"{percent(share)} of the misfit changes sign with the direction of motion, the rest does not"


def _even(traces: Fingerprint) -> list[str]:
    n = traces.pressure_exponent_even
    if n is None:
        return []
    if abs(n) < FLAT:  # the table of what is left shows otherwise: the fit hides a part that goes with pressure
        return ["what is missing of the even part is the same at every pressure; the fit makes up for some of it"]
    return [f"what is even goes as pressure to the power {n:.2g}{_meaning(n)}"]


def _odd(traces: Fingerprint) -> list[str]:
    n, m = traces.pressure_exponent_odd, traces.speed_exponent_odd
    words = [] if n is None else [f"what is odd goes as pressure to the power {n:.2g}{_meaning(n)}"]
    return words if m is None else [*words, f"and as speed to the power {m:.2g}{_meaning(m)}"]


def _meaning(exponent: float) -> str:
    return ": does not depend on it" if abs(exponent) < FLAT else " (in proportion)" if abs(exponent - 1) < 0.1 else ""


def _drift(traces: Fingerprint) -> list[str]:
    drift = traces.cycle_drift
    return [f"{percent(drift)} of it changes from one loop to its repetition"] if drift and drift > 0.1 else []


# ---------------------------------------------------------------------------------------------------------------- fit


def fit_in_words(fit: Fit) -> list[str]:
    """What the user must know about a fit before trusting its numbers."""
    words = [] if fit.converged else ["The search did not converge: the values below are not to be trusted."]
    words += [f"{name} lies at an end of its range: its error means nothing." for name in fit.at_bound]
    words += [f"{', '.join(g)} can make up for each other: the data fix them only together." for g in tied_groups(fit)]
    if fit.held:
        words.append(f"Held, because these data cannot see them: {', '.join(fit.held)}.")
    return words + [f"Search: {failure}" for failure in fit.failures]


def tied_groups(fit: Fit) -> list[list[str]]:
    """Parameters that are tied, directly or through others."""
    groups: list[set[str]] = []
    for name, others in fit.tied.items():
        joined = {name, *others}
        for group in [group for group in groups if group & joined]:
            groups.remove(group)
            joined |= group
        groups.append(joined)
    return [sorted(group) for group in groups]


# ---------------------------------------------------------------------------------------------------------- diagnosis


def effect_set(names: Sequence[str]) -> str:
    """A set of effects for people."""
    return " + ".join(names) if names else "nothing"


def values_in_words(e: Explanation) -> str:
    """The numbers of an explanation, each with its robust standard error."""
    return "; ".join(f"{name} = {units.show(value, unit, error)}" for name, (value, error, unit) in e.estimate.items())


def most_alike(e: Evidence) -> str:
    """The effect whose mark is most like this one's; empty where none is."""
    return max(e.similar, key=lambda name: e.similar[name], default="")


def remark(e: Evidence) -> str:
    """What is to be said of an effect beside its numbers."""
    return e.reason or ("explains the data" if e.adequate else "")


def verdict_in_words(d: Diagnosis) -> str:
    """The verdict in one sentence, and whether what is missing matters."""
    size = " It is small: below half a per cent of full scale." if d.verdict in FOUND and d.negligible else ""
    return _verdict(d) + size


def _verdict(d: Diagnosis) -> str:
    sets = [effect_set(names) for names in d.explanations]
    if d.verdict == "nothing detectable":
        return "Nothing is missing that these data could show."
    if d.verdict == "missing":
        return f"{sets[0]} is missing." if len(d.explanations[0]) == 1 else f"Missing: {sets[0]}."
    if d.verdict == "one of":
        return f"One of these is missing, and these data cannot tell which: {'; '.join(sets)}."
    if d.verdict == "not in the library":
        return "Something is missing, and no effect of the library explains all of it."
    return f"These data cannot say whether something is missing: {'; '.join(d.notes[:1]) or 'too little shows'}."


def leading_in_words(d: Diagnosis, unit: str = "N") -> str | None:
    """What removes most of the error, whatever the verdict; None where next to nothing is removed or missing."""
    if d.leading is None or (d.verdict not in FOUND and d.leading.share < SOME):
        return None
    lead = d.leading
    names = " or ".join(lead.effects)
    left = f"{amount(d.held_out_rmse, unit)} -> {amount(lead.held_out_rmse, unit)} on runs left out"
    most = f"{names} does more than any other single effect that contradicts no measured size"
    most = f"Mostly {names}" if lead.share > MOST else most
    return f"{most}: {left}; it takes away {percent(lead.share)} of the squared error."


def p_in_words(d: Diagnosis) -> str:
    """How sure the gate is, and what that rests on."""
    test = f"p = {d.p_value:.2g} in the test that nothing is missing (level {d.level:g}), which rests on {d.rests_on}."
    unseen = d.verdict in FOUND and d.p_value >= d.level
    return test + (" It sees nothing, but the error is many times the noise." if unseen else "")


def substitutes_in_words(d: Diagnosis) -> list[str]:
    """What these data cannot tell from an effect that the model has."""
    found: dict[str, list[str]] = {}
    for mine, other in d.substitutes:
        found.setdefault(mine, []).append(other)
    return [
        f"{' or '.join(others)} in place of {mine} would predict the same: these data cannot tell which it is."
        for mine, others in found.items()
    ]


def measurement_in_words(planned: "NextMeasurement") -> list[str]:
    """What to record next and why, and how surely it decides."""
    often = f"It tells them apart in {percent(planned.power)} of the cases"
    if planned.power < HOPELESS:
        often += ": no recording that was tried does better"
    return [f"{planned.what}: {planned.why}.", f"{often}."]


def motions_in_words(d: Diagnosis, experiments: Sequence[Experiment]) -> list[str]:
    """What errors are of, where motions were read as force; where these show nothing, that the motions may."""
    tests = {recording.test for each in experiments for recording in each.recordings}
    if not tests & {*MOVING_TESTS}:
        return []
    both = "the errors of effects count motions read as force too; that after ERROR is of what was measured as force"
    coarse = (
        "a motion read as force is far noisier than the motion itself: 'mckibben compare' says how far the model "
        "misses the motions, 'mckibben add DATASET EFFECT' whether an effect that you suspect mends that"
    )
    return [both] * bool(tests & {*FORCE_TESTS}) + [coarse] * (d.verdict not in FOUND)
