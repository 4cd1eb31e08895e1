"""The result as a page that needs nothing else, and as a table in Markdown and CSV."""

from __future__ import annotations

import base64
import csv
import io
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jinja2 import Environment

from .distance import Distance, distance_scores
from .kinds import kind_scores, named_kinds
from .rig_scores import alarm_table, named_rigs, rig_scores, usual
from .rivals import NAMES
from .scores import ELSE, KIND, Record, Score, answered, confusion, holds, right, rival_scores, scores, sets, wrong

MOST_WRONG = 60
Section = tuple[str, str, dict[str, list[Score]]]  # title, explanation, columns of scores
ERR, ALARMS = "Instruments that err", "Clean recordings said to lack something, by kind of instrument"
RIVALS, ORACLE = "Instruments that err: the same cases by other methods", "Distance to the oracle"
RIGS_TEXT = """Gauges, load cells and rulers that err as those of laboratories do; all other tables have exact
instruments. Columns: with the data sheets stated in muscle.toml, and with accuracies presumed by the program."""
ALARMS_TEXT = (
    """Each kind alone, all together ("laboratory"; a ripple that no gauge shows is no part of it), and half of that."""
)
RIVALS_TEXT = """All kinds of error together."""
ORACLE_TEXT = """The printed detection limit over the size that an oracle with the same accuracies detects with power
0.8; it knows the family of the effect and the covariance of the noise, and like the program it judges by no reading
next to a turning point and lets friction differ by 2 % from run to run. Who does not know the family cannot be below
1.26: a smaller number says that the printed limit promises more than the recording holds."""
FALSE = "#c00000"  # what was named wrongly, or not at all
HEADS = (
    "one effect, % of cases",
    "cases",
    "unique",
    "in the set",
    "wrong",
    "nothing",
    "inconclusive",
    "not in library",
)

PAGE = """<!doctype html><html lang="en"><meta charset="utf-8"><title>Hidden effects</title>
<style>
body {font: 15px/1.45 system-ui, sans-serif; max-width: 76rem; margin: 2rem auto; padding: 0 1rem; color: #222}
table {border-collapse: collapse; margin: 1rem 0} th, td {text-align: left; padding: .2rem .8rem .2rem 0}
tr {border-bottom: 1px solid #ddd} .yes {color: #14743b} .no {color: #b3261e} img {max-width: 100%}
td.n {text-align: right; font-variant-numeric: tabular-nums} code {background: #f3f3f3; padding: .1rem .3rem}
</style>
<h1>Hidden effects: how often is the verdict right?</h1>
<p>{{ count }} simulated recordings with something hidden in them, or nothing, by a simulator that shares no code with
the program. Intervals are 95 % (Wilson). <code>{{ command }}</code></p>
<p><b>{{ asked | selectattr("met") | list | length }} of {{ asked | length }} goals met</b>
{%- if asked | length < goals | length %}; the other {{ goals | length - asked | length }} have no case{% endif %}.</p>
{% for part in (goals, others) %}
<table><tr><th>measure<th>{{ "goal" if loop.first else "" }}<th>reached<th>cases<th></tr>
{% for s in part %}<tr><td>{{ s.measure }}<td>{{ s.goal }}<td>{{ s.words }}<td class="n">{{ s.count }}
<td>{% if s.goal and s.met is not none %}
<span class="{{ 'yes' if s.met else 'no' }}">{{ 'met' if s.met else 'not met' }}</span>{% endif %}</tr>
{% endfor %}</table>{% endfor %}
{% if kinds %}<h2>Other kinds of recording</h2>
<p>Isometric tests, static maps, loops with either, and loops driven by a sine; the tables above count them only
among those that crashed or were not diagnosed. Shares of cases, and how many cases there were.</p>
<table><tr><th>measure{% for kind in kinds %}<th>{{ kind }}{% endfor %}</tr>
{% for row in kind_rows %}<tr><td>{{ row[0].measure }} {{ row[0].goal }}{% for s in row %}
<td>{{ counted(s) }}{% endfor %}</tr>
{% endfor %}</table>{% endif %}
{% for title, text, columns, rows in rigs %}<h2>{{ title }}</h2>
<p>{{ text }}</p>
<table><tr><th>measure{% for column in columns %}<th>{{ column }}{% endfor %}</tr>
{% for row in rows %}<tr><td>{{ row[0].measure }} {{ row[0].goal }}{% for s in row %}
<td>{{ counted(s) }}{% endfor %}</tr>
{% endfor %}</table>{% endfor %}
{% if picture %}<h2>What was hidden, and what was named</h2>
<p>Counts; red is what must not happen. An exact like of the truth counts as the truth. The lowest rows are in nobody's
library.</p>
<img alt="confusion matrix" src="data:image/png;base64,{{ picture }}">{% endif %}
{% if rivals %}<h2>The same cases by other methods</h2>
<table><tr><th>measure{% for name in rivals %}<th>{{ names.get(name, name) }}{% endfor %}<th>cases</tr>
{% for row in rows %}<tr><td>{{ row[0].measure }}{% for s in row %}<td>{{ s.words }}{% endfor %}
<td class="n">{{ row[0].count }}</tr>{% endfor %}</table>{% endif %}
<h2>By kind of noise, protocol and size</h2>
<table><tr>{% for head in heads %}<th>{{ head }}{% endfor %}</tr>
{% for row in breakdown %}<tr><td>{{ row[0] }}{% for v in row[1:] %}<td class="n">{{ v }}{% endfor %}</tr>
{% endfor %}</table>
<h2>Wrong names and crashes, one by one</h2>
<table><tr><th>case<th>said</tr>
{% for id, words in failures %}<tr><td><code>{{ id }}</code><td>{{ words }}</tr>{% endfor %}</table>
</html>"""


def write_page(records: Sequence[Record], path: Path, command: str, oracle: Sequence[Distance] = ()) -> str:
    """Write PATH, and beside it .md and .csv; returns their names in words. `oracle`: distances to it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    table, rivals, kinds = scores(records), rival_scores(records), kind_scores(records)
    rigs = rig_tables(records, oracle)
    page = Environment(autoescape=True).from_string(PAGE)
    path.write_text(
        page.render(
            count=len(records),
            command=command,
            goals=[score for score in table if score.goal],
            asked=[score for score in table if score.goal and score.count],
            others=[score for score in table if not score.goal],
            kinds=list(kinds),
            counted=counted,
            kind_rows=list(zip(*kinds.values(), strict=True)),
            rigs=[(title, text, list(one), list(zip(*one.values(), strict=True))) for title, text, one in rigs],
            picture=base64.b64encode(picture(records)).decode(),
            rivals=list(rivals) if len(rivals) > 1 else [],
            rows=list(zip(*rivals.values(), strict=True)),
            names=NAMES,
            heads=HEADS,
            breakdown=breakdown(records),
            failures=failures(records),
        )
    )
    path.with_suffix(".md").write_text(
        markdown(table, command) + column_markdown("other kinds of recording", kinds) + rig_markdown(rigs)
    )
    more = [score for title, _, one in rigs if title != RIVALS for score in named_rigs(title, one)]
    write_csv([*table, *named_kinds(kinds), *more], path.with_suffix(".csv"))
    return f"{path}, {path.with_suffix('.md').name}, {path.with_suffix('.csv').name}"


def markdown(table: Sequence[Score], command: str) -> str:
    """The scores as a Markdown table."""
    rows = [f"| {s.measure} | {s.goal} | {s.words} | {s.count} |" for s in table]
    head = ["| measure | goal | reached (95 % interval) | cases |", "|---|---|---|---|"]
    return "\n".join([f"`{command}`", "", *head, *rows]) + "\n"


def rig_tables(records: Sequence[Record], oracle: Sequence[Distance] = ()) -> list[Section]:
    """What was measured with instruments that err, and how far from the oracle the program is."""
    tables = [
        (ERR, RIGS_TEXT, rig_scores(records)),
        (ALARMS, ALARMS_TEXT, alarm_table(records)),
        (RIVALS, RIVALS_TEXT, rival_scores(usual(records))),
        (ORACLE, ORACLE_TEXT, distance_scores(oracle)),
    ]
    return [(title, text, table) for title, text, table in tables if table and (len(table) > 1 or title != RIVALS)]


def rig_markdown(sections: Sequence[Section]) -> str:
    """The same as Markdown tables."""
    return "".join(column_markdown(title, table) for title, _, table in sections)


def column_markdown(title: str, kinds: dict[str, list[Score]]) -> str:
    """Scores of several columns: a row for each measure."""
    if not kinds:
        return ""
    head = [f"| {title} | goal | {' | '.join(kinds)} |", "|---" * (2 + len(kinds)) + "|"]
    cells = [[row[0].measure, row[0].goal, *map(counted, row)] for row in zip(*kinds.values(), strict=True)]
    return "\n".join(["", *head, *(f"| {' | '.join(row)} |" for row in cells)]) + "\n"


def counted(score: Score) -> str:
    """A share and the number of cases that it rests on; a plain number alone."""
    if not score.count:
        return "-"
    return f"{score.words} of {score.count}" if score.share else score.words


def write_csv(table: Sequence[Score], path: Path) -> None:
    """The scores for machines."""
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["measure", "goal", "value", "low", "high", "cases", "met"])
        writer.writerows([s.measure, s.goal, s.value, s.low, s.high, s.count, s.met] for s in table)


def failures(records: Sequence[Record]) -> list[tuple[str, str]]:
    """What a maintainer looks at first."""
    crashed = [(r["id"], r["error"]) for r in records if "error" in r]
    told = [r for r in answered(records) if r["hidden"] and wrong(r)]
    named = [(r["id"], f"{r['verdict']}: {' | '.join('+'.join(s) for s in sets(r))}") for r in told]
    return [*crashed, *named][:MOST_WRONG]


def breakdown(records: Sequence[Record]) -> list[list]:
    """Single effects by noise, protocol and size, in per cent."""
    single = [r for r in answered(records) if r["group"] == "single"]
    rows = []
    for key in ("noise", "protocol", "size", "hidden"):
        for value in dict.fromkeys(str(r[key]) + r["unit"] * (key == "size") for r in single):
            mine = [r for r in single if str(r[key]) + r["unit"] * (key == "size") == value]
            rows.append([words(key, value), len(mine), *outcomes(mine)])
    return rows


def words(key: str, value: str) -> str:
    """A row's label."""
    if key == "hidden":
        return value.strip("[]'")
    return f"{key}: {value}".replace("sigma", " sigma").replace("limit", " x limit")


def outcomes(mine: Sequence[Record]) -> list[str]:
    """Shares of what can be said."""
    counts = [
        sum(map(right, mine)),
        sum(map(holds, mine)),
        sum(map(wrong, mine)),
        *(sum(r["verdict"] == v for r in mine) for v in ("nothing detectable", "inconclusive", "not in the library")),
    ]
    return [f"{100 * count / len(mine):.0f}" for count in counts]


def false_name(row: str, column: str) -> bool:
    """Whether a cell counts what must not happen."""
    return column not in (row, *ELSE) or (column == "nothing" != row)


def picture(records: Sequence[Record]) -> bytes:
    """The confusion matrix as PNG: each row's shares, counts written in; empty without cases of its groups."""
    from matplotlib.figure import Figure

    rows, columns, counts = confusion(records)
    if not rows:
        return b""
    figure = Figure(figsize=(2.5 + 0.3 * max(len(columns), 8), 2 + 0.27 * max(len(rows), 6)), layout="constrained")
    axes = figure.subplots()
    axes.imshow(counts / counts.sum(axis=1, keepdims=True), cmap="Blues", vmin=0, vmax=1, aspect="auto")
    for i, j in zip(*np.nonzero(counts), strict=True):
        strong = counts[i, j] > 0.6 * counts[i].sum()
        ink = FALSE if false_name(rows[i], columns[j]) else "white" if strong else "black"
        axes.text(j, i, str(counts[i, j]), ha="center", va="center", fontsize=7, color=ink, weight="bold")
    axes.axvline(len(columns) - len(ELSE) - 0.5, color="grey", linewidth=0.8)
    axes.axhline(sum(row not in KIND for row in rows) - 0.5, color="grey", linewidth=0.8)
    axes.set_xticks(range(len(columns)), [c.replace("_", " ") for c in columns], rotation=60, ha="right", fontsize=8)
    axes.set_yticks(range(len(rows)), [r.replace("_", " ") for r in rows], fontsize=8)
    axes.set_xlabel("named uniquely, or what was said instead")
    axes.set_ylabel("hidden")
    kept = io.BytesIO()
    figure.savefig(kept, format="png", dpi=110)
    return kept.getvalue()
