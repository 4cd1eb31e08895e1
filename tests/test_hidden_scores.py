"""The hidden-effect benchmark: its scores and its page, of records made up for the purpose."""

import numpy as np
import pytest
from hidden.study import rival_table
from hidden.study import scores as tables
from hidden.study.kinds import ALL, kind_scores
from hidden.study.page import write_page
from hidden.study.rivals import NAMES
from hidden.study.worth import mix, worth


def record(group, hidden, verdict, explanations=(), classes=(), **more):
    """A record made by hand."""
    names = {
        "group": group,
        "hidden": list(hidden),
        "verdict": verdict,
        "explanations": [list(e) for e in explanations],
    }
    usual = {"noise": "white", "protocol": "rich", "size": 5.0, "unit": "sigma", "number": 1, "change": "as it is"}
    numbers = {"misfit": 3.0, "floor": 0.6, "left_out_after": 0.63, "seconds": 2.0, "limit": 1.0}
    return {
        "id": f"{group}/{hidden}/{more}",
        "classes": [list(c) for c in classes],
        **names,
        **usual,
        **numbers,
        **more,
    }


def by_measure(records):
    """Scores by what they measure."""
    return {score.measure: score for score in tables.scores(records)}


def test_what_counts_as_named():
    """Uniquely, as a class of exact likes, in a set, wrongly, and not at all."""
    likes = record("single", ["tip"], "one of", [["tip"], ["hill"]], [["tip", "hill"]])
    apart = record("single", ["tip"], "one of", [["tip"], ["hill"]])
    wrong = record("single", ["tip"], "missing", [["hill"]])
    assert tables.right(likes)
    assert tables.holds(apart)
    assert not tables.unique(apart)
    assert tables.wrong(wrong)
    assert tables.astray(wrong)
    assert not tables.astray({**wrong, "mimic": 0.01})
    assert tables.extra(record("pair", ["tip", "hill"], "missing", [["creep", "hill", "tip"]]))
    assert not tables.right(record("pair", ["tip", "hill"], "missing", [["tip"]]))
    assert not tables.unique(record("single", ["tip"], "not in the library"))


def test_the_table_counts_rightly():
    """Against counts made by hand, intervals against Wilson's formula."""
    clean = [record("none", [], "nothing detectable") for _ in range(9)] + [record("none", [], "missing", [["tip"]])]
    limit = {"unit": "limit", "size": 3.0}
    single = [record("single", ["tip"], "missing", [["tip"]], **limit) for _ in range(3)]
    single += [record("single", ["tip"], "nothing detectable", **limit, left_out_after=1.2)]
    lost = [{"id": "x", "group": "single", "hidden": ["tip"], "error": "crashed"}]
    found = by_measure(clean + single + lost)
    alarm = found["false alarm, white noise"]
    z, n, p = 1.959963984540054, 10, 0.1
    middle, half = (p + z**2 / 2 / n) / (1 + z**2 / n), z * np.sqrt(p * 0.9 / n + z**2 / 4 / n**2) / (1 + z**2 / n)
    assert (alarm.value, alarm.count, alarm.met) == (0.1, 10, False)
    assert (alarm.low, alarm.high) == pytest.approx((middle - half, middle + half))
    assert found["one effect at 3 x its detection limit: named uniquely"].value == 0.75
    assert found['"nothing" above the detection limit'].value == 0.25
    assert found["left-out error after the loop / noise put in: median"].value == pytest.approx(1.05)
    assert found["cases that crashed or took too long"].value == pytest.approx(1 / 15)


def test_other_kinds_are_counted_apart(tmp_path):
    """Each kind for itself and all together; never among the loops."""
    held = {"protocol": "isometric"}
    told = [record("kinds", [], verdict, **held) for verdict in ("nothing detectable", "inconclusive", "one of")]
    told += [record("kinds", ["tip"], "missing", [["tip"]], **held)]
    told += [record("kinds", ["tip"], "missing", [["hill"]], protocol="static map", mimic=0.01)]
    told += [record("kinds", ["tip"], "one of", [["hill", "tip"], ["creep", "tip"]], **held)]
    told += [record("kinds", ["screw_ripple"], "not in the library", **held)]
    told += [{"id": "x", "group": "kinds", "hidden": ["creep"], "visible": False, **held}]
    found = {kind: {s.measure: (s.value, s.count) for s in scores} for kind, scores in kind_scores(told).items()}
    assert list(found) == [ALL, "isometric", "static map"]
    assert found["isometric"]["false alarm on clean data"] == (pytest.approx(1 / 3), 3)
    assert found["isometric"]["clean data called inconclusive"] == (pytest.approx(1 / 3), 3)
    assert found["isometric"]["one effect: named uniquely"] == (0.5, 2)
    assert found["isometric"]["one effect: named, but only with others that are not there"] == (0.5, 2)
    assert found["static map"]["one effect: another named uniquely"] == (1.0, 1)
    assert found["static map"]["the same, less what follows the truth within 0.1 noise"] == (0.0, 1)
    assert found[ALL]["one effect: in the set"] == (pytest.approx(1 / 3), 3)
    assert found[ALL]["outside the library: said so"] == (1.0, 1)
    assert found["isometric"]["no sensible size would show (not diagnosed)"] == (0.25, 4)
    assert by_measure(told)["clean data called inconclusive"].count == 0
    write_page(told, tmp_path / "page.html", "make hidden")
    assert "<h2>Other kinds of recording</h2>" in (tmp_path / "page.html").read_text()
    rows = (tmp_path / "page.md").read_text().splitlines()
    assert "| other kinds of recording | goal | all of them | isometric | static map |" in rows
    assert "isometric: false alarm on clean data" in (tmp_path / "page.csv").read_text()


def test_traces_and_invariance():
    """Parity and exponent of what is unknown; the same verdict said four ways."""
    seen = {"odd": 0.1, "even_P": 1.9, "odd_P": None}
    bent = record("outside", ["pressure_squared_spring"], "not in the library", fingerprint=seen)
    assert tables.traced(bent)
    assert not tables.traced({**bent, "fingerprint": {**seen, "even_P": 1.7}})
    assert not tables.traced({**bent, "fingerprint": {**seen, "odd": 0.9}})
    ways = [record("invariance", ["tip"], "missing", [["tip"]], change=c) for c in ("as it is", "shuffled")]
    ways += [record("invariance", ["tip"], "one of", [["tip"], ["hill"]], change="other units")]
    found = by_measure(ways)
    assert found["verdict unchanged, shuffled"].value == 1.0
    assert found["verdict unchanged, other units"].value == 0.0


def test_rivals_are_counted_by_the_same_rule():
    """An exact like is right for all; a rival cannot abstain."""
    answers = {"bic": ["hill"], "ar1": []}
    told = [record("single", ["tip"], "one of", [["tip"], ["hill"]], [["tip", "hill"]], rivals=answers)]
    told += [record("none", [], "nothing detectable", rivals=answers)]
    found = tables.rival_scores(told)
    named = {method: {s.measure: s.value for s in table} for method, table in found.items()}
    assert [named[m]["one effect: exactly named"] for m in ("this program", "bic", "ar1")] == [1.0, 1.0, 0.0]
    assert [named[m]["false alarm on clean data"] for m in ("this program", "bic", "ar1")] == [0.0, 1.0, 0.0]


def test_the_page_stands_alone(tmp_path):
    """No link leaves it, and the table is beside it."""
    told = [record("none", [], "nothing detectable"), record("single", ["tip"], "missing", [["tip"]])]
    write_page(told, tmp_path / "page.html", "make hidden")
    text = (tmp_path / "page.html").read_text()
    assert "http" not in text
    assert "data:image/png;base64" in text
    assert "false alarm, white noise" in (tmp_path / "page.md").read_text()
    rows, columns, counts = tables.confusion(told)
    assert counts[rows.index("tip"), columns.index("tip")] == 1
    assert counts[rows.index("nothing"), columns.index("nothing")] == 1


def test_what_a_verdict_is_worth_is_counted_over_all_of_which_it_is_said():
    limit = {"unit": "limit", "size": 3.0}
    told = [
        record("instruments", [], "missing", [["tip"]], number=0),
        record("instruments", ["tip"], "missing", [["tip"]], **limit),
        record("instruments", ["hill"], "missing", [["tip"]], mimic=0.01, **limit),
        record("instruments", ["tip", "hill"], "one of", [["tip"], ["creep"]], **limit),
        record("instruments", ["tip", "hill"], "one of", [["tip"], ["creep"], ["hill", "tip"]], **limit),
        record("instruments", ["speed_hump"], "not in the library"),
        record("instruments", ["weight"], "nothing detectable", unit="limit", size=1.0),
        record("instruments", ["speed_hump"], "within the instruments"),
    ]
    assert mix(told) == (
        "1 with nothing hidden, 1 with one effect at its printed limit, 2 with one effect of three times its limit, "
        "2 with two or three effects of three times theirs, 2 with an effect of nobody's library"
    )
    found = [answer.split(":")[0] for *_, answer in worth(told)]
    assert found == ["1 of 3", "2 of 3", "1 of 2", "never said", "1 of 1", "0 of 2", "1 of 2"]


def test_the_table_of_rivals_counts_ties_for_the_program_and_sets_for_the_rest():
    answers = {"bic": ["tip"], "told": ["hill", "tip"]}
    told = [
        record("instruments", ["tip"], "one of", [["tip"], ["creep"]], rivals=answers),
        record("instruments", [], "nothing detectable", rivals=answers),
        record("instruments", ["strain_bump"], "not in the library", rivals=answers),
    ]
    rows = {name: rival_table.compared(told, answer) for name, answer in rival_table.answers_of(told).items()}
    counts = {name: [cell.split(":")[0] for cell in cells] for name, cells in rows.items()}
    never = "never said"
    assert counts["this program"] == ["0 of 1", "1 of 1", "1 of 1", "0 of 1", never, "0 of 1"]
    assert counts[NAMES["bic"]] == ["1 of 1", "1 of 1", "1 of 1", "1 of 1", never, "1 of 1"]
    assert counts[NAMES["told"]] == ["1 of 1", "1 of 1", "0 of 1", "0 of 1", never, "1 of 1"]
