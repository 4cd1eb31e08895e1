"""A MATLAB file as columns: vectors, matrices and the fields of structs; nothing in it is ever run."""

import io
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from fitting.errors import InputError, unknown_name
from fitting.recordings.mat_elements import mat5_variables
from fitting.recordings.mat_variables import DamagedError, Struct, Unread, columns_of
from fitting.recordings.settings import TABLES
from fitting.recordings.source import Source
from fitting.recordings.table_text import bytes_of

HDF5 = b"\x89HDF\r\n\x1a\n"  # how files of version 7.3 begin, behind 512 bytes of MATLAB's own
AGAIN = "save it again in MATLAB or Octave: save('name.mat', '-v7', 'time', 'pressure', ...)"
TOO_MUCH = f"the MATLAB file unpacks to more than {TABLES.unpacked_bytes / 1e6:g} MB"
BEGIN = "save vectors, in MATLAB: save('loops.mat', 'time', 'pressure', 'force', 'displacement')"


def mat_source(path: Path, variable: str | None) -> Source:
    """The variables of a file as a recording; `variable` names one of its structs or matrices."""
    raw = bytes_of(path)
    variables = read_variables(raw, path)
    if variable is None:
        _check_one(variables, path)
    else:
        if variable not in variables:
            raise unknown_name("variable", variable, variables, path)
        only = variables[variable]
        variables = only if isinstance(only, dict) else {variable: only}
    columns, unread = columns_of(variables)
    if not columns:
        why = "; ".join(f"'{name}' {reason}" for name, reason in [*unread.items()][:3])
        problem = "no variable in it is a column" + (f": {why}" if why else "")
        raise InputError(problem, path, cure=_cure(unread))
    heads, longest = [*columns, *unread], max(map(len, columns.values()))

    def cells() -> tuple[list[pd.Series], str]:
        empty = pd.Series([], dtype=float)
        return [*columns.values(), *(empty for _ in unread)], "."

    return Source(heads, None, np.arange(1, longest + 1), raw, cells, unread)


def struct_names(path: Path) -> list[str]:
    """The structs of a file that each hold a recording; none where it cannot be read."""
    try:
        return _alike(read_variables(bytes_of(path), path))
    except InputError:
        return []


def _alike(variables: Struct) -> list[str]:
    """The structs that have columns of the same names as another one: each is a recording of its own."""
    structs = {name: {*columns_of(value)[0]} for name, value in variables.items() if isinstance(value, dict)}
    return [name for name, heads in structs.items() if any(heads & o for n, o in structs.items() if n != name)]


def _check_one(variables: Struct, path: Path) -> None:
    alike = _alike(variables)
    if alike:
        names = ", ".join(f"'{name}'" for name in alike)
        cure = f'add variable = "{alike[0]}" below file in muscle.toml; every struct is a [[recording]] of its own'
        raise InputError(f"{len(alike)} structs have columns of the same names: {names}", path, cure=cure)


def read_variables(raw: bytes, path: Path) -> Struct:
    """The variables of a file of any version."""
    damaged = "this is no MATLAB file, or it is damaged or breaks off"
    try:
        if HDF5 in (raw[:8], raw[512:520]):
            from fitting.recordings.mat_hdf5 import hdf5_variables

            return hdf5_variables(raw)
        return _mat4_variables(raw) if 0 in raw[:4] else mat5_variables(raw)  # a zero there: version 4
    except DamagedError:
        raise InputError(damaged, path, cure=AGAIN) from None
    except MemoryError:
        raise InputError(TOO_MUCH, path, cure="save fewer variables, or every tenth sample") from None


def _mat4_variables(raw: bytes) -> Struct:
    """The variables of a file of version 4, which has matrices and texts only."""
    from scipy.io import loadmat

    try:
        found = loadmat(io.BytesIO(raw))
    except Exception:  # scipy trusts its input: a damaged one ends in any exception that there is
        raise DamagedError from None
    return {name: _plain(value) for name, value in found.items() if not name.startswith("__")}


def _plain(value: Any) -> Any:
    if not isinstance(value, np.ndarray):
        return Unread.SPARSE
    return [str(text).strip() for text in value.ravel()] if value.dtype.kind in "US" else value


def _cure(unread: dict[str, str]) -> str:
    """What to type in MATLAB."""
    name = next((name for name, reason in unread.items() if reason == Unread.OBJECT), None)
    if name is None:
        return BEGIN
    return f"in MATLAB: s = table2struct({name}, 'ToScalar', true); save('loops.mat', '-struct', 's')"
