"""What the records add up to, as a page in Markdown: shares with the error that counting has."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from scipy import stats

from .cases import GROUPS

Record = dict[str, Any]
WITHIN = stats.norm.ppf(0.95)  # standard errors that hold 90 %
BINS = ((0.0, 0.25), (0.25, 0.5), (0.5, 1.0), (1.0, 2.0), (2.0, np.inf))  # misfit in standard deviations of a reading
VISIBLE = 0.5  # standard deviations of a reading
FAR = 4.0  # standard deviations: hardly ever by chance, in five parameters with heavy tails
REASONS = {"something is missing": "the test for anything missing", "the misfit in": "misfit above the noise",
           "the data move": "data against a prior", "the priors keep": "priors that keep the misfit large",
           "errors that loops share": "the robust spread"}  # fmt: skip


def page(records: Sequence[Record], command: str, about: str) -> str:
    """The page."""
    drawn, lacking = ([r for r in records if r["group"] == group and "error" not in r] for group in GROUPS)
    failed = [r for r in records if "error" in r]
    parts = ["# Do intervals hold the truth?", about, f"`{command}`"]
    parts += [f"{len(failed)} data sets ended in an error: {failed[0]['error']}"] if failed else []
    if drawn:
        parts += ["## Nothing left out", chains(drawn), held(drawn), by_noise(drawn), alarms(drawn), errors(drawn)]
    if lacking:
        parts += ["## An effect left out", warned(lacking), by_misfit(lacking), by_effect(lacking)]
    return "\n\n".join(parts) + "\n"


def chains(records: Sequence[Record]) -> str:
    """How the posteriors came about."""
    seconds = [r["seconds"] for r in records]
    settled = sum(r["settled"] for r in records)
    methods = ", ".join(sorted({r["method"] for r in records}))
    return (
        f"{len(records)} data sets ({methods}); {settled} settled; {np.median(seconds):.1f} s each (median), "
        f"{max(seconds):.0f} s at most, fit and compilation included."
    )


def inside(records: Iterable[Record], name: str) -> np.ndarray:
    """Whether the interval of 90 % holds the truth."""
    return np.array([0.05 < r["parameters"][name]["rank"] < 0.95 for r in records])


def held(records: Sequence[Record]) -> str:
    """Coverage and ranks by parameter."""
    rows = []
    for name in records[0]["parameters"]:
        rank = [r["parameters"][name]["rank"] for r in records]
        counts = np.histogram(rank, bins=10, range=(0, 1))[0]
        uniform = stats.kstest(rank, "uniform").pvalue, stats.chisquare(counts).pvalue
        rows.append((name, share(inside(records, name)), *(f"{p:.2f}" for p in uniform), " ".join(map(str, counts))))
    every = np.concatenate([inside(records, name) for name in records[0]["parameters"]])
    rows.append(("all together", f"{100 * np.mean(every):.1f} %", "", "", ""))
    heads = ("parameter", "90 % intervals that hold the truth", "ranks uniform: p (KS)", "p (chi2)", "ranks in tenths")
    return table(heads, rows)


def by_noise(records: Sequence[Record]) -> str:
    """Coverage of all parameters together for each kind of noise."""
    rows = []
    for noise in dict.fromkeys(r["noise"] for r in records):
        mine = [r for r in records if r["noise"] == noise]
        every = np.concatenate([inside(mine, name) for name in mine[0]["parameters"]])
        rows.append((noise, str(len(mine)), f"{100 * np.mean(every):.1f} %"))
    return table(("noise", "data sets", "intervals that hold the truth (five to a data set)"), rows)


def alarms(records: Sequence[Record]) -> str:
    """Warnings that should not be."""
    false = [not r["calibrated"] for r in records]
    return f"Warned without reason: {share(np.array(false))}{reasons(records)}."


def reasons(records: Iterable[Record]) -> str:
    """How often each warning was given."""
    told = [{words for begins, words in REASONS.items() if any(w.startswith(begins) for w in r["warnings"])}
            for r in records]  # fmt: skip
    counts = {words: sum(words in some for some in told) for words in REASONS.values()}
    return " (" + ", ".join(f"{words}: {count}" for words, count in counts.items()) + ")"


def errors(records: Sequence[Record]) -> str:
    """The error bars of the fit, which knows nothing of the noise's memory, on the same data."""
    rows = []
    for name in records[0]["fit"]:
        for kind in ("robust", "iid"):
            z = np.array([r["fit"][name][kind] for r in records])
            rows.append((name, kind, f"{np.std(z):.2f}", share(np.abs(z) < WITHIN), f"{np.max(np.abs(z)):.1f}"))
    heads = ("parameter", "error of the fit", "sd of (fit - truth)/error", "within 1.645 errors", "farthest")
    words = "The same data by `fit` (least squares): distance from the truth in its own standard errors, 1 if right."
    return f"{words}\n\n{table(heads, rows)}"


def warned(records: Sequence[Record]) -> str:
    """How often the program warns."""
    alarm = np.array([not r["calibrated"] for r in records])
    seen = np.array([r["misfit"] >= VISIBLE for r in records])
    misled = np.array([farthest(r) > FAR for r in records])
    return (
        f"Warned of: {share(alarm)} of all{reasons(records)}; {share(alarm[seen])} where the effect leaves "
        f"{VISIBLE:g} standard deviations of a reading or more once the model is fitted ({seen.sum()} data sets). "
        f"In {misled.sum()} some parameter is more than {FAR:g} of its standard deviations from the truth; of these "
        f"{share(alarm[misled])} are warned of."
    )


def farthest(record: Record) -> float:
    """The largest distance of any truth from the middle of its interval, in standard deviations."""
    places = record["parameters"].values()
    return max(abs(p["truth"] - (p["q05"] + p["q95"]) / 2) / p["sd"] for p in places)


def by_misfit(records: Sequence[Record]) -> str:
    """Warnings by how much of the effect the model cannot follow."""
    rows = []
    for low, high in BINS:
        mine = [r for r in records if low <= r["misfit"] < high]
        alarm = np.array([not r["calibrated"] for r in mine])
        every = np.array([inside(mine, name) for name in records[0]["parameters"]])
        rows.append((f"{low:g} to {high:g}", str(len(mine)), share(alarm),
                     f"{100 * np.mean(every):.0f} %" if mine else "-"))  # fmt: skip
    heads = ("misfit left, rms, in standard deviations of a reading", "data sets", "warned", "intervals that hold")
    return table(heads, rows)


def by_effect(records: Sequence[Record]) -> str:
    """Warnings by effect."""
    rows = []
    for name in sorted({r["left_out"] for r in records}):
        mine = [r for r in records if r["left_out"] == name]
        count = sum(not r["calibrated"] for r in mine)
        misses = ", ".join(f"{r['misfit']:.2f}" for r in mine if r["calibrated"])
        rows.append((name, f"{count} of {len(mine)}", misses or "-"))
    return table(("left out", "warned", "misfit of those without a warning"), rows)


def share(hits: np.ndarray) -> str:
    """A share with its 95 % interval (Wilson)."""
    if not len(hits):
        return "-"
    ends = stats.binomtest(int(np.sum(hits)), len(hits)).proportion_ci(method="wilson")
    return f"{100 * np.mean(hits):.1f} % ({100 * ends.low:.1f} to {100 * ends.high:.1f})"


def table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table in Markdown."""
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)
