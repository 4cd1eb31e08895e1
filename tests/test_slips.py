"""A slip of the pen is named as what it is: each is made in a folder in which nothing else is wrong."""

from dataclasses import replace

import numpy as np
import pytest
from small_muscle import LENGTH, ideal, loops, write

from fitting.comparison.compare import compare
from fitting.comparison.slips import Slip, force_over_stated
from fitting.least_squares.fit import fit
from fitting.recordings.experiment import read_experiment
from fitting.report.text.next_step import after_comparison
from fitting.report.text.warnings import SLIPS, comparison_warnings
from mckibben_jax.effects import CoulombFriction, IdealCylinder

HELD = ('test = "loop"', 'test = "isometric"')
KGF, LBF, PSI = 9.80665, 4.4482216, 6.894757


def compared(folder, rows, described=("", "")):
    """A muscle of which something takes a fifth, beside the baseline, with one line of its description changed."""
    place = write(folder, rows, extra="")
    told = (place / "muscle.toml").read_text()
    assert described[0] in told
    (place / "muscle.toml").write_text(told.replace(*described))
    muscle = read_experiment(place)
    found = compare(fit([muscle], [IdealCylinder(), CoulombFriction()], starts=2), [muscle])
    return found, " ".join(comparison_warnings(found)), after_comparison(found, ["here"])


def rows(force=1.0, pressure=1.0):
    """What was written of such a muscle, whose rubber takes a fifth of its pull."""
    whole = loops(lambda eps, p, sign: 3e-4 * p + 60.0 * eps, points=30, repeats=1)
    return [(run, t, p * pressure, x, f * force) for run, t, p, x, f in whole]


def inflated():
    """The same muscle while it is held and inflated: a swap of its columns looks like another muscle."""
    course = np.linspace(0.0, 1.0, 30)
    p = 5e4 + 3.5e5 * np.r_[course, course[::-1]]
    runs = [(held, p, ideal(held, p) - 3e-4 * p - 60.0 * held) for held in (0.0, 0.01, 0.02)]
    return [
        (run, 0.05 * k, pressure, held * LENGTH, force)
        for run, (held, *course) in enumerate(runs)
        for k, (pressure, force) in enumerate(zip(*course, strict=True))
    ]


@pytest.mark.parametrize(
    ("slip", "written", "described"),
    [
        (Slip.DIAMETER, rows(), ("8.0 +/- 0.1 mm", "16 +/- 0.1 mm")),
        (Slip.HALF_RADIUS, rows(), ("8.0 +/- 0.1 mm", "4 +/- 0.1 mm")),
        (Slip.ANGLE_FROM_HOOP, rows(), ("23 +/- 0.3 deg", "67 +/- 0.3 deg")),
        (Slip.KILOGRAM_FORCE, rows(force=1 / KGF), ("", "")),
        (Slip.POUND_FORCE, rows(force=1 / LBF), ("", "")),
        (Slip.NEWTON_AS_KILOGRAM_FORCE, rows(force=KGF), ("", "")),
        (Slip.NEWTON_AS_POUND_FORCE, rows(force=LBF), ("", "")),
        (Slip.TENTH_OF_PRESSURE, rows(pressure=10.0), ("", "")),
        (Slip.TEN_TIMES_PRESSURE, rows(pressure=0.1), ("", "")),
        (Slip.PSI_AS_KILOPASCAL, rows(pressure=1 / PSI), ("", "")),
        (Slip.BAR_AS_PSI, rows(pressure=PSI / 100), ("", "")),
        (Slip.SWAPPED, [(run, t, f * 1e3, x, p / 1e3) for run, t, p, x, f in inflated()], HELD),
    ],
    ids=lambda value: value.name if isinstance(value, Slip) else "",
)
def test_a_slip_is_named_and_comes_before_any_effect(slip, written, described, tmp_path):
    found, told, after = compared(tmp_path / "set", written, described)
    named = {each.slip: each.ratio for each in found.slips}
    assert slip in named
    assert named[slip] == pytest.approx(0.8, abs=0.1)
    assert SLIPS[slip] in told
    assert after is None


def test_nothing_is_said_where_nothing_is_wrong(tmp_path):
    _, told, after = compared(tmp_path / "set", rows())
    assert told == ""
    assert after == "mckibben diagnose here"


def test_where_no_usual_slip_explains_it_that_is_said(tmp_path):
    """A cell that reads 25 times too much is nobody's unit."""
    found, told, after = compared(tmp_path / "set", rows(force=25.0))
    assert found.slips == ()
    assert "No usual slip explains it" in told
    assert after is None


def test_every_slip_has_words():
    assert set(SLIPS) == set(Slip)


def test_what_the_stated_sizes_pull_is_that_of_the_ideal_cylinder_alone(tmp_path):
    """A model of a Festo hose with rubber thrice as stiff, put back to the stated wall, pulled -0.21 times as much."""
    found, _, _ = compared(tmp_path / "set", rows(), ("8.0 +/- 0.1 mm", "16 +/- 0.1 mm"))
    plain = force_over_stated(found.fit)
    assert plain == pytest.approx(0.8 / 4, abs=0.03)
    values = np.where(np.array(found.fit.layout.names) == "coulomb_friction.f_s", 0.9, found.fit.vector)
    assert force_over_stated(replace(found.fit, vector=values)) == plain


def test_a_muscle_without_pressure_is_held_against_nothing(tmp_path):
    found, _, _ = compared(tmp_path / "set", rows())
    empty = replace(found.fit.samples, pressure=np.zeros_like(found.fit.samples.pressure))
    assert force_over_stated(replace(found.fit, samples=empty)) is None
