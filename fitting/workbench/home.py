"""What is taken home from the workbench: the model, the report page, the session as a script, muscle.toml."""

from pathlib import Path

from fitting.errors import InputError
from fitting.model_files import writer
from fitting.report.page.page import page
from fitting.report.page.posterior import posterior_sections
from fitting.study.request import Request
from fitting.study.task import NO_MODEL
from fitting.workbench.data import is_dropped
from fitting.workbench.session import Session, fit_of, in_own_units

FOLDER = "FOLDER"  # stands for the place of files that were dropped: where they are kept is nobody's concern


def model_text(session: Session) -> str:
    """The fitted model as a model.toml."""
    return writer.model_text(fit_of(session), session.last.task.experiments)


def muscle_text(session: Session) -> str | None:
    """The muscle.toml of files that were dropped, which may have been filled in here; None for data on disk."""
    folder = _place(session)
    return (folder / "muscle.toml").read_text(encoding="utf-8") if folder else None


@in_own_units
def report_text(session: Session) -> str:
    """The report page, with every step."""
    step = session.last
    if step.comparison is None:
        raise InputError("nothing was fitted yet", cure="wait for the first fit")
    diagnosis = next((s.diagnosis for s in reversed(session.steps) if s.diagnosis is not None), None)
    sampled = () if step.posterior is None else posterior_sections(step.posterior)
    text = page(step.task, step.comparison, diagnosis, session.stages, more=sampled)
    folder = _place(session)
    return text.replace(str(folder), FOLDER) if folder else text


def _place(session: Session) -> Path | None:
    """Where dropped files are kept, or None."""
    folder = session.last.task.experiments[0].folder
    return folder if is_dropped(folder) else None


SCRIPT = '''"""What was done at the workbench, to be run again: python session.py {usage}

DATASET is the folder with muscle.toml and the recordings. Writes {written} into the current folder.
"""

import subprocess
import sys

DATA = sys.argv[1:]{default}
if not DATA:
    sys.exit(__doc__)
COMMANDS = {commands}

for name, *arguments in COMMANDS:
    command = ["mckibben", name, *DATA, *arguments]
    print("$", *command, flush=True)
    ended = subprocess.run([sys.executable, "-m", "fitting.cli", *command[1:]])
    if ended.returncode:
        sys.exit(ended.returncode)
'''


def script_text(session: Session) -> str:
    """The session as a Python script that gives the same commands."""
    request, commands, written = session.request, [], []
    model = _model_words(session)
    for number, step in enumerate(session.steps):
        if step.comparison is None:
            continue
        saved = f"session_model_{number}.toml"
        commands.append([*step.typed, *model, "--save", saved])
        written.append(saved)
        model = ["--model", saved, *_data_words(request)]
        if step.diagnosis is not None:
            sought = ["--candidates", *step.sought] if step.sought else []
            commands.append(["diagnose", *model, *sought])
    commands.append(["report", *model, "--no-diagnosis", "--html", "session_report.html"])
    lines = ",\n".join(f"    {command!r}" for command in commands)
    dropped = _place(session) is not None
    return SCRIPT.format(
        usage="DATASET" if dropped else "[DATASET]",
        written=", ".join([*written, "session_report.html"]),
        default="" if dropped else f" or {list(request.data)!r}",
        commands=f"[\n{lines},\n]",
    )


def _data_words(request: Request) -> list[str]:
    return [*request.words("muscle", "test", "effect_file", "define"), "--seed", str(request.seed)]


def _model_words(session: Session) -> list[str]:
    """What the first model is. The baseline is said to be it: beside the data there may be a model file by then."""
    request, task = session.request, session.steps[0].task
    begun = ["--baseline"] if task.origin == NO_MODEL else []
    return [*request.words("model", "baseline"), *begun, *_data_words(request)]
