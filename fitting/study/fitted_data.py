"""The data that a model file was fitted to: those of --data, or those beside the file."""

from pathlib import Path
from typing import Any

from fitting.errors import InputError
from fitting.least_squares.record import Fit
from fitting.library.library import library
from fitting.model_files.model_file import ModelFile, read_model
from fitting.study.known import as_known
from fitting.study.request import Request
from fitting.study.task import Task, task_of


def fitted_data(given: dict[str, Any]) -> tuple[Task, Fit, Path]:
    """The task of what was typed, the model at its values, the first folder; InputError where they cannot be used."""
    stored = read_model(given["model"], library(given["effect_file"]))
    model = stored.path
    if given["muscle"]:
        cure = "leave --muscle out; or take the model without draws"
        raise InputError("the muscle of --muscle is not the one that was measured", given["muscle"], cure=cure)
    if not stored.data:
        raise InputError("the model was fitted to no data", model, cure="fit it: 'mckibben fit DATASET --model FILE'")
    folders = [Path(each) for each in given["data"]] or [model.parent]
    cure = "name the folder of the data that the model was fitted to: --data my_muscle/"
    for folder in folders:
        if not (folder / "muscle.toml").is_file():
            raise InputError("there are no data beside the model file", model, cure=cure)
    more = {"effect_file": given["effect_file"], "seed": given["seed"], "own": stored.own}
    task = task_of(Request(data=tuple(map(str, folders)), model=str(model), **more))
    if not stored.fitted_to(task.experiments):
        raise _other_data(folders, stored)
    fit, missing = as_known(task)
    if missing:
        cure = f"'mckibben fit {folder}' fits it"
        raise InputError(f"the model file has no value for {missing[0]}, which varies", model, cure=cure)
    return task, fit, folders[0]


def _other_data(folders: list[Path], stored: ModelFile) -> InputError:
    """What to do where a model was fitted to other data, or to more data sets than these."""
    problem, cure = "these are not the data that the model was fitted to", "name the data by --data"
    if len(stored.data) > len(folders):
        problem = f"the model was fitted to {len(stored.data)} data sets: {', '.join(stored.data)}"
        cure = f"name them all: {' '.join(f'--data {name}' for name in stored.data)}"
    elif len(folders) == 1:
        cure = f"fit again: 'mckibben fit {folders[0]}'; or {cure}"
    return InputError(problem, folders[0], cure=cure)
