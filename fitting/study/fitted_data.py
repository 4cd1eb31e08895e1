"""The data that a model file was fitted to: those of --data, or those beside the file."""

from pathlib import Path
from typing import Any

from fitting.errors import InputError
from fitting.least_squares.record import Fit
from fitting.model_files.model_file import read_model
from fitting.study.request import Request
from fitting.study.task import Task, as_known, task_of


def fitted_data(given: dict[str, Any]) -> tuple[Task, Fit, Path]:
    """From what was typed: the task, the model at its values, the folder. InputError where they cannot be used."""
    model = Path(given["model"])
    if given["muscle"]:
        cure = "leave --muscle out; or take the model without draws"
        raise InputError("the muscle of --muscle is not the one that was measured", given["muscle"], cure=cure)
    folder = Path(given["data"] or model.parent)
    if not (folder / "muscle.toml").is_file():
        cure = "name the folder of the data that the model was fitted to: --data my_muscle/"
        raise InputError("there are no data beside the model file", model, cure=cure)
    task = task_of(Request(data=(str(folder),), model=str(model), effect_file=given["effect_file"], seed=given["seed"]))
    if not read_model(model, task.library).fitted_to(task.experiments):
        cure = f"fit again: 'mckibben fit {folder}'; or name the data by --data"
        raise InputError("these are not the data that the model was fitted to", folder, cure=cure)
    fit, missing = as_known(task)
    if missing:
        cure = f"'mckibben fit {folder}' fits it"
        raise InputError(f"the model file has no value for {missing[0]}, which varies", model, cure=cure)
    return task, fit, folder
