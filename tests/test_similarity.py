"""Which effects look alike: against a table of cosines that was computed independently, on the same loops."""

from dataclasses import replace
from types import SimpleNamespace

import jax.numpy as jnp
import numpy as np
import pytest

from fitting.diagnosis.similarity import CYCLE, Scene, Similarity, openings, signature, similarity
from mckibben_jax import effects as library
from mckibben_jax.effects import IdealCylinder, Tip
from mckibben_jax.model import model
from mckibben_jax.muscle import Muscle
from mckibben_jax.state import State

MUSCLE = Muscle(
    0.3, 7e-3, np.radians(20.0), wall_thickness=0.07 * 7e-3, shear_modulus=0.54e6, strand_width=3e-4,
    strand_modulus=2e9, strand_poisson=0.35,
)  # fmt: skip
BASE = model(MUSCLE, IdealCylinder(), Tip(k=1.25))
PLAIN = model(MUSCLE, IdealCylinder())
CONTRACTION, PRESSURE = np.linspace(0, 0.26, 27), np.arange(1, 6) * 1e5

# Pair, cosine of the raw signatures, the same after amplitude, angle and tip factor are fitted (None: both vanish), and
# how far off either may be: the table rounds, and its effects stand at sizes of their own.
TABLE = [
    ("Tip", "ConicalEnds", 0.998, None, 0.004),
    ("Tip", "ReducedLength", 0.973, None, 0.02),
    ("ReducedLength", "ConicalEnds", 0.96, None, 0.02),
    ("PressureOffset", "DeadBand", 1.0, 1.0, 1e-6),
    ("ForceOffset", "Weight", -1.0, -1.0, 1e-6),
    ("BladderMooneyRivlin", "BladderSchulte", 0.96, 0.945, 0.02),
    ("DeadBand", "ForceOffset", -0.90, -0.90, 0.02),
    ("StrandStretch", "SeriesCompliance", 0.91, 0.91, 0.05),
    ("CoulombFriction", "HertzFriction", 0.99, 0.99, 0.01),
    ("CoulombFriction", "TextileFriction", 0.985, 0.985, 0.012),
    ("TextileFriction", "ConstantFriction", 0.935, 0.935, 0.02),
    ("BladderHysteresis", "ConstantFriction", 0.97, 0.97, 0.03),
    ("CoulombFriction", "CrossingFriction", 0.99, 0.99, 0.012),
]
VANISH = ["Tip", "ConicalEnds", "ReducedLength", "ForceGain", "PressureGain"]


def loops() -> Scene:
    """Both branches at every contraction and pressure of the table, each sample a run of its own."""
    grid = np.stack(np.meshgrid(CONTRACTION, PRESSURE, [0.02, -0.02], indexing="ij"), axis=-1).reshape(-1, 3)
    contraction, pressure, rate = (jnp.asarray(column)[:, None] for column in grid.T)
    zero = jnp.zeros_like(contraction)
    return Scene(State(contraction, pressure, rate, zero, zero, zero, zero), np.ones(contraction.shape, bool), 1.0)


def kinds():
    return {getattr(library, name) for row in TABLE for name in row[:2]} | {getattr(library, n) for n in VANISH}


@pytest.fixture(scope="module")
def found():
    scene, traces = loops(), {}
    rubber = BASE.add(library.BladderMooneyRivlin())
    for kind in kinds():
        base = rubber if "rubber" in kind.needs else BASE
        traces[kind.__name__] = signature(kind, {0: base}, [scene])
    return similarity(traces, freed(scene))


def freed(scene):
    """What amplitude, braid angle and tip factor can make up for: P times any parabola over contraction."""
    angle = float(MUSCLE.braid_angle)
    turned = [replace(BASE, muscle=replace(MUSCLE, braid_angle=jnp.asarray(angle + d))) for d in (1e-5, -1e-5)]
    stretched = [model(MUSCLE, IdealCylinder(), Tip(k=1.25 + d)) for d in (1e-5, -1e-5)]
    pairs = [[scene.rows(m) for m in both] for both in (turned, stretched)]
    return np.stack([scene.rows(BASE), *(a - b for a, b in pairs)], axis=1)


@pytest.mark.parametrize(("one", "other", "raw", "after", "tolerance"), TABLE)
def test_cosines_are_those_of_the_table(found, one, other, raw, after, tolerance):
    assert found.cosine(one, other) == pytest.approx(raw, abs=tolerance)
    if after is not None:
        assert found.cosine(one, other, freed=True) == pytest.approx(after, abs=tolerance)


@pytest.mark.parametrize("name", VANISH)
def test_what_is_a_parabola_times_pressure_is_absorbed(found, name):
    assert found.left[found.names.index(name)] < 0.02


def test_what_the_geometry_leaves_of_each_effect(found):
    """Shares of the rms that remain: stretch and compliance a quarter, whatever has no pressure about 43 %."""
    left = dict(zip(found.names, found.left, strict=True))
    assert left["StrandStretch"] == pytest.approx(0.25, abs=0.06)
    assert left["SeriesCompliance"] == pytest.approx(0.25, abs=0.06)
    for name in ("BladderMooneyRivlin", "BladderSchulte", "ForceOffset"):
        assert left[name] == pytest.approx(0.43, abs=0.06)
    assert left["CoulombFriction"] == pytest.approx(1.0, abs=0.01)  # no even law makes up for an odd one


def test_effects_that_look_alike_are_chained():
    """The first like the second, this like the third; the fourth like none of them, the fifth is absorbed."""
    freed = np.eye(5)
    for one, other, cosine in ((0, 1, 0.99), (1, 2, -0.99), (0, 2, 0.9), (3, 4, 1.0)):
        freed[one, other] = freed[other, one] = cosine
    found = Similarity(tuple("abcde"), np.eye(5), freed, np.array([1.0, 1.0, 1.0, 1.0, 0.01]), np.ones(5))
    assert found.classes == (("a", "b", "c"),)


def test_what_could_be_measured_is_what_its_words_say():
    """Pressures, turning points and speeds against the loops that were measured: 0 to 26 % at up to 500 kPa."""
    measured = loops()
    offered = openings(SimpleNamespace(), [measured])
    stroke, top = CONTRACTION.max(), PRESSURE.max()
    states = {what: scene.states for what, scene in offered.items()}
    assert not np.any(states["a pull without pressure"].pressure)
    low = np.unique(states["loops from a tenth of the pressure upwards"].pressure)
    np.testing.assert_allclose(low, [0.1 * top, 0.3 * top, top])
    fast, small = states["the same loops ten times as fast"], states["small loops inside large ones"]
    for given, rate in ((fast, 0.2), (small, 0.02)):
        np.testing.assert_allclose(np.abs(given.rate[:, 1:-1]), rate)
        np.testing.assert_allclose(np.unique(given.pressure), [0.1 * top, 0.4 * top, top])
        assert given.contraction.max() == pytest.approx(stroke, rel=0.03)
        way = np.abs(np.diff(given.contraction[0]))
        np.testing.assert_allclose(way, rate * np.diff(given.time[0]), atol=stroke / CYCLE)
    turns = np.diff(np.sign(small.rate[0])) != 0
    inner = np.asarray(small.contraction[0])[1:][turns]
    assert np.any(np.abs(inner - 0.4 * stroke) < 0.03 * stroke)
    assert np.any(np.abs(inner - 0.6 * stroke) < 0.03 * stroke)
    halved = offered["a second muscle, half as long"].change(MUSCLE)
    assert float(halved.length) == pytest.approx(0.5 * float(MUSCLE.length))
