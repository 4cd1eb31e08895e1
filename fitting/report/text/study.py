"""Data, model and steps of a study, in sentences and on the terminal."""

from collections.abc import Sequence

from rich.console import RenderableType
from rich.text import Text

from fitting.recordings.hoses import hoses_of, perhaps_of_one_hose
from fitting.recordings.records import Experiment, NoiseSource
from fitting.report.settings import LAYOUT
from fitting.report.text.amounts import amount
from fitting.report.text.attempts import attempts_text, freed_text, held_text, strained_text
from fitting.report.text.layout import columns, line, lines, spaced
from fitting.report.text.stages import dropped_text, stage_text, stage_verdict
from fitting.report.text.stated_sizes import confined_texts, kept_texts
from fitting.showing import counted
from fitting.study.stages import Stage
from fitting.study.task import Task


def data_text(experiments: Sequence[Experiment]) -> str:
    """What the data are: names, runs, samples."""
    runs = [run for e in experiments for recording in e.recordings for run in recording.runs]
    weighted = sum(int(run.weight.sum()) for run in runs)
    tests = dict.fromkeys(
        "motions read as force" if recording.noise_source is NoiseSource.MOTION else recording.test
        for e in experiments
        for recording in e.recordings
    )
    return (
        f"{_listed(experiments)}: {', '.join(tests)}; {counted(len(runs), 'run')}, {counted(weighted, 'sample')} used"
    )


def hose_texts(experiments: Sequence[Experiment]) -> list[str]:
    """Which muscles share the sizes of a hose, and how those do that may be cut from one."""
    texts = [
        f"{_listed(members)} are cut from {hose} and share all sizes but length and moving mass."
        for hose, members in hoses_of(experiments).items()
    ]
    if bare := perhaps_of_one_hose(experiments):
        texts.append(
            f"{_listed(bare)} state the same radius and braid angle. If they are cut from one hose, the line "
            'hose = "NAME" above [muscle] in each muscle.toml lets them share its sizes in a fit.'
        )
    return texts


def _listed(experiments: Sequence[Experiment]) -> str:
    *most, last = (each.name for each in experiments)
    return f"{', '.join(most)} and {last}" if most else last


def opening(task: Task) -> list[RenderableType]:
    """The first lines of every study: which model, which data.

    The model's effects are named as files and commands name them, so that one line says them and where they come from.
    """
    return [
        line("MODEL", f"{' + '.join(task.names)} ({task.origin})"),
        line("DATA", data_text(task.experiments)),
        *lines("HOSE", hose_texts(task.experiments)),
        *lines("SIZES", [*confined_texts(task.held), *kept_texts(task.kept)]),
    ]


def steps_report(stages: Sequence[Stage], unit: str = "N") -> list[RenderableType]:
    """How the error fell, step by step."""
    said = any(stage.verdict for stage in stages)
    table = columns("", "RMS", "held out", "", *(["verdict then"] if said else []), words=(0, 3), spare=(3,))
    top = max(stage.rmse for stage in stages) or 1.0
    for stage in stages:
        bar = Text("█" * max(1, round(LAYOUT.bar * stage.rmse / top)), style="cyan")
        verdict = [stage_verdict(stage)] if said else []
        table.add_row(stage_text(stage), amount(stage.rmse, unit), amount(stage.held_out_rmse, unit), bar, *verdict)
    return [spaced(table)]


def step_report(stage: Stage, unit: str = "N") -> list[RenderableType]:
    """One step of a discovery, told as soon as it is made."""
    held_out = f"on held-out runs {amount(stage.held_out_rmse, unit)}"
    words = f"{stage_text(stage)}: {amount(stage.rmse, unit)}, {held_out}; {stage_verdict(stage)}"
    told = [*dropped_text(stage), *held_text(stage.held), *freed_text(stage.freed), *strained_text(stage.strained)]
    told += attempts_text(stage.attempts, unit)
    return [line("STEP", words, "bold"), *lines("", told)]
