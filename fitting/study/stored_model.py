"""The model that a command takes from a model file."""

from pathlib import Path

from fitting.errors import InputError
from fitting.library.library import library
from fitting.model_files.model_file import read_model
from fitting.recordings.muscle_file import read_muscle
from mckibben_jax.model import Model, model


def stored_model(
    file: str, muscle_file: str | None, effect_file: str | None, dataset: str | None = None
) -> tuple[Model, Path]:
    """The model of a model file with its own muscle or that of a `muscle_file`, and where the file lies.

    `dataset` is the data set whose muscle and values are meant, where the model was fitted to several; the first one
    unless given.
    """
    stored = read_model(file, library(effect_file))
    stored = stored.of_set(stored.called(dataset or stored.name)) if dataset or len(stored.sets) > 1 else stored
    muscle = read_muscle(muscle_file)[0] if muscle_file else stored.muscle
    if muscle is None:
        raise InputError("the model file has no [muscle]", stored.path, cure="add --muscle muscle.toml")
    return model(muscle, *stored.effects), stored.path
