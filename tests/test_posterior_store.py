"""Chains on disk: killed at any moment, resumed, the same numbers; and what is said where nothing can be written."""

import dataclasses
import os
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from fitting.errors import InputError
from fitting.posterior.sample import sample
from fitting.posterior.store import Store
from tests.test_posterior import straight_line

STEPS = 1000
CHILD = """
import sys
import jax
jax.config.update("jax_enable_x64", True)
from tests.test_posterior_store import grown
grown(sys.argv[1])
"""


def grown(path, **more):
    """The posterior of the straight line, its chains kept in a file; never settled before its last step."""
    found, experiment = straight_line()
    few = {"ensembles": 2, "walkers": 8, "max_steps": STEPS, "limit_s": 1e4}
    return sample(found, [experiment], seed=3, chains=path, **few, **more)


def killed(path, blocks, wait):
    """Start, let some blocks be written, wait a little, kill -9; how many blocks are kept."""
    child = subprocess.Popen([sys.executable, "-c", CHILD, str(path)], cwd=Path(__file__).parents[1])
    try:
        while child.poll() is None and count(path) < blocks:
            time.sleep(0.005)
        time.sleep(wait)
        child.send_signal(signal.SIGKILL)
    finally:
        child.kill()
        child.wait()
    return count(path)


def count(path):
    import sqlite3

    try:
        return sqlite3.connect(path).execute("SELECT count(*) FROM block").fetchone()[0]
    except sqlite3.Error:
        return 0


@pytest.fixture(scope="module")
def undisturbed():
    return grown(None)


@pytest.mark.parametrize("moment", [0])
def test_killed_and_resumed_it_is_the_same_posterior(tmp_path, undisturbed, moment):
    assert_resumes(tmp_path / "chains", undisturbed, moment)


@pytest.mark.slow
@pytest.mark.parametrize("moment", range(10))
def test_killed_at_ten_random_moments(tmp_path, undisturbed, moment):
    assert_resumes(tmp_path / "chains", undisturbed, 100 + moment)


def assert_resumes(path, undisturbed, moment):
    random = np.random.default_rng(moment)
    kept = killed(path, int(random.integers(1, 8)), random.uniform(0, 0.05))
    assert kept >= 1
    resumed = grown(str(path))
    np.testing.assert_array_equal(resumed.draws.values, undisturbed.draws.values)
    assert count(path) >= kept  # a fast machine may have been done before it was killed


def test_a_finished_run_is_read_not_sampled_again(tmp_path, undisturbed):
    path = str(tmp_path / "chains")
    grown(path)
    before = count(path)
    again = grown(path)
    assert count(path) == before
    np.testing.assert_array_equal(again.draws.values, undisturbed.draws.values)


def test_another_model_or_seed_has_its_own_place(tmp_path):
    path = str(tmp_path / "chains")
    found, experiment = straight_line()
    short = {"ensembles": 2, "walkers": 8, "max_steps": 50, "chains": path}
    first = sample(found, [experiment], seed=1, **short)
    other = sample(found, [experiment], seed=2, **short)
    assert not np.array_equal(first.draws.values, other.draws.values)
    moved = dataclasses.replace(experiment, sha256="1" * 64)
    before = count(path)
    sample(found, [moved], seed=1, **short)
    assert count(path) > before


def test_again_begins_anew(tmp_path):
    store = Store(tmp_path / "chains", "run")
    store.at("main").append(1, {"chain": np.ones(3)})
    Store(tmp_path / "chains", "other").append(1, {"chain": np.ones(2)})
    store.forget()
    assert store.at("main").blocks() == []
    assert len(Store(tmp_path / "chains", "other").blocks()) == 1


def test_a_full_disk_is_said_and_what_was_kept_stays(tmp_path):
    """A limit on the size of files stands for the full disk: writing fails in the same place."""
    store = Store(tmp_path / "chains", "run")
    store.append(1, {"chain": np.arange(10.0)})
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    previous = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, hard))
    try:
        with pytest.raises(InputError, match="the disk took no more; the chains up to here are kept") as caught:
            store.append(2, {"chain": np.zeros(100_000)})
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        signal.signal(signal.SIGXFSZ, previous)
    assert "goes on from there" in caught.value.cure
    np.testing.assert_array_equal(store.blocks()[0]["chain"], np.arange(10.0))
    assert len(store.blocks()) == 1


def test_a_place_that_cannot_be_written_is_said(tmp_path):
    with pytest.raises(InputError, match="the chains cannot be kept here"):
        Store(tmp_path / "nowhere" / "chains", "run").frame()
    with pytest.raises(InputError, match="the chains cannot be kept here"):
        Store(tmp_path, "run").frame()


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_a_folder_without_permission_is_said(tmp_path):
    tmp_path.chmod(0o500)
    with pytest.raises(InputError, match="cannot be kept here"):
        Store(tmp_path / "chains", "run").frame()


def test_a_file_that_is_something_else_is_left_alone(tmp_path):
    path = tmp_path / "notes.txt"
    path.write_text("my notes, which are long enough to be no header of a database\n" * 20)
    before = path.read_bytes()
    with pytest.raises(InputError, match="no file of chains"):
        Store(path, "run").frame()
    assert path.read_bytes() == before
