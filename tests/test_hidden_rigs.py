"""The hidden-effect benchmark: scores of instruments that err, of records made up for the purpose."""

import pytest
from hidden.simulator import EVERY_NOISE, LABORATORY, Truth, static, with_baseline
from hidden.simulator import dataset as data_set
from hidden.simulator import write as write_folder
from hidden.study import distance
from hidden.study.cases import Case
from hidden.study.judge import true_floor
from hidden.study.page import column_markdown, write_page
from hidden.study.protocols import PROTOCOLS, WHOLE
from hidden.study.rig_scores import WITHIN, alarm_table, rig_scores, usual
from hidden.study.run import limits_of
from test_hidden_scores import record

from fitting import read_experiment

MINE = {"instruments": "laboratory", "stated": True, "unit": "limit", "size": 3.0}


def told(hidden, verdict, explanations=(), **more):
    """A record of this group."""
    return record("instruments", hidden, verdict, explanations, **{**MINE, **more})


def by_measure(records, column="all"):
    """Scores of one column by what they measure."""
    return {score.measure: score for score in rig_scores(records)[column]}


def test_within_the_instruments_is_no_alarm_and_an_answer():
    clean = [told([], WITHIN), told([], "nothing detectable"), told([], "inconclusive"), told([], "missing", [["tip"]])]
    found = by_measure(clean)
    assert found["clean, all together: said to lack something"].value == 0.25
    assert found["clean, all together, rich: nothing detectable or within the instruments"].value == 0.5
    assert found["clean, worst kind: share said to lack something"].value == 0.25
    assert found["clean, worst kind: share said to lack something"].met is False


def test_the_worst_kind_is_the_worst():
    clean = [told([], "nothing detectable", instruments="skew") for _ in range(4)]
    clean += [told([], verdict, instruments="drift") for verdict in ("nothing detectable", "not in the library")]
    assert by_measure(clean)["clean, worst kind: share said to lack something"].value == 0.5
    table = alarm_table(clean)
    assert {score.measure: score.value for score in table["rich"]} == {"skew": 0.0, "drift": 0.5}


def test_statements_have_columns_of_their_own():
    single = [told(["tip"], "missing", [["tip"]]), told(["tip"], "missing", [["hill"]], stated=False)]
    measure = "one effect at 3 x its limit: named uniquely or as its class"
    assert [by_measure(single, key)[measure].value for key in ("all", "stated", "presumed")] == [0.5, 1.0, 0.0]


def test_power_is_that_at_the_printed_limit():
    records = [told(["tip"], verdict, size=1.0) for verdict in ("missing", "one of", "inconclusive", "missing")]
    found = by_measure(records)
    assert found["power at the printed detection limit"].value == 0.75
    assert found["one effect at 3 x its limit: in the set"].count == 0
    assert usual(records) == []


def test_several_strangers_and_kinds_alone_are_counted_apart():
    records = [
        told(["hill", "tip"], "missing", [["hill", "tip"]]),
        told(["creep", "hill", "tip"], "missing", [["hill", "tip"]]),
        told(["strain_bump"], "not in the library"),
        told(["tip"], "one of", [["tip"], ["hill"]], instruments="skew"),
    ]
    found = by_measure(records)
    assert (found["two at once: exact"].value, found["three at once: exact"].value) == (1.0, 0.0)
    assert found["outside the library: said so"].value == 1.0
    assert found["one effect at 3 x its limit: in the set"].count == 0
    assert found["one kind alone, one effect: in the set"].value == 1.0
    assert [one["group"] for one in usual(records)] == ["pair", "triple", "outside"]


def test_the_page_shows_them(tmp_path):
    records = [told([], "nothing detectable", limits={"tip": 1.0}), told(["tip"], "missing", [["tip"]])]
    write_page(records, tmp_path / "page.html", "a command")
    for name in ("page.html", "page.md"):
        assert "laboratory" in (tmp_path / name).read_text()
    assert (
        "Instruments that err, stated: one effect at 3 x its limit: in the set" in (tmp_path / "page.csv").read_text()
    )


def test_distances_are_limits_over_what_the_oracle_detects(tmp_path, monkeypatch):
    """Of the pilots only; the oracle is asked once, and not again when the study goes on."""
    asked = []
    monkeypatch.setattr(distance, "asked", lambda *key: asked.append(key) or (0.5 if key[2] == "tip" else None))
    pilot = told([], "nothing detectable", number=0, noise="ar", limits={"tip": 1.0, "creep": 2.0, "hill": None})
    old = record("none", [], "nothing detectable", number=0, noise="ar", limits={"tip": 0.6})
    found = [pilot, {**pilot, "stated": False}, {**pilot, "number": 1}, {**pilot, "noise": "white"}, old]
    for _ in range(2):
        mine = distance.distances(found, tmp_path / "oracle.jsonl")
    assert [(one.effect, one.instruments, one.stated) for one in mine] == [
        ("tip", "laboratory", True), ("tip", "laboratory", False), ("tip", "exact", False),
    ]  # fmt: skip
    assert [one.ratio for one in mine] == pytest.approx([2.0, 2.0, 1.2])
    assert sorted(asked) == [("rich", "exact", "tip"), ("rich", "laboratory", "creep"), ("rich", "laboratory", "tip")]
    table = distance.distance_scores(mine)
    assert {key: (column[0].value, column[0].met) for key, column in table.items()} == {
        "rich, laboratory, stated": (2.0, False),
        "rich, laboratory, presumed": (2.0, False),
        "rich, exact": (pytest.approx(1.2), True),
    }
    assert "| tip |  | 2.00 | 2.00 | 1.20 |" in column_markdown("Distance", table)


def test_the_oracle_is_asked_in_newtons():
    assert 0.1 < distance.asked("poor", "exact", "tip") < 0.5
    assert distance.asked("poor", "exact", "supply_lag") is None


def test_limits_belong_to_their_instruments():
    """Records from before instruments erred had exact ones."""
    old = record("none", [], "nothing detectable", number=0, limits={"tip": 1.0})
    new = told([], "nothing detectable", number=0, limits={"tip": 2.0})
    assert limits_of([old, new]) == {
        ("white", "rich", "exact", False): {"tip": 1.0},
        ("white", "rich", "laboratory", True): {"tip": 2.0},
    }


@pytest.mark.parametrize("protocol", ["poor", "isometric", "static map"])
def test_the_floor_is_noise_whatever_the_instruments_do(protocol):
    case = Case("instruments", (), 0.0, "sigma", "white", protocol, 0, 1, instruments="laboratory")
    data = PROTOCOLS[protocol].data(
        Truth(WHOLE, with_baseline()), EVERY_NOISE["white"], case.recording_seed(), LABORATORY
    )
    assert true_floor(case, data) == pytest.approx(0.6, rel=0.25)


def test_the_program_reads_the_data_sheets_that_are_written(tmp_path):
    truth = Truth(WHOLE, with_baseline())
    made = [*PROTOCOLS["poor"].recordings(truth, EVERY_NOISE["white"], 1, 60, LABORATORY)]
    made += PROTOCOLS["isometric"].recordings(truth, EVERY_NOISE["white"], 1, 60, LABORATORY)
    made.append(static(truth, instruments=LABORATORY))
    folder = write_folder(data_set(truth, made), tmp_path / "data", say_accuracy=True)
    loop, held, points = (one.accuracy for one in read_experiment(folder).recordings)
    assert loop.pressure.noise == pytest.approx(150.0)
    assert loop.pressure.resolution == pytest.approx(1e6 / 4096, rel=1e-5)
    assert loop.force.drift == pytest.approx(5 / 3600)
    assert loop.force.hysteresis == pytest.approx(5e-4)
    assert loop.skew == pytest.approx(0.005)
    assert held.position.zero_per_run == pytest.approx(1e-3)
    assert points.force.gain_per_run == pytest.approx(0.002)
