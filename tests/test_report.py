"""What a user reads on the terminal: sentences, tables, amounts."""

import dataclasses
import re
from types import SimpleNamespace

import pytest
from small_muscle import loops, write
from studied import proposed, seen_through

from fitting.cli.run import CommandRun
from fitting.comparison.compare import Row, Table, compare
from fitting.diagnosis.outcomes import Reason, Verdict, Why
from fitting.diagnosis.record import Evidence, Leading
from fitting.least_squares.fit import fit
from fitting.planning.next_measurement import PairPower
from fitting.recordings.experiment import read_experiment
from fitting.recordings.records import NoiseSource
from fitting.report.text.amounts import amount, with_error
from fitting.report.text.comparison import comparison_report, judgement, kind_text, worst_text
from fitting.report.text.diagnosis import (
    diagnosis_report,
    headline_text,
    leading_text,
    measurement_text,
    motion_notes,
    p_value_text,
    remark,
    undecided_text,
    verdict_text,
)
from fitting.report.text.evidence import sort_evidence
from fitting.report.text.fit import fit_report
from fitting.report.text.layout import console, paste_line
from fitting.report.text.next_step import after_diagnosis
from fitting.report.text.plan import _expected
from fitting.report.text.reasons import why_text
from fitting.report.text.stages import stage_verdict
from fitting.report.text.values import range_cells, value_cells
from fitting.report.text.warnings import comparison_warnings
from fitting.study.plan import Plan
from fitting.study.stages import Stage
from mckibben_jax.effects import CoulombFriction, IdealCylinder


def command_after(*diagnosis, **options):
    """The command that comes after a diagnosis, or None."""
    step = after_diagnosis(*diagnosis, **options)
    return step and step.command


def with_radius(diagnosis, times):
    """The diagnosis with the sizes as they were measured, but for a radius of so many times that."""
    fit = diagnosis.baseline
    sizes = {entry.name: entry.prior[0] for entry in fit.layout.entries if entry.prior is not None}
    vector = fit.vector.copy()
    vector[fit.layout.at(list(sizes))] = [value * (times if "radius" in name else 1.0) for name, value in sizes.items()]
    return dataclasses.replace(diagnosis, baseline=dataclasses.replace(fit, vector=vector))


def text_of(shown):
    out = console()
    with out.capture() as captured:
        for thing in shown:
            out.print(thing)
    return captured.get()


def test_the_terminal_says_the_error_where_and_what_kind(study):
    words = text_of(comparison_report(study[1]))
    assert "of full scale" in words
    assert "the same in both directions" in words
    assert "repeated loops agree to" in words
    assert "by pressure" in words


def test_the_terminal_says_what_is_missing_what_is_not_and_what_cannot_be_seen(diagnosis):
    words = text_of(diagnosis_report(diagnosis))
    assert "VERDICT   Spring in parallel (linear_spring) is missing." in words
    assert "NOT IT    Viscous damping (viscous_damping)" in words
    needed = "Mullins effect of the rubber (mullins): cannot be tested: needs rubber in the model"
    assert needed in " ".join(words.split())
    assert command_after(diagnosis, ["here"]) == "mckibben add here linear_spring"


@pytest.mark.parametrize(
    ("verdict", "explanations", "words"),
    [
        ("nothing detectable", (), "Nothing is missing that these data could show."),
        (
            "one of",
            (("tip",), ("dead_band", "weight")),
            "cannot tell which (the likeliest first): ⟦tip⟧; ⟦dead_band⟧ + ⟦weight⟧.",
        ),
        ("not in the library", (), "no effect of the library explains all of it"),
        ("inconclusive", (), "cannot say"),
        ("within the instruments", (), "Errors of the instruments within their accuracy explain all of the misfit."),
    ],
)
def test_every_verdict_has_its_sentence(diagnosis, verdict, explanations, words):
    assert words in verdict_text(dataclasses.replace(diagnosis, verdict=verdict, explanations=explanations))


def test_instruments_that_had_to_err_far_beyond_their_accuracy_do_not_count_as_an_explanation(diagnosis):
    """A load cell that is known to 0.1 % and had to err by 1.5 %."""
    strained = seen_through(diagnosis, Verdict.WITHIN_INSTRUMENTS)
    assert verdict_text(strained).endswith("Do not believe it before that is checked.")
    assert stage_verdict(Stage("", 1.0, 1.0, strained.verdict, strained=True)) != strained.verdict
    believed = dataclasses.replace(strained, instruments=strained.instruments[:1])
    assert verdict_text(believed) == "Errors of the instruments within their accuracy explain all of the misfit."


def test_only_what_is_missing_is_called_small(diagnosis):
    small = dataclasses.replace(diagnosis, negligible=True)
    assert "It is small" in verdict_text(small)
    assert "small" not in verdict_text(dataclasses.replace(small, verdict="inconclusive", why=Why(Reason.FEW_LOOPS)))


def test_what_could_hide_here_is_not_called_absent(diagnosis):
    faint = dataclasses.replace(diagnosis, faint=("viscous_damping",))
    assert "NOT IT    End stop (end_stop):" in text_of(diagnosis_report(faint))


def test_an_error_many_times_the_noise_that_no_flip_sees_says_so(diagnosis):
    assert "many times the noise" not in p_value_text(diagnosis)
    assert "many times the noise" in p_value_text(dataclasses.replace(diagnosis, p_value=0.2))


def test_commands_can_be_pasted_whatever_the_folder_is_called(diagnosis):
    assert command_after(diagnosis, ["Müskel №1 – größe 20°"]) == "mckibben add 'Müskel №1 – größe 20°' linear_spring"
    as_measured = with_radius(diagnosis, 1.0)
    nobodys = dataclasses.replace(as_measured, verdict="not in the library", leading=None, explanations=())
    assert command_after(nobodys, ["here"]) == "mckibben diagnose here --propose"
    assert command_after(nobodys, ["here"], proposed=True) is None
    assert command_after(diagnosis, ["here"], proposed=True) == "mckibben add here linear_spring"


@pytest.mark.parametrize(("factor", "said"), [(9.81, "0.1 times"), (0.25, "4 times"), (1.0, None)])
def test_a_force_of_an_unlikely_size_asks_for_units_and_sizes(study, factor, said):
    """The model pulls so many times what was measured."""
    c = study[1]
    measured = c.fit.samples.measured
    fit = dataclasses.replace(c.fit, residual=(factor - 1) * measured)
    told = comparison_warnings(dataclasses.replace(c, fit=fit, rmse=fit.rmse))
    assert (said in told[0]) if said else told == []


@pytest.mark.parametrize(("times", "said"), [(1.0, False), (1000.0, True)])
def test_a_muscle_that_moves_faster_than_any_asks_for_the_unit_of_the_time(study, times, said):
    """Seconds under a head in milliseconds: 20 m/s were shown without a word."""
    c = study[1]
    samples = dataclasses.replace(c.fit.samples, rate=times * c.fit.samples.rate)
    told = " ".join(comparison_warnings(dataclasses.replace(c, fit=dataclasses.replace(c.fit, samples=samples))))
    assert ("Check the unit of the time" in told) == said


@pytest.mark.parametrize(
    ("radius", "factor", "times"), [("16", 1.0, 0.25), ("4", 1.0, 4.0), ("8", 1 / 9.81, 0.1), ("8", 1.0, None)]
)
def test_a_size_that_a_fit_corrects_does_not_hide_a_wrong_unit(tmp_path, radius, factor, times):
    """Sizes with an error give way: the fit of a diameter taken for the radius looked right but for its radius."""
    rows = [(*row, force * factor) for *row, force in loops(lambda eps, *_: 60.0 * eps, points=30, repeats=1)]
    folder = write(tmp_path / "m", rows, extra="")
    described = (folder / "muscle.toml").read_text().replace("8.0 +/- 0.1 mm", f"{radius} +/- 0.1 mm")
    (folder / "muscle.toml").write_text(described)
    muscle = read_experiment(folder)
    told = comparison_warnings(compare(fit([muscle], [IdealCylinder(), CoulombFriction()], starts=2), [muscle]))
    found = [float(ratio) for ratio in re.findall(r"on average (\S+) times", " ".join(told))]
    assert found == ([] if times is None else [pytest.approx(times, rel=0.3)])


@pytest.mark.parametrize(("added", "hinted"), [(101325.0, True), (0.0, False), (-5e4, False)])
def test_pressures_that_begin_at_an_atmosphere_and_fit_without_it_are_doubted(added, hinted):
    """`data/muscle_a` is of gauge readings of 1 bar and more; the error without the atmosphere is that of before."""
    muscle = read_experiment("data/muscle_a")
    right = fit([muscle], [IdealCylinder(), CoulombFriction()])
    c = compare(fit([shifted(muscle, added)], [IdealCylinder(), CoulombFriction()]), [muscle])
    told = " ".join(comparison_warnings(c))
    assert ('pressure = "absolute"' in told) == hinted
    if hinted:
        assert c.if_absolute == pytest.approx(right.rmse, rel=0.2)


def shifted(experiment, pressure):
    """The same readings with so much more in the pressure."""
    recordings = [
        dataclasses.replace(r, runs=tuple(dataclasses.replace(run, pressure=run.pressure + pressure) for run in r.runs))
        for r in experiment.recordings
    ]
    return dataclasses.replace(experiment, recordings=tuple(recordings))


def test_warnings_name_bounds_ties_and_what_is_held(study):
    fit = dataclasses.replace(study[1].fit, at_bound=("muscle.radius",), held=("x.y",), converged=False)
    words = " ".join(text_of(fit_report(fit)).split())
    assert "radius (muscle.radius) lies at the " in words
    for part in ("did not converge", " end of its range", "held at their values: x.y"):
        assert part in words


def test_an_error_wider_than_the_range_is_unknown(study, monkeypatch):
    """A stiffness that does nothing any more was told as 100000 +/- 3972898 N/mm."""
    fit, name = study[1].fit, "muscle.radius"
    entry = fit.layout.entry(name)
    width = entry.upper - entry.lower
    monkeypatch.setattr(type(fit), "error", lambda *_, robust=True: width * (1.01 if robust else 0.99))
    shown, robust, independent = value_cells(fit, name)
    assert (shown, robust) == (amount(fit.values[name], "m"), "unknown")
    assert independent == amount(0.99 * width, "m", 2)
    monkeypatch.setattr(type(fit), "error", lambda *_, robust=True: 0.99 * width)
    assert "unknown" not in value_cells(fit, name)


def test_a_headline_that_nothing_is_decided_leaves_the_long_list_to_the_sentence_below(diagnosis):
    names = ("tip", "weight", "force_offset", "end_stop", "linear_spring", "viscous_damping")
    faint = dataclasses.replace(diagnosis, verdict="inconclusive", why=Why(Reason.FAINT, names), explanations=())
    assert headline_text(faint) == "These data cannot say whether something is missing."
    assert undecided_text(faint).startswith("Only a large amount of each of these would show: ")
    assert undecided_text(faint).endswith(" and 2 more.")
    assert verdict_text(faint) == f"{headline_text(faint)[:-1]}: o{undecided_text(faint)[1:]}"
    assert (headline_text(diagnosis), undecided_text(diagnosis)) == (verdict_text(diagnosis), "")


@pytest.mark.parametrize(("value", "ends"), [(4.5e5, ("1 kPa", "20000 kPa")), (4.5e6, ("0.001 MPa", "20 MPa"))])
def test_a_range_has_one_unit_that_of_the_value(value, ends):
    entry = SimpleNamespace(lower=1e3, upper=20e6, unit="Pa")
    fit = SimpleNamespace(layout=SimpleNamespace(entry=lambda _: entry), values={"bladder.G": value})
    assert range_cells(fit, "bladder.G") == ends


def test_noise_has_no_kind(study):
    c = dataclasses.replace(study[1], rmse=0.3)
    assert "mostly noise" in kind_text(c)


@pytest.mark.parametrize(
    ("value", "unit", "shown"),
    [
        (1063.4, "N", "1063 N"),
        (0.6, "N", "0.6 N"),
        (0.00012, "m", "0.12 mm"),
        (0.0, "N", "0 N"),
        (12345.6, "N", "12346 N"),
    ],
)
def test_amounts_are_written_without_powers_of_ten(value, unit, shown):
    assert amount(value, unit) == shown


def test_a_value_goes_as_far_as_its_error():
    assert with_error(0.00710014, 0.000032, "m") == ("7.100 mm", "0.032 mm")
    assert with_error(0.5, float("nan"), "1") == ("0.5", "")


def test_of_several_the_one_that_leads_is_added_first(diagnosis):
    either = dataclasses.replace(diagnosis, verdict="one of", explanations=(("tip",), ("linear_spring",)))
    assert diagnosis.leading.effects == ("linear_spring",)
    assert command_after(either, ["here"]) == "mckibben add here linear_spring"
    assert command_after(dataclasses.replace(either, leading=None), ["here"]) == "mckibben add here tip"


def test_a_command_is_not_broken_however_narrow_the_terminal_is():
    command = "mckibben simulate here --noise '0.139 lbf' " + "--turns 0,0.24,0.1,0.24 " * 8
    narrow = console()
    narrow.width = 40
    with narrow.capture() as captured:
        CommandRun.print(SimpleNamespace(console=narrow), [paste_line("REHEARSE", command)])
    assert captured.get() == f"REHEARSE  {command}\n"


def test_a_number_that_is_none_has_no_digits():
    assert amount(float("inf"), "N") == "no number"
    assert amount(float("nan"), "N") == "no number"


def test_an_even_misfit_without_pressure_is_one_that_the_fit_hides_in_part(study):
    """The table below it may change sign with pressure: that is what the fit made of it."""
    flat = dataclasses.replace(study[1].fingerprint, odd_share=0.0, pressure_exponent_even=0.05)
    words = kind_text(dataclasses.replace(study[1], fingerprint=flat))
    assert "the same at every pressure; fitted parameters absorb some of it" in words
    steep = dataclasses.replace(flat, pressure_exponent_even=2.0)
    assert "pressure to the power 2" in kind_text(dataclasses.replace(study[1], fingerprint=steep))


@pytest.mark.parametrize(("share", "said"), [(1.064, "a branch moves by 6.34 N when"), (0.09, None), (None, None)])
def test_how_far_a_branch_moves_is_said_in_newtons(study, share, said):
    """A share of the misfit was said, and no more than all of it: a few branches may move by more than a fit leaves."""
    c = study[1]
    moved = dataclasses.replace(c, rmse=5.96, fingerprint=dataclasses.replace(c.fingerprint, cycle_drift=share))
    assert (said in kind_text(moved)) if said else "branch moves" not in kind_text(moved)


def test_motions_read_as_force_are_not_called_described(study):
    """Their noise as force is coarse: how far they are missed is another question."""
    good = dataclasses.replace(study[1], rmse=study[1].noise, noise_floor=None)
    assert judgement(good).startswith("The model describes these data")
    read = judgement(dataclasses.replace(good, noise_sources=(NoiseSource.MOTION,)))
    assert read.startswith("Read as force")
    assert "mckibben compare" in read


def test_an_error_is_held_against_a_noise_that_is_told(study):
    """Which noise, how large, and where it is known from: the error of a loop's repetition, or one reading's."""
    stated = dataclasses.replace(study[1], rmse=3.0, noise=0.5, noise_floor=None, noise_sources=(NoiseSource.STATED,))
    assert "3 N, 6 times the noise of one reading, 0.5 N (as stated)." in judgement(stated)
    assert "0.5 N (presumed)." in judgement(dataclasses.replace(stated, noise_sources=(NoiseSource.ASSUMED,)))
    repeated = dataclasses.replace(stated, noise_floor=1.0)
    assert "3 N, 3 times that by which repeated loops differ, 1 N." in judgement(repeated)


def test_one_run_that_is_off_alone_is_named(study):
    """Not an effect but a recording to look at; and not where others are off as well, or runs are too few."""
    rows = [Row(f"run {k}", 100, size, 0.0, 2 * size) for k, size in enumerate((1.0, 1.2, 9.0, 1.1))]
    c = dataclasses.replace(study[1], rmse=5.0, noise=0.3, noise_floor=None)
    told = lambda rows, rmse=5.0: worst_text(  # noqa: E731
        dataclasses.replace(c, rmse=rmse, tables=(Table("run", tuple(rows)),))
    )
    assert "run 2, 9 N; no other run has more than 1.2 N" in told(rows)
    assert "alone" not in told([*rows, Row("run 4", 100, 4.0, 0.0, 8.0)])
    assert "alone" not in told(rows[1:])
    assert "alone" not in told(rows, rmse=0.3)


def test_presumed_noise_judges_nothing(study):
    within = dataclasses.replace(study[1], rmse=0.2, noise=0.3, noise_floor=None, noise_sources=(NoiseSource.ASSUMED,))
    assert "State the noise" in judgement(within)
    for times, words in ((0.9, " is within the noise"), (1.2, " is not much above the noise")):
        assert words in judgement(dataclasses.replace(within, noise=within.rmse / times))


@pytest.mark.parametrize(
    ("share", "said"), [(0.8, "Mostly ⟦tip⟧: "), (0.3, "⟦tip⟧ lowers the error more than any other ")]
)
def test_what_does_less_than_half_is_not_most_of_it(share, said):
    lead = Leading(("tip",), share, 2.0, 3.0)
    told = SimpleNamespace(verdict="not in the library", leading=lead, held_out_rmse=4.0, explanations=())
    assert leading_text(told).startswith(said)
    assert leading_text(told).endswith("of the squared error.")


@pytest.mark.parametrize(
    ("verdict", "explanations", "end"),
    [
        ("missing", (("tip",),), "of the squared error."),
        ("one of", (("cones",), ("tip",)), "of the squared error."),
        ("missing", (("cones",),), "But the verdict names another explanation."),
        ("missing", (("tip", "cones"),), "But the verdict names another explanation."),
        ("inconclusive", (), "But these data do not prove that it is there."),
    ],
)
def test_what_leads_is_no_second_verdict(verdict, explanations, end):
    lead = Leading(("tip",), 0.3, 2.0, 3.0)
    told = SimpleNamespace(verdict=verdict, leading=lead, held_out_rmse=4.0, explanations=explanations)
    assert leading_text(told).endswith(end)


@pytest.mark.parametrize(
    ("needs", "said"),
    [
        (("rubber",), "needs rubber in the model"),
        (("strand_modulus", "strand_poisson"), "needs strand_modulus and strand_poisson in muscle.toml"),
        (("rubber", "wall_thickness"), "needs rubber in the model and wall_thickness in muscle.toml"),
    ],
)
def test_what_an_effect_needs_is_said_with_its_place(needs, said):
    assert why_text(Why(Reason.NEEDS, needs)) == f"cannot be tested: {said}"


def test_a_lead_of_next_to_nothing_is_neither_told_nor_added_where_nothing_is_missing(diagnosis):
    nothing = Leading(("tip",), 0.01, 2, 2)
    as_measured = with_radius(diagnosis, 1.0)
    faint = dataclasses.replace(as_measured, verdict="inconclusive", explanations=(), leading=nothing)
    assert leading_text(faint) is None
    assert command_after(faint, ["here"]) == "mckibben plan here"
    whole = dataclasses.replace(faint, verdict="nothing detectable", leading=None)
    assert command_after(whole, ["here"]) == "mckibben posterior here --quick"
    some = dataclasses.replace(faint, verdict="not in the library", leading=Leading(("tip",), 0.2, 2, 2))
    assert command_after(some, ["here"]) == "mckibben diagnose here --propose"
    most = dataclasses.replace(some, leading=Leading(("tip",), 0.8, 2, 2))
    assert command_after(most, ["here"]) == "mckibben add here tip"


def test_laws_of_rubber_that_could_not_be_tried_are_said_before_another_effect_is_added(diagnosis):
    """Without the thickness of the wall a bending of strands leads where rubber is missing."""
    lacking = Evidence("bladder_ogden", why=Why(Reason.NEEDS, ("wall_thickness",)))
    told = lambda d: [text for text in text_of(diagnosis_report(d)).split("CHECK") if "Laws of the rubber" in text]  # noqa: E731
    without = dataclasses.replace(diagnosis, effects={**diagnosis.effects, "bladder_ogden": lacking})
    assert len(told(without)) == 1
    assert "wall_thickness" in told(without)[0]
    assert told(diagnosis) == []
    assert told(dataclasses.replace(without, verdict="nothing detectable", explanations=())) == []
    tried = {**without.effects, "bladder_ogden": dataclasses.replace(lacking, why=None, rmse=1.0, held_out_rmse=1.0)}
    assert told(dataclasses.replace(diagnosis, effects=tried)) == []


def test_sizes_that_deny_what_was_measured_are_held_before_anything_else_is_asked(diagnosis):
    """They may stand in for what is missing; an effect that is named is added all the same, and to a complete model
    nothing is."""
    denying, held = with_radius(diagnosis, 1.1), "muscle.radius muscle.braid_angle"
    assert command_after(denying, ["here"]) == "mckibben add here linear_spring"
    for verdict in ("inconclusive", "nothing detectable", "not in the library"):
        faint = dataclasses.replace(denying, verdict=verdict, explanations=(), leading=None)
        held_first = f"mckibben diagnose here --fix {held}"
        after = "mckibben posterior here --quick" if verdict == "nothing detectable" else held_first
        assert command_after(faint, ["here"]) == after


def test_what_helps_only_with_another_is_not_called_idle(diagnosis):
    """Missing: two effects, of which one does nothing by itself."""
    pair = dataclasses.replace(diagnosis, explanations=(("linear_spring", "viscous_damping"),))
    assert "NOT IT    End stop (end_stop):" in text_of(diagnosis_report(pair))


@pytest.mark.parametrize(("better", "said"), [(0.3, True), (1.0, False)])
def test_what_lowers_the_error_is_not_called_unseen_though_a_little_of_it_would_not_show(diagnosis, better, said):
    stretch = Evidence("strand_stretch", 0.9, diagnosis.rmse, better * diagnosis.held_out_rmse, None, 1.0,
                       unexplained=better * 2.0, why=Why(Reason.NOT_SEEN))  # fmt: skip
    found = dataclasses.replace(diagnosis, unexplained=2.0, effects=diagnosis.effects | {"strand_stretch": stretch})
    helping, _, blind = sort_evidence(found)
    unseen = [name for names in blind.values() for name in names]
    assert ("strand_stretch" in [e.name for e in helping]) == said
    assert ("strand_stretch" in unseen) != said
    words = " ".join(text_of(diagnosis_report(found)).split())
    assert remark(stretch) == "a small amount of it would not show"
    assert ("(strand_stretch): these data cannot see it beside this model" in words) != said


def test_the_nearest_set_says_why_it_explains_nothing(diagnosis):
    """A few newtons are worth little with a load cell that is off by half of full scale."""
    best = dataclasses.replace(diagnosis.tried[0], unexplained=0.2)
    whys = (Why(Reason.UNBELIEVED, ("force_offset",)), Why(Reason.STILL_MISSING, p_value=0.002), Why(Reason.FAR_WORSE))
    near = tuple(dataclasses.replace(best, why=why) for why in whys)
    words = " ".join(text_of(diagnosis_report(dataclasses.replace(diagnosis, nearest=near))).split())
    left = "Spring in parallel (linear_spring): 0.31 N, of which 0.2 N is unexplained"
    assert f"{left}; needs an instrument that is off by more than a tenth of full scale: Wrong zero" in words
    assert f"{left}; something is still missing (p = 0.002)" in words
    assert "others leave far less" not in words
    little = dataclasses.replace(near[1], unexplained=0.0)
    words = " ".join(text_of(diagnosis_report(dataclasses.replace(diagnosis, nearest=(little,)))).split())
    assert "of which 0 N is unexplained; what is left is small, but too alike for chance (p = 0.002)" in words


def test_the_terminal_gives_the_values_of_what_is_missing(diagnosis):
    words = text_of(diagnosis_report(diagnosis))
    assert "VALUES    stiffness in parallel (linear_spring.K) = 1.600 +/- 0.020 N/mm" in words


@pytest.mark.parametrize(("tests", "verdict", "said"), [
    (["step"], "inconclusive", "far noisier"), (["step"], "missing", ""), (["loop"], "inconclusive", ""),
    (["loop", "quick release"], "missing", "measured forces"),
])  # fmt: skip
def test_motions_that_say_nothing_as_force_are_looked_at_as_motions(diagnosis, tests, verdict, said):
    data = SimpleNamespace(recordings=[SimpleNamespace(test=test) for test in tests])
    told = " ".join(motion_notes(dataclasses.replace(diagnosis, verdict=verdict), [data]))
    assert said in told if said else not told


@pytest.mark.parametrize(("power", "said"), [(0.005, "power of 0.5 %; no other recording that was"), (0.9, "90 %.")])
def test_a_recording_that_hardly_decides_says_so(power, said):
    planned = proposed(power)
    assert said in " ".join(measurement_text(planned))
    assert "pulls up to" not in " ".join(measurement_text(planned))  # it is not known of this one
    assert measurement_text(dataclasses.replace(planned, pull=687.0))[-1] == "It pulls up to 687 N."


@pytest.mark.parametrize("power", [0.75, 0.95])
def test_a_plan_says_how_often_it_decides(power):
    tip, cones = ("tip",), ("conical_ends",)
    step = SimpleNamespace(pairs=(PairPower(tip, cones, power, 20.0),), power=power)
    tied = () if power > 0.8 else ((tip, cones),)
    plan = Plan(SimpleNamespace(verdict="one of"), (tip, cones), (step,), tied, None)
    said = _expected(plan)
    assert "other pairs" not in said
    assert ("uniquely" in said) == (power > 0.8)
    assert ("told apart in 75 % of the cases" in said) == (power < 0.8)
