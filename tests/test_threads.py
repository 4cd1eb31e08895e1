"""Work on several items at once."""

import os
import subprocess
import sys
import threading

import jax
import jax.numpy as jnp
import pytest

from fitting.threads import at_once, worker_count


def test_results_stand_in_the_order_of_the_items():
    assert at_once(2, divmod, [7, 9, 11], [2, 4, 3]) == [(3, 1), (2, 1), (3, 2)]


def test_as_many_work_at_a_time_as_were_asked_for():
    both = threading.Barrier(2, timeout=30)
    assert sorted(at_once(2, lambda _: both.wait(), [0, 0])) == [0, 1]


@pytest.mark.parametrize("wanted", [True, False])
def test_threads_count_as_precisely_as_their_caller(wanted):
    """In the tasks of a cluster JAX is asked for 64 bits in one thread only."""
    with jax.enable_x64(wanted):
        expected = jnp.zeros(1).dtype
        assert at_once(2, lambda _: jnp.zeros(1).dtype, [0, 0]) == [expected] * 2


def test_what_goes_wrong_in_a_thread_is_raised():
    with pytest.raises(ZeroDivisionError):
        at_once(2, divmod, [7], [0])


@pytest.mark.parametrize(("cores", "expected"), [(1, 2), (2, 2), (6, 6), (96, 8)])
def test_searches_share_the_cores_of_the_machine(monkeypatch, cores, expected):
    monkeypatch.setattr("fitting.threads.cores", lambda: cores)
    assert worker_count() == expected


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="this system ties no process to cores")
def test_cores_are_those_that_this_process_may_use():
    """A batch system gives a process some cores of many."""
    tied = "import os; os.sched_setaffinity(0, {min(os.sched_getaffinity(0))}); "
    code = tied + "from fitting.threads import cores; print(cores())"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "1"
