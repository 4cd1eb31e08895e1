"""A model of one muscle beside the data of another: what it predicted before anything is fitted there."""

import json

import pytest
from click.testing import CliRunner
from small_muscle import loops, write

from fitting.cli.main import main


@pytest.fixture(scope="module")
def told(tmp_path_factory):
    """What `compare` says of a muscle whose radius is stated 3 % too large, with a model of its twin; and its JSON."""
    place = tmp_path_factory.mktemp("two")
    spring = lambda eps, *_: 400 * eps  # noqa: E731
    one, other = (write(place / name, loops(spring, points=30, repeats=2, seed=k), name) for k, name in enumerate("ab"))
    described = other / "muscle.toml"
    described.write_text(described.read_text().replace('"8.0 +/- 0.1 mm"', '"8.24 +/- 0.3 mm"'))
    model = place / "model.toml"
    run = lambda *words: CliRunner().invoke(main, [*map(str, words)], catch_exceptions=False)  # noqa: E731
    assert (
        run("fit", one, "--effects", "ideal_cylinder", "coulomb_friction", "linear_spring", "--save", model).exit_code
        == 0
    )
    said = run("compare", other, "--model", model, "--json", place / "r.json")
    again = run(
        "compare",
        other,
        "--model",
        model,
        "--fix",
        "muscle.radius",
        "muscle.braid_angle",
        "--json",
        place / "held.json",
    )
    results = [json.loads((place / name).read_text()) for name in ("r.json", "held.json")]
    return [" ".join(each.output.split()) for each in (said, again)], results


def test_the_error_before_a_fit_is_the_prediction(told):
    (said, again), (fitted, held) = told
    assert "PREDICTED With the values of the model file and the sizes that muscle.toml states, the RMS error is" in said
    assert "fitted to these data: the errors below are no predictions." in said
    assert "FITTED" not in said
    assert fitted["predicted"]["then_fitted"] == ["muscle.radius", "muscle.braid_angle"]
    assert fitted["predicted"]["rmse"] == pytest.approx(held["rmse_N"])  # all held: nothing else is predicted
    assert fitted["predicted"]["rmse"] > 5 * fitted["rmse_N"]
    assert "PREDICTED" not in again
    assert "predicted" not in held
