"""The hidden-effect benchmark itself: its plan, its sizes, its scores, and that it goes on where it stopped."""

import ast
import json
import os
import time
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from hidden.simulator import NOISES, STRANGERS, TYPICAL, Noise, Truth, write
from hidden.study import scores as tables
from hidden.study.__main__ import main
from hidden.study.cases import KINDS, PLACES, Case, chosen, plan
from hidden.study.changes import changed
from hidden.study.judge import hidden_of, judged, noise_sd
from hidden.study.kinds import ALL, kind_scores
from hidden.study.mimicry import mimic
from hidden.study.page import write_page
from hidden.study.protocols import LOOPS, OTHERS, PROTOCOLS, WHOLE
from hidden.study.run import append, records, worked
from hidden.study.sizes import RANGES, base_of, hiding, misfit, scaled, sized
from scipy.optimize import least_squares

from fitting.recordings import read_experiment

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
        assert {case.protocol for case in mine} == set(LOOPS), group
    assert {case.hidden[0] for case in cases if case.group == "outside"} == set(STRANGERS)
    assert all(len(set(case.hidden)) == {"pair": 2, "triple": 3}.get(case.group, len(case.hidden)) for case in cases)


def test_the_plan_goes_beyond_loops():
    """Every other kind of recording, clean in every noise and with everything at two sizes; behind all that was."""
    cases = plan(1)
    kinds = [case for case in cases if case.group == "kinds"]
    assert cases[-len(kinds) :] == tuple(kinds)
    assert set(LOOPS).isdisjoint(OTHERS)
    for protocol in OTHERS:
        mine = [case for case in kinds if case.protocol == protocol]
        clean = [case for case in mine if not case.hidden]
        assert len(clean) >= 6
        assert {case.noise for case in clean} == set(NOISES)
        for name in (*TYPICAL, *STRANGERS):
            assert {5.0, 10.0} <= {case.size for case in mine if case.hidden == (name,)}, (protocol, name)


def test_some_groups_can_be_asked_for():
    """Their share is what it is in the whole; clean cases come along where detection limits are needed."""
    cases = plan(1)
    part = chosen(cases, 0.1, ("kinds", "outside"))
    assert part == tuple(case for case in chosen(cases, 0.1) if case.group in ("kinds", "outside"))
    assert {case.group for case in chosen(cases, 0.1, ("single",))} == {"single", "none"}
    answer = CliRunner().invoke(main, ["--groups", "kinds,kins"])
    assert answer.exit_code == 2
    assert "no group kins; the plan has none, single" in answer.output


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
    truth += [
        HERE / "study" / f"{name}.py"
        for name in ("protocols", "sizes", "cases", "mimicry", "changes", "scores", "kinds")
    ]
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
    (recording,) = PROTOCOLS["rich"].recordings(hiding(base_of(given), given), Noise(sd=0.0))
    columns = recording.columns
    speed = np.abs(np.gradient(columns["displacement"], columns["time"]))
    kept = speed > 0.95 * np.where(columns["run"] < 5, 0.005, 0.02)

    def left(place):
        effects = {"ideal_cylinder": {}, "coulomb_friction": {"f_s": place[0]}}
        (other,) = PROTOCOLS["rich"].recordings(Truth(WHOLE, effects), Noise(sd=0.0))
        return (other.clean - recording.clean)[kept]

    found = least_squares(left, [0.01], x_scale=0.01, diff_step=1e-3)
    assert np.sqrt(np.mean(found.fun**2)) == pytest.approx(3.0, rel=0.1)


@pytest.mark.parametrize(
    ("protocol", "name"),
    [
        ("isometric", "supply_lag"),
        ("static map", "textile_friction"),
        ("static map without branches", "tip"),
        ("loops and static map", "creep"),  # only the loops show it
        ("loops and isometric", "supply_lag"),  # only the held lengths show it
    ],
)
def test_a_size_counts_every_recording(protocol, name):
    """Over all samples of the data, whichever recording shows the effect; friction refitted by scipy."""
    given = sized(protocol, name, 3.0, {}, SIGMA)
    assert given is not None
    hidden = PROTOCOLS[protocol].recordings(hiding(base_of([name]), {name: given}), Noise(sd=0.0))

    def left(place):
        effects = {"ideal_cylinder": {}, "coulomb_friction": {"f_s": place[0]}}
        plain = PROTOCOLS[protocol].recordings(Truth(WHOLE, effects), Noise(sd=0.0))
        return np.concatenate([(a.clean - b.clean)[steady(b)] for a, b in zip(plain, hidden, strict=True)])

    found = least_squares(left, [0.01], x_scale=0.01, diff_step=1e-3)
    assert np.sqrt(np.mean(found.fun**2)) == pytest.approx(3.0, rel=0.1)


def steady(recording):
    """Samples of loops at 0.01 m/s away from turning points; all of other recordings."""
    if recording.test != "loop":
        return np.ones(len(recording.clean), bool)
    return np.abs(np.gradient(recording.columns["displacement"], recording.columns["time"])) > 0.95 * 0.01


@pytest.mark.parametrize(
    ("protocol", "name"),
    [
        ("isometric", "creep"),
        ("isometric", "textile_friction"),
        ("static map", "viscous_damping"),
        ("static map without branches", "textile_friction"),
        ("sine loops", "supply_lag"),
    ],
)
def test_what_a_kind_of_recording_cannot_show_is_not_diagnosed(protocol, name):
    """Friction at rest, speed where nothing moves, a lag where the pressure is held."""
    assert judged(Case("kinds", (name,), 10.0, "sigma", "white", protocol, 0, 1), {})["visible"] is False


@pytest.mark.parametrize("protocol", OTHERS)
def test_every_kind_of_recording_is_written_and_read(protocol, tmp_path):
    """As the tests that it is said to be, with as many readings; the same seed gives the same folder."""
    truth = hiding(base_of(["tip"]), {"tip": {"k": 1.1}})
    first, again = (write(PROTOCOLS[protocol].data(truth, NOISES["ar"], 3), tmp_path / name) for name in "ab")
    read, made = read_experiment(first), PROTOCOLS[protocol].recordings(truth, NOISES["ar"], 3)
    assert [recording.test for recording in read.recordings] == [part.test for part in PROTOCOLS[protocol].parts]
    for recording, true in zip(read.recordings, made, strict=True):
        measured = np.concatenate([run.measured for run in recording.runs])
        assert len(measured) == len(true.clean), recording.test
        assert np.std(measured - true.clean) == pytest.approx(NOISES["ar"].sd, rel=0.3), recording.test
    assert all((again / path.name).read_bytes() == path.read_bytes() for path in first.iterdir())


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


def test_a_tip_is_named_though_the_length_is_held():
    """One case of the other kinds of recording; static maps have a file of their own."""
    found = judged(Case("kinds", ("tip",), 10.0, "sigma", "ar", "isometric", 0, 1), {})
    assert tables.right(found)
    assert 0.9 < found["left_out_after"] / found["floor"] < 1.1


@pytest.mark.slow
@pytest.mark.timeout(7200)
def test_a_share_of_the_study(tmp_path):
    """Two in a hundred of the plan, as `make hidden` runs it: no crash, few false names."""
    from hidden.study.run import study

    found = by_measure(study(tmp_path / "share.jsonl", 0.02, 2, quiet=True))
    assert found["cases that crashed or took too long"].value == 0
    assert found["a wrong effect named uniquely, in the library"].low < 0.05
