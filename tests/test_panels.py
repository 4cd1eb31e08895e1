"""Pictures of measured and model: where readings lie, what is thinned, and how large a page becomes."""

import re

import numpy as np
import pytest
from folders import folder_of, loop_columns, table
from hidden.simulator import Muscle, Noise, Truth, dataset, static, with_baseline
from hidden.simulator import write as write_hidden
from small_muscle import loops, write

from fitting.comparison.compare import compare
from fitting.problem.residuals import problem
from fitting.problem.unknowns import unknowns
from fitting.recordings.experiment import read_experiment
from fitting.recordings.records import Run
from fitting.report.page.page import page
from fitting.report.pictures import figures, maps
from fitting.report.pictures.loops import frame
from fitting.report.pictures.panels import Panel, every_panel, panels
from fitting.study.request import Request
from fitting.study.stages import Stage
from fitting.study.task import fit_task, task_of
from mckibben_jax.effects import IdealCylinder


def test_measured_points_lie_where_their_axes_say(study):
    task, c = study
    panel = panels(task.experiments, c.fit.samples, c.fit.residual)[0]
    placed = frame(panel, 0, [c.fit.residual])
    x, y, width, height = placed.window.place
    at = np.array([[float(v) for v in point.split()] for point in re.findall(r"M([\d. -]+)h0", placed.opening)])
    assert np.all((at[:, 0] > x) & (at[:, 0] < x + width))
    assert np.all((at[:, 1] > y) & (at[:, 1] < y + height))
    top = np.argmin(at[:, 1])
    value = (at[top, 1] - placed.window.origin[1]) / placed.window.scale[1]
    assert panel.measured.max() == pytest.approx(value, rel=0.01)


def test_a_small_misfit_shows_in_a_strip_of_its_own(study):
    """Half a newton beside hundreds: on the axes of the force nobody sees it; the strip is scaled to it."""
    task, c = study
    panel = panels(task.experiments, c.fit.samples, c.fit.residual)[0]
    missed = 0.5 * np.sin(np.arange(len(c.fit.residual)))
    placed = frame(panel, 0, [missed])
    drawn = placed.misfit(panel.model(missed) - panel.measured)
    _, top, _, height = placed.strip.place
    at = np.array([float(v) for v in re.findall(r"M[\d.-]+ ([\d.-]+)h0", drawn)])
    assert np.all((at > top) & (at < top + height))
    assert np.ptp(at) > 0.8 * height
    assert "misfit, &#177; 0.5 N" in drawn
    band = float(re.search(r'class="noise" d=".*?v([\d.]+)h', drawn)[1])
    assert band == pytest.approx(height, abs=0.1)  # two standard deviations of 0.3 N are more than all of it


def test_runs_of_one_name_in_two_files_are_told_apart(tmp_path):
    extra = 'noise = "0.3 N"\n[[recording]]\nfile = "tuesday.csv"\ntest = "loop"'
    folder = write(tmp_path, loops(repeats=1), extra=extra)
    rows = loops(repeats=1, seed=1)
    write(tmp_path / "other", rows)
    (tmp_path / "other" / "loops.csv").rename(folder / "tuesday.csv")
    task = task_of(Request(data=(str(folder),), starts=1))
    c = compare(fit_task(task), task.experiments)
    labels = [panel.label for panel in panels(task.experiments, c.fit.samples, c.fit.residual)]
    assert labels[0] == "loops.csv, run 0, 100 kPa"
    assert labels[3] == "tuesday.csv, run 0, 100 kPa"
    assert len(set(labels)) == 6


@pytest.mark.parametrize(
    ("pressures", "along", "held"),
    [
        ((2.0, 2.5), "contraction", "225 kPa"),  # a regulator that gives way; the median of each loop
        ((0.5, 3.0), "pressure [kPa]", "pressure up to 300 kPa"),  # a sweep that moves the muscle against a spring
    ],
)
def test_loops_in_which_the_pressure_is_swept_are_drawn_along_it(tmp_path, pressures, along, held):
    columns = loop_columns()
    share = columns["contraction [%]"] / 20
    columns["pressure [bar]"] = pressures[0] + np.ptp(pressures) * share
    columns["force [N]"] = 10 + 100 * share if pressures[1] == 3.0 else columns["force [N]"]
    experiment = read_experiment(folder_of(tmp_path, table(columns)))
    _, samples = problem([experiment], unknowns([experiment], [IdealCylinder()]))
    (panel,) = every_panel([experiment], samples, np.zeros(len(samples)))
    assert (panel.xlabel, panel.held) == (along, held)


def test_thinning_keeps_the_corners_of_every_loop():
    count = 200_000
    eps = 0.1 * (1 - np.cos(np.linspace(0, 4 * np.pi, count)))
    half = np.searchsorted([count // 4, count // 2, 3 * count // 4], np.arange(count), side="right")
    force = np.where(half % 2, 100.0, 50.0) - 200 * eps
    force[31_415] = 400.0  # a single spike
    panel = panel_of(eps, force, half)
    kept = panel.shown(force)
    assert sum(map(len, kept)) <= 400
    for part, branch in zip(kept, range(4), strict=True):
        mine = np.flatnonzero(half == branch)
        assert (part[0], part[-1]) == (mine[0], mine[-1])
    assert 31_415 in np.concatenate(kept)
    assert panel.is_thinned


def panel_of(eps, force, half):
    zero = np.zeros(len(eps))
    run = Run(name="1", time=np.arange(len(eps)) * 1e-3, pressure=zero + 1e5, contraction=eps, rate=zero,
              pressure_rate=zero, measured=force, weight=zero + 1, branch=np.where(half % 2, -1, 1), loop=half // 2,
              half=half, row=np.arange(len(eps)))  # fmt: skip
    place = np.arange(len(eps))
    return Panel("1", "100 kPa", run, place, place, "loop", "N", eps, "contraction", 1.0)


@pytest.mark.slow
def test_a_million_samples_make_a_page_below_ten_megabytes(tmp_path):
    folder = write(tmp_path, loops(points=10_000, pressures=tuple(np.linspace(1e5, 5e5, 10)), repeats=5))
    task = task_of(Request(data=(str(folder),), starts=1))
    text = page(task, compare(fit_task(task), task.experiments))
    assert sum(len(run) for run in task.experiments[0].recordings[0].runs) > 990_000
    assert len(text.encode()) < 10e6
    assert "Thinned for drawing" in text


def test_a_long_recording_still_makes_a_small_page(tmp_path):
    folder = write(tmp_path, loops(points=1500, pressures=(1e5, 2e5, 3e5, 4e5)))
    task = task_of(Request(data=(str(folder),), starts=1))
    assert len(page(task, compare(fit_task(task), task.experiments))) < 2e6


def test_text_in_pictures_is_text_in_the_colour_of_the_page(study):
    svg = figures.as_svg(maps.branch_maps(study[1])[0], "map")
    assert re.search(r"<text[^>]*fill: currentColor[^>]*>pressure \[kPa\]</text>", svg)
    assert figures.INK not in svg
    assert "<image" not in svg
    assert 'id="map-' in svg


def test_pictures_of_one_page_share_no_names(study):
    pictures = [figures.as_svg(figures.waterfall([Stage("a", 1.0, None)], 0.5), name) for name in ("one", "two")]
    first, second = (set(re.findall(r'id="([^"]+)"', svg)) for svg in pictures)
    assert first
    assert not first & second


@pytest.mark.parametrize(
    ("lengths", "pressures", "held"),
    [
        (9, [1e5, 2e5, 3e5], ["100 kPa", "200 kPa", "300 kPa"]),
        (9, [2e5], ["200 kPa"]),
        (4, np.linspace(1e5, 3e5, 20), ["ε = 0", "ε = 0.0667", "ε = 0.133", "ε = 0.2"]),
        (20, np.linspace(1e5, 3e5, 20), ["100 kPa to 300 kPa"]),
    ],
)
def test_lines_of_a_map_join_points_of_one_pressure_or_one_length(lengths, pressures, held, tmp_path):
    truth, contractions = Truth(Muscle(), with_baseline()), tuple(np.linspace(0, 0.2, lengths))
    recording = static(truth, contractions=contractions, pressures=tuple(pressures), noise=Noise(sd=0.1))
    experiment = read_experiment(write_hidden(dataset(truth, [recording], "map"), tmp_path / "map"))
    _, samples = problem([experiment], unknowns([experiment], [IdealCylinder()]))
    residual = np.arange(float(len(samples)))
    found = every_panel([experiment], samples, residual)
    assert [panel.held for panel in found] == held
    assert sorted(np.concatenate([panel.mine for panel in found])) == list(range(len(samples)))
    for panel in found:
        shown = panel.model(residual)[panel.position]
        np.testing.assert_allclose(shown, samples.measured[panel.mine] + residual[panel.mine])


def test_a_line_stops_where_its_branch_does(study):
    """A release that moves between two rests is not crossed by the line of the rests."""
    task, c = study
    panel = panels(task.experiments, c.fit.samples, c.fit.residual)[0]
    placed = frame(panel, 0, [c.fit.residual])
    values = panel.model(c.fit.residual)
    part = panel.branches[0][np.isfinite(values[panel.branches[0]])]
    assert placed.path(values, part).count("M") == 1
    broken = values.copy()
    broken[part[3:6]] = np.nan
    kept = np.concatenate([part[:3], part[6:]])
    assert placed.path(broken, kept).count("M") == 2
    assert placed.path(broken, kept).count("L") == len(kept) - 2


def test_one_run_of_several_pressures_and_speeds_is_told_by_its_loops(tmp_path):
    """A file without a column of runs: two loops slowly at 1 bar, then two twice as fast at 3 bar."""
    columns = loop_columns(loops=4)
    later = np.arange(404) >= 202
    columns["pressure [bar]"] = np.where(later, 3.0, 1.0)
    columns["time [s]"] = np.round(np.cumsum(np.where(later, 0.05, 0.1)), 3)
    columns["force [N]"] = columns["pressure [bar]"] * columns["force [N]"]
    task = task_of(Request(data=(str(folder_of(tmp_path, table(columns))),), starts=1))
    compared = compare(fit_task(task), task.experiments)
    (panel,) = panels(task.experiments, compared.fit.samples, compared.fit.residual)
    assert panel.label == "run 1, 100 kPa to 300 kPa"
    (speeds,) = (table.rows for table in compared.tables if table.title == "speed")
    slow, fast = (float(row.label.split()[0]) for row in speeds)
    assert fast == pytest.approx(2 * slow, rel=0.02)
