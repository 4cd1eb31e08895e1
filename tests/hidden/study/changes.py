"""The same recording said in another way: more densely sampled, in other units, in another order."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pandas as pd

OTHER = {"ms": ("s", 1e3), "psi": ("kPa", 1 / 6.894757293168361), "in": ("mm", 1 / 25.4)}
OTHER |= {"lbf": ("N", 1 / 4.4482216152605)}
TIMES = 10


def changed(folder: Path, change: str, random: np.random.Generator) -> Path:
    """Rewrite a data set in place."""
    if change == "10x resampled":
        rewritten(folder, resampled)
    elif change == "other units":
        rewritten(folder, in_other_units)
        toml = folder / "muscle.toml"
        toml.write_text(lengths_in_inches(toml.read_text()))
    elif change == "shuffled":
        rewritten(folder, lambda table: shuffled(table, random))
    elif change != "as it is":
        raise ValueError(f"no such change: {change}")
    return folder


def rewritten(folder: Path, how) -> None:
    """Every CSV of a folder."""
    for path in folder.glob("*.csv"):
        how(pd.read_csv(path)).to_csv(path, index=False, float_format="%.12g")


def resampled(table: pd.DataFrame) -> pd.DataFrame:
    """Ten times as many samples of each run, on straight lines between those measured."""
    parts = []
    for _, run in table.groupby("run", sort=False):
        old = np.arange(len(run))
        new = np.linspace(0, len(run) - 1, TIMES * (len(run) - 1) + 1)
        parts.append(pd.DataFrame({name: np.interp(new, old, run[name]) for name in run.columns}))
    whole = pd.concat(parts, ignore_index=True)
    return whole.astype({"run": int})


def in_other_units(table: pd.DataFrame) -> pd.DataFrame:
    """Milliseconds, pounds per square inch, inches and pounds."""
    columns = {}
    for title in table.columns:
        unit = re.search(r"\[(.+)\]", title)
        new = next((name for name, (old, _) in OTHER.items() if unit and unit.group(1) == old), None)
        if new is None:
            columns[title] = table[title]
        else:
            columns[re.sub(r"\[.+\]", f"[{new}]", title)] = table[title] * OTHER[new][1]
    return pd.DataFrame(columns)


def lengths_in_inches(toml: str) -> str:
    """Every "... mm" of a muscle.toml."""

    def inches(found: re.Match) -> str:
        numbers = [f"{float(text) / 25.4:.12g}" for text in found.group(1).split("+/-")]
        return f'"{" +/- ".join(numbers)} in"'

    return re.sub(r'"([^"]+) mm"', inches, toml)


def shuffled(table: pd.DataFrame, random: np.random.Generator) -> pd.DataFrame:
    """Runs and columns in another order."""
    runs = [run for _, run in table.groupby("run", sort=False)]
    order = random.permutation(len(runs))
    columns = random.permutation(table.columns)
    return pd.concat([runs[i] for i in order], ignore_index=True)[list(columns)]
