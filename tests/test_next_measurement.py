"""The proposed recording: what it is, and its worth against a simulator that shares no code."""

import json
import shlex
from dataclasses import replace
from itertools import combinations
from types import SimpleNamespace

import numpy as np
import pytest
from click.testing import CliRunner
from hidden.simulator import Muscle, Noise, Truth, dataset, isometric, loops, with_baseline, write
from test_inverse_dynamics import released
from threadpoolctl import threadpool_limits

from fitting import showing
from fitting.cli.main import main
from fitting.diagnosis.diagnose import diagnose
from fitting.diagnosis.outcomes import NOTHING_MISSING
from fitting.diagnosis.record import Evidence
from fitting.least_squares.fit import fit
from fitting.planning import next_measurement as nm
from fitting.planning.candidates import grid, on_specimen, rig_abilities
from fitting.planning.likes import with_likes_apart
from fitting.planning.prospect import prospect as prospect_of
from fitting.planning.protocols import Protocol, Specimen
from fitting.planning.settings import GRID
from fitting.planning.sharper import sharper
from fitting.problem.thinning import thinned
from fitting.problem.varying import Varying
from fitting.recordings.experiment import read_experiment
from fitting.report.text.layout import console
from fitting.report.text.measurement import needs_text, purpose_text, rehearsal_command
from fitting.report.text.plan import _expected, plan_report, plan_result
from fitting.study.plan import Plan, plan_of
from fitting.study.request import Request
from mckibben_jax.effect import name_of
from mckibben_jax.effects import LIBRARY, ConstantFriction, CoulombFriction, EndStop, IdealCylinder, ViscousDamping

KNOWN = {name_of(kind): kind for kind in LIBRARY}
BASELINE = (IdealCylinder(), CoulombFriction())
NOISE = Noise(sd=0.6, phi=0.7)
ONE_PRESSURE = {"pressures": (3e5,), "speeds": (0.01,), "turns": (0.0, *(0.25, 0.0) * 6), "samples": 1800}
PER_NODE = 8
PSI = {"Pa": "psi", "N": "lbf", "m": "in"}


def recorded(folder, hidden, seed=1, **protocol):
    """A data set of the independent simulator, and its truth."""
    truth = Truth(Muscle(), with_baseline(**hidden))
    recording = loops(truth, noise=NOISE, seed=seed, **(protocol or ONE_PRESSURE))
    write(dataset(truth, [recording], "Set", NOISE, seed), folder)
    return truth, read_experiment(folder)


def left_tied(experiment, *rivals, verdict="one of"):
    """A diagnosis that could not tell these apart."""
    base = fit([thinned(experiment, 3500)], BASELINE, starts=2)
    return SimpleNamespace(
        verdict=verdict, explanations=tuple((name,) for name in rivals), tried=(), nearest=(), baseline=base, effects={}
    )


def readings_of(truth, protocol, repeats, seed):
    """What the independent simulator reads around each node, in standard deviations: (cycles, nodes)."""
    count = 2 * repeats * GRID.nodes * PER_NODE + 1
    back_and_forth = lambda ends: (ends[0], *(ends[1], ends[0]) * repeats)  # noqa: E731
    given = {"samples": count, "noise": NOISE, "seed": seed}
    if protocol.test == "isometric":
        turns = back_and_forth(protocol.pressures)
        made = isometric(truth, contractions=protocol.contractions[:1], turns=turns, ramps=(protocol.rate,), **given)
    else:
        speed, turns = protocol.rate * truth.muscle.length, back_and_forth(protocol.contractions)
        pressures = protocol.pressures[:1]
        made = loops(truth, pressures=pressures, speeds=(speed,), turns=turns, rounding=0.002, **given)
    return made.columns["force"][:-1].reshape(repeats, 2 * GRID.nodes, PER_NODE).mean(axis=2) / NOISE.sd


def stands_alone(prospect, number, repeats, truth, name, seed):
    """Whether after the recording the test rejects all explanations but the true one."""
    readings = readings_of(truth, prospect.protocols[number], repeats, seed)
    with threadpool_limits(1, "blas"):
        rejected = prospect.outlook.rejected(number, readings)
    return [added for added, gone in zip(prospect.names, rejected, strict=True) if not gone] == [(name,)]


# ----------------------------------------------------------------------------------------------------------- protocols


@pytest.fixture(scope="module")
def one_pressure(tmp_path_factory):
    """Loops at one pressure and one speed, with constant friction hidden."""
    folder = tmp_path_factory.mktemp("one_pressure")
    return folder, *recorded(folder, {"constant_friction": {"F_c": 6.0}})


def test_candidates_stay_inside_what_the_rig_has_shown(one_pressure):
    """What is not marked keeps to the pressures, the stroke and, within a factor, the speeds of the data."""
    can = rig_abilities(one_pressure[2])
    assert (can.pressure, can.contractions) == (pytest.approx(3e5), (0.0, pytest.approx(0.25)))
    assert can.speeds == (pytest.approx(0.01, rel=0.02),) * 2
    for protocol in grid(can):
        assert 0 <= protocol.contractions[0] <= protocol.contractions[1] <= 0.25
        if not protocol.beyond:
            assert protocol.test == "loop"
            assert protocol.pressures[1] <= 3.06e5
            assert protocol.rate * can.length <= 1.02 * GRID.faster * 0.01
    assert {p.test for p in grid(can) if p.beyond} == {"loop", "isometric"}


@pytest.mark.parametrize(
    ("interval", "tests", "quick"), [(0.01, "loop", True), (0.1, "loop", False), (1.0, "static", True)]
)
def test_a_sweep_that_the_logger_hardly_reads_is_not_asked_for(one_pressure, interval, tests, quick):
    """A board that reads ten times a second was to sweep from 2 to 4 bar within 0.64 s: six readings."""
    can = replace(rig_abilities(one_pressure[2]), interval=interval, tests=frozenset({tests}))
    sweeps = [p.branch_time for p in grid(can) if p.test == "isometric"]
    assert sweeps
    assert (min(sweeps) < 1.3) is quick
    assert tests == "static" or min(sweeps) >= 20 * interval


def test_what_is_faster_than_the_data_show_says_so(one_pressure):
    """Three times as fast most rigs still go, but who reads the plan should know it before."""
    can = replace(rig_abilities(one_pressure[2]), tests=frozenset({"loop", "isometric"}), ramps=(1e4, 5e4))
    fast = [p for p in grid(can) if p.test == "loop" and p.rate * can.length > 1.02 * can.speeds[1]]
    steep = [p for p in grid(can) if p.test == "isometric" and p.rate > 1.02 * can.ramps[1]]
    assert fast
    assert steep
    assert all("times as fast as in these data (10 mm/s)" in needs_text(p) for p in fast)
    assert all("a pressure that changes 3 times as fast as in these data (50 kPa/s)" in needs_text(p) for p in steep)
    assert not any("times as fast" in needs_text(p) for p in grid(can) if p not in fast and p not in steep)
    assert max(p.rate * can.length for p in fast) <= 1.02 * GRID.much_faster * can.speeds[1]


def test_releases_do_not_show_a_rig_that_moves_the_length(tmp_path):
    """They move at a metre a second; no drive does that, and none was seen."""
    data, _ = released(tmp_path)
    can = rig_abilities(data)
    swung = max(float(run.measured.max()) for recording in data.recordings for run in recording.runs)
    assert 0.5 < can.contractions[1] * can.length / swung < 0.99  # where it came to rest for a moment nothing is read
    assert can.tests == frozenset()
    assert np.isnan(can.speeds[1])
    assert all("a rig that moves the length" in needs_text(p) or p.test == "isometric" for p in grid(can))
    assert max(p.rate * can.length for p in grid(can) if p.test == "loop") <= 0.1
    assert on_specimen(can, Specimen.HALF_AS_LONG)


@pytest.mark.parametrize(("test", "own"), [("loop", {}), ("isometric", {}), ("loop", PSI), ("isometric", PSI)])
def test_the_rehearsal_records_what_was_proposed(one_pressure, tmp_path, test, own):
    """`mckibben simulate` understands the line, and its file holds so many loops between these turning points."""
    can = rig_abilities(one_pressure[2])
    protocol = next(p for p in grid(can) if p.test == test and p.branch_time < 10 and not p.hold)
    model = tmp_path / "model.toml"
    model.write_text(
        'format = 1\n[muscle]\nlength = "300 mm"\nradius = "7 mm"\nbraid_angle = "20 deg"\n'
        '[[effect]]\nname = "ideal_cylinder"\n[[effect]]\nname = "coulomb_friction"\n'
    )
    with showing.spoken(own):  # in the units that the data are measured in
        line = rehearsal_command(protocol, 3, can, str(model), str(tmp_path / "out"))
    assert line is not None
    assert (" psi" in line) == bool(own)
    done = CliRunner().invoke(main, shlex.split(line)[1:])
    assert done.exit_code == 0, done.output
    (run,) = read_experiment(tmp_path / "out").recordings[0].runs
    assert run.loop.max() == 2
    moved = run.contraction if test == "loop" else run.pressure
    ends = protocol.contractions if test == "loop" else protocol.pressures
    first = pytest.approx(ends[0], rel=1e-5, abs=1e-6)
    assert (moved.min(), moved.max()) == (first, pytest.approx(ends[1], rel=0.01))


# ---------------------------------------------------------------------------------------------------------- the choice

FRICTIONS = {
    "constant_friction": {"F_c": 6.0},
    "textile_friction": {"f_s": 0.016, "beta": 0.7},
    "viscous_damping": {"B": 500.0},
}


@pytest.mark.parametrize("name", FRICTIONS)
def test_the_proposed_loops_leave_one_explanation(tmp_path, name):
    """At one pressure and speed three kinds of loss look the same; after the proposed loops one is left."""
    truth, experiment = recorded(tmp_path, {name: FRICTIONS[name]})
    tied = left_tied(experiment, *FRICTIONS)
    told = list[tuple[str, float]]()
    found = nm.next_measurement(tied, [experiment], progress=lambda words, share: told.append((words, share)))
    assert [words for words, _ in told] == [
        *(f"predicting with {n}" for n in FRICTIONS),
        "choosing recording 1 of 1 at most",
    ]
    assert [share for _, share in told] == pytest.approx([0.0, 0.4 / 3, 0.8 / 3, 0.4])
    assert found is not None
    assert found.power >= 0.9
    largest = NOISE.sd * readings_of(truth, found.protocol, 1, seed=1).max()
    assert 0.98 * largest < found.pull < 1.5 * largest  # a false explanation may predict more at that speed
    assert needs_text(found.protocol) == "a drive 3 times as fast as in these data (10 mm/s)"
    assert len(found.pairs) == 3
    prospect = prospect_of(tied, [experiment], nm.remaining(tied), Varying())
    number = prospect.protocols.index(found.protocol)
    alone = [stands_alone(prospect, number, found.repeats, truth, name, seed) for seed in range(5)]
    assert sum(alone) >= 4


def test_what_no_recording_separates_is_said(one_pressure):
    """A hung weight and an offset of the load cell are one and the same number."""
    tied = left_tied(one_pressure[2], "force_offset", "weight")
    assert nm.next_measurement(tied, [one_pressure[2]]) is None
    plan = plan_of_it(tied, one_pressure[2])
    assert plan.tied == ((("force_offset",), ("weight",)),)
    assert plan.instruments == ("force_offset",)
    result = plan_result(plan, "folder/model.toml")
    assert "as now" in result["expected_verdict"]
    assert result["next_measurement"] is None


def test_what_was_added_is_told_from_what_does_the_same_in_its_place(one_pressure):
    """Constant friction was found; at one speed viscous damping is nearly the same. Which is it?"""
    present = [*BASELINE, ConstantFriction()]
    found = diagnose([one_pressure[2]], present, candidates=[ViscousDamping(), EndStop()])
    assert found.verdict in NOTHING_MISSING
    assert not plan_of_it(found, one_pressure[2]).of_likes
    found = replace(found, substitutes=(("constant_friction", "viscous_damping"),))
    plan = plan_of_it(found, one_pressure[2])
    assert plan.rivals == (("constant_friction",), ("viscous_damping",))
    assert "constant_friction.F_c" not in with_likes_apart(found, [one_pressure[2]], Varying()).baseline.layout.names
    told = plan_result(plan, "m.toml")
    assert (told["verdict"], told["explanations"]) == (found.verdict, [])
    assert told["likes"] == [["constant_friction"], ["viscous_damping"]]
    (step, *_) = plan.steps
    assert step.power >= 0.8
    assert abs(np.log(step.speed / 0.01)) > np.log(1.5)  # another speed than was recorded
    words = " ".join(shown_words(plan).split())
    assert "The model has Constant friction (constant_friction); these data cannot tell apart:" in words
    assert "EXPECT one of them is left: that of the model, or another that is missing then" in words


def test_a_gauge_is_told_from_a_muscle_by_venting():
    rivals = (("pressure_offset",), ("dead_band",))
    plan = Plan(SimpleNamespace(verdict="one of"), rivals, (), (rivals,), None, ("pressure_offset",))
    assert "vented" in shown_words(plan)
    assert "vented" not in shown_words(replace(plan, instruments=()))


@pytest.mark.parametrize(
    ("strained", "said"), [(True, "instruments, far beyond their accuracy"), (False, "within the instruments")]
)
def test_a_plan_says_of_instruments_what_the_verdict_says(strained, said):
    found = SimpleNamespace(verdict="within the instruments", is_strained=strained)
    assert (
        _expected(Plan(found, (), (None,), (), None)) == f"as now ({said}), or one of the effects shown is missing too"
    )


def plan_of_it(found, experiment):
    task = SimpleNamespace(experiments=(experiment,), library=KNOWN, varying=Varying(), seed=0, asked={"seed": 0})
    return plan_of(task, found)


def shown_words(plan):
    out = console()
    with out.capture() as captured:
        for thing in plan_report(plan, "model.toml"):
            out.print(thing)
    return captured.get()


@pytest.mark.parametrize(("model", "named"), [(None, "folder/model.toml"), ("else where.toml", "'else where.toml'")])
def test_a_rehearsal_names_the_model_that_was_given(one_pressure, model, named):
    tied = left_tied(one_pressure[2], "viscous_damping", "linear_spring")
    result = plan_result(plan_of_it(tied, one_pressure[2]), Request(data=("folder",), model=model).model_file)
    rehearsed = [step["simulate"] for step in result["protocol"] if step["simulate"]]
    assert rehearsed
    assert all(f"mckibben simulate {named} " in command for command in rehearsed)


def test_nothing_to_separate(one_pressure):
    """One explanation, or none."""
    assert nm.next_measurement(left_tied(one_pressure[2], "viscous_damping"), [one_pressure[2]]) is None
    assert nm.next_measurement(left_tied(one_pressure[2], verdict="nothing detectable"), [one_pressure[2]]) is None


def test_what_the_data_do_not_see_is_made_visible(one_pressure):
    """At one speed an effect of speed hides; the proposed loops have another speed."""
    seen = left_tied(one_pressure[2], verdict="inconclusive")
    seen.effects = {"kinetic_friction": Evidence("kinetic_friction", rmse=1.0)}
    seen.noise_floor = 0.6
    found = sharper(seen, [one_pressure[2]])
    assert found is not None
    assert found.protocol.test == "loop"
    assert abs(np.log(found.speed / 0.01)) > np.log(1.5)
    assert "kinetic_friction" in purpose_text(found)


@pytest.mark.slow
def test_plan_from_the_command_line(one_pressure, tmp_path):
    """The whole way: diagnosis, protocol, rehearsal line, keys for machines."""
    out = tmp_path / "plan.json"
    names = ["textile_friction", "viscous_damping", "constant_friction", "linear_spring"]
    done = CliRunner().invoke(main, ["plan", str(one_pressure[0]), "--candidates", *names, "--json", str(out)])
    assert done.exit_code == 0, done.output
    result = json.loads(out.read_text())
    assert result["verdict"] == "one of"
    step = result["protocol"][0]
    assert {"what", "separates", "power", "test", "repeats", "simulate", "order"} <= set(step)
    assert step["simulate"].startswith("mckibben simulate")
    assert step["what"] in " ".join(done.output.split())
    assert result["next_measurement"]["power"] == step["power"]


@pytest.mark.slow
def test_the_whole_diagnosis_becomes_unique(one_pressure, tmp_path):
    """With the proposed loops recorded as a file beside the others, the diagnosis itself names the effect."""
    _, truth, experiment = one_pressure
    names = ["textile_friction", "viscous_damping", "constant_friction", "linear_spring"]
    tied = diagnose([experiment], BASELINE, candidates=[KNOWN[name]() for name in names])
    assert tied.verdict == "one of"
    found = nm.next_measurement(tied, [experiment])
    assert found is not None
    low, high = found.protocol.contractions
    turns = (low, *(high, low) * found.repeats)
    first = loops(truth, noise=NOISE, seed=1, **ONE_PRESSURE)
    more = loops(truth, found.protocol.pressures[:1], (found.speed,), turns, 200 * found.repeats, noise=NOISE, seed=7,
                 file="next.csv")  # fmt: skip
    write(dataset(truth, [first, more], "Set", NOISE, 1), tmp_path)
    after = diagnose([read_experiment(tmp_path)], BASELINE, candidates=[KNOWN[name]() for name in names])
    assert after.explanations == (("constant_friction",),)


def told(*powers):
    """A recording that tells the first pairs of three explanations apart so often."""
    pairs = zip(combinations((("a",), ("b",), ("c",)), 2), powers, strict=False)
    return SimpleNamespace(pairs=tuple(nm.PairPower(*pair, power, 10.0) for pair, power in pairs))


@pytest.mark.parametrize(
    ("before", "then", "worth"),
    [
        ([told(0.78)], told(0.78), False),  # the same once more
        ([told(0.78)], told(0.8), True),
        ([told(0.78)], told(0.2, 0.5), True),  # a pair that nothing told apart
        ([told(0.78, 0.9), told(0.5)], told(0.7, 0.9), False),
    ],
)
def test_a_recording_is_asked_for_if_it_tells_something_apart_better_than_those_before(before, then, worth):
    assert nm.tells_more(then, before) is worth


def test_a_map_takes_the_time_of_its_points():
    """12 places there, 12 back, 10 s each (`point_time`), three times."""
    assert nm.seconds_of(Protocol("static", (3e5, 3e5), (0.0, 0.2), 0.0), 3) == 3 * 24 * 10.0
