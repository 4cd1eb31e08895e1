"""Pictures of where a model fails: one function each, returning a matplotlib figure. Nothing else draws."""

import io
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from fitting import units
from fitting.compare import PRESSURE_LED, Comparison, branch_name
from fitting.diagnosis import Diagnosis
from fitting.records import FORCE_TESTS, Experiment, Recording, Run
from fitting.sentences import rounded

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Okabe & Ito: told apart by every kind of colour vision
BLUE, ORANGE, GREEN, GREY, VERMILION, SKY = "#0072B2", "#E69F00", "#009E73", "#8C8C8C", "#D55E00", "#56B4E9"
INK = "#13579b"  # stands for the page's own text colour, which is light on dark or dark on light
MOST_PANELS = 24
MOST_POINTS = 300
COLUMNS = 4
MOST_EFFECTS = 10
SETTINGS: dict[Any, Any] = {
    "svg.fonttype": "none", "text.parse_math": False, "font.size": 9, "axes.titlesize": 9, "axes.labelsize": 9,
    "axes.edgecolor": INK, "axes.labelcolor": INK, "axes.titlecolor": INK, "text.color": INK, "xtick.color": INK,
    "ytick.color": INK, "xtick.labelsize": 8, "ytick.labelsize": 8, "axes.linewidth": 0.6, "xtick.major.width": 0.6,
    "ytick.major.width": 0.6, "axes.spines.top": False, "axes.spines.right": False, "figure.facecolor": "none",
    "axes.facecolor": "none", "savefig.facecolor": "none", "legend.frameon": False, "font.family": "sans-serif",
}  # fmt: skip


@dataclass(frozen=True)
class Stage:
    """One step of a study: what was added, the error then, and the verdict there."""

    added: str
    rmse: float
    left_out: float | None
    verdict: str = ""


def waterfall(stages: Sequence[Stage], floor: float, unit: str = "N") -> "Figure":
    """How far the error has fallen, and how far it could."""
    name, size = units.shown_in(unit, max(stage.rmse for stage in stages))
    figure, axes = _figure(6.8, 0.75 + 0.36 * len(stages))
    with _settings():
        for row, stage in enumerate(stages):
            good = stage.rmse <= 1.5 * floor
            axes.barh(row, stage.rmse / size, height=0.62, color=GREEN if good else BLUE)
            if stage.left_out is not None and np.isfinite(stage.left_out):
                left = stage.left_out / size
                axes.plot([left, left], [row - 0.31, row + 0.31], color=VERMILION, linewidth=2)
            end = max(stage.rmse, stage.left_out or 0.0) / size
            marked = "" if stage.left_out is None else f" (left out {stage.left_out / size:.3g})"
            _beside(axes, end, row, f"{stage.rmse / size:.3g} {name}{marked}")
        axes.axvline(floor / size, color=INK, linestyle=(0, (3, 2)), linewidth=1)
        _beside(axes, floor / size, -0.75, f"noise {floor / size:.2g} {name}")
        axes.set_yticks(range(len(stages)), [stage.added for stage in stages])
        axes.set_ylim(len(stages) - 0.5, -0.95)
        axes.set_xlim(0, 1.4 * max(max(s.rmse, s.left_out or 0.0, floor) for s in stages) / size)
        marked = any(stage.left_out is not None for stage in stages)
        axes.set_xlabel(f"rms error [{name}]" + ("; mark: on runs left out" if marked else ""))
        axes.tick_params(axis="y", length=0)
    return figure


def traces(c: Comparison, experiments: Sequence[Experiment]) -> "Figure":
    """Measured against model, one small panel per run; the worst runs if there are too many."""
    panels = _panels(c, experiments)
    rows = -(-len(panels) // COLUMNS)
    columns = min(COLUMNS, max(len(panels), 1))
    figure = _blank(1.9 * columns + 0.3, 1.62 * rows + 0.5)
    with _settings():
        for number, panel in enumerate(panels):
            axes = figure.add_subplot(rows, columns, number + 1)
            _draw(axes, panel, c)
            if number % columns == 0 or panel.ylabel != panels[number - 1].ylabel:
                axes.set_ylabel(panel.ylabel)
            if number + columns >= len(panels) or panel.xlabel != panels[number + columns].xlabel:
                axes.set_xlabel(panel.xlabel)
        _legend(figure, panels)
        figure.tight_layout(pad=0.4, h_pad=0.7, w_pad=0.6, rect=(0, 0, 1, 1 - 0.3 / (1.62 * rows + 0.5)))
    return figure


def residual_map(c: Comparison) -> "Figure":
    """Where the model pulls too much or too little, over contraction and pressure, on either branch."""
    found = c.cells
    if found is None:
        raise ValueError("there is no map: no force was measured")
    branches = [b for b in (1, -1, 0) if found.count[b].any()]
    top = max(float(np.nanmax(np.abs(found.mean[b]))) for b in branches) or 1.0
    height = 0.9 + 0.24 * max(len(found.pressure), 4)
    figure = _blank(3.1 * len(branches) + 0.9, height)
    figure.set_layout_engine("constrained")
    with _settings():
        drawn = None
        for number, branch in enumerate(branches):
            axes = figure.add_subplot(1, len(branches), number + 1)
            values = np.ma.masked_invalid(found.mean[branch])
            drawn = axes.pcolormesh(values, cmap=_diverging(), vmin=-top, vmax=top, edgecolors="face", linewidth=0.2)
            _label_cells(axes, c, number == 0)
            axes.set_title(branch_name(branch, _led_by(c)) if len(branches) > 1 or branch else "all points")
        bar = figure.colorbar(drawn, ax=figure.axes, shrink=0.9, aspect=18, pad=0.02)  # type: ignore[arg-type]
        bar.outline.set_visible(False)  # type: ignore[operator]
        bar.set_label("model minus measured [N]")
    return figure


def effects_picture(d: Diagnosis, floor: float, unit: str = "N") -> "Figure":
    """What the error would be with each effect added: the fewer newtons the better."""
    tested = [e for e in d.effects.values() if e.detection_limit is not None and np.isfinite(e.held_out_rmse or np.nan)]
    tested = sorted(tested, key=lambda e: e.held_out_rmse or 0.0)[:MOST_EFFECTS]
    name, size = units.shown_in(unit, d.rmse)
    figure, axes = _figure(6.8, 0.9 + 0.23 * len(tested))
    with _settings():
        for row, e in enumerate(tested):
            left = (e.held_out_rmse or 0.0) / size
            axes.barh(row, left, height=0.66, color=GREEN if e.adequate else SKY)
            if left < 0.97 * d.held_out_rmse / size:
                _beside(axes, left, row, f"{left:.3g}")
        for value, words in ((d.held_out_rmse, "model as it is"), (floor, "noise")):
            axes.axvline(value / size, color=INK, linestyle=(0, (3, 2)), linewidth=1)
            axes.text(value / size, -0.75, words, va="bottom", ha="center", fontsize=8)
        axes.set_yticks(range(len(tested)), [e.name for e in tested])
        axes.set_ylim(len(tested) - 0.5, -0.9)
        axes.set_xlim(0, 1.15 * max([d.held_out_rmse, *(e.held_out_rmse or 0.0 for e in tested)]) / size)
        axes.set_xlabel(f"error on runs left out, with this effect added [{name}]; green: explains the data")
        axes.tick_params(axis="y", length=0)
    return figure


def as_svg(figure: "Figure", prefix: str) -> str:
    """The figure as an SVG element to stand in a page, in the page's own text colour and font."""
    from matplotlib import rc_context

    out = io.StringIO()
    with rc_context({**SETTINGS, "svg.hashsalt": prefix}):
        figure.savefig(out, format="svg", metadata={"Date": None, "Creator": None})
    text = out.getvalue()
    text = text[text.index("<svg") :].replace(INK, "currentColor")
    text = re.sub(r'(<svg[^>]*?) height="[^"]*"', r"\1", text)
    text = re.sub(r'(<svg[^>]*?) width="[^"]*"', r'\1 width="100%"', text)
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    text = re.sub(r"font-family: [^;\"]*", "font-family: system-ui, sans-serif", text)
    return re.sub(r'(\bid="|url\(#|href="#)', rf"\g<1>{prefix}-", text)


# ----------------------------------------------------------------------------------------------------- measured panels


@dataclass(frozen=True)
class _Panel:
    title: str
    run: Run
    number: int  # of the run, through all recordings
    test: str
    unit: str
    xlabel: str
    ylabel: str
    rmse: float


def _panels(c: Comparison, experiments: Sequence[Experiment]) -> list[_Panel]:
    """The runs, joined to one where each is a few points of a static map."""
    found: list[_Panel] = []
    number = 0
    for experiment in experiments:
        for recording in experiment.recordings:
            for run in recording.runs:
                found.append(_panel(c, experiment, recording, run, number))
                number += 1
    found = [panel for panel in found if np.isfinite(panel.rmse)]
    if len(found) > MOST_PANELS:
        worst = sorted(found, key=lambda panel: -panel.rmse)[:MOST_PANELS]
        found = [panel for panel in found if panel in worst]
    return found


def _panel(c: Comparison, experiment: Experiment, recording: Recording, run: Run, number: int) -> _Panel:
    residual = c.fit.residual[c.fit.samples.run == number]
    rmse = float(np.sqrt(np.mean(residual**2))) if len(residual) else float("nan")
    force = recording.test in FORCE_TESTS
    xlabel = {"isometric": "pressure [kPa]", "loop": "contraction", "static": _static_axis(run)[1]}.get(
        recording.test, "pressure [kPa]" if recording.test == "isotonic" else "time [s]"
    )
    ylabel = "force [N]" if force else "shortening [mm]"
    title = f"run {run.name}, {_held(run, recording.test)}: {rounded(rmse, recording.unit, 2)}"
    return _Panel(title, run, number, recording.test, recording.unit, xlabel, ylabel, rmse)


def _held(run: Run, test: str) -> str:
    """What a run holds while something else moves."""
    by_pressure = test == "isometric" or (test == "static" and _static_axis(run)[1].startswith("pressure"))
    if by_pressure:
        return f"ε = {np.median(run.contraction):.3g}"
    if run.load is not None:
        return f"{np.median(run.load):.0f} N"
    return f"{np.median(run.pressure) / 1e3:.0f} kPa"


def _static_axis(run: Run) -> tuple[np.ndarray, str]:
    """A static run is drawn along whatever it varies more."""
    pressure, contraction = np.ptp(run.pressure) / max(np.max(run.pressure), 1.0), np.ptp(run.contraction) / 0.3
    return (run.pressure / 1e3, "pressure [kPa]") if pressure > contraction else (run.contraction, "contraction")


def _along(panel: _Panel) -> np.ndarray:
    if panel.test == "static":
        return _static_axis(panel.run)[0]
    if panel.test in ("isometric", "isotonic"):
        return panel.run.pressure / 1e3
    return panel.run.contraction if panel.test == "loop" else panel.run.time


def _draw(axes: "Axes", panel: _Panel, c: Comparison) -> None:
    """Measured as grey dots, the model as lines in the colour of the branch."""
    run, size = panel.run, 1.0 if panel.unit == "N" else 1e-3
    along, samples = _along(panel), c.fit.samples
    thin, few = slice(None, None, max(1, len(run) // MOST_POINTS)), len(run) < 30
    axes.plot(along[thin], run.measured[thin] / size, ".", color=GREY, markersize=7 if few else 3.2, markeredgewidth=0)
    mine = samples.run == panel.number
    model = np.full(len(run), np.nan)
    model[samples.position[mine]] = run.measured[samples.position[mine]] + c.fit.residual[mine]
    for branch, colour in _colours(panel):
        values = np.where(run.branch == branch, model, np.nan)[thin] / size
        axes.plot(along[thin], values, "+" if few else "-", color=colour, linewidth=0.9, markersize=5)
    axes.set_title(panel.title, loc="left", pad=3, fontsize=8.5)
    axes.locator_params(nbins=4)


def _colours(panel: _Panel) -> tuple[tuple[int, str], ...]:
    """The colour of each branch; along a motion they need none."""
    return ((1, BLUE), (-1, VERMILION), (0, GREEN if panel.unit == "N" else BLUE))


def _legend(figure: "Figure", panels: Sequence[_Panel]) -> None:
    from matplotlib.lines import Line2D

    test = panels[0].test if panels else "loop"
    force = [panel for panel in panels if panel.unit == "N"] or panels
    seen = {int(b) for panel in force for b in np.unique(panel.run.branch[panel.run.weight > 0])}
    entries = [Line2D([], [], marker=".", linestyle="", color=GREY, label="measured (title: rms error)")]
    for branch, colour in ((1, BLUE), (-1, VERMILION), (0, GREEN)):
        if branch in seen:
            words = f"model, {branch_name(branch, test)}" if len(seen) > 1 else "model"
            entries.append(Line2D([], [], color=colour, label=words))
    figure.legend(handles=entries, loc="upper left", ncols=len(entries), borderaxespad=0.1, fontsize=8.5)


# --------------------------------------------------------------------------------------------------------------- maps


def _beside(axes: "Axes", x: float, y: float, words: str) -> None:
    """Words a little to the right of a place."""
    axes.annotate(words, (x, y), (4, 0), textcoords="offset points", va="center", fontsize=8.5)


def _led_by(c: Comparison) -> str:
    tests = {score.test for score in c.by_recording if score.unit == c.unit}
    return next(iter(tests)) if len(tests) == 1 and tests <= set(PRESSURE_LED) else "loop"


def _label_cells(axes: "Axes", c: Comparison, first: bool) -> None:
    assert c.cells is not None  # the caller has looked
    pressure, contraction = c.cells.pressure, c.cells.contraction
    at = np.linspace(0, len(contraction) - 1, min(5, len(contraction))).round().astype(int)
    axes.set_xticks(at + 0.5, [f"{contraction.centre[k]:.2f}" for k in at])
    axes.set_xlabel("contraction")
    axes.set_yticks(np.arange(len(pressure)) + 0.5, [f"{p / 1e3:.0f}" if first else "" for p in pressure.centre])
    if first:
        axes.set_ylabel("pressure [kPa]")
    for side in axes.spines.values():
        side.set_visible(False)


def _diverging() -> Any:
    from matplotlib.colors import LinearSegmentedColormap

    colours = LinearSegmentedColormap.from_list("misfit", [BLUE, "#f2f2f2", VERMILION], N=41)  # few: no bitmap
    return colours.with_extremes(bad="none")


# -------------------------------------------------------------------------------------------------------------- canvas


def _settings() -> Any:
    from matplotlib import rc_context

    return rc_context(SETTINGS)


def _blank(width: float, height: float) -> "Figure":
    """A figure that no window belongs to."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    with _settings():
        figure = Figure(figsize=(width, height))
    FigureCanvasAgg(figure)
    return figure


def _figure(width: float, height: float) -> tuple["Figure", "Axes"]:
    figure = _blank(width, height)
    with _settings():
        axes = figure.add_subplot()
        figure.set_layout_engine("tight", pad=0.4)
    return figure, axes
