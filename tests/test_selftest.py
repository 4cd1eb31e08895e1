"""The self-test hides what it says, in recordings that err as it says, and reports what the diagnosis made of it."""

import dataclasses

import numpy as np
import pytest
import small_muscle
from rich.console import Console

from fitting.diagnosis.diagnose import prepared
from fitting.errors import InputError
from fitting.least_squares.fit import fit
from fitting.least_squares.working_noise import Noise
from fitting.library.line import effect_from_line
from fitting.recordings.accuracy import Accuracy, ChannelAccuracy
from fitting.recordings.experiment import read_experiment
from fitting.report.text.selftest import misfit_texts, nothing_text, selftest_report, selftest_result, sought_text
from fitting.selftest import selftest as module
from fitting.selftest.hide import Hiding
from fitting.selftest.instruments import Rig
from fitting.selftest.record import Log, Outcome, SelfTest, Sought, Trial
from fitting.selftest.rehearse import rehearsed
from fitting.selftest.selftest import selftest
from fitting.study.request import Request
from fitting.study.task import task_of
from mckibben_jax.effects import (
    CoulombFriction,
    ForceOffset,
    HertzFriction,
    IdealCylinder,
    Presliding,
    SchulteFriction,
    TextileFriction,
    Tip,
)

BASE = (IdealCylinder(), CoulombFriction())
KINDS = (Tip(), ForceOffset(), TextileFriction(), Presliding(), SchulteFriction())
EXACT = Accuracy(
    *(ChannelAccuracy(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0) for _ in range(3)), skew=0.0
)  # nothing errs but what is told


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    rows = small_muscle.loops(points=40, repeats=2, pressures=(1e5, 2e5, 3e5, 4e5))
    return small_muscle.write(tmp_path_factory.mktemp("self") / "small", rows)


@pytest.fixture(scope="module")
def experiment(folder):
    return read_experiment(folder)


@pytest.fixture(scope="module")
def search(experiment):
    return prepared([experiment], BASE, KINDS)


# What is hidden -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["tip", "force_offset", "textile_friction", "presliding"])
def test_an_effect_leaves_what_was_asked_for_when_the_model_is_fitted_again(name, search, experiment):
    """Against a fit of the model without it to its own recordings, made without any error."""
    hiding = Hiding(search, name)
    hidden = hiding.of(2.0)
    assert hidden.size == pytest.approx(2.0, rel=0.25)
    made = with_force(search, experiment, hiding.effects, hidden.vector)
    again = fit([made], BASE, start=search.baseline.values, starts=1)
    assert again.rmse == pytest.approx(hidden.size, rel=0.05)
    truth = [effect for each, effect in search.world.effects.items() if each in hiding.effects]
    with_it = fit([made], truth, start=search.baseline.values | hidden.values, starts=1)
    assert with_it.rmse < 0.02


def with_force(search, experiment, effects, vector):
    """The recordings as a rig without errors would read them."""
    exact = dataclasses.replace(
        experiment, recordings=tuple(dataclasses.replace(r, accuracy=EXACT) for r in experiment.recordings)
    )
    quiet = Noise(0.0, np.zeros(len(Noise(0.0, np.zeros(0)).memories)))
    examiner = search.examiner
    before = examiner._noise.get(search.base)
    examiner._noise[search.base] = quiet
    try:
        return rehearsed(search, [exact], effects, vector, seed=0)[0]
    finally:
        examiner._noise.pop(search.base) if before is None else examiner._noise.update({search.base: before})


def test_nothing_hidden_and_no_error_is_the_model_itself(search, experiment):
    made = with_force(search, experiment, search.base.effects, search.base.vector)
    assert fit([made], BASE, start=search.baseline.values, starts=1).rmse < 1e-6


def test_a_size_beyond_the_range_is_not_hidden(search):
    assert Hiding(search, "presliding").of(1e6) is None


def test_a_parameter_grows_towards_its_usual_value(search):
    """Textile friction is Coulomb's at beta = 1, and usually below."""
    hidden = Hiding(search, "textile_friction").of(1.0)
    assert hidden.values["textile_friction.beta"] < 1
    assert hidden.values["textile_friction.f_s"] == pytest.approx(search.baseline.values["coulomb_friction.f_s"])


# What errs ------------------------------------------------------------------------------------------------------------


def drawn(experiment, accuracy, noise=0.0, seed=0):
    """Readings of the first recording of a rig whose only errors are these."""
    recording = dataclasses.replace(experiment.recordings[0], accuracy=accuracy, found=EXACT)
    quiet = Noise(noise, np.zeros(len(Noise(0.0, np.zeros(0)).memories)))
    shown = [run.measured for run in recording.runs]
    length = float(experiment.muscle.length)
    return recording, Rig(recording, quiet, 1.0, np.random.default_rng(seed)).readings(shown, length)


def test_a_rig_without_errors_reads_what_is_there(experiment):
    recording, read = drawn(experiment, EXACT)
    for run, one in zip(recording.runs, read, strict=True):
        np.testing.assert_allclose(one.pressure, run.pressure)
        np.testing.assert_allclose(one.contraction, run.contraction, atol=1e-15)
        np.testing.assert_allclose(one.measured, run.measured)


def one_error(channel, **sizes):
    return dataclasses.replace(EXACT, **{channel: dataclasses.replace(getattr(EXACT, channel), **sizes)})


def test_a_gain_of_the_gauge_is_one_factor_for_all_readings(experiment):
    recording, read = drawn(experiment, one_error("pressure", gain=0.02))
    factors = np.concatenate([one.pressure / run.pressure for one, run in zip(read, recording.runs, strict=True)])
    assert np.ptp(factors) < 1e-12
    assert 0 < abs(factors[0] - 1) < 0.1


def test_a_zero_of_each_run_differs_from_run_to_run(experiment):
    recording, read = drawn(experiment, one_error("force", zero_per_run=3.0))
    shifts = [one.measured - run.measured for one, run in zip(read, recording.runs, strict=True)]
    assert all(np.ptp(shift) < 1e-9 for shift in shifts)
    assert len({round(float(shift[0]), 6) for shift in shifts}) == len(shifts)


def test_errors_are_as_large_as_they_are_allowed(experiment):
    """Over many rigs; zero of the load cell, and its noise in readings' noises of 0.3 N."""
    zeros = [drawn(experiment, one_error("force", zero=2.0), seed=s)[1][0].measured[0] for s in range(400)]
    there = experiment.recordings[0].runs[0].measured[0]
    assert np.std(np.array(zeros) - there) == pytest.approx(2.0, rel=0.12)
    recording, read = drawn(experiment, EXACT, noise=1.0)
    left = np.concatenate([one.measured - run.measured for one, run in zip(read, recording.runs, strict=True)])
    assert np.std(left) == pytest.approx(0.3, rel=0.08)


def test_readings_are_rounded_as_the_gauge_rounds(experiment):
    _, read = drawn(experiment, one_error("pressure", resolution=500.0, noise=2000.0))
    values = np.concatenate([one.pressure for one in read]) / 500.0
    np.testing.assert_allclose(values, np.round(values), atol=1e-9)


def test_a_skew_shifts_the_force_in_time(experiment):
    recording, read = drawn(experiment, dataclasses.replace(EXACT, skew=0.2))
    run = recording.runs[0]
    shifts = np.linspace(-0.8, 0.8, 1601)
    misses = [np.sum((np.interp(run.time - s, run.time, run.measured) - read[0].measured) ** 2) for s in shifts]
    assert min(misses) < 1e-3 * misses[800]


# The whole ------------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def task(folder):
    return task_of(Request(data=(str(folder),), baseline=True))


def test_what_is_hidden_at_a_few_times_its_limit_is_named(task, tmp_path):
    """And the next call goes on where the first was, with a torn line in between."""
    log = Log(tmp_path / "log.jsonl", "")
    first = selftest(task, KINDS, ("tip",), log)
    assert first.clean.verdict in ("nothing detectable", "within the instruments")
    (tip,) = first.sought
    assert tip.seen_from <= 8.1 * tip.limit
    text = log.path.read_text()
    log.path.write_text(text + text.splitlines()[-1][:40])
    log.keep(first.clean)  # on a line of its own
    assert len(dataclasses.replace(log, mark="").known()) == 1
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "diagnose", None)
        assert selftest(task, KINDS, ("tip",), log) == first
    with pytest.raises(InputError, match="did you mean 'tip'"):
        selftest(task, KINDS, ("tipp",))


def test_another_seed_is_another_self_test(task, tmp_path, search):
    other = dataclasses.replace(task, seed=1)
    assert module._mark(task, search) != module._mark(other, search)


# What is said ---------------------------------------------------------------------------------------------------------


def trial(effect, size, outcome, *explanations):
    return Trial(effect, size, size, {"tip.k": 1.25} if effect == "tip" else {}, "missing", explanations, outcome)


NOTHING = Trial("", 0.0, 0.0, {}, "nothing detectable", (), Outcome.NOT_SEEN)
TIP = Sought("tip", 0.5, (trial("tip", 0.5, Outcome.NOT_SEEN), trial("tip", 1.0, Outcome.ONE_OF, ("tip",), ("creep",)),
                          trial("tip", 2.0, Outcome.NAMED, ("tip",))))  # fmt: skip
LOST = Sought("creep", 0.1, (trial("creep", 0.4, Outcome.MISTAKEN, ("hill",)), trial("creep", 0.8, Outcome.UNKNOWN)))
BLIND = Sought("supply_lag", None, why_not="these data cannot see it")


def test_an_effect_is_found_from_where_every_larger_one_is():
    assert (TIP.seen_from, TIP.named_from) == (1.0, 2.0)
    gap = dataclasses.replace(TIP, trials=(TIP.trials[2], trial("tip", 4.0, Outcome.MISTAKEN, ("hill",))))
    assert (gap.seen_from, gap.named_from) == (None, None)
    assert LOST.taken_for == (("hill",),)


def test_a_report_says_what_was_found_of_each_and_what_was_not():
    test = SelfTest(NOTHING, (TIP, LOST, BLIND), {"tip.k": "1"})
    out = Console(width=300, record=True, file=open("/dev/null", "w"))  # noqa: SIM115
    for part in selftest_report(test):
        out.print(part)
    said = " ".join(out.export_text().split())
    for words in (
        "nothing was found missing",
        "1 effect of 2: Tip correction (tip)",
        "not found at any size that was tried: Creep (creep)",
        "Lag of the supply pressure (supply_lag): these data cannot see it",
        "tied with Creep (creep)",
        "Hill's law of shortening (hill) or none of the library",
        "> 0.8 N",
    ):
        assert words in said  # fmt: skip
    assert sought_text(TIP) == "⟦tip⟧: named from 2 N"
    told = selftest_result(test)["effects"]
    assert told["tip"]["named_from_N"] == 2.0
    assert told["tip"]["trials"][0]["values"] == {"tip.k": {"value": 1.25, "unit": "1"}}
    assert told["creep"]["taken_for"] == [["hill"]]
    assert told["supply_lag"] == {"detection_limit_N": None, "named_from_N": None, "seen_from_N": None,
                                  "taken_for": [], "why_not": "these data cannot see it", "trials": []}  # fmt: skip


def test_a_model_that_misses_the_recordings_is_no_truth_to_test_with():
    test = SelfTest(NOTHING, (TIP,), {"tip.k": "1"}, rmse=12.5, over_noise=25.0)
    (said,) = misfit_texts(test)
    assert "misses these recordings by 12.5 N rms, 25 times the noise" in said
    assert misfit_texts(dataclasses.replace(test, over_noise=1.1)) == []
    assert selftest_result(test)["model_rmse_over_noise"] == 25.0


def test_a_false_alarm_is_said_first():
    alarm = dataclasses.replace(NOTHING, verdict="missing", explanations=(("tip",),))
    assert nothing_text(alarm).startswith("A false alarm")
    assert "tip" in nothing_text(alarm)


def test_what_needs_a_measurement_is_no_candidate(experiment):
    with pytest.raises(InputError, match="unknown effect in --hide"):
        module._chosen(prepared([experiment], BASE, [*KINDS, HertzFriction()]), ("hertz_friction",))


def test_a_file_that_is_no_log_is_left_alone(tmp_path):
    data, log = tmp_path / "loops.csv", Log(tmp_path / "log.jsonl")
    data.write_text("run,time [s]\n")
    with pytest.raises(InputError, match="left alone"):
        Log(data).check()
    log.check()
    log.keep(NOTHING)
    log.check()
    assert Log(log.path).known() == {("", 0.0): NOTHING}
    assert Log(log.path, again=True).known() == {}


def test_instruments_of_one_accuracy_err_alike_in_all_recordings(experiment):
    """Two recordings of one gauge: one zero, one gain."""
    accuracy = one_error("pressure", zero=1000.0, gain=0.01)
    both = tuple(dataclasses.replace(experiment.recordings[0], accuracy=accuracy, found=EXACT) for _ in range(2))
    shared, read = {}, []
    quiet = Noise(0.0, np.zeros(len(Noise(0.0, np.zeros(0)).memories)))
    random = np.random.default_rng(0)
    for recording in both:
        rig = Rig(recording, quiet, 1.0, random, shared)
        read.append(rig.readings([run.measured for run in recording.runs], float(experiment.muscle.length)))
    for one, other in zip(*read, strict=True):
        np.testing.assert_array_equal(one.pressure, other.pressure)


def test_effects_of_one_name_and_another_law_are_other_self_tests():
    marks = []
    for text in ("drag = -B*v, B = 5 N s/m (0..99)", "drag = -B*v*v, B = 5 N s^2/m^2 (0..99)"):
        marks.append(module._law(effect_from_line(text)()))
    assert marks[0] != marks[1]
