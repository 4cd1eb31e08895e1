"""A command that takes minutes says so where no terminal shows its bar."""

import time

import pytest

from fitting.cli import waiting


@pytest.fixture
def clock(monkeypatch):
    """Seconds that pass when the test says so."""

    class Clock:
        now = 0.0

    monkeypatch.setattr(waiting.time, "monotonic", lambda: Clock.now)
    return Clock


def test_a_line_a_minute_where_there_is_no_terminal(clock, capsys):
    with waiting.progress_bar("diagnosing", quiet=False) as told:
        for seconds, words in ((30, "one effect at a time"), (61, "pairs"), (90, "testing"), (190, "triples")):
            clock.now = seconds
            told(words, 0.5)
    said = capsys.readouterr()
    assert said.err == "mckibben: 1 min, pairs\nmckibben: 3 min, triples\n"
    assert said.out == ""


def test_a_line_a_minute_though_the_work_says_nothing_new(clock, capsys, monkeypatch):
    monkeypatch.setattr(waiting, "A_LOOK", 0.01)
    with waiting.progress_bar("sampling", quiet=False):
        clock.now = 130
        time.sleep(0.2)
    assert capsys.readouterr().err == "mckibben: 2 min, sampling\n"


def test_what_is_printed_is_a_sign_of_life(clock, capsys):
    with waiting.progress_bar("diagnosing", quiet=False) as told:
        clock.now = 59
        with told.aside():
            pass
        clock.now = 100
        told("pairs", 0.5)
        assert capsys.readouterr().err == ""
        clock.now = 120
        told("pairs", 0.6)
        assert capsys.readouterr().err == "mckibben: 2 min, pairs\n"


def test_nothing_is_said_where_quiet_was_asked_for(clock, capsys):
    with waiting.progress_bar("diagnosing", quiet=True) as told:
        clock.now = 1000
        told("pairs", 0.5)
    assert capsys.readouterr().err == ""


def test_a_terminal_has_its_bar_instead(clock, capsys, monkeypatch):
    monkeypatch.setenv("FORCE_COLOR", "1")  # as rich decides whether it writes to a terminal
    with waiting.progress_bar("diagnosing", quiet=False) as told:
        clock.now = 1000
        told("pairs", 0.5)
    assert "mckibben:" not in capsys.readouterr().err
