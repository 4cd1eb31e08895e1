"""Other people's muscles, by the same script that is run on folders of them."""

from pathlib import Path

import numpy as np
import pytest
from real_muscles import best_polynomial, by_length, data_sets, discovered, outcome_text, rubber_text
from small_muscle import loops, write

from fitting.least_squares.fit import fit
from fitting.recordings.experiment import read_experiment
from mckibben_jax.effects import IdealCylinder

DATA = Path(__file__).parents[1] / "data"


STAYS_ABOVE = pytest.mark.xfail(strict=True, reason="1.6 % of full scale remain, and follow no effect of the library")


@pytest.mark.slow
@pytest.mark.parametrize("name", ["martens2017_dmsp10", pytest.param("martens2017_dmsp20", marks=STAYS_ABOVE)])
def test_a_published_muscle_is_explained_by_its_rubber(name):
    outcome = discovered(DATA / name)
    first, last = outcome.found.stages[1], outcome.found.stages[-1]
    compared = outcome.found.comparison
    assert outcome.task.library[first.added[0]].family == "bladder"
    assert compared.share < 0.01
    assert (last.held_out_rmse or np.inf) < outcome.free.held_out_rmse
    assert len(outcome.found.stages) <= 5
    assert f"first effect  {first.added[0]}" in outcome_text(outcome)
    assert f"{first.added[0]}." in rubber_text(outcome.found)


def test_sets_are_found_in_a_folder_and_by_themselves():
    names = [place.name for place in data_sets([str(DATA)])]
    assert {"martens2017_dmsp10", "martens2017_dmsp20"} <= set(names)
    assert "sealed" not in names
    assert list(data_sets([str(DATA / "martens2017_dmsp10")])) == [DATA / "martens2017_dmsp10"]


def test_a_folder_without_a_muscle_is_not_passed_over(tmp_path):
    (tmp_path / "force.csv").write_text("force [N]\n1\n")
    with pytest.raises(SystemExit, match=r"no muscle\.toml"):
        list(data_sets([str(DATA / "martens2017_dmsp10"), str(tmp_path)]))


def test_polynomials_reach_the_noise_of_a_force_that_is_one(tmp_path):
    """The ideal law is linear in pressure and of second degree in contraction, and friction is none."""
    folder = write(tmp_path / "small", loops(lambda *_: 0.0, noise=0.3, repeats=2))
    found = fit([read_experiment(folder)], [IdealCylinder()], starts=1)
    size = float(np.sqrt(np.mean((found.samples.measured - np.mean(found.samples.measured)) ** 2)))
    free = best_polynomial(found)
    assert free.rmse <= free.held_out_rmse < 0.5 * size
    assert by_length(found) < size
