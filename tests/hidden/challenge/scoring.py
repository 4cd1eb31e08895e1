"""Score a program's answers against the truth."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

NAMES = ("missing", "one of")  # verdicts that name explanations
ALARMS = (*NAMES, "not in the library")  # verdicts that say that something is missing
VERDICTS = (*ALARMS, "nothing detectable", "within the instruments", "inconclusive")
Z = 1.959963984540054  # 95 % of a normal distribution, both sides


@dataclass(frozen=True)
class Case:
    """One case: its truth, and what was answered (None: no valid answer)."""

    name: str
    effects: frozenset[str]
    in_library: bool
    sizes: dict[str, float]
    answer: dict | None

    @property
    def verdict(self) -> str:
        """The verdict, or "no answer"."""
        return self.answer["verdict"] if self.answer else "no answer"

    @property
    def named(self) -> set[frozenset[str]]:
        """The explanations that the verdict names; none with a verdict that names none."""
        return {frozenset(names) for names in self.answer["explanations"]} if self.verdict in NAMES else set()


@dataclass(frozen=True)
class Measure:
    """A count out of `cases` with Wilson's 95 % interval of the share."""

    name: str
    count: int
    cases: int

    @property
    def interval(self) -> tuple[float, float]:
        """Wilson 1927; the whole range where there is no case."""
        if not self.cases:
            return 0.0, 1.0
        share, n = self.count / self.cases, self.cases
        middle = (share + Z**2 / (2 * n)) / (1 + Z**2 / n)
        half = Z / (1 + Z**2 / n) * math.sqrt(share * (1 - share) / n + Z**2 / (4 * n**2))
        return max(middle - half, 0.0), min(middle + half, 1.0)


def valid_answer(path: Path) -> dict | None:
    """The answer, or None where it is missing or not in the format: no valid answer counts against the program."""
    try:
        answer = json.loads(path.read_text())
    except (OSError, ValueError):
        return None
    if not isinstance(answer, dict) or answer.get("verdict") not in VERDICTS:
        return None
    explanations = answer.setdefault("explanations", [])
    sound = isinstance(explanations, list) and all(
        isinstance(names, list) and names and all(isinstance(name, str) for name in names) for names in explanations
    )
    return answer if sound and (explanations or answer["verdict"] not in NAMES) else None


def read_cases(truth: dict[str, dict], answers: Path) -> list[Case]:
    """Truth and answer of every case."""
    return [
        Case(
            name,
            frozenset(entry["effects"]),
            entry.get("in_library", True),
            entry.get("sizes", {}),
            valid_answer(answers / f"{name}.json"),
        )
        for name, entry in sorted(truth.items())
    ]


def outcome(case: Case) -> str:
    """What became of one case, in the words of the README's table."""
    if case.answer is None:
        return "no answer"
    if not case.effects:
        return "false alarm" if case.verdict in ALARMS else "silent on a clean case"
    if case.verdict == "not in the library":
        return "not in the library, wrongly" if case.in_library else "not in the library, right"
    if not case.named:
        return "nothing said"
    holds = case.in_library and case.effects in case.named
    if len(case.named) == 1:
        return "named exactly" if holds else "wrong alone"
    return "tied set contains" if holds else "tied set without the truth"


def estimates(case: Case) -> dict[str, tuple[float, float, float]]:
    """(true, estimated, standard error) of each stated size: where one effect is hidden and it is among those named."""
    if len(case.effects) != 1 or case.effects not in case.named:
        return {}
    (effect,) = case.effects
    given = ((case.answer or {}).get("effects", {}).get(effect) or {}).get("estimate") or {}
    sizes = {full: (value, given.get(full.split(".", 1)[-1])) for full, value in case.sizes.items()}
    return {full: (value, *map(float, pair[:2])) for full, (value, pair) in sizes.items() if usable(pair)}


def usable(pair: object) -> bool:
    """Whether an estimate is [value, standard error], both finite numbers."""
    numbers = isinstance(pair, list) and len(pair) >= 2 and all(isinstance(one, int | float) for one in pair[:2])
    return numbers and bool(np.all(np.isfinite(pair[:2])))  # type: ignore[index]


def covered(row: tuple[float, float, float]) -> bool:
    """Whether the 95 % interval of an estimate holds the true value."""
    true, value, error = row
    return abs(value - true) <= Z * error


def counted(name: str, cases: Iterable[Case], test: Callable[[Case], bool]) -> Measure:
    """How many of the cases pass the test."""
    results = [test(case) for case in cases]
    return Measure(name, sum(results), len(results))


def measures(cases: list[Case]) -> list[Measure]:
    """All measures. A case without a valid answer stays in the number of cases."""
    clean = [case for case in cases if not case.effects]
    hidden = [case for case in cases if case.effects]
    known = [case for case in hidden if case.in_library]
    unknown = [case for case in hidden if not case.in_library]
    rows = [row for case in known for row in estimates(case).values()]
    return [
        counted("named exactly", known, lambda case: outcome(case) == "named exactly"),
        counted("tied set contains the truth", known, lambda case: outcome(case) == "tied set contains"),
        counted("tied set without the truth", hidden, lambda case: outcome(case) == "tied set without the truth"),
        counted("wrong alone", hidden, lambda case: outcome(case) == "wrong alone"),
        counted("nothing said", hidden, lambda case: outcome(case) == "nothing said"),
        counted("false alarm on clean", clean, lambda case: outcome(case) == "false alarm"),
        counted('"not in the library" right', unknown, lambda case: outcome(case) == "not in the library, right"),
        counted('"not in the library" wrong', known, lambda case: outcome(case) == "not in the library, wrongly"),
        counted("no valid answer", cases, lambda case: case.answer is None),
        Measure("95 % interval covers the size", sum(map(covered, rows)), len(rows)),
    ]


def table(cases: list[Case]) -> str:
    """The measures, and below them every case, as text."""
    lines = [f"{'measure':<32}{'count':>9}   share (95 % interval)"]
    for one in measures(cases):
        low, high = one.interval
        share = f"{one.count / one.cases:4.0%} ({low:.0%} to {high:.0%})" if one.cases else "no case"
        lines.append(f"{one.name:<32}{one.count:>4} / {one.cases:<3}  {share}")
    lines += ["", f"{'case':<10}{'hidden':<30}{'outcome':<30}verdict"]
    for case in cases:
        said = " or ".join("+".join(sorted(names)) for names in sorted(case.named, key=sorted))
        hidden = "+".join(sorted(case.effects)) or "nothing"
        lines.append(f"{case.name:<10}{hidden:<30}{outcome(case):<30}{case.verdict}{': ' + said if said else ''}")
    return "\n".join(lines)


def score_record(cases: list[Case]) -> dict:
    """The same for other programs."""
    rows = {
        one.name: {"count": one.count, "cases": one.cases, "interval": list(one.interval)} for one in measures(cases)
    }
    each = {
        case.name: {"outcome": outcome(case), "verdict": case.verdict, "estimates": estimates(case)} for case in cases
    }
    return {"measures": rows, "cases": each}
