"""The model file: it gives back what was written, and says what is wrong with it."""

import numpy as np
import pytest

from fitting.errors import InputError
from fitting.library.library import library
from fitting.model_files.model_file import read_model
from fitting.model_files.writer import is_edited, write_model


def test_a_model_file_gives_back_what_was_written(study, tmp_path):
    task, c = study
    path = tmp_path / "model.toml"
    assert write_model(path, c.fit, task.experiments) is None
    found = read_model(path, library())
    assert [type(effect).__name__ for effect in found.effects] == ["IdealCylinder", "CoulombFriction"]
    for name, value in found.values.items():
        assert value == pytest.approx(c.fit.values[name], rel=1e-9)
    assert found.states["coulomb_friction.f_s"] == "fitted"
    assert found.states["muscle.length"] == "fixed"
    assert found.fitted_to(task.experiments)
    np.testing.assert_allclose(float(found.muscle.radius), c.fit.values["muscle.radius"], rtol=1e-9)


def test_a_model_file_that_was_edited_is_left_alone(study, tmp_path):
    task, c = study
    path = tmp_path / "model.toml"
    write_model(path, c.fit, task.experiments)
    assert not is_edited(path)
    assert write_model(path, c.fit, task.experiments) is None  # its own it may replace
    path.write_text(path.read_text().replace("fitted", "fixed", 1))
    before = path.read_text()
    assert "left alone" in write_model(path, c.fit, task.experiments)
    assert path.read_text() == before


def test_a_place_that_cannot_be_written_to_is_said(study, tmp_path):
    task, c = study
    assert "cannot be written" in write_model(tmp_path / "nowhere" / "model.toml", c.fit, task.experiments)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("format = 1", "format = 2"), "newer program"),
        (('"coulomb_friction"', '"coulomb_fricton"'), "did you mean 'coulomb_friction'"),
        (("f_s = ", "f_t = "), "did you mean 'f_s'"),
        (('state = "fitted"}', 'state = "fited"}'), "did you mean 'fitted'"),
        (('radius = {value = "', 'radius = {value = "? '), "not a number"),
    ],
)
def test_a_model_file_with_a_slip_is_refused_with_the_cure(study, tmp_path, change, words):
    task, c = study
    path = tmp_path / "model.toml"
    write_model(path, c.fit, task.experiments)
    path.write_text(path.read_text().replace(*change))
    with pytest.raises(InputError) as error:
        read_model(path, library())
    assert words in str(error.value)
    assert str(path) in str(error.value)
