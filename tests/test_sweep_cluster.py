"""Sweeps on a Dask cluster whose workers die."""

import os
import signal
import subprocess
import sys

import numpy as np
import pytest
from sweeping import ALL, BEST, FILE, SAMPLE, order, table

from fitting.designs.sweep import sweep
from fitting.errors import InputError
from mckibben_jax.design.batch import Engine


@pytest.mark.parametrize("keep", [BEST, ALL])
def test_a_cluster_loses_and_doubles_nothing_when_a_worker_is_killed(tmp_path, keep):
    distributed = pytest.importorskip("distributed")
    from fitting.cli.cluster.sweeps import on

    whole = sweep(order(tmp_path, keep), tmp_path / "whole", piece=250)
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as cluster:
        victims = [worker.pid for worker in cluster.workers.values()]
        on_cluster = on(cluster.scheduler_address)

        def work(*ordered):
            for done, found in enumerate(on_cluster(*ordered)):
                if done == 2:
                    os.kill(victims[0], signal.SIGKILL)
                yield found

        shared = sweep(order(tmp_path, keep), tmp_path / "shared", work=work, piece=250)
    assert shared.computed == 5000
    for a, b in zip(whole.tally, shared.tally, strict=True):
        np.testing.assert_array_equal(a, b)
    for name, column in table(whole).items():
        np.testing.assert_array_equal(column, table(shared)[name])


MODEL = """format = 1
[muscle]
length = "300 mm"
radius = "8 mm"
braid_angle = "25 deg"
[[effect]]
name = "ideal_cylinder"
[[effect]]
name = "spring"
define = "spring = -K*x, K = 500 N/m (0..9000)"
K = "2000 N/m"
"""
ELSEWHERE = """
import sys
from fitting.cli.cluster.sweeps import do_piece
print(do_piece(open(sys.argv[1], "rb").read(), 0, 1000, float("-inf")).scores[0].hex())
"""


def test_an_effect_that_a_line_defines_goes_along(tmp_path):
    """A class that pickle takes apart forgets what its fields are, and the law would be another one."""
    from fitting.cli.cluster.scheduler import pack

    (tmp_path / "model.toml").write_text(MODEL)
    model, muscle = 'file = "model.toml"', FILE.partition("[model]")[0]
    ordered = order(tmp_path, BEST, SAMPLE, **{'effects = ["ideal_cylinder"]': model, muscle: "\n"})
    (tmp_path / "order").write_bytes(pack(ordered))
    ran = subprocess.run([sys.executable, "-c", ELSEWHERE, str(tmp_path / "order")], capture_output=True, text=True)
    best = Engine(ordered.batch, 1000).tally(0).scores[0]
    assert float.fromhex(ran.stdout.strip()) == best, ran.stderr
    alone = order(tmp_path, BEST, SAMPLE).batch
    assert best < Engine(alone, 1000).tally(0).scores[0]  # the spring takes its share


def test_a_scheduler_that_does_not_answer_is_said(monkeypatch):
    pytest.importorskip("distributed")
    from fitting.cli.cluster.sweeps import on

    monkeypatch.setattr("fitting.cli.cluster.scheduler.ANSWERS", "1s")
    with pytest.raises(InputError, match="no Dask scheduler answers"):
        on("tcp://127.0.0.1:9")
