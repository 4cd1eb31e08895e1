"""The folder that the results of many data sets go into: for each a JSON file and a model, and one table of all.

The JSON file of a data set comes last and whole; it says under which order, from which data, it came about, and with
which model beside it. So what is there counts once, and is done again only where the order, the data, the model or the
program changed.
"""

import dataclasses
import hashlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from fitting.cli.each.work import Found, Order
from fitting.errors import InputError
from fitting.report.results import write_json
from fitting.study.data_sets import DataSet
from fitting.study.task import Task
from fitting.version import program_version
from fitting.writing import write_text
from mckibben_jax.effect import name_of
from mckibben_jax.muscle import quantities
from mckibben_jax.parameter import parameters

TABLE = "table.csv"
NO_ROOM = "make room, or name another folder with --out; the same command then goes on"
IN_OTHER_WORDS = ("experiments", "effects", "library", "origin")  # parts of a task that a mark tells otherwise


def mark(order: Order, task: Task) -> str:
    """What makes a result the same: the data, the model with its values, what may vary, the program."""
    effects = {name_of(e): {p.name: float(getattr(e, p.name)) for p in parameters(e)} for e in task.effects}
    lines = {name: getattr(kind, "line", None) for name, kind in task.library.items()}
    sizes = [{name: None if (v := getattr(e.muscle, name)) is None else float(v) for name in quantities()}
             for e in task.experiments]  # fmt: skip
    told = {f.name: getattr(task, f.name) for f in dataclasses.fields(task) if f.name not in IN_OTHER_WORDS}
    parts = [order.command, order.candidates, order.rivals, order.code, order.through_instruments,
             [e.sha256 for e in task.experiments], sizes, effects, lines, told, program_version()]  # fmt: skip
    return hashlib.sha256(json.dumps(parts, sort_keys=True, default=repr).encode()).hexdigest()


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


class Folder:
    """Results on disk, by the name of the data set. Without `models`, no model is written, looked at or deleted."""

    def __init__(self, place: Path, models: bool = True):
        self.place, self.models = place, models
        try:
            place.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            cure = "name another folder with --out"
            raise InputError(f"no folder can be made: {error.strerror}", place, cure=cure) from None

    def known(self, one: DataSet, mark: str, fitted: bool = False) -> dict[str, Any] | None:
        """What came of a data set, if that was under the same order, and the model that it gave is there.

        One that was `fitted` gave a model if it converged; where none is noted, `--no-save` was given then.
        """
        try:
            told = json.loads(self._path(one, ".json").read_text(encoding="utf-8"))
        except (OSError, ValueError):  # not there, or not ours
            return None
        if not (isinstance(told, dict) and told.get("order") == mark and "result" in told):
            return None
        model, result = told.get("model"), told["result"]
        unsaved = model is None and fitted and result["converged"]
        return result if not self.models or (model == self._model_there(one) and not unsaved) else None

    def write(self, one: DataSet, mark: str | None, found: Found) -> None:
        """Keep what came of a data set; one that could not be used carries no mark, and is tried again."""
        model = _digest(found.model) if self.models and found.model else None
        if model:
            write_text(self._path(one, ".toml"), found.model, NO_ROOM)
        elif self.models:
            self._path(one, ".toml").unlink(missing_ok=True)  # of another order
        order = None if found.failed else mark
        told = {"data_set": one.name, "path": one.path, "order": order, "model": model, "result": found.result}
        write_json(str(self._path(one, ".json")), told)

    def write_table(self, rows: Sequence[Mapping[str, Any]]) -> None:
        """The table of all data sets."""
        import pandas as pd

        write_text(self.place / TABLE, pd.DataFrame(list(rows)).to_csv(index=False), NO_ROOM)

    def _path(self, one: DataSet, ending: str) -> Path:
        return self.place / f"{one.name}{ending}"

    def _model_there(self, one: DataSet) -> str | None:
        """The digest of a data set's model: that of another order, written by a command beside this one, differs."""
        try:
            return _digest(self._path(one, ".toml").read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return None
