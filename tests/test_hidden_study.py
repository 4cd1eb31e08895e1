"""The hidden-effect benchmark itself: its plan, its sizes, its scores, and that it goes on where it stopped."""

import ast
import json
import os
import time
from pathlib import Path

import numpy as np
import pytest
from hidden.simulator import NOISES, STRANGERS, TYPICAL, Noise, Truth
from hidden.study import scores as tables
from hidden.study.cases import KINDS, PLACES, Case, chosen, plan
from hidden.study.changes import changed
from hidden.study.judge import hidden_of, judged, noise_sd
from hidden.study.mimicry import mimic
from hidden.study.page import write_page
from hidden.study.protocols import PROTOCOLS, WHOLE
from hidden.study.run import append, records, worked
from hidden.study.sizes import RANGES, base_of, hiding, misfit, scaled, sized
from scipy.optimize import least_squares

HERE = Path(__file__).parent / "hidden"
SIGMA = 0.6


# --------------------------------------------------------------------------------------------------------------- plan


def test_the_plan_is_fixed_by_its_seed():
    """Case by case; another seed draws other pairs and other noise."""
    one, again, other = plan(1), plan(1), plan(2)
    assert one == again
    assert len({case.id for case in one}) == len(one)
    assert [c.hidden for c in one if c.group == "pair"] != [c.hidden for c in other if c.group == "pair"]
    assert one[0].recording_seed() != other[0].recording_seed()


def test_the_plan_is_as_wide_as_promised():
    """Twenty effects and more, every size, kind of noise and protocol, none to three effects, and outside."""
    cases = plan(1)
    single = [case for case in cases if case.group == "single"]
    assert len({case.hidden for case in single}) >= 20
    assert {(case.size, case.unit) for case in single} == {(2, "sigma"), (5, "sigma"), (10, "sigma"), (3, "limit")}
    for group in ("none", "single", "outside", "pair", "triple"):
        mine = [case for case in cases if case.group == group]
        assert {case.noise for case in mine} == set(NOISES), group
        assert {case.protocol for case in mine} == set(PROTOCOLS), group
    assert {case.hidden[0] for case in cases if case.group == "outside"} == set(STRANGERS)
    assert all(len(set(case.hidden)) == {"pair": 2, "triple": 3}.get(case.group, len(case.hidden)) for case in cases)


@pytest.mark.parametrize("share", [0.02, 0.1, 0.5])
def test_a_share_is_even_and_nested(share):
    """Every group in proportion, and a larger share holds it; detection limits have their clean cases."""
    cases, small = plan(1), chosen(plan(1), share)
    assert set(small) <= set(chosen(cases, min(1.0, 2 * share)))
    for group in ("single", "power", "outside"):
        whole, part = (sum(case.group == group for case in these) for these in (cases, small))
        assert part == pytest.approx(share * whole, rel=0.15, abs=3)
    pilots = {(c.noise, c.protocol) for c in small if c.group == "none" and c.number == 0}
    assert {(c.noise, c.protocol) for c in small if c.unit == "limit"} <= pilots
    assert set(chosen(cases, 1.0)) == set(cases)


def test_noise_is_independent_of_how_it_is_said():
    """A changed recording is the same recording."""
    mine = [case for case in plan(1) if case.group == "invariance" and case.number == 0]
    assert len({case.change for case in mine}) == 4
    assert len({case.recording_seed() for case in mine}) == 1
    assert len({json.dumps(case.shapes()) for case in mine}) == 1


def test_the_truth_shares_no_code_with_the_program():
    """Neither the simulator nor what decides how much is hidden."""
    truth = [path for path in HERE.glob("*.py") if not path.name.startswith(("test_", "make_"))]
    truth += [HERE / "study" / f"{name}.py" for name in ("protocols", "sizes", "cases", "mimicry", "changes", "scores")]
    for path in truth:
        for node in ast.walk(ast.parse(path.read_text())):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            assert not any(name.split(".")[0] in ("mckibben_jax", "fitting", "jax") for name in names), path.name


# -------------------------------------------------------------------------------------------------------------- sizes


@pytest.mark.parametrize("name", ["tip", "creep", "hertz_friction", "series_compliance", "screw_ripple"])
def test_a_size_is_what_a_refit_leaves(name):
    """Checked on the whole recording, the baseline refitted by scipy."""
    given = {name: sized("rich", name, 3.0, {}, SIGMA)}
    recording = PROTOCOLS["rich"].record(hiding(base_of(given), given), Noise(sd=0.0))
    columns = recording.columns
    speed = np.abs(np.gradient(columns["displacement"], columns["time"]))
    kept = speed > 0.95 * np.where(columns["run"] < 5, 0.005, 0.02)

    def left(place):
        effects = {"ideal_cylinder": {}, "coulomb_friction": {"f_s": place[0]}}
        return (PROTOCOLS["rich"].record(Truth(WHOLE, effects), Noise(sd=0.0)).clean - recording.clean)[kept]

    found = least_squares(left, [0.01], x_scale=0.01, diff_step=1e-3)
    assert np.sqrt(np.mean(found.fun**2)) == pytest.approx(3.0, rel=0.1)


def test_sizes_stay_where_a_search_may_go():
    """Otherwise the truth could not be found; and the shapes of the plan stay there too."""
    from mckibben_jax.effect import name_of
    from mckibben_jax.effects import LIBRARY
    from mckibben_jax.parameter import parameters

    declared = {f"{name_of(kind)}.{p.name}": (p.lower, p.upper) for kind in LIBRARY for p in parameters(kind)}
    for full, (low, high) in RANGES.items():
        if full in declared:
            assert declared[full][0] <= low < high <= declared[full][1], full
    for case in plan(1)[::7]:
        for name in case.hidden:
            for key, value in scaled(name, 1.0, case.shapes()[name]).items():
                low, high = declared.get(f"{name}.{key}", (-np.inf, np.inf))
                assert low <= value <= high, (case.id, key)


def test_what_no_size_would_show_is_said():
    """A held pressure never lags."""
    case = Case("single", ("supply_lag",), 5.0, "sigma", "white", "rich", 0, 1)
    assert hidden_of(case, {})[0] is None
    assert judged(case, {})["visible"] is False


def test_limits_are_taken_from_the_clean_case():
    """Three times what was printed."""
    case = Case("single", ("tip",), 3.0, "limit", "white", "rich", 0, 1)
    hidden, target = hidden_of(case, {"tip": 0.5})
    assert target == 1.5
    assert misfit("rich", hidden, noise_sd(NOISES["white"])) == pytest.approx(1.5, rel=0.03)


def test_exact_likes_are_told_by_the_simulator():
    """A gain of the force is a gain of the pressure; a tip is no spring."""
    gain = {"force_gain": sized("rich", "force_gain", 3.0, {}, SIGMA)}
    assert mimic("rich", gain, ["pressure_gain"], SIGMA) < 1e-3
    tip = {"tip": sized("rich", "tip", 3.0, {}, SIGMA)}
    assert mimic("rich", tip, ["linear_spring"], SIGMA) > 1.0


@pytest.mark.parametrize("change", ["other units", "shuffled"])
def test_said_in_another_way_it_reads_the_same(change, tmp_path):
    """Run by run, to the digits written."""
    from hidden.simulator import write

    from fitting.recordings import read_experiment

    data = PROTOCOLS["geometry to 1 %"].data(Truth(WHOLE, base_of(())), NOISES["white"], 3)
    before = read_experiment(write(data, tmp_path / "before"))
    after = read_experiment(changed(write(data, tmp_path / "after"), change, np.random.default_rng(1)))
    runs = {run.name: run for run in after.recordings[0].runs}
    assert set(runs) == {run.name for run in before.recordings[0].runs}
    for run in before.recordings[0].runs:
        np.testing.assert_allclose(runs[run.name].measured, run.measured, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(runs[run.name].contraction, run.contraction, rtol=1e-9, atol=1e-12)
    for key, (mean, error) in before.priors.items():
        assert after.priors[key] == pytest.approx((mean, error), rel=1e-9)


# ------------------------------------------------------------------------------------------------------------- scores


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


# ---------------------------------------------------------------------------------------------------------------- run


def pretended(case, limits, rivals):
    """Stands in for a diagnosis: some cases die, some hang, the rest say what limits they were given."""
    if case.number == 3:
        os._exit(3)
    if case.number == 4:
        time.sleep(60)
    return {"id": case.id, **vars(case), "limits": {"tip": 0.5}, "given": limits, "verdict": "nothing detectable"}


def test_a_stopped_study_goes_on(tmp_path):
    """What is there is kept, a torn line is done again, and crashes and hangs are records."""
    cases = [Case("none", (), 0.0, "sigma", KINDS[0], PLACES[0], number, 1) for number in range(5)]
    cases += [Case("single", ("tip",), 3.0, "limit", KINDS[0], PLACES[0], 0, 1)]
    out = tmp_path / "study.jsonl"
    append(out, {"id": cases[1].id, **vars(cases[1]), "verdict": "kept"})
    with out.open("a") as file:
        file.write(json.dumps({"id": cases[2].id, "verdict": "torn"})[:-9])
    found = {r["id"]: r for r in worked(cases, out, 1, 8.0, 0.0, True, pretended)}
    assert list(found) == [case.id for case in cases]
    assert found[cases[1].id]["verdict"] == "kept"
    assert found[cases[2].id]["verdict"] == "nothing detectable"
    assert "died" in found[cases[3].id]["error"]
    assert "not done after 8 s" in found[cases[4].id]["error"]
    assert found[cases[5].id]["given"] == {"tip": 0.5}
    assert {r["id"] for r in records(out)} == set(found)


# ---------------------------------------------------------------------------------------------------------- diagnoses


@pytest.fixture(scope="module")
def diagnosed():
    """A handful of the plan's cases, by the same compiled functions."""
    asked = {
        "clean": Case("none", (), 0.0, "sigma", "white", "no repeats", 0, 1),
        "known": Case("single", ("bladder_neo_hookean",), 10.0, "sigma", "ar", "no repeats", 0, 1),
        "unknown": Case("outside", ("screw_ripple",), 10.0, "sigma", "white", "no repeats", 0, 1),
    }
    return {name: judged(case, {}, rivals=True) for name, case in asked.items()}


def test_a_few_cases_of_the_plan(diagnosed):
    """Nothing, one effect, one of nobody's library."""
    clean, known, unknown = (diagnosed[name] for name in ("clean", "known", "unknown"))
    assert not tables.said(clean)
    assert len(clean["limits"]) > 20
    assert tables.right(known)
    assert 0.9 < known["left_out_after"] / known["floor"] < 1.1
    assert unknown["verdict"] == "not in the library"
    assert unknown["fingerprint"]["odd"] < 0.5


def test_rivals_answer_the_same_cases(diagnosed):
    """Forward selections name the effect that is plainly there, or more; sparse regression may take one like it."""
    for name in ("bic", "ar1"):
        assert "bladder_neo_hookean" in diagnosed["known"]["rivals"][name]
    assert set(TYPICAL) >= {n for r in diagnosed.values() for names in r["rivals"].values() for n in names}


@pytest.mark.slow
@pytest.mark.timeout(7200)
def test_a_share_of_the_study(tmp_path):
    """Two in a hundred of the plan, as `make hidden` runs it: no crash, few false names."""
    from hidden.study.run import study

    found = by_measure(study(tmp_path / "share.jsonl", 0.02, 2, quiet=True))
    assert found["cases that crashed or took too long"].value == 0
    assert found["a wrong effect named uniquely, in the library"].low < 0.05
