"""Where a fitted model goes, and what is said about it."""

from pathlib import Path

from rich.console import RenderableType

from fitting.cli.run import CommandRun
from fitting.errors import InputError
from fitting.least_squares.record import Fit
from fitting.model_files.model_file import read_model
from fitting.model_files.writer import is_edited, write_model
from fitting.report.text.layout import line, lines, paste_line
from fitting.study.request import MODEL_FILE
from mckibben_jax.effect import name_of

LIKELIER = "with the values that are likelier where instruments err"
NONE_LIKELIER = (
    "These are the values of the curve of least error. There are likelier ones only where the model leaves hardly more "
    "than noise and errors of the instruments, where no instrument errs by more than five times its accuracy, where no "
    "stated size is denied, and where no motion was recorded."
)


def save(run: CommandRun, fit: Fit, after: str | None = None) -> list[RenderableType]:
    """Write the fitted model, and say where it went (and what comes `after` that) or why it did not."""
    if run.request.no_save:
        return []
    if not fit.converged:
        return [line("SAVED", "nothing: the search did not converge")]
    path = Path(run.request.save) if run.request.save else run.task.experiments[0].folder / MODEL_FILE
    likelier = fit.through if run.request.through_instruments else None
    before = _other_effects(path, run)
    why = write_model(path, likelier or fit, run.task.experiments)
    if why is None:
        how = f"--model {path} takes it up" if run.request.save else "the next command on these data begins from it"
        which = f"{path}, {LIKELIER}" if likelier else f"{path}"
        said = [f"It replaces a model that was there: {before}."] if before else []
        said += [NONE_LIKELIER] if run.request.through_instruments and not likelier else []
        after_it = [paste_line("NEXT", after)] if after else []
        return [line("SAVED", f"{which}; {how}"), *lines("", said, "yellow"), *after_it]
    if run.request.save and not (path.exists() and is_edited(path)):  # what comes next will look for it there
        raise InputError(f"the model is not saved: {why}", cure="make room, or name another file with --save")
    return [line("SAVED", f"nothing: {why}. Name another file with --save FILE", "yellow")]


def _other_effects(path: Path, run: CommandRun) -> str:
    """The effects of a model file that is about to be replaced though the command began with others; empty if not."""
    try:
        names = tuple(map(name_of, read_model(path, run.task.library).effects)) if path.exists() else ()
    except InputError:
        return ""  # who wrote it is told elsewhere
    return "" if set(names) == set(run.task.names) else " + ".join(names)
