"""Which arguments are data and which are effects."""

from collections.abc import Sequence
from pathlib import Path

from fitting.errors import InputError


def split(arguments: Sequence[str]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Data are the arguments that exist as a path; the others are effects."""
    data = tuple(argument for argument in arguments if Path(argument).exists())
    names = tuple(argument for argument in arguments if argument not in data)
    if not data:
        raise InputError("no data set is named", value=" ".join(arguments), cure="name a folder with muscle.toml")
    if not names:
        raise InputError("no effect is named", cure="'mckibben effects' lists them")
    return data, names
