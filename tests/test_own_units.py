"""Answers in the units of the data: Hill's numbers, motions as force, proposals, many data sets, the workbench."""

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from click.testing import CliRunner
from folders import folder_of
from rich.console import Console
from small_muscle import loops, write
from test_hill import LOADS, TIME, hill_motion
from test_inverse_dynamics import released

from fitting import showing, units
from fitting.cli.main import main
from fitting.diagnosis.findings import GroupKind, RestsOn
from fitting.diagnosis.outcomes import Verdict
from fitting.diagnosis.proposal_terms import line_of, terms
from fitting.diagnosis.record import Diagnosis, Evidence
from fitting.hill.hill import curves
from fitting.library.line import VARIABLES, effect_from_line
from fitting.posterior.predict import Band
from fitting.recordings.experiment import read_experiment
from fitting.recordings.inverse_dynamics import as_force
from fitting.recordings.settings import DYNAMICS
from fitting.report.pictures.hill import speed_over_load
from fitting.report.pictures.posterior import predicted
from fitting.report.text.hill import hill_report
from fitting.workbench.session import Step
from fitting.workbench.text import evidence
from mckibben_jax.muscle import Muscle
from mckibben_jax.parameter import parameters
from mckibben_jax.state import State

IMPERIAL = {"Pa": "psi", "N": "lbf", "m": "inch"}
POUND, INCH, PSI = 4.4482216, 0.0254, 6894.757


def imperial(folder):
    """Quick releases in psi, inches and pounds."""
    rows = ["run,time [s],pressure [psi],displacement [inch],load [lbf]"]
    for run, load in enumerate(LOADS):
        way = hill_motion(load) / INCH
        rows += [f"{run},{t:.4f},72.52,{x:.6f},{load / POUND:.4f}" for t, x in zip(TIME, way, strict=True)]
    folder.mkdir()
    return folder_of(folder, "\n".join(rows) + "\n", test="quick release")


def printed(shown):
    console = Console(width=200, highlight=False, markup=False)
    with console.capture() as said:
        for part in shown:
            console.print(part)
    return said.get()


def test_a_load_in_pounds_says_in_what_its_owner_reads_forces(tmp_path):
    experiment = read_experiment(imperial(tmp_path / "releases"))
    assert showing.own_units(experiment.units) == IMPERIAL


def test_hills_numbers_are_told_in_the_units_of_the_data(tmp_path):
    found = curves([read_experiment(imperial(tmp_path / "releases"))])
    with showing.spoken(IMPERIAL):
        said = printed(hill_report(found, None))
    assert re.search(r"b = [\d.]+ \+/- [\d.]+ inch/s", said), said
    assert re.search(r"F0 = [\d.]+ \+/- [\d.]+ lbf at 72.52 psi", said), said
    assert "steady speed [inch/s]" in said
    assert f"{LOADS[0] / POUND:.3g} lbf" in said
    assert not re.search(r"\d (N|m/s|mm/s|kPa)\b", said), said
    b = float(re.search(r"b = ([\d.]+)", said)[1])
    assert b * INCH == pytest.approx(found[0].hill.b, rel=0.01)


def test_the_picture_of_speeds_is_drawn_in_the_units_of_the_data(tmp_path):
    found = curves([read_experiment(imperial(tmp_path / "releases"))])
    with showing.spoken(IMPERIAL):
        (axes,) = speed_over_load(found).axes
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("load [lbf]", "steady speed [inch/s]")
    readings, hill, _ = axes.get_lines()
    np.testing.assert_allclose(readings.get_xdata(), LOADS / POUND, rtol=1e-3)
    np.testing.assert_allclose(readings.get_ydata(), [r.speed / INCH for r in found[0].hill.readings], rtol=1e-6)
    assert hill.get_xdata()[-1] == pytest.approx(found[0].hill.isometric / POUND, rel=1e-6)
    assert axes.get_ylim()[1] > max(readings.get_ydata())
    assert "72.52 psi" in hill.get_label()


@pytest.mark.parametrize(("unit", "own", "label"), [("m", {}, "mm"), ("m", IMPERIAL, "inch"), ("N", IMPERIAL, "lbf")])
def test_the_band_of_a_prediction_is_drawn_in_the_units_of_the_data(unit, own, label):
    course, size = np.arange(9.0), units.factor(label, unit)
    run = Band(0, 0, "a.csv", "1", unit, course, course + size, course - 2 * size, course, course + 2 * size)
    with showing.spoken(own):
        (axes,) = predicted(SimpleNamespace(bands=[run])).axes
    assert axes.get_ylabel() == f"misfit [{label}]"
    np.testing.assert_allclose(axes.get_lines()[0].get_ydata(), 1.0)


@pytest.mark.parametrize(
    ("limit", "value", "own", "usual"),
    [
        ("loud", 0.0, r"too noisy, [\d.]+ lbf of [\d.]+ lbf", r"too noisy, [\d.]+ N of [\d.]+ N"),
        ("fewest", 999, "faster than 0.39 inch/s", "faster than 10 mm/s"),
    ],
)
def test_why_a_motion_is_no_force_is_told_in_the_units_of_the_data(tmp_path, monkeypatch, limit, value, own, usual):
    data, _ = released(tmp_path)
    monkeypatch.setattr("fitting.recordings.inverse_dynamics.DYNAMICS", replace(DYNAMICS, **{limit: value}))
    with showing.spoken(IMPERIAL):
        (theirs,) = as_force(data)[1]
    assert re.search(own, theirs), theirs
    assert not re.search(r"\d (N|mm/s)\b", theirs), theirs
    (ours,) = as_force(data)[1]
    assert re.search(usual, ours), ours


# ---------------------------------------------------------------------------------------------------------- proposals


@pytest.fixture(scope="module")
def states():
    """States of loops at several pressures and speeds."""
    eps = 0.24 * np.concatenate([np.linspace(0, 1, 60), np.linspace(1, 0, 60)])
    runs = [(p, v) for p in (1e5, 2e5, 3e5, 4e5) for v in (0.005, 0.02)]
    way = np.repeat([1.0, -1.0], 60)
    eps, pressure, rate, time = (
        np.concatenate(part)
        for part in zip(*((eps, 0 * eps + p, v / 0.3 * way, 0.1 * np.arange(120)) for p, v in runs), strict=True)
    )
    at = State(eps, pressure, rate=rate, time=time)
    return {name: np.asarray(variable.at(Muscle(0.3, 0.007, 0.35), at)) for name, variable in VARIABLES.items()}


def test_a_proposal_is_the_same_law_in_its_readers_units(states):
    """Every form: pasted in pounds and psi it gives the newtons that it gives in newtons and kPa."""
    places = slice(None, None, 37)
    state = State(states["eps"][places], states["P"][places], rate=states["v"][places] / 0.3, time=states["t"][places])
    seen = set()
    with showing.spoken(IMPERIAL):
        theirs = terms(states)
        lines = [line_of("form", [term], [-3.21]) for term in theirs]
    for term, line in list(zip(theirs, lines, strict=True))[::5]:
        assert not re.search(r"\d (N|kPa|MPa|mm|mm/s)\b", line), line
        seen |= set(re.findall(r"\d (lbf|psi|inch/s|inch)\b", line))
        kind = effect_from_line(line)
        force = np.broadcast_to(kind().force(Muscle(0.3, 0.007, 0.35), state), states["t"][places].shape)
        wanted = -3.21 * term.column(states)[places]
        np.testing.assert_allclose(force, wanted, rtol=0.02, atol=0.06)
    assert seen == {"lbf", "psi", "inch", "inch/s"}


def test_a_proposal_in_the_usual_units_is_as_it_was(states):
    said = " ".join(line_of("form", [term], [-3.21]) for term in terms(states))
    assert set(re.findall(r"\d (N|kPa|mm/s|mm|s|%|lbf|psi)\b", said)) == {"N", "kPa", "mm/s", "mm", "s"}
    assert [p.unit for p in parameters(effect_from_line(line_of("form", [terms(states)[0]], [-3.21])))] == ["N"]


# ------------------------------------------------------------------------------------------------------ many data sets


def in_imperial(folder, number):
    """A small muscle whose recordings are in psi, inches and pounds."""
    write(folder, loops(points=20, repeats=2, seed=number))
    text = (folder / "muscle.toml").read_text()
    (folder / "muscle.toml").write_text(text.replace('"0.3 N"', '"0.0674 lbf"'))
    head, *rows = (folder / "loops.csv").read_text().splitlines()
    cells = [[float(cell) for cell in row.split(",")] for row in rows]
    lines = [f"{r:.0f},{t},{p * 1e3 / PSI:.5f},{x * 1e-3 / INCH:.7f},{f / POUND:.6f}" for r, t, p, x, f in cells]
    head = head.replace("kPa", "psi").replace("[mm]", "[inch]").replace("[N]", "[lbf]")
    (folder / "loops.csv").write_text("\n".join([head, *lines]) + "\n")


def test_many_data_sets_are_answered_in_the_unit_they_share(tmp_path):
    for number in (0, 1):
        in_imperial(tmp_path / f"m{number}", number)
    asked = ["fit", str(tmp_path / "m0"), str(tmp_path / "m1"), "--each", "--starts", "1", "--out", str(tmp_path / "o")]
    for _ in range(2):  # computed, then read from the folder
        done = CliRunner().invoke(main, asked)
        assert done.exit_code == 0, done.output
        assert re.search(r"m0 +[\d.]+ lbf", done.output), done.output
        assert not re.search(r"\d (N|mm)\b", done.output), done.output
    assert "rmse [N]" in (tmp_path / "o" / "table.csv").read_text()  # files are in SI
    write(tmp_path / "m2", loops(points=20, repeats=2))
    done = CliRunner().invoke(main, [*asked[:3], str(tmp_path / "m2"), *asked[3:]])
    assert re.search(r"m0 +[\d.]+ N", done.output), done.output  # they do not agree


# ------------------------------------------------------------------------------------------------------- the workbench


def test_the_evidence_of_motions_is_told_as_force():
    """A model of motions errs in millimetres; the errors of its diagnosis are newtons, or the user's own."""
    spring = Evidence("linear_spring", rmse=1.5, held_out_rmse=2.5, detection_limit=0.5)
    fit = SimpleNamespace(samples=())
    found = replace(_nothing(), effects={"linear_spring": spring}, held_out_rmse=20.0, baseline=fit)
    task = SimpleNamespace(library={}, experiments=(SimpleNamespace(units=({"N": "lbf", "m": "inch"},)),))
    comparison = SimpleNamespace(unit="m", fit=fit)
    step = Step("model", ("fit",), task, comparison, None, found)
    shown = evidence(step, {"linear_spring": "<button>linear_spring</button>"})
    assert f"{1.5 / POUND:.3g} lbf" in shown
    assert "inch" not in shown
    assert "mm" not in shown


def _nothing():
    fields = dict.fromkeys(Diagnosis.__dataclass_fields__, ())
    numbers = ("p_value", "level", "rmse", "held_out_rmse", "noise_floor", "full_scale")
    return Diagnosis(
        **(
            fields
            | dict.fromkeys(numbers, 1.0)
            | {
                "leading": None,
                "effects": {},
                "verdict": Verdict.ONE_OF,
                "rests_on": RestsOn(6, (GroupKind.LOOP,)),
                "why": None,
            }
        )
    )
