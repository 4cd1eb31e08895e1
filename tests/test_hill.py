"""Speed over load: Hill's numbers from motions whose speeds are known in closed form."""

import io
import json
import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from click.testing import CliRunner
from folders import folder_of
from rich.console import Console
from scipy.constants import g

from fitting.cli.main import main
from fitting.errors import InputError
from fitting.hill.hill import Reading, by_pressure, curves, dry_curve, hill_curve, releases, straight_part
from fitting.hill.motion import Motions, _read_again
from fitting.recordings.experiment import read_experiment
from fitting.report.text.hill import hill_report, said_of_viscosity

ISOMETRIC, CURVATURE, LARGEST = 900.0, 0.3, 1.6  # N, 1, m/s
STROKE, FRICTION = 0.09, 40.0  # m, N
LOADS = np.linspace(100.0, 700.0, 7)
TIME = np.arange(-10, 400) * 1e-3


def hill_motion(load):
    """A muscle that is at once at Hill's speed and stops at its stroke, m."""
    w = load / ISOMETRIC
    return np.clip(LARGEST * CURVATURE * (1 - w) / (w + CURVATURE) * TIME, 0, 0.06)


def dry_motion(load):
    """A linear spring with constant friction lifts a mass (eq 47): a cosine that stops where it would turn, m."""
    stiffness, mass = ISOMETRIC / STROKE, load / g
    reach, clock = (ISOMETRIC - FRICTION - load) / stiffness, np.sqrt(stiffness / mass)
    return reach * (1 - np.cos(np.clip(clock * TIME, 0, np.pi)))


def printed(shown):
    """What a terminal of 120 columns shows."""
    console = Console(width=120, file=io.StringIO())
    console.print(*shown)
    return console.file.getvalue()


def recorded(path, motion, loads=LOADS, noise=0.0, pressure=lambda load: 5):
    """The folder of quick releases of a motion."""
    scatter, rows = np.random.default_rng(3), ["run,time [s],pressure [bar],displacement [mm],load [N]"]
    for run, load in enumerate(loads):
        place = 1e3 * motion(load) + scatter.normal(0, noise, len(TIME))
        rows += [f"{run},{t:.4f},{pressure(load)},{x:.5f},{load:.3f}" for t, x in zip(TIME, place, strict=True)]
    path.mkdir(exist_ok=True)
    return folder_of(path, "\n".join(rows) + "\n", test="quick release")


@pytest.mark.parametrize("noise", [0.0, 0.05])
def test_a_hill_muscle_gives_its_numbers(tmp_path, noise):
    (one,) = curves([read_experiment(recorded(tmp_path, hill_motion, noise=noise))])
    assert one.hill.isometric == pytest.approx(ISOMETRIC, rel=0.01)
    assert one.hill.curvature == pytest.approx(CURVATURE, rel=0.03)
    assert one.hill.largest == pytest.approx(LARGEST, rel=0.02)
    assert one.hill.b == pytest.approx(CURVATURE * LARGEST, rel=0.04)
    assert one.dry.misfit > 5 * one.hill.misfit
    assert not one.alike


def test_inertia_with_dry_friction_is_not_taken_for_viscosity(tmp_path):
    (one,) = curves([read_experiment(recorded(tmp_path, dry_motion))])
    speeds = [reading.speed for reading in one.hill.readings]
    exact = (ISOMETRIC - FRICTION - LOADS) / np.sqrt(ISOMETRIC / STROKE * LOADS / g)
    np.testing.assert_allclose(speeds, exact, rtol=0.03)  # a straight part is a little less steep than its middle
    assert one.dry.heaviest == pytest.approx(ISOMETRIC - FRICTION, rel=0.01)
    assert one.alike


def test_what_dry_friction_reads_as_is_the_published_number():
    """Fifty loads from 0.1 to 0.95 of the heaviest: a/F0 = 0.226, as computed from eq 47 solved."""
    w = np.linspace(0.1, 0.95, 50)
    read = [Reading("", float(x), 5e5, float((1 - x) / np.sqrt(x)), 0.0, 0.0, 1.0) for x in w]
    found = dry_curve(read)
    assert found.misfit < 1e-6
    assert found.heaviest == pytest.approx(1.0, rel=1e-6)
    assert 0.1 < found.read_as_hill.curvature < 0.4  # with F0 free; 0.226 where it is held at the heaviest


@pytest.mark.parametrize("noise", [0.0, 1e-4])
def test_the_straight_part_is_where_the_position_is_straight(noise):
    time = np.linspace(0, 0.4, 401)
    bend = np.where(time < 0.1, 5 * time**2, 0.05 + (time - 0.1))  # at constant acceleration, then at 1 m/s
    place = np.where(time < 0.25, bend, 0.2) + np.random.default_rng(0).normal(0, noise, 401)
    slope, error, part = straight_part(time, place, noise)
    assert slope == pytest.approx(1.0, rel=0.02)
    assert error < 0.02
    assert time[part][0] > 0.06
    assert time[part][-1] < 0.27


def test_too_few_loads_and_no_release_are_said(tmp_path):
    with pytest.raises(InputError, match="needs 4 loads"):
        curves([read_experiment(recorded(tmp_path / "few", hill_motion, LOADS[:3]))])
    with pytest.raises(InputError, match=re.escape("at most 3 (at 500 kPa)")):
        curves([read_experiment(recorded(tmp_path / "few", hill_motion, LOADS[:3]))])
    with pytest.raises(InputError, match="does not move in any run"):
        read_experiment(recorded(tmp_path / "still", lambda load: 0 * TIME))
    with pytest.raises(InputError, match="no quick release"):
        releases([])


def test_a_pressure_with_too_few_loads_is_left_out_and_said(tmp_path):
    """The two heaviest at 3 bar: the curve is that of the five others."""
    folder = recorded(tmp_path / "some", hill_motion, pressure=lambda load: 3 if load > 550 else 5)
    experiments = [read_experiment(folder)]
    (one,) = curves(experiments)
    assert [r.load for r in one.hill.readings] == list(LOADS[:5])
    told = printed(hill_report((one,), None, by_pressure(experiments)))
    assert "2 releases at 300 kPa: 2 loads there, and a curve needs 4" in told
    assert "LEFT OUT" not in printed(hill_report((one,), None, by_pressure(experiments)[-1:]))


def test_the_errors_are_as_large_as_the_scatter(tmp_path):
    """Over repeated noise the spread of a/F0 is what its standard error says, within a factor of two."""
    (one,) = curves([read_experiment(recorded(tmp_path, hill_motion))])
    scatter, found = np.random.default_rng(1), []
    for _ in range(60):
        read = [replace(r, speed=r.speed + scatter.normal(0, 0.01)) for r in one.hill.readings]
        fitted = hill_curve(read)
        found.append((fitted.curvature, fitted.curvature_error))
    spread, stated = np.std([f[0] for f in found]), np.median([f[1] for f in found])
    assert 0.5 < spread / stated < 2


def test_the_command_warns_and_writes(tmp_path):
    data = recorded(tmp_path / "dry", dry_motion)
    told = CliRunner().invoke(main, ["hill", str(data), "--no-motion", "--json", str(tmp_path / "h.json"),
                                     "--html", str(tmp_path / "h.html")])  # fmt: skip
    assert told.exit_code == 0, told.output
    assert "WARNING" in told.output
    assert "cannot tell" in told.output
    (curve,) = json.loads((tmp_path / "h.json").read_text())["curves"]
    assert curve["alike"] is True
    assert len(curve["readings"]) == len(LOADS)
    assert "<svg" in (tmp_path / "h.html").read_text()


@pytest.mark.parametrize(
    ("misses", "b", "ends", "words"),
    [
        ((5e-5, 6e-5), 90.0, (), "more than this motion bears"),
        ((1e-3, 2e-3), 90.0, (), "--shooting 8"),  # a search that failed is no physics
        ((6e-3, 5e-3), 0.5, (), "something else"),
        ((6e-3, 5e-3), 42.0, ("hill.a_over_F0",), "Try ⟦viscous_damping⟧"),
        ((5e-5, 5e-5), 100.0, ("hill.b",), "no need of viscosity"),
        ((1e-3, 5e-5), 0.5, (), "+/- 10 mm/s. Trust these before the numbers after HILL"),
        ((1e-2, 1e-3), 0.5, (), "the drag is not Hill's, or another part of the model is wrong"),
        ((1e-3, 5e-5), 0.5, ("hill.a_over_F0",), "at an end of the range"),
        ((1e-3, 5e-5), 100.0, ("hill.b",), "only (F0 + a)/b is found"),
    ],
)
def test_the_motion_says_what_hills_numbers_are_worth(misses, b, ends, words):
    """Misfits of the motion in m without and with Hill's force, noise 0.05 mm, speeds up to 1 m/s."""

    def fitted(miss, **values):
        entries = [SimpleNamespace(name=f"hill.{name}", unit=unit) for name, unit in (("a_over_F0", "1"), ("b", "m/s"))]
        layout = SimpleNamespace(names=tuple(values), entries=entries)
        return SimpleNamespace(layout=layout, values=values, error=lambda name: 0.01, at_bound=ends, rmse=miss,
                               over_noise=miss / 5e-5)  # fmt: skip

    motions = Motions(fitted(misses[0]), fitted(misses[1], **{"hill.a_over_F0": 0.3, "hill.b": b}))
    told = said_of_viscosity(motions, "hill.b = 500 mm/s +/- 10 mm/s", 1.0)
    assert words in told
    assert ("Trust these" in told) == (words == "+/- 10 mm/s. Trust these before the numbers after HILL")
    read = SimpleNamespace(curvature=0.366, pressure=3e5)
    told = said_of_viscosity(replace(motions, read_again=(read,)), "", 1.0)
    assert ("read so, the motion of this model gives a/F0 = 0.366 at 300 kPa" in told) == ("Trust these" in told)
    assert ("viscous_damping" in told) == (b > 10 and (misses[0] > misses[1] or misses[0] > 2e-4))


@pytest.mark.parametrize("share", [1.0, 0.5, 0.0])
def test_the_motion_of_a_model_is_read_as_that_of_the_muscle(tmp_path, share):
    """A model that reaches this share of every position; one that moves no load costs nobody the other results."""
    experiments = [read_experiment(recorded(tmp_path, hill_motion, pressure=lambda load: 3 if load > 550 else 5))]
    runs = [run for recording in experiments[0].recordings for run in recording.runs]
    measured = np.concatenate([run.measured for run in runs])
    samples = SimpleNamespace(
        run=np.repeat(np.arange(len(runs)), [len(run) for run in runs]),
        position=np.concatenate([np.arange(len(run)) for run in runs]),
        measured=measured,
    )
    found = _read_again(experiments, SimpleNamespace(samples=samples, residual=(share - 1) * measured))
    assert len(found) == (share > 0)
    (one,) = curves(experiments)
    for curve in found:
        assert [r.speed for r in curve.readings] == pytest.approx([share * r.speed for r in one.hill.readings])
        assert curve.curvature == pytest.approx(one.hill.curvature, rel=1e-4)


@pytest.mark.slow
def test_the_motion_itself_gives_hills_numbers(tmp_path):
    """Releases of the program's own muscle with Hill's force, fitted without and with it."""
    from fitting.hill.motion import motions
    from fitting.study.courses import release_courses
    from fitting.study.request import Request
    from fitting.study.simulate import write_data_set
    from fitting.study.task import task_of
    from mckibben_jax.effects import CoulombFriction, Hill, IdealCylinder
    from mckibben_jax.model import model
    from mckibben_jax.muscle import Muscle

    truth = model(Muscle(0.3, 7e-3, np.radians(20)), IdealCylinder(), CoulombFriction(), Hill(0.25, 0.6))
    courses = release_courses([5e5], [150.0, 300.0, 450.0, 600.0], 0.4, 250.0)
    write_data_set(tmp_path / "hill", truth, "quick release", courses, 5e-5, 0)
    task = task_of(Request(data=(str(tmp_path / "hill"),), starts=2))
    found = motions(task, curves(task.experiments))
    (curvature, error), (b, b_error) = found.direct.values()
    assert abs(curvature - 0.25) < 4 * error + 0.01
    assert abs(b - 0.6) < 4 * b_error + 0.02
    assert found.errors[1] < found.errors[0] / 3
    (read,), (one,) = found.read_again, curves(task.experiments)
    assert read.curvature == pytest.approx(
        one.hill.curvature, rel=0.1
    )  # the way of reading is what makes the difference
