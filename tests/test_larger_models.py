"""A larger model ends no higher than the one in it, wherever its own search would be caught."""

import json
from pathlib import Path
from types import SimpleNamespace

import jax
import pytest
from click.testing import CliRunner
from small_muscle import loops, surface, write

from fitting.cli.main import main
from fitting.diagnosis import judging
from fitting.diagnosis.among_all import fit_from_smaller
from fitting.diagnosis.discover import discover
from fitting.diagnosis.judging import ends_of, first_sound
from fitting.diagnosis.lay_out import universe
from fitting.least_squares.fit import fit
from fitting.recordings.experiment import read_experiment
from fitting.report.text.diagnosis import verdict_text
from mckibben_jax.effect import Pulling
from mckibben_jax.effects import (
    BladderMooneyRivlin,
    ConicalEnds,
    CoulombFriction,
    EndStop,
    IdealCylinder,
    LinearSpring,
    TextileFriction,
    Tip,
)
from mckibben_jax.parameter import parameter

BASE = (IdealCylinder(), CoulombFriction())


class Trap(Pulling):
    """A force that vanishes at q = 0, and is least again near q = 3, where a search that begins there stays."""

    source = "a test"
    q: jax.Array = parameter(2.966, "1", "place", range=(0.0, 4.0))

    def force(self, muscle, state):
        """The pull, N."""
        return 100.0 * self.q * ((self.q - 3.0) ** 2 + 0.2) * state.contraction


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    """Loops in which nothing is missing, and the fit of the model that made them."""
    experiment = read_experiment(write(tmp_path_factory.mktemp("d") / "small", loops(points=20, repeats=2)))
    return experiment, fit([experiment], BASE, starts=1)


def test_from_its_own_start_the_search_is_caught(small):
    experiment, smaller = small
    assert fit([experiment], [*BASE, Trap()], starts=1).cost > 2 * smaller.cost


@pytest.mark.parametrize("starts", [1, 2])
def test_a_fit_from_a_smaller_model_ends_no_higher(small, starts):
    experiment, smaller = small
    larger = fit([experiment], [*BASE, Trap()], start=smaller.values, starts=starts)
    assert larger.cost <= smaller.cost * (1 + 1e-9)
    assert larger.values["trap.q"] == pytest.approx(0.0, abs=0.01)


def test_add_begins_at_the_model_before(small, tmp_path):
    """The command, with a user's own effect that traps the search."""
    source = Path(__file__).read_text().split("class Trap")[1].split("@pytest")[0]
    heads = "import jax\nfrom mckibben_jax.effect import Pulling\nfrom mckibben_jax.parameter import parameter\n\n\n"
    own = tmp_path / "own.py"
    own.write_text(f"{heads}class Trap{source}")
    folder, out = write(tmp_path / "small", loops(points=20, repeats=2)), tmp_path / "r.json"
    order = ["add", folder, "trap", "--effect-file", own, "--starts", 1, "--json", out]
    done = CliRunner().invoke(main, [str(word) for word in order])
    assert done.exit_code == 0, done.output
    before, after = json.loads(out.read_text())["steps"]
    assert after["rmse_N"] == pytest.approx(before["rmse_N"], rel=0.02)
    assert (folder / "model.toml").exists()


def test_among_all_candidates_too(small):
    """Each of them is absent at some value of its parameters, which nobody has to name."""
    experiment, _ = small
    candidates = [Trap(), LinearSpring(), EndStop(), Tip(), ConicalEnds(), BladderMooneyRivlin()]
    world = universe([experiment], BASE, candidates)
    base = world.fit(frozenset(world.base), world.start)
    assert world.fit(world.with_added(["trap"]), base.vector, ["trap"]).cost > 2 * base.cost
    for name in world.candidates:
        assert fit_from_smaller(world, world.with_added([name]), base).cost <= base.cost * (1 + 1e-6), name


def test_a_friction_in_place_of_another_is_told_as_that(tmp_path):
    """Else a reader takes both for parts of the model, which has one."""
    load = lambda eps, pressure: surface(eps) * pressure / 1000.0  # noqa: E731  kN
    textile = lambda eps, p, sign: (20.0 * load(eps, p) ** 0.7 - 12.0 * load(eps, p)) * sign  # noqa: E731
    experiment = read_experiment(write(tmp_path / "set", loops(textile, points=40, repeats=2)))
    steps = discover([experiment], BASE, candidates=[TextileFriction(), Tip()])
    assert [(step.added, step.dropped) for step in steps] == [
        (("baseline",), ()),
        (("textile_friction",), ("coulomb_friction",)),
    ]
    named = "⟦textile_friction⟧ is missing in place of ⟦coulomb_friction⟧."
    assert verdict_text(steps[0].diagnosis).startswith(named)


@pytest.mark.parametrize(
    ("adequate", "cost", "stays"),
    [(True, 2.0, True), (True, 3.0, False), (False, 2.0, False), (False, 0.5, True)],
    ids=["adequate", "far more error", "not adequate", "lower anyway"],
)
def test_an_adequate_model_stays_in_its_valley(adequate, cost, stays, monkeypatch):
    """The lower end of the two, of cost 1, may be one that instruments made."""
    there, other = SimpleNamespace(cost=cost), SimpleNamespace(cost=1.0)
    world = SimpleNamespace(
        with_added=lambda names: names, fit=lambda *_, **__: there, decided=lambda fit: fit, left_out=lambda *_: None,
        at=lambda *_: there,
    )  # fmt: skip
    monkeypatch.setattr(judging, "fit_from_smaller", lambda *_, **__: other)
    search = SimpleNamespace(examiner=SimpleNamespace(groups=None, left=lambda fit: fit.cost))
    found = next(ends_of(world, search, None, SimpleNamespace(fit=None), ("end_stop",), adequate))
    assert found.fit is (there if stays else other)


@pytest.mark.parametrize(("left", "stays"), [(0.5, True), (0.9, False)], ids=["far less", "hardly less"])
def test_an_adequate_model_stays_where_it_is_right_though_the_way_leads_down(left, stays, monkeypatch):
    """A search from there ends where less is left of the rows, but more beyond what instruments can make of them."""
    before, there, other = (SimpleNamespace(cost=cost) for cost in (2.0, 1.5, 1.0))
    world = SimpleNamespace(
        with_added=lambda names: names, fit=lambda *_, **__: there, decided=lambda fit: fit, left_out=lambda *_: None,
        at=lambda *_: before,
    )  # fmt: skip
    monkeypatch.setattr(judging, "fit_from_smaller", lambda *_, **__: other)
    beyond = {id(before): left, id(there): 1.0}
    search = SimpleNamespace(examiner=SimpleNamespace(groups=None, left=lambda fit: beyond[id(fit)]))
    ends = list(ends_of(world, search, None, SimpleNamespace(fit=None), ("end_stop",), True))
    assert [end.fit for end in ends] == ([before, there] if stays else [there])
    assert first_sound(ends, lambda end: ("too dear",) if end.fit is before else ()).fit is there
    assert first_sound(ends, lambda end: ("anything",)) is ends[0]
