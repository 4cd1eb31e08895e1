"""Where a search stops: no three effects are looked for where all together would not do, and else they are found."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hidden.simulator import COLOURED, LABORATORY, dataset, loops, write
from hidden.study.sizes import base_of, hiding

from fitting.diagnosis.diagnose import prepared
from fitting.diagnosis.larger_sets import is_hopeless
from fitting.diagnosis.nuisance import Nuisance
from fitting.diagnosis.outcomes import Verdict
from fitting.diagnosis.verdict import diagnosis_of
from fitting.recordings.experiment import read_experiment
from mckibben_jax.effect import name_of
from mckibben_jax.effects import LIBRARY, CoulombFriction, IdealCylinder

NAMES = ("tip", "linear_spring", "viscous_damping", "force_offset", "constant_friction", "creep")
CANDIDATES = [kind() for kind in LIBRARY if name_of(kind) in NAMES]  # few: each must be compiled
THREE = {"tip": {"k": 1.15}, "linear_spring": {"K": 400.0}, "viscous_damping": {"B": 500.0}}  # 10 to 40 N each
NOBODYS = {"screw_ripple": {"A": 8.0, "p": 0.012}}


def search(folder, hidden, seed=3):
    """A search for what is hidden in loops whose instruments err."""
    truth = hiding(base_of(hidden), hidden)
    made = loops(truth, pressures=(1e5, 3e5, 5e5), samples=500, noise=COLOURED, seed=seed, instruments=LABORATORY)
    data = read_experiment(write(dataset(truth, [made], "Three", COLOURED, seed), folder))
    return prepared([data], [IdealCylinder(), CoulombFriction()], candidates=CANDIDATES)


def sizes(result):
    """Of the sets that were fitted."""
    return {len(added) for added in result.fits}


@pytest.fixture(scope="module")
def nobodys(tmp_path_factory):
    return search(tmp_path_factory.mktemp("nobodys") / "data", NOBODYS)


def test_no_three_are_looked_for_where_all_effects_together_leave_most(nobodys):
    result = nobodys.run()
    assert sizes(result) == {1, 2}
    assert diagnosis_of(result).verdict is Verdict.NOT_IN_LIBRARY
    assert len([added for added in result.adequacy_tests if len(added) == 2]) <= nobodys.settings.tested_at_a_look


def test_three_large_effects_are_found(tmp_path):
    """A linear look beside the best two is wrong by newtons here, and leaves little all the same."""
    searching = search(tmp_path / "data", THREE)
    result = searching.run()
    assert set(THREE) in result.adequate
    assert not searching.is_hopeless()
    assert diagnosis_of(result).explanations == (tuple(sorted(THREE)),)


def test_what_is_rejected_is_not_hopeless_where_all_together_leave_little(nobodys):
    """Of the same misfit, all together leave as much as there is; a share that nothing reaches is never hopeless."""
    fit = nobodys.fits[nobodys.best(2)[0]]
    assert is_hopeless(nobodys.examiner, fit, nobodys.fits)
    assert not is_hopeless(nobodys.examiner, fit, nobodys.fits, replace(nobodys.settings, hopeless=1.1))


def test_columns_beside_a_fit_give_way_and_nothing_is_known_of_them():
    random = np.random.default_rng(0)
    slopes, columns = random.normal(size=(30, 3)), random.normal(size=(30, 2))
    by = Nuisance(slopes, np.zeros(3), np.eye(3)).beside(1e6 * columns)
    np.testing.assert_allclose(by.project_out(columns), 0, atol=1e-9)
    assert np.linalg.norm(by.project_out(slopes)) > 0.1  # priors hold the fit's own parameters


@pytest.mark.parametrize(("share", "hopeless"), [(0.3, False), (0.9, True)])
def test_hopeless_is_what_leaves_a_good_part_of_the_misfit_beyond_the_floor(share, hopeless):
    """Rows of mean square 16, of which all effects together leave a share; the noise has 1."""
    along = np.zeros((100, 1))
    along[:50] = 1.0
    rows = np.concatenate([np.full(50, np.sqrt(2 * 15 * (1 - share))), np.tile([1.0, -1.0], 25)])
    rows[50:] *= np.sqrt(2 * (15 * share + 1))
    assert np.mean(rows**2) == pytest.approx(16)
    fit = SimpleNamespace(rows=rows, slopes=np.zeros((100, 0)), prior_rows=np.zeros(0), prior_slopes=np.zeros((0, 0)))
    examiner = SimpleNamespace(
        columns=lambda *_: ([], along),
        rejecting=lambda *_: SimpleNamespace(rejected=True, floor=1.0),
        without_instruments=lambda columns: columns,
    )
    assert is_hopeless(examiner, fit, {}, SimpleNamespace(hopeless=0.5)) is hopeless
