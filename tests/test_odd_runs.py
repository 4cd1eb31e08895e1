"""A run that differs from the others by more than its instruments allow is named, and told with and without."""

from dataclasses import replace

import numpy as np
import pytest
from hidden.instruments import LABORATORY
from hidden.simulator import EVERY_NOISE, Truth, dataset, loops, with_baseline, write
from hidden.study.protocols import WHOLE

from fitting import diagnose, read_experiment
from fitting.report.results import odd_runs_result
from fitting.report.text.instrument_answers import odd_run_texts
from mckibben_jax import CoulombFriction, IdealCylinder, Tip

TRUTH = Truth(WHOLE, with_baseline())


def diagnosed(folder, run=None, zero=0.0, gain=0.0):
    """The verdict on a clean muscle under all instrument errors, one run of which errs by more, of two candidates."""
    made = loops(TRUTH, noise=EVERY_NOISE["ar"], seed=5, samples=200, instruments=LABORATORY)
    if run is not None:
        force, mine = made.columns["force"].copy(), made.columns["run"] == run
        force[mine] = force[mine] * (1 + gain) + zero
        made = replace(made, columns={**made.columns, "force": force})
    experiment = read_experiment(write(dataset(TRUTH, [made]), folder, say_accuracy=True))
    return diagnose([experiment], [IdealCylinder(), CoulombFriction()], candidates=[Tip()])


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
