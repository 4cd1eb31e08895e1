"""Recordings as Excel and MATLAB keep them, for the tests: the loop of `folders` in every kind of file."""

import io

import h5py
import numpy as np
import pytest
import scipy.io
from folders import MUSCLE, loop_columns

from fitting.errors import InputError
from fitting.recordings.experiment import read_experiment
from fitting.recordings.tables import read_table

NAMES = {"time [s]": "time", "pressure [bar]": "pressure", "contraction [%]": "contraction", "force [N]": "force"}
UNITS = 'units = { time = "s", pressure = "bar", contraction = "%", force = "N" }'


def full_columns():
    """The columns of the loop, each with a value for every reading."""
    columns = loop_columns()
    count = len(columns["time [s]"])
    return {name: np.broadcast_to(np.asarray(values, float), count) for name, values in columns.items()}


def vectors():
    """The same by names that MATLAB allows."""
    return {NAMES[name]: values for name, values in full_columns().items()}


def described(folder, file, more=UNITS):
    """A muscle.toml beside the file."""
    (folder / "muscle.toml").write_text(f'{MUSCLE}\n[[recording]]\nfile = "{file}"\ntest = "loop"\n{more}\n')
    return folder


def read_as(file, folder, content, more=UNITS):
    """What is read where a file of this name holds these bytes."""
    (folder / file).write_bytes(content)
    return read_experiment(described(folder, file, more))


def refused_as(file, folder, content, more=UNITS):
    """The message with which such a file is refused; it names the file and a cure."""
    with pytest.raises(InputError) as caught:
        read_as(file, folder, content, more)
    assert caught.value.cure, caught.value
    assert file in str(caught.value)
    return str(caught.value)


def mat(variables, **options):
    """The bytes of a MATLAB file of version 5."""
    out = io.BytesIO()
    scipy.io.savemat(out, variables, **{"do_compression": True, "oned_as": "column"} | options)
    return out.getvalue()


def mat73(variables):
    """The bytes of a MATLAB file of version 7.3, made as MATLAB does: no MATLAB was there to write one."""
    out = io.BytesIO()
    with h5py.File(out, "w", userblock_size=512) as file:
        for name, value in variables.items():
            _member(file, name, value)
    raw = bytearray(out.getvalue())
    raw[:116] = b"MATLAB 7.3 MAT-file".ljust(116)
    raw[124:128] = b"\x00\x02IM"
    return bytes(raw)


def _member(group, name, value):
    if isinstance(value, dict):
        inner = group.create_group(name)
        inner.attrs["MATLAB_class"] = np.bytes_("struct")
        for field, each in value.items():
            _member(inner, field, each)
    elif isinstance(value, list) and isinstance(value[0], dict):
        inner = group.create_group(name)
        inner.attrs["MATLAB_class"] = np.bytes_("struct")
        for field in value[0]:
            inner.create_dataset(field, data=_references(group, [each[field] for each in value]))
    elif isinstance(value, list):
        data = group.create_dataset(name, data=_references(group, value))
        data.attrs["MATLAB_class"] = np.bytes_("cell")
    elif isinstance(value, str):
        data = group.create_dataset(name, data=np.array([[ord(letter)] for letter in value], np.uint16))
        data.attrs["MATLAB_class"] = np.bytes_("char")
    else:
        data = group.create_dataset(name, data=np.atleast_2d(value.T), compression="gzip")
        data.attrs["MATLAB_class"] = np.bytes_("double")


def _references(group, values):
    kept = group.file.require_group("#refs#")
    for value in values:
        _member(kept, str(len(kept)), value)
    names = range(len(kept) - len(values), len(kept))
    return np.array([[kept[str(number)].ref] for number in names], dtype=h5py.ref_dtype)


def workbook(sheets, change=lambda book: None):
    """The bytes of an Excel workbook: rows of cells by sheet; `change` may do more to it."""
    import openpyxl

    book, out = openpyxl.Workbook(), io.BytesIO()
    book.remove(book.active)
    for name, rows in sheets.items():
        sheet = book.create_sheet(name)
        for row in rows:
            sheet.append(row)
    change(book)
    book.save(out)
    return out.getvalue()


def rows_of(columns=None):
    """A header and the readings below it."""
    columns = full_columns() if columns is None else columns
    return [list(columns), *(list(map(float, row)) for row in zip(*columns.values(), strict=True))]


def is_read_or_refused(path):
    """Whether the file is read, or refused with a cure."""
    try:
        read_table(path, given_units={"time": "s", "pressure": "bar", "contraction": "%", "force": "N"})
    except InputError as error:
        return bool(error.cure)
    return True
