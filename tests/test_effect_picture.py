"""The small picture of what an effect leaves in the data: in the test that shows it, and of the right shape."""

import numpy as np
import pytest
from click.testing import CliRunner

from fitting.cli.main import main
from fitting.report.pictures.effect import HIGH, WIDE, trace
from mckibben_jax.effect import Pulling
from mckibben_jax.effects import BladderNeoHookean, CoulombFriction, ForceOffset, SupplyOrifice, ViscousDamping


class Nothing(Pulling):
    """Pulls not at all."""

    def force(self, muscle, state):
        return 0.0 * state.contraction


def found(kind):
    shown = trace(kind)
    assert shown is not None
    return shown


def test_friction_is_what_turns_with_the_direction():
    shown = found(CoulombFriction)
    assert shown.over == "contraction"
    inside = np.abs(np.gradient(shown.at)) > 0
    assert np.all(shown.added[inside & shown.contracting] < 0)
    assert np.all(shown.added[inside & ~shown.contracting] >= 0)


def test_rubber_does_not_know_the_direction():
    shown = found(BladderNeoHookean)
    order = np.argsort(shown.at)
    assert np.abs(np.diff(shown.added[order])).max() < 0.1 * np.ptp(shown.added)


SHOWN = {ForceOffset: "10 mm/s", ViscousDamping: "300 mm/s", SupplyOrifice: "jump"}


@pytest.mark.parametrize(("kind", "test"), SHOWN.items())
def test_the_plainest_test_that_shows_it_is_drawn(kind, test):
    assert test in found(kind).test


def test_what_leaves_nothing_has_no_picture():
    assert trace(Nothing) is None


def test_the_command_draws_in_the_terminal_and_on_a_page(tmp_path):
    told = CliRunner().invoke(main, ["effects", "presliding", "--html", str(tmp_path / "e.html")])
    assert told.exit_code == 0, told.output
    drawn = [line for line in told.output.splitlines() if any(0x2800 < ord(letter) < 0x2900 for letter in line)]
    assert len(drawn) <= HIGH
    assert len(drawn) > HIGH / 2
    assert max(map(len, drawn)) <= WIDE + 10
    assert (tmp_path / "e.html").read_text().count("<svg") == 1
