"""What was the same throughout a recording is stated once: a held length, a load that hangs on."""

import re

import numpy as np
import pytest
from folders import folder_of, isometric_columns, only_run, release_columns, table

from fitting.errors import InputError
from fitting.recordings.experiment import read_experiment
from fitting.recordings.template import muscle_file


def of_one_length() -> dict:
    """An isometric recording whose length stands in no column."""
    columns = isometric_columns(lengths=(270,))
    return {head: values for head, values in columns.items() if not head.startswith("length")}


@pytest.mark.parametrize("said", ['length = "270 mm"', 'contraction = "10 %"', 'displacement = "3 cm"'])
def test_a_held_length_needs_no_column(tmp_path, said):
    """It stood in the name of each sheet, and a column had to be typed into the workbook."""
    csv = table(of_one_length())
    _, run = only_run(folder_of(tmp_path, csv, test="isometric", more=f"constant = {{ {said} }}"))
    np.testing.assert_allclose(run.contraction, 0.1)


def test_a_load_that_hangs_on_needs_no_column(tmp_path):
    columns = {head: values for head, values in release_columns().items() if not head.startswith("load")}
    _, run = only_run(folder_of(tmp_path, table(columns), test="quick release", more='constant = { load = "20 kg" }'))
    np.testing.assert_allclose(run.load, 20 * 9.80665)


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ("", "constant = .*length = .160 mm"),
        ('constant = { length = "? mm" }', "still to be filled in"),
        ('constant = { length = "270 bar" }', "bar"),
        ("constant = { length = 270 }", "not text"),
        ('constant = { force = "3 N" }', "force"),
        ('constant = { lenght = "270 mm" }', "did you mean 'length'"),
        ('constant = { length = "270 mm", displacement = "30 mm" }', "the same twice"),
        ('constant = { load = "3 kg", length = "270 mm" }', "no load counts"),
        ('constant = { pressure = "3 bar", length = "270 mm" }', "state it once"),
    ],
)
def test_what_is_wrong_with_a_constant_is_said_with_its_cure(tmp_path, more, said):
    with pytest.raises(InputError) as refused:
        only_run(folder_of(tmp_path, table(of_one_length()), test="isometric", more=more))
    assert re.search(said, str(refused.value))


def test_a_column_and_a_constant_are_not_both_taken(tmp_path):
    with pytest.raises(InputError, match="state it once"):
        read_experiment(
            folder_of(tmp_path, table(isometric_columns()), test="isometric", more='constant = { length = "1 m" }')
        )


def test_init_asks_for_the_length_where_no_column_tells_it(tmp_path):
    (tmp_path / "isometric.csv").write_text(table(of_one_length()))
    assert 'constant = { length = "? mm" }' in muscle_file(tmp_path)
    (tmp_path / "isometric.csv").rename(tmp_path / "hose of 270 mm.csv")
    assert 'test = "isometric"' in muscle_file(tmp_path)  # what moves is recorded
    (tmp_path / "hose of 270 mm.csv").unlink()
    (tmp_path / "isometric.csv").write_text(table(isometric_columns()))
    assert "constant = " not in muscle_file(tmp_path)
