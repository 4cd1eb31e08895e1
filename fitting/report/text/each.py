"""What came of many data sets: a row of the table for each, and in words."""

from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np
from rich.console import RenderableType

from fitting import showing
from fitting.report.settings import SHOWN
from fitting.report.text.amounts import amount, percent
from fitting.report.text.layout import columns, line, lines
from fitting.report.text.names import mark, marked
from fitting.study.data_sets import DataSet

NOT_USED, NOT_CONVERGED = "cannot be used", "not converged"

Result = dict[str, Any]


def outcome(result: Result) -> str:
    """One word on a data set: its verdict, or whether it was fitted."""
    if "error" in result:
        return NOT_USED
    if not result.get("converged", True):
        return NOT_CONVERGED
    return result.get("verdict") or "fitted"


def row(one: DataSet, result: Result) -> dict[str, Any]:
    """A data set's row of the table: SI, with the unit in the column's head."""
    told: dict[str, Any] = {"data set": one.name, "path": one.path, "outcome": outcome(result)}
    if "error" in result:
        return told | {"message": result["error"]["message"]}
    rmse, full, unit = _errors(result)
    told |= {f"rmse [{unit}]": rmse, f"full scale [{unit}]": full}
    if "verdict" in result:
        sets = [" + ".join(names) for names in result["explanations"]]
        lead = result["leading"]
        told |= {"explanations": " | ".join(sets), "leading": " | ".join(lead["effects"]) if lead else "",
                 "p value": result["p_value"], "rests on": result["rests_on"]}  # fmt: skip
    for name, p in result.get("parameters", {}).items():
        told |= {f"{name} [{p['unit']}]": p["value"], f"{name} robust error [{p['unit']}]": p["robust_error"],
                 f"{name} state": p["state"]}  # fmt: skip
    return told


def _errors(result: Result) -> tuple[float | None, float | None, str]:
    """Root mean square error and full scale, and their unit: m where only positions were measured."""
    told = result.get("comparison", result)
    unit = "m" if all(recording["unit"] == "m" for recording in told["by_recording"]) else "N"
    return *(told.get(f"{key}_{unit}", told[f"{key}_N"]) for key in ("rmse", "full_scale")), unit


# On the terminal -----------------------------------------------------------------------------------------------------


def report(sets: Sequence[DataSet], results: Sequence[Result]) -> list[RenderableType]:
    """How many came out how, the data sets with the largest errors, what the parameters are, which cannot be used."""
    counts = Counter(outcome(result) for result in results)
    shown: list[RenderableType] = [line("RESULT", _counted(counts, len(sets)), "bold")]
    missing = Counter(text for result in results for text in _missing(result))
    shown += lines("MISSING", (f"{names}: {count}" for names, count in missing.most_common(SHOWN.folders)))
    if any("error" not in result for result in results):
        shown.append(_table(sets, results))
    shown += _parameters(results)
    bad = [f"{result['error']['message']}" for result in results if "error" in result]
    shown += lines("NOT USED", bad[: SHOWN.folders], "yellow")
    more = len(bad) - SHOWN.folders
    return shown + ([line("", f"... and {more} more: see the table")] if more > 0 else [])


def _counted(counts: Counter[str], total: int) -> str:
    parts = ", ".join(f"{count} {word}" for word, count in counts.most_common())
    return f"{total} data set{'s' * (total != 1)}, each on its own: {parts}"


def _missing(result: Result) -> list[str]:
    """What a diagnosis found to be missing, alone or as one of several."""
    if result.get("verdict") not in ("missing", "one of"):
        return []
    return [" or ".join(marked(names, " + ") for names in result["explanations"])]


def _table(sets: Sequence[DataSet], results: Sequence[Result]) -> RenderableType:
    good = [(one, result) for one, result in zip(sets, results, strict=True) if "error" not in result]
    ranked = sorted(good, key=lambda pair: -_share(pair[1]))
    table = columns("data set", "error, rms", "of full scale", "outcome", words=(0, 3))
    for one, result in ranked[: SHOWN.folders]:
        rmse, full, unit = _errors(result)
        size = percent(_share(result)) if full else "-"
        table.add_row(one.name, amount(rmse, unit), size, ": ".join([outcome(result), *_missing(result)]))
    if len(ranked) > SHOWN.folders:
        table.add_row(f"... and {len(ranked) - SHOWN.folders} with less error", "", "", "")
    return table


def _share(result: Result) -> float:
    rmse, full, _ = _errors(result)
    return rmse / full if rmse is not None and full else 0.0


def _parameters(results: Sequence[Result]) -> list[RenderableType]:
    """How the fitted parameters differ from data set to data set."""
    values: dict[tuple[str, str], list[float]] = {}
    for result in results:
        for name, p in result.get("parameters", {}).items():
            if p["state"] == "fitted" and p["value"] is not None:
                values.setdefault((name, p["unit"]), []).append(p["value"])
    several = {key: found for key, found in values.items() if len(found) > 1}
    if not several:
        return []
    table = columns("parameter", "data sets", "least", "median", "largest")
    for (name, unit), found in list(several.items())[: SHOWN.folders]:
        table.add_row(
            mark(name), str(len(found)), *(showing.show(x, unit) for x in np.quantile(found, (0.0, 0.5, 1.0)))
        )
    return [table]
