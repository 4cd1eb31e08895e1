"""Every text on a terminal of 80 columns: no line is longer, no identifier is split, no bar is cut."""

import dataclasses
import re
from types import SimpleNamespace

import pytest
from click.testing import CliRunner
from rich.console import Console
from studied import nothing_missing, seen_through

from fitting.cli.main import COMMANDS, main
from fitting.diagnosis.findings import Attempt, GroupKind, Objection, RestsOn
from fitting.diagnosis.outcomes import Reason, Verdict
from fitting.diagnosis.record import Evidence, Explanation
from fitting.evidence.sessions import GrowingEvidence, Weighed
from fitting.problem.estimate import Estimate
from fitting.report.text.alike import known_report
from fitting.report.text.catalogue import effect_report, effects_report
from fitting.report.text.comparison import comparison_report
from fitting.report.text.diagnosis import diagnosis_report
from fitting.report.text.equations import equation_report, equations_report
from fitting.report.text.fit import fit_report
from fitting.report.text.layout import columns, spaced
from fitting.report.text.names import mark
from fitting.report.text.plan import plan_report
from fitting.report.text.selftest import selftest_report
from fitting.report.text.sessions import sessions_report
from fitting.report.text.study import opening, step_report, steps_report
from fitting.report.text.warm import warm_report
from fitting.selftest.record import Outcome, SelfTest, Sought, Trial
from fitting.study.plan import Plan
from fitting.study.stages import Stage
from mckibben_jax import LIBRARY, SUPPLIES, name_of, parameters, title_of
from mckibben_jax.laws.review import EQUATIONS

KINDS = (*LIBRARY, *SUPPLIES)
LONGEST = tuple(sorted(map(name_of, KINDS), key=len)[-4:])


def printed(shown, width):
    """What a terminal of so many columns shows."""
    out = Console(width=width, record=True, file=open("/dev/null", "w"), highlight=False, markup=False)  # noqa: SIM115
    for part in shown:
        out.print(part)
    return out.export_text()


def holds_in_80_columns(shown):
    """The text at 80 columns, and beside it at a width at which nothing needs to be broken."""
    narrow, wide = printed(shown, 80), printed(shown, 1000)
    assert max(len(line.rstrip()) for line in narrow.splitlines()) <= 80
    assert "⟦" not in narrow  # names are said, not marked
    split = {word for word in identifiers(narrow) if word not in identifiers(wide)}
    assert not split
    assert set(re.findall("█+", narrow)) <= set(re.findall("█+", wide))
    return narrow


def identifiers(text):
    """Every name with an underscore, with what stands around it up to the next space: a part of one is another."""
    return {word for word in re.findall(r"[\w.@]+", text) if "_" in word}


@pytest.mark.parametrize("width", [80, 90, 100, 110, 120, 140])
def test_a_remark_in_the_last_column_is_broken_and_never_cut(width):
    """Beside columns of numbers and long names, of which some are given up where there is no room."""
    remark = "explains the data, and so does its special case bladder_neo_hookean"
    table = columns("effect added", "RMS", "held out", "smallest", "most similar", "", words=(0, 4, 5), spare=(4, 3))
    for name in ("bladder_mooney_rivlin", "tip"):
        table.add_row(mark(name), "0.592 N", "0.595 N", "0.332 N", "bladder_neo_hookean 1.00", remark)
    words = printed([spaced(table)], width).split()
    assert all(words.count(word) >= 2 for word in remark.split())


def test_the_head_of_a_number_is_broken_before_a_remark_is():
    """Forty rows of remarks in three lines each hid the table of a measured muscle; the head has one row."""
    table = columns("effect added", "smallest detectable", "", words=(0, 2))
    table.add_row("tip", "19 N", "leaves most of the error")
    wide, narrow = (printed([table], width).splitlines() for width in (60, 55))
    assert [len(shown) for shown in (wide, narrow)] == [2, 3]
    assert [line.split() for line in narrow] == [
        ["smallest"],
        ["effect", "added", "detectable"],
        ["tip", "19", "N", "leaves", "most", "of", "the", "error"],
    ]


def everything_found(d):
    """A diagnosis with all effects of the library, the longest names in every place."""
    effects = {name_of(kind): evidence(kind) for kind in KINDS}
    best = Explanation(LONGEST, 0.3123456, 0.32, 9.0, 0.4, True,
                       estimate={full: e for name in LONGEST for full, e in named(effects[name]).items()})  # fmt: skip
    halves = (LONGEST[:2], LONGEST[2:])
    return dataclasses.replace(d, effects=effects, explanations=halves, tried=(best,), nearest=(best,),
                               substitutes=((LONGEST[0], LONGEST[1]),), classes=(halves,))  # fmt: skip


def evidence(kind):
    name = name_of(kind)
    estimate = {p.name: Estimate(p.default, p.default / 30 or 1e-3, p.unit) for p in parameters(kind)}
    return Evidence(name, 0.01, 0.312, 0.324, 0.2, 0.1, {LONGEST[-1]: 0.95}, estimate, name in LONGEST)


def named(e):
    return {f"{e.name}.{key}": value for key, value in e.estimate.items()}


@pytest.mark.parametrize("verdict", list(Verdict))
def test_a_diagnosis(diagnosis, verdict):
    made = nothing_missing if verdict in (Verdict.NOTHING, Verdict.WITHIN_INSTRUMENTS) else seen_through
    holds_in_80_columns(diagnosis_report(made(diagnosis, verdict)))
    said = holds_in_80_columns(diagnosis_report(dataclasses.replace(everything_found(diagnosis), verdict=verdict)))
    assert LONGEST[-1] in said


def test_a_comparison_a_fit_and_what_is_known(study):
    task, c = study
    said = holds_in_80_columns([*opening(task), *comparison_report(c), *fit_report(c.fit), *known_report(c.fit)])
    assert "by pressure" in said
    assert "coulomb_friction.f_s" in said


def test_the_steps_of_a_discovery():
    why = (Objection(Reason.AT_BOUND, f"{LONGEST[-1]}.C10"),)
    stage = Stage("", 3.123, 17.4, "not in the library", None, (Attempt(LONGEST, 3.2, 17.9, why),), ("muscle.radius",),
                  added=LONGEST[2:], dropped=LONGEST[:1])  # fmt: skip
    said = holds_in_80_columns([*step_report(stage), *steps_report([Stage("baseline", 49.3, 103.0, "one of"), stage])])
    assert "in the library" in said  # the last column is not cut off
    usual = [Stage("baseline", 49.3, 103.0, "one of"), dataclasses.replace(stage, dropped=())]
    assert holds_in_80_columns(steps_report(usual)).count("not in the library") == 1
    assert "█" in holds_in_80_columns(steps_report([Stage("baseline", 49.3, 103.0, "one of")]))


def test_a_plan_a_self_test_and_what_was_compiled():
    rivals = ((LONGEST[0],), (LONGEST[1],))
    holds_in_80_columns(plan_report(Plan(SimpleNamespace(verdict="one of"), rivals, (), (rivals,), None, ()), "m.toml"))
    outcomes = (Outcome.NOT_SEEN, Outcome.ONE_OF, Outcome.MISTAKEN)
    sizes = [Trial(LONGEST[0], 1.0, 1.0, {f"{LONGEST[0]}.k": 1.2}, "missing", rivals, each) for each in outcomes]
    nothing = Trial("", 0.0, 0.0, {}, "nothing detectable", (), Outcome.NOT_SEEN)
    blind = Sought("supply_lag", None, why_not="these data cannot see it")
    test = SelfTest(nothing, (Sought(LONGEST[0], 0.5, tuple(sizes)), blind), {f"{LONGEST[0]}.k": "1"})
    holds_in_80_columns(selftest_report(test))
    singles = [Weighed((name,), (1e-3, 5.0, 1e9), 12.3, name) for name in LONGEST]
    rests = tuple(RestsOn(20 + k, (GroupKind.LOOP,), 0) for k in range(3))
    asked = GrowingEvidence(
        ("a_long_name", "of_a", "session"), rests, Weighed((), (1.0, 9.0, 1e9), 1.0, "tip"), singles
    )
    holds_in_80_columns(sessions_report(asked))
    kept = SimpleNamespace(bytes=2**30, programs=123, folder="/home/somebody/.cache/mckibben")
    holds_in_80_columns(warm_report({"a_data_set_with_a_long_name/of_a_muscle": 61.2}, kept))


def test_the_library_and_the_equations():
    said = holds_in_80_columns([*effects_report(KINDS), *(part for kind in KINDS for part in effect_report(kind))])
    assert all(f"{title_of(kind)} ({name_of(kind)})" in said for kind in KINDS)
    holds_in_80_columns([*equations_report(EQUATIONS), *(part for e in EQUATIONS for part in equation_report(e))])


@pytest.mark.parametrize("name", COMMANDS)
def test_the_help_of_every_command(name, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    said = CliRunner().invoke(main, [name, "--help"]).output
    assert said.startswith("Usage:")
    assert max(map(len, said.splitlines())) <= 80
