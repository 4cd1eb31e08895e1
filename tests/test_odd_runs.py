"""A run that differs from the others by more than its instruments allow is named, and told with and without."""

from dataclasses import replace

import numpy as np
import pytest
from hidden.instruments import LABORATORY
from hidden.simulator import EVERY_NOISE, Truth, dataset, loops, with_baseline, write
from hidden.study.protocols import WHOLE

from fitting import diagnose, read_experiment
from fitting.diagnosis.diagnose import prepared
from fitting.diagnosis.odd_runs import without_run
from fitting.report.results import odd_runs_result
from fitting.report.text.instrument_answers import odd_run_texts
from mckibben_jax import CoulombFriction, IdealCylinder, Tip

TRUTH = Truth(WHOLE, with_baseline())
BASE = [IdealCylinder(), CoulombFriction()]


def recorded(folder, run=None, zero=0.0, gain=0.0):
    """A clean muscle under all instrument errors, one run of which errs by more."""
    made = loops(TRUTH, noise=EVERY_NOISE["ar"], seed=5, samples=200, instruments=LABORATORY)
    if run is not None:
        force, mine = made.columns["force"].copy(), made.columns["run"] == run
        force[mine] = force[mine] * (1 + gain) + zero
        made = replace(made, columns={**made.columns, "force": force})
    return read_experiment(write(dataset(TRUTH, [made]), folder, say_accuracy=True))


def diagnosed(folder, **wrong):
    """The verdict on it, of one candidate."""
    return diagnose([recorded(folder, **wrong)], BASE, candidates=[Tip()])


@pytest.mark.parametrize(
    ("wrong", "kind", "size"), [({"zero": 8.0}, "zero_per_run", 8.0), ({"gain": 0.03}, "gain_per_run", 0.03)]
)
def test_a_run_that_somebody_bumped_into_is_named(wrong, kind, size, tmp_path):
    found = diagnosed(tmp_path / "data", run=3, **wrong)
    (one,) = odd_runs_result(found)
    assert (one["run"], one["channel"], one["kind"]) == ("3", "force", kind)
    assert one["size"] == pytest.approx(size, rel=0.4)  # the other runs' parameters give way to it
    assert one["p_value_without"] > found.level
    (text,) = odd_run_texts(found)
    assert text.startswith("Run 3 of ")
    assert "from run to run" not in text


def test_runs_within_their_accuracy_are_not(tmp_path):
    found = diagnosed(tmp_path / "data")
    assert found.odd_runs == ()
    assert np.isfinite(found.p_value)


def test_a_run_that_is_left_out_says_nothing(tmp_path):
    search = prepared([recorded(tmp_path / "data")], BASE, [Tip()])
    examiner, base = search.examiner, search.base
    _, columns = examiner.columns(base, {}, glance=True)
    mine = search.world.samples.run == 3
    torn = replace(base, rows=np.where(mine, 50 * np.sin(np.arange(len(mine))), base.rows))
    for run, same in ((3, True), (4, False)):
        p_values = [without_run(examiner, fit, columns, run) for fit in (base, torn)]
        assert (p_values[0] == pytest.approx(p_values[1])) is same
    other = np.where(mine[:, None], 7.0, columns)  # what candidates would change there says nothing, either
    assert without_run(examiner, base, other, 3) == pytest.approx(without_run(examiner, base, columns, 3))
