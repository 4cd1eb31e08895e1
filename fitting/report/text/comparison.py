"""A comparison of model and data: how large the error is, where it is, and of what kind."""

from collections.abc import Sequence

from rich.console import RenderableType
from rich.text import Text

from fitting import showing
from fitting.comparison.compare import Comparison, Row, branch_name
from fitting.comparison.compare import Table as ErrorTable
from fitting.comparison.fingerprint import Fingerprint
from fitting.recordings.records import NoiseSource
from fitting.report.settings import ERROR_TEXT, LAYOUT, SHOWN
from fitting.report.text.amounts import amount, percent, places
from fitting.report.text.bands import band_lines
from fitting.report.text.instruments import channel_lines
from fitting.report.text.layout import columns, line, lines, spaced
from fitting.report.text.noise import NOISE_TEXT
from fitting.report.text.stated_sizes import absurd_texts
from fitting.report.text.warnings import comparison_warnings

ERRORS = {"rms": "rmse", "mean": "bias", "largest": "largest"}  # columns of the error tables: the field of a `Row`


def worst_text(c: Comparison) -> str:
    """Where the error is largest; and which run it is, if one alone is off."""
    return " ".join([f"Worst at {place_text(c)}.", *_one_run(c)])


def place_text(c: Comparison) -> str:
    """Where the error is largest, and how large it is there."""
    w = c.worst
    parts = (w.pressure, f"contraction {w.contraction}", branch_name(w.branch, w.test) if w.branch else "")
    return f"{', '.join(part for part in parts if part)}: {w.times:.1f} times the average error"


def _one_run(c: Comparison) -> list[str]:
    """What one run alone shows is seldom an effect: the recording, or what was done to the muscle in it."""
    runs = next((table.rows for table in c.tables if table.title == "run"), ())
    if len(runs) < ERROR_TEXT.fewest_runs or not fails(c):
        return []
    first, second = sorted(runs, key=lambda row: -row.rmse)[:2]
    if first.rmse < ERROR_TEXT.alone * second.rmse:
        return []
    most = f"no other run has more than {amount(second.rmse, c.unit)}"
    return [f"One run alone has a large error: {first.label}, {amount(first.rmse, c.unit)}; {most}. Look at it first."]


def error_text(c: Comparison) -> str:
    """How large the error is, and how large it could be for nothing but noise."""
    of_full = f"RMS error {amount(c.rmse, c.unit)}, {percent(c.share)} of full scale ({amount(c.full_scale, c.unit)})"
    return f"{of_full}; largest error {amount(c.largest, c.unit)}. {floor_text(c)}"


def floor_text(c: Comparison) -> str:
    """The noise, and where it is known from."""
    reading = f"The noise of one reading is {amount(c.noise, c.unit)} ({_sources(c)})"
    if c.noise_floor is None:
        return f"{reading}; no loop was repeated, so it cannot be checked."
    beside = "" if c.one_way is None else ", beside what changes in all of them in one direction"
    return f"{reading}; repeated loops agree to {amount(c.noise_floor, c.unit)}{beside}."


def fails(c: Comparison) -> bool:
    """Whether the model leaves more than noise."""
    return c.rmse > ERROR_TEXT.near_floor * c.floor


def judgement(c: Comparison) -> str:
    """Whether the model is good enough, and whether it is of another muscle than was measured."""
    return " ".join([_judged(c), *absurd_texts(c.fit)])


def _judged(c: Comparison) -> str:
    """One sentence on whether the model is good enough."""
    readings, numbers = sum(score.count for score in c.by_recording), len(c.fit.free)
    if readings <= numbers:
        return f"{readings} readings cannot judge a model with {numbers} fitted parameters: record more."
    if not fails(c) and NoiseSource.MOTION in c.noise_sources:
        return (
            f"Read as force, the motions are described to within their noise, {amount(c.noise, c.unit)}. That noise is "
            "large: 'mckibben compare' gives the error of the model in the motions themselves."
        )
    if not fails(c) and c.noise_floor is None and NoiseSource.ASSUMED in c.noise_sources:
        near = "is within" if c.rmse <= c.noise else "is not much above"
        return (
            f"The RMS error of the model, {amount(c.rmse, c.unit)}, {near} the noise that is assumed here, "
            f"{amount(c.noise, c.unit)}. State the noise in muscle.toml to have the model judged."
        )
    if not fails(c):
        return f"The model describes these data nearly to their noise: RMS error {amount(c.rmse, c.unit)}."
    times = f"{c.rmse / c.floor:.0f} times" if c.rmse > 2.5 * c.floor else f"{c.rmse / c.floor:.1f} times"
    size = " The error is small: below 0.5 % of full scale." if c.negligible else ""
    guessed = not c.noise_floor and NoiseSource.NEIGHBOURS in c.noise_sources and c.rmse < ERROR_TEXT.slow * c.floor
    doubt = " Neighbouring readings do not show slow noise: if you know the noise, state it in muscle.toml."
    error = f"The RMS error of the model is {amount(c.rmse, c.unit)}, {times} {_floor(c)}."
    return f"{error}{size}{doubt * guessed}"


def _floor(c: Comparison) -> str:
    """The noise that the error is held against: how large it is, and where it is known from."""
    if c.noise_floor:
        return f"that by which repeated loops differ, {amount(c.noise_floor, c.unit)}"
    return f"the noise of one reading, {amount(c.noise, c.unit)} ({_sources(c)})"


def _sources(c: Comparison) -> str:
    return " and ".join(NOISE_TEXT[source] for source in c.noise_sources)


def kind_text(c: Comparison) -> str:
    """What kind of thing is missing, as far as the misfit shows."""
    if not fails(c):
        presumed = c.noise_floor is None and NoiseSource.ASSUMED in c.noise_sources
        noise = f"about the noise that is presumed, {amount(c.noise, c.unit)}, or less" if presumed else "mostly noise"
        return f"the misfit is {noise}, and nothing can be read from its shape"
    traces = c.fingerprint
    return "; ".join(part for part in (_parity(traces), *_even(traces), *_odd(traces), *_drift(c)) if part)


def _parity(traces: Fingerprint) -> str:
    share = traces.odd_share
    if share is None:
        return "no state was reached in both directions, so hysteresis cannot be separated from the rest"
    if share > ERROR_TEXT.mostly:
        return f"{percent(share)} of the misfit changes sign with the direction of motion (odd: hysteresis)"
    if share < 1 - ERROR_TEXT.mostly:
        return f"{percent(1 - share)} of the misfit is the same in both directions (even: not hysteresis)"
    return f"{percent(share)} of the misfit changes sign with the direction of motion, the rest does not"


def _even(traces: Fingerprint) -> list[str]:
    n = traces.pressure_exponent_even
    if n is None:
        return []
    # the table of what is left shows otherwise: the fit hides a part that goes with pressure
    if abs(n) < ERROR_TEXT.flat:
        return ["the even part of the misfit is the same at every pressure; fitted parameters absorb some of it"]
    return [f"the even part grows as pressure to the power {n:.2g}{_meaning(n)}"]


def _odd(traces: Fingerprint) -> list[str]:
    n, m = traces.pressure_exponent_odd, traces.speed_exponent_odd
    words = [] if n is None else [f"the odd part grows as pressure to the power {n:.2g}{_meaning(n)}"]
    return words if m is None else [*words, f"and as speed to the power {m:.2g}{_meaning(m)}"]


def _meaning(exponent: float) -> str:
    if abs(exponent) < ERROR_TEXT.flat:
        return " (independent of it)"
    return " (proportional)" if abs(exponent - 1) < 0.1 else ""


def _drift(c: Comparison) -> list[str]:
    """How far a branch moves when it is measured again: a few that move far may outweigh what most of them scatter."""
    drift = c.fingerprint.cycle_drift or 0.0
    return [f"a branch moves by {amount(drift * c.rmse, c.unit)} when it is measured again"] if drift > 0.1 else []


def comparison_report(c: Comparison) -> list[RenderableType]:
    """Where the model fails."""
    shown: list[RenderableType] = [
        line("RESULT", judgement(c), "bold"),
        line("ERROR", error_text(c)),
        *lines("NEW RUN", band_lines(c.bands)),
        *([line("WHERE", worst_text(c))] if fails(c) else []),
        line("KIND", kind_text(c)),
        *lines("WARNING", comparison_warnings(c), "yellow"),
    ]
    shown += lines("CHANNELS", channel_lines(c.channels))
    shown += lines("NOTE", c.notes)
    if len(c.by_recording) > 1:
        shown.append(_recordings(c))
    return [*shown, *(_errors_by(table, c.unit) for table in c.tables)]


def _errors_by(table: ErrorTable, unit: str) -> RenderableType:
    rows = table.rows
    left_out = len(rows) - SHOWN.runs if len(rows) > SHOWN.runs + 1 else 0
    if left_out:
        worst = sorted(rows, key=lambda row: -row.rmse)[: SHOWN.runs]
        rows = tuple(row for row in rows if row in worst)
    top = max(row.rmse for row in rows)
    heads, cells = error_cells(rows, unit)
    shown = columns(f"by {table.title}", *heads, "", words=(0, len(heads) + 1), spare=(len(heads) + 1,))
    for row, words in zip(rows, cells, strict=True):
        shown.add_row(*words, Text("█" * max(1, round(LAYOUT.bar * row.rmse / top)) if top > 0 else "", style="cyan"))
    if left_out:
        shown.add_row(f"... and {left_out} with less error", *("" for _ in heads))
    return spaced(shown)


def _recordings(c: Comparison) -> RenderableType:
    heads = ("by recording", "test", "samples", "rms", "largest", "full scale", "noise")
    table = columns(*heads, spare=(6, 5, 4))
    several = len({score.dataset for score in c.by_recording}) > 1
    for s in c.by_recording:
        name = f"{s.dataset}, {s.file}" if several else s.file
        values = (amount(value, s.unit) for value in (s.rmse, s.largest, s.full_scale, s.noise))
        table.add_row(name, s.test, str(s.count), *values)
    return spaced(table)


def error_cells(rows: Sequence[Row], unit: str) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """The heads behind that of the group, and of each row its group, samples and errors, all to the same digit."""
    name, size = showing.shown_in(unit, max(row.rmse for row in rows))
    after = places(row.rmse / size for row in rows)
    cells = lambda row: (f"{getattr(row, field) / size:z.{after}f}" for field in ERRORS.values())  # noqa: E731
    heads = ("samples", *(f"{head} [{name}]" for head in ERRORS))
    return heads, [(row.label, str(row.count), *cells(row)) for row in rows]
