"""What the records add up to: every measure beside its goal, with the error that counting has."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import binomtest

Record = dict[str, Any]
SAID = ("missing", "one of", "not in the library")
SEVERAL = ("single", "pair", "triple")
MIMIC = 0.1  # of the noise: what follows the truth this closely cannot be told from it by such data

# What each effect of nobody's library leaves: odd in the direction of motion or not, and its exponent in pressure.
KIND = {
    "strain_bump": (False, 0.0),
    "pressure_stair": (False, None),
    "screw_ripple": (False, 0.0),
    "pressure_squared_spring": (False, 2.0),
    "warming_gain": (False, 1.0),
    "speed_hump": (True, 0.0),
    "striped_friction": (True, 0.0),
    "pressure_speed_spring": (False, 1.0),
}
EXPONENT = 0.2


@dataclass(frozen=True)
class Score:
    """One measure: a share of `count` cases (or a plain number) with its 95 % interval, and the goal."""

    measure: str
    goal: str
    value: float
    count: int
    low: float = float("nan")
    high: float = float("nan")
    met: bool | None = None
    share: bool = True

    @property
    def words(self) -> str:
        """The value as people read it."""
        if not self.count:
            return "no case"
        if not self.share:
            return f"{self.value:.2f}"
        return f"{100 * self.value:.1f} % ({100 * self.low:.1f} to {100 * self.high:.1f})"


# ------------------------------------------------------------------------------------------------- what a record says


def answered(records: Iterable[Record]) -> list[Record]:
    """Those with a verdict."""
    return [record for record in records if "verdict" in record]


def truth(record: Record) -> list[str]:
    """What is hidden."""
    return sorted(record["hidden"])


def sets(record: Record) -> list[list[str]]:
    """The explanations named; none unless the verdict names any."""
    return [sorted(names) for names in record["explanations"]] if record["verdict"] in SAID[:2] else []


def said(record: Record) -> bool:
    """Whether something is said to be missing."""
    return record["verdict"] in SAID


def unique(record: Record) -> bool:
    """Whether one explanation is named, or one class of exact likes."""
    named = ["+".join(names) for names in sets(record)]
    return len(named) == 1 or (len(named) > 1 and any(set(named) <= set(alike) for alike in record["classes"]))


def right(record: Record) -> bool:
    """Whether the truth is named uniquely."""
    return unique(record) and truth(record) in sets(record)


def wrong(record: Record) -> bool:
    """Whether something else is named uniquely."""
    return unique(record) and truth(record) not in sets(record)


def astray(record: Record) -> bool:
    """Whether something else is named uniquely that could be told from the truth."""
    return wrong(record) and not followed(record)


def followed(record: Record) -> bool:
    """Whether what is named instead follows the truth so closely that no such data tell them apart."""
    return record.get("mimic", np.inf) < MIMIC * record["floor"]


def holds(record: Record) -> bool:
    """Whether the truth is among the explanations."""
    return truth(record) in sets(record)


def extra(record: Record) -> bool:
    """Whether what is named uniquely holds an effect that is not there."""
    return unique(record) and all(set(names) - set(truth(record)) for names in sets(record))


def missed(record: Record) -> bool:
    """Whether nothing is said although what is hidden exceeds its own printed detection limit."""
    return record["verdict"] == "nothing detectable"


def above_limit(record: Record) -> bool:
    """Whether a single effect is larger than the detection limit printed for it."""
    return len(record["hidden"]) == 1 and record.get("limit") is not None and record["misfit"] > record["limit"]


def traced(record: Record) -> bool:
    """Whether parity and pressure exponent of an unknown effect are right."""
    (name,) = record["hidden"]
    odd, exponent = KIND[name]
    found = record.get("fingerprint") or {}
    if found.get("odd") is None or (found["odd"] > 0.5) != odd:
        return False
    seen = found["odd_P" if odd else "even_P"]
    if exponent is None or record["protocol"] == "one pressure":
        return True
    return seen is not None and abs(seen - exponent) <= EXPONENT


# -------------------------------------------------------------------------------------------------------- the measures


def share(
    measure: str, goal: str, records: Sequence[Record], test: Callable[[Record], bool], least=None, most=None
) -> Score:
    """A share of the records with Wilson's interval; `least` and `most` bound the goal."""
    hits = sum(bool(test(record)) for record in records)
    if not records:
        return Score(measure, goal, float("nan"), 0)
    interval = binomtest(hits, len(records)).proportion_ci(method="wilson")
    value = hits / len(records)
    met = (least is None or value >= least) and (most is None or value <= most)
    return Score(measure, goal, value, len(records), interval.low, interval.high, met)


def number(measure: str, goal: str, values: Sequence[float], what=np.median, least=None, most=None) -> Score:
    """A statistic of numbers."""
    values = [value for value in values if np.isfinite(value)]
    if not values:
        return Score(measure, goal, float("nan"), 0, share=False)
    value = float(what(values))
    met = (least is None or value >= least) and (most is None or value <= most)
    return Score(measure, goal, value, len(values), met=met if (least, most) != (None, None) else None, share=False)


def scores(records: Sequence[Record]) -> list[Score]:
    """The whole table."""
    told = answered(records)
    return [
        *false_alarms(told), *single_effects(told), *wrong_names(told), *outsiders(told), *several(told),
        *powers(told), *left_out(told), *nexts(told), *invariances(told), *times(told), *set_apart(records),
    ]  # fmt: skip


def of(records: Iterable[Record], *groups: str) -> list[Record]:
    """Records of these groups."""
    return [record for record in records if record["group"] in groups]


def false_alarms(told: Sequence[Record]) -> list[Score]:
    """Clean data, noise by noise."""
    clean = of(told, "none")
    kinds = dict.fromkeys(record["noise"] for record in clean)
    each = [
        share(f"false alarm, {kind} noise", "<= 6 %", [r for r in clean if r["noise"] == kind], said, most=0.06)
        for kind in kinds
    ]
    unsure = share("clean data called inconclusive", "", clean, lambda r: r["verdict"] == "inconclusive")
    return [*each, unsure]


def single_effects(told: Sequence[Record]) -> list[Score]:
    """One effect of the library."""
    out = []
    single = of(told, "single")
    for words, mine, goal in [
        ("at 3 x its detection limit", [r for r in single if r["unit"] == "limit"], True),
        *((f"of {s:g} noise sigmas", [r for r in single if r["unit"] == "sigma" and r["size"] == s], False)
          for s in sorted({r["size"] for r in single if r["unit"] == "sigma"})),
    ]:  # fmt: skip
        with_set = [len(sets(r)) for r in mine if sets(r)]
        out += [
            share(f"one effect {words}: named uniquely", ">= 95 %" * goal, mine, right, least=0.95 if goal else None),
            share(f"one effect {words}: in the set", ">= 99 %" * goal, mine, holds, least=0.99 if goal else None),
            number(f"one effect {words}: mean set", "<= 1.3" * goal, with_set, np.mean, most=1.3 if goal else None),
        ]
    return out


def wrong_names(told: Sequence[Record]) -> list[Score]:
    """What must hardly ever happen."""
    single, outside = of(told, "single"), of(told, "outside")
    return [
        share("a wrong effect named uniquely, in the library", "<= 1 %", single, wrong, most=0.01),
        share("the same, less what follows the truth within 0.1 noise", "", single, astray),
        share("a wrong effect named uniquely, outside the library", "<= 3 %", outside, unique, most=0.03),
        share("the same, outside, less what follows it within 0.1 noise", "", outside, astray),
        share('"nothing" above the detection limit', "<= 1 %", list(filter(above_limit, single)), missed, most=0.01),
    ]


def outsiders(told: Sequence[Record]) -> list[Score]:
    """Effects that nobody's library has."""
    outside = of(told, "outside")
    known = lambda r: r["verdict"] == "not in the library"  # noqa: E731
    return [
        share("outside the library: said so", ">= 90 %", outside, known, least=0.9),
        *(share(f"outside the library, {s:g} sigmas: said so", "", [r for r in outside if r["size"] == s], known)
          for s in sorted({r["size"] for r in outside})),
        share("the same, but where a named effect follows it within 0.1 noise", "",
              [r for r in outside if not followed(r)], known),
        share("outside: parity and pressure exponent right", ">= 85 %", outside, traced, least=0.85),
    ]  # fmt: skip


def several(told: Sequence[Record]) -> list[Score]:
    """Two and three at once."""
    both = of(told, "pair", "triple")
    nearly = "or named what follows it within 0.1 noise"
    or_like = lambda r: holds(r) or followed(r)  # noqa: E731
    return [
        share("two at once: exact set", ">= 85 %", of(told, "pair"), right, least=0.85),
        share("two at once: in the set", "", of(told, "pair"), holds),
        share(f"two at once: in the set, {nearly}", "", of(told, "pair"), or_like),
        share("three at once: exact set", ">= 65 %", of(told, "triple"), right, least=0.65),
        share("three at once: in the set", "", of(told, "triple"), holds),
        share(f"three at once: in the set, {nearly}", "", of(told, "triple"), or_like),
        share("two or three at once: another set named uniquely", "", both, wrong),
        share("two or three at once: false extras", "<= 3 %", both, extra, most=0.03),
        share("the same, less what follows the truth within 0.1 noise", "", both,
              lambda r: extra(r) and not followed(r)),
    ]  # fmt: skip


def powers(told: Sequence[Record]) -> list[Score]:
    """At the printed detection limit."""
    power = of(told, "power")
    whole = share("power at the printed detection limit", "80 +- 5 %", power, said, least=0.75, most=0.85)
    kinds = sorted({r["protocol"] for r in power})
    return [whole, *(share(f"power, {kind}", "", [r for r in power if r["protocol"] == kind], said) for kind in kinds)]


def left_out(told: Sequence[Record]) -> list[Score]:
    """How far the error falls, over the noise that was put in."""
    ratios = [r["left_out_after"] / r["floor"] for r in of(told, *SEVERAL) if r["floor"] > 0]
    measure = "left-out error after the loop / noise put in"
    return [
        number(f"{measure}: median", "<= 1.10", ratios, np.median, most=1.1),
        number(f"{measure}: least", ">= 0.95", ratios, np.min, least=0.95),
    ]


def nexts(told: Sequence[Record]) -> list[Score]:
    """What the proposed recording does for an open tie, beside one drawn at random with as many loops."""
    tied = [r for r in of(told, "next") if r.get("proposed") and r.get("random")]
    then = lambda record, key: right(record | record[key])  # noqa: E731
    measure = "an open tie made unique, and rightly"
    return [
        share(f"{measure}, by the proposed recording", ">= 80 %", tied, lambda r: then(r, "proposed"), least=0.8),
        share(f"{measure}, by one drawn at random", "<= 45 %", tied, lambda r: then(r, "random")),
        number("power foretold for the proposed recording's worst pair", "", [r["proposed"]["power"] for r in tied]),
        number("mean set before it", "", [len(sets(r)) for r in tied], np.mean),
        number("mean set after it", "", [len(sets(r | r["proposed"])) for r in tied], np.mean),
    ]


def invariances(told: Sequence[Record]) -> list[Score]:
    """The same recording said in another way."""
    mine = of(told, "invariance")
    first = {r["number"]: r for r in mine if r["change"] == "as it is"}
    out = []
    for change in dict.fromkeys(r["change"] for r in mine if r["change"] != "as it is"):
        pairs = [r for r in mine if r["change"] == change and r["number"] in first]
        same = lambda r: verdict(r) == verdict(first[r["number"]])  # noqa: E731
        out.append(share(f"verdict unchanged, {change}", "100 %", pairs, same, least=1.0))
    return out


def verdict(record: Record) -> tuple:
    """Verdict and names, in no order."""
    return record["verdict"], frozenset(frozenset(names) for names in sets(record))


def times(told: Sequence[Record]) -> list[Score]:
    """Seconds from folder to verdict, with as many processes as the study had."""
    seconds = [r["seconds"] for r in told if r["protocol"] == "rich" and r["change"] != "10x resampled"]
    return [
        number("seconds for 10,000 samples, warm: median", "<= 8", seconds, np.median, most=8.0),
        number("seconds for 10,000 samples: 95 % below", "", seconds, lambda s: np.quantile(s, 0.95)),
        number("seconds for 10,000 samples, compilation included: most", "<= 30", seconds, np.max, most=30.0),
    ]


def set_apart(records: Sequence[Record]) -> list[Score]:
    """What has no verdict."""
    hiding = [r for r in records if r["hidden"]]
    return [
        share("cases that crashed or took too long", "0", records, lambda r: "error" in r, most=0.0),
        share(
            "cases that no sensible size would show (not diagnosed)", "", hiding, lambda r: r.get("visible") is False
        ),
    ]


# ----------------------------------------------------------------------------------------------------------- rivals


def rival_scores(records: Sequence[Record]) -> dict[str, list[Score]]:
    """Ours and theirs on the cases that all have answered."""
    mine = [record for record in answered(records) if "rivals" in record]
    names = list(mine[0]["rivals"]) if mine else []
    table = {"this program": compared(mine, program_answer)}
    return table | {name: compared(mine, lambda r, name=name: [sorted(r["rivals"][name])]) for name in names}


def program_answer(record: Record) -> list[list[str]]:
    """Sets named by the program; an empty set stands for "nothing"."""
    return sets(record) if said(record) else [[]]


def compared(records: Sequence[Record], answer: Callable[[Record], list[list[str]]]) -> list[Score]:
    """One method's scores. An exact like of the truth is as good as the truth, whoever names it."""

    def exact(record: Record) -> bool:
        alike = alikes(record)
        return bool(answer(record)) and all("+".join(names) in alike for names in answer(record))

    def named(record: Record) -> bool:
        return len(answer(record)) == 1 and bool(answer(record)[0])

    return [
        share("false alarm on clean data", "", of(records, "none"), lambda r: answer(r) != [[]]),
        share("one effect: exactly named", "", of(records, "single"), exact),
        share("one effect: others named", "", of(records, "single"), lambda r: named(r) and not exact(r)),
        share("outside: an effect of the library named", "", of(records, "outside"), named),
        share("two at once: exact", "", of(records, "pair"), exact),
        share("three at once: exact", "", of(records, "triple"), exact),
    ]


def alikes(record: Record) -> set[str]:
    """The truth, and what these data cannot tell from it at all."""
    mine = "+".join(truth(record))
    return {mine}.union(*(names for names in record["classes"] if mine in names))


# --------------------------------------------------------------------------------------------------------- confusion

ELSE = ("one of, truth among them", "one of, without the truth", "not in the library", "inconclusive", "nothing")


def named_as(record: Record) -> str:
    """Under which heading a verdict on one effect (or none) goes."""
    if right(record):
        return truth(record)[0]
    if unique(record):
        return "+".join(sets(record)[0])
    if record["verdict"] == "one of":
        return ELSE[0] if holds(record) else ELSE[1]
    return {"not in the library": ELSE[2], "inconclusive": ELSE[3]}.get(record["verdict"], ELSE[4])


def confusion(records: Sequence[Record]) -> tuple[list[str], list[str], np.ndarray]:
    """Truth by name given: labels of rows and columns, counts. Sets of several names share one column."""
    mine = of(answered(records), "none", "single", "outside")
    rows = list(dict.fromkeys("+".join(r["hidden"]) or "nothing" for r in mine))
    heads = [named_as(r) for r in mine]
    heads = ["several effects" if "+" in head else head for head in heads]
    effects = [row for row in rows if row in heads and row not in ELSE]
    others = sorted(set(heads) - set(effects) - set(ELSE) - {"several effects"})
    columns = [*effects, *others, "several effects", *ELSE]
    counts = np.zeros((len(rows), len(columns)), int)
    for record, head in zip(mine, heads, strict=True):
        counts[rows.index("+".join(record["hidden"]) or "nothing"), columns.index(head)] += 1
    return rows, columns, counts
