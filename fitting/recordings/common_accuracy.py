"""`[accuracy]` of a muscle.toml: what the instruments of all its recordings may err by, stated once."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fitting.errors import InputError
from fitting.recordings.accuracy_table import POSITIONS, accuracy_of
from fitting.recordings.muscle_file import read_toml
from fitting.recordings.records import POSITION_TESTS
from fitting.recordings.toml_rows import row_in_table


def common_accuracy(table: Mapping[str, Any], path: Path, raw: bytes) -> Mapping[str, Any]:
    """The table [accuracy] of a muscle.toml, once every line of it has been read; empty where there is none."""
    stated = table.get("accuracy", {})
    try:
        accuracy_of(stated, "loop", 1.0)
    except InputError as error:
        raise error.located(path, row_in_table(raw, "accuracy", (error.key or "").partition(".")[2])) from None
    return stated


def common_accuracy_of(path: Path) -> Mapping[str, Any]:
    """The same of a file."""
    table, raw = read_toml(path)
    return common_accuracy(table, path, raw)


def with_common(options: Mapping[str, Any], test: str, common: Mapping[str, Any]) -> Any:
    """What a recording with these keys states of its accuracy, and of what it does not state the whole file's.

    Those of a force are not of a recording in which none is read, nor those of a position that is read another way.
    """
    own = options.get("accuracy")
    if not common or not (own is None or isinstance(own, Mapping)):
        return own
    stated: Mapping[str, Any] = own or {}
    merged: dict[str, Any] = {c: dict(errors) for c, errors in common.items() if _is_about(c, test, stated)}
    if "noise" in options:  # of what the test measures
        for measured in {"force", *POSITIONS} & {*merged}:
            merged[measured].pop("noise", None)
    for column, errors in stated.items():
        both = column in merged and isinstance(errors, Mapping)
        merged[column] = merged[column] | dict(errors) if both else errors
    return merged


def _is_about(column: str, test: str, own: Mapping[str, Any]) -> bool:
    """Whether what the whole file states of a column may be said of a recording."""
    if column == "force":
        return test not in POSITION_TESTS
    return column not in POSITIONS or not {*POSITIONS} & {*own} - {column}
