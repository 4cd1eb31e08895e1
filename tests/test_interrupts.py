"""Ctrl-C: it stops a command wherever it falls, and the command says what is kept."""

import ctypes
import os
import signal
import subprocess
import sys
import time

import pytest
from click.testing import CliRunner

from fitting.cli.interrupts import end_at_once, interruptible
from fitting.cli.main import main
from fitting.model_files.model_file import read_model
from fitting.posterior import sample as sampling
from fitting.report.text.study import step_report
from fitting.shipped import example_data
from mckibben_jax.effect import name_of

CALLBACK = ctypes.CFUNCTYPE(None)


def by_ctrl_c():
    raise KeyboardInterrupt


def by_a_scheduler():
    os.kill(os.getpid(), signal.SIGTERM)
    time.sleep(0.01)


@pytest.mark.parametrize(
    ("stopped", "ctrl_c"),
    [(by_ctrl_c, signal.default_int_handler), (by_a_scheduler, signal.SIG_IGN)],  # what a shell runs behind ignores it
)
def test_a_stop_in_a_callback_of_compiled_code_is_not_lost(stopped, ctrl_c):
    """Python alone reports it and goes on."""
    before, called = signal.signal(signal.SIGINT, ctrl_c), CALLBACK(stopped)
    try:
        with pytest.raises(KeyboardInterrupt), interruptible():  # noqa: PT012  it is raised a few steps after the call
            called()
            time.sleep(5.0)
            pytest.fail("it was lost")
    finally:
        signal.signal(signal.SIGINT, before)


def test_a_scheduler_that_ends_a_job_stops_a_command_as_ctrl_c_does():
    before = signal.getsignal(signal.SIGTERM)
    with pytest.raises(KeyboardInterrupt), interruptible():  # noqa: PT012  it is raised a few steps after the call
        os.kill(os.getpid(), signal.SIGTERM)
        time.sleep(5.0)
    assert signal.getsignal(signal.SIGTERM) is before


def test_a_server_is_ended_at_once_by_the_same_signal():
    before = signal.getsignal(signal.SIGTERM)
    with interruptible():
        end_at_once()
        assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL
    assert signal.getsignal(signal.SIGTERM) is before


def test_other_errors_in_callbacks_are_reported_as_before(monkeypatch):
    seen = []
    monkeypatch.setattr(sys, "unraisablehook", seen.append)

    @CALLBACK
    def wrong():
        raise ValueError("of its own")

    with interruptible():
        wrong()
    assert [found.exc_type for found in seen] == [ValueError]
    assert sys.unraisablehook == seen.append


@pytest.mark.parametrize("kept", [True, False])
def test_a_stopped_posterior_says_what_is_kept(tmp_path, monkeypatch, kept):
    """It says nothing else: emcee would print every walker and a traceback."""
    chains = tmp_path / "kept.chains"
    where = ["--chains", str(chains)] if kept else ["--no-chains"]
    monkeypatch.setattr(sampling, "log_probs", lambda *_: _stopped)
    result = CliRunner().invoke(main, ["posterior", str(example_data("muscle_a")), "--baseline", "--quiet", *where])
    assert result.exit_code == 1
    assert "Stopped." in result.stderr
    assert (f"kept in {chains}" if kept else "No chains are kept") in result.stderr
    assert "Aborted" not in result.stderr  # which sounds like a crash
    assert "Traceback" not in result.output
    assert "params:" not in result.output


@pytest.mark.parametrize("steps", [1, 2])
def test_a_stopped_discovery_keeps_its_last_step(springy, tmp_path, monkeypatch, steps):
    """A newcomer stopped it after 27 minutes, when all but the last table was there, and had nothing."""
    shown, file = [], tmp_path / "model.toml"

    def stopped(stage):
        shown.append(stage)
        if len(shown) == steps:
            raise KeyboardInterrupt
        return step_report(stage)

    monkeypatch.setattr("fitting.report.text.study.step_report", stopped)
    done = CliRunner().invoke(main, ["discover", str(springy), "--baseline", "--save", str(file)])
    assert done.exit_code == 1
    if steps == 1:
        assert "Stopped. No step is kept." in done.stderr
        assert not file.exists()
        return
    assert "Stopped. The last step is kept." in done.stderr
    assert "SAVED" in done.stdout
    assert shown[-1].added
    assert set(shown[-1].added) <= {name_of(effect) for effect in read_model(file).effects}


def _stopped(_points):
    raise KeyboardInterrupt


STUCK = """
import ctypes, signal
from fitting.cli import interrupts
signal.signal(signal.SIGINT, signal.default_int_handler)  # what a shell runs behind ignores it
interrupts.GRACE = 0.5
with interrupts.interruptible():
    mutex, c = ctypes.create_string_buffer(64), ctypes.CDLL(None)
    c.pthread_mutex_lock(mutex)
    print("begun", flush=True)
    c.pthread_mutex_lock(mutex)  # waits for itself, as threads of a library did; no signal wakes it up
"""


@pytest.mark.skipif(sys.platform != "linux", reason="a mutex of zeros is one of Linux")
@pytest.mark.parametrize("signals", [(signal.SIGTERM,), (signal.SIGINT, signal.SIGINT)])
def test_compiled_code_that_never_returns_is_ended(signals):
    """`timeout` could not end a command whose threads waited for each other, nor could Ctrl-C."""
    with subprocess.Popen([sys.executable, "-c", STUCK], stdout=subprocess.PIPE, stderr=subprocess.PIPE) as child:
        assert child.stdout.readline() == b"begun\n"
        for number in signals:
            time.sleep(0.2)  # it is in there
            child.send_signal(number)
        _, said = child.communicate(timeout=20)
    assert child.returncode == 1
    assert b"did not stop within" in said
