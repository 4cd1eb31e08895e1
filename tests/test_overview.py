"""The misfit of all runs in one picture: every model on the same axes, colours by what a run holds."""

import re

import numpy as np
import pytest
from small_muscle import loops, write

from fitting.comparison.compare import compare
from fitting.report.pictures.overview import overview_html
from fitting.report.pictures.panels import panels
from fitting.study.request import Request
from fitting.study.task import fit_task, task_of


def drawn(study, *misfits):
    """The picture of constant misfits (N), one a model."""
    task, c = study
    models = [np.full(len(c.fit.residual), misfit) for misfit in misfits]
    return overview_html(panels(task.experiments, c.fit.samples, c.fit.residual), models)


def lines(text, model):
    """Points (x, y) of every line of one model, in points of the picture."""
    group = re.search(rf'<g class="model m{model}">(.*?)</g>', text, flags=re.DOTALL)[1]
    paths = re.findall(r' d="M([\d. L-]+)"', group)
    return [np.array([[float(v) for v in at.split()] for at in path.split("L")]) for path in paths]


def test_each_model_lies_where_its_misfit_is_on_axes_that_all_share(study):
    text = drawn(study, 4.0, -2.0, 0.0)
    heights = [np.concatenate(lines(text, k))[:, 1] for k in range(3)]
    above, below, none = (float(np.mean(each)) for each in heights)
    assert all(np.ptp(each) < 0.11 for each in heights)  # a constant misfit is a level line, to a printed tenth
    assert above < none < below  # SVG counts downwards
    assert none - above == pytest.approx(2 * (below - none), abs=0.2)
    panel = [
        float(v) for v in re.search(r'<svg x="([\d.]+)" y="([\d.]+)" width="([\d.]+)" height="([\d.]+)"', text).groups()
    ]
    assert none == pytest.approx(panel[1] + panel[3] / 2, abs=0.1)
    assert panel[1] < above < below < panel[1] + panel[3]


def test_each_run_has_a_line_for_each_direction(study):
    task, c = study
    shown = panels(task.experiments, c.fit.samples, c.fit.residual)
    assert len(lines(drawn(study, 1.0), 0)) == 2 * len(shown)
    assert drawn(study, 1.0).count("stroke-dasharray") == 2 * len(shown)  # one direction, in two shapes


def test_the_mean_keeps_the_shape_and_averages_the_noise(study):
    task, c = study
    shown = panels(task.experiments, c.fit.samples, c.fit.residual)
    along = np.concatenate([panel.along[panel.position] for panel in shown])
    scatter = np.random.default_rng(0).normal(0, 1.0, len(along))
    text = overview_html(shown, [30 * along, 30 * along + scatter])
    plain, noisy = (np.concatenate(lines(text, k)) for k in range(2))
    slope, _ = np.polyfit(plain[:, 0], plain[:, 1], 1)
    left = plain[:, 1] - np.polyval(np.polyfit(plain[:, 0], plain[:, 1], 1), plain[:, 0])
    assert slope < 0
    assert np.max(np.abs(left)) < 0.2
    newton = -slope * np.ptp(plain[:, 0]) / (30 * np.ptp(along))  # points of the picture
    assert np.std(noisy[:, 1] - plain[:, 1]) < 0.8 * newton


def test_colours_follow_the_pressure(study):
    text = drawn(study, 1.0)
    assert re.findall(r'<i class="h(\d)"></i>([^<]*)<', text) == [("0", "100 kPa"), ("2", "200 kPa"), ("4", "400 kPa")]


def test_one_run_alone_has_no_overview(tmp_path):
    """Its own panel shows the same."""
    task = task_of(Request(data=(str(write(tmp_path, loops(pressures=(2e5,)))),), starts=1))
    c = compare(fit_task(task), task.experiments)
    assert overview_html(panels(task.experiments, c.fit.samples, c.fit.residual), [c.fit.residual]) == ""
