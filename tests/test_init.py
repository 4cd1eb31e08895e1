"""`mckibben init` writes a muscle.toml that only needs its values."""

import pytest
from folders import isometric_columns, loop_csv, release_columns, table

from fitting.errors import InputError
from fitting.reading.init import write_muscle_file
from fitting.recordings import read_experiment

pytestmark = pytest.mark.filterwarnings("error")


def test_init_writes_a_file_to_fill_in_and_never_overwrites(tmp_path):
    (tmp_path / "rig.csv").write_text(loop_csv().replace("force [N]", "Load cell"))
    (tmp_path / "held lengths.csv").write_text(table(isometric_columns()))
    (tmp_path / "quick_release.csv").write_text(table(release_columns()))
    path = write_muscle_file(tmp_path)
    text = path.read_text()
    for expected in (
        'test = "loop"',
        'test = "isometric"',
        'test = "quick release"',
        'columns = { force = "Load cell" }',
    ):
        assert expected in text
    with pytest.raises(InputError, match="still to be filled in"):
        read_experiment(tmp_path)
    path.write_text(
        text.replace('length = "? mm"', 'length = "300 mm"', 1)
        .replace('radius = "? mm"', 'radius = "7 mm"')
        .replace('"? deg"', '"20 deg"')
        .replace('units = { force = "?" }', 'units = { force = "N" }')
    )
    filled = path.read_text()
    assert [r.test for r in read_experiment(tmp_path).recordings] == ["isometric", "quick release", "loop"]
    with pytest.raises(InputError, match="left alone"):
        write_muscle_file(tmp_path)
    assert path.read_text() == filled


def test_init_in_a_folder_without_recordings(tmp_path):
    with pytest.raises(InputError, match="no CSV file"):
        write_muscle_file(tmp_path)
    with pytest.raises(InputError, match="no such folder"):
        write_muscle_file(tmp_path / "gone")
