"""The hidden-effect benchmark: its plan, and that the truth shares no code with the program."""

import ast
import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from hidden.simulator import NOISES, STRANGERS, TYPICAL, Truth, with_baseline
from hidden.study.__main__ import main
from hidden.study.cases import chosen, plan
from hidden.study.erring import MEASURED, NO_OTHER, RIGS
from hidden.study.judge import mimicked
from hidden.study.protocols import LOOPS, OTHERS, PROTOCOLS, WHOLE

from fitting.library.library import library

HERE = Path(__file__).parent / "hidden"


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


def test_the_plan_hides_every_effect_that_a_verdict_may_name():
    """But slack: where a tube buckles is no size that loops can be given. Ogden's rubber was once forgotten."""
    named = {n for n, kind in library(None).items() if not (kind.rival or kind.on_request)} - set(with_baseline())
    assert named - set(TYPICAL) == {"slack"}
    assert {case.hidden[0] for case in plan(1) if case.group == "single"} == set(TYPICAL)


def test_a_set_that_the_simulator_does_not_know_is_followed_by_nothing():
    """The study of one recording broke off."""
    case = next(case for case in plan(1) if case.group == "single" and case.protocol == "rich")
    record = {"hidden": list(case.hidden), "verdict": "missing", "explanations": [["slack"]], "classes": []}
    assert mimicked(case, {case.hidden[0]: dict(TYPICAL[case.hidden[0]])}, record) == {}


def test_the_plan_goes_beyond_loops():
    """Every other kind of recording, clean in every noise and with everything at two sizes; behind all that was."""
    cases = plan(1)
    kinds = [case for case in cases if case.group == "kinds"]
    loops_only = [case.group not in ("kinds", "instruments") for case in cases]
    assert loops_only == sorted(loops_only, reverse=True)
    assert set(LOOPS).isdisjoint(OTHERS)
    for protocol in OTHERS:
        mine = [case for case in kinds if case.protocol == protocol]
        clean = [case for case in mine if not case.hidden]
        assert len(clean) >= 6
        assert {case.noise for case in clean} >= set(NOISES)
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
    assert "no kins; the plan has none, single" in answer.output
    answer = CliRunner().invoke(main, ["--instruments", "laboratory,lab"])
    assert "no lab; the plan has exact" in answer.output


@pytest.mark.parametrize("share", [0.02, 0.1, 0.5])
def test_a_share_is_even_and_nested(share):
    """Every group in proportion, and a larger share holds it; detection limits have their clean cases."""
    cases, small = plan(1), chosen(plan(1), share)
    assert set(small) <= set(chosen(cases, min(1.0, 2 * share)))
    for group in ("single", "power", "outside"):
        whole, part = (sum(case.group == group for case in these) for these in (cases, small))
        assert part == pytest.approx(share * whole, rel=0.15, abs=3)
    pilots = {c.place for c in small if c.group in ("none", "instruments") and not c.hidden and c.number == 0}
    assert {c.place for c in small if c.unit == "limit"} <= pilots
    assert set(chosen(cases, 1.0)) == set(cases)


def test_the_plan_has_instruments_that_err():
    """200 clean recordings of each kind that shows in every protocol, the data sheets stated in half of them."""
    mine = [case for case in plan(1) if case.group == "instruments"]
    clean = [case for case in mine if not case.hidden]
    assert {case.instruments for case in clean} == set(RIGS)
    assert sum(case.instruments == "laboratory" for case in clean) == 200
    assert sum(case.stated for case in clean if case.instruments == "laboratory") == 100
    single = [case for case in mine if len(case.hidden) == 1 and case.unit == "limit"]
    assert len({case.hidden for case in single if case.instruments == "laboratory"}) >= 20
    assert len({(case.hidden, case.instruments) for case in single}) >= 20 * 10
    assert not any(case.stated for case in mine if case.instruments == "exact")


def test_a_statement_changes_neither_noise_nor_draws_and_has_a_record_of_its_own():
    mine = [case for case in plan(1) if case.group == "instruments" and case.number == 3 and not case.hidden]
    rich = [case for case in mine if case.protocol == "rich" and case.instruments in ("laboratory", "drift")]
    assert len({case.id for case in rich}) == 4
    assert len({case.recording_seed() for case in rich}) == 1


@pytest.mark.parametrize("protocol", MEASURED)
def test_kinds_left_out_of_a_protocol_change_nothing_there(protocol):
    """What is called idle is idle, and what is not shows."""
    truth = Truth(WHOLE, with_baseline())
    exact, *others = (PROTOCOLS[protocol].recordings(truth, NOISES["ar"], 3, 60, rig)[0] for rig in RIGS.values())
    for rig, other in zip(list(RIGS)[1:], others, strict=True):
        same = all(np.array_equal(exact.columns[key], other.columns[key]) for key in exact.columns if key != "branch")
        assert same == (rig in NO_OTHER[protocol]), rig


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
        for name in (
            "protocols",
            "sizes",
            "cases",
            "mimicry",
            "changes",
            "scores",
            "kinds",
            "erring",
            "rig_scores",
            "distance",
        )
    ]
    for path in truth:
        for node in ast.walk(ast.parse(path.read_text())):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            assert not any(name.split(".")[0] in ("mckibben_jax", "fitting", "jax") for name in names), path.name
