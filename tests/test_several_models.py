"""Several models of one muscle: weights of their mean against closed forms, and what `simulate --also` writes."""

import json

import numpy as np
import pandas as pd
import pytest
from small_muscle import LENGTH
from typed import copied, refused, run

from fitting.study.several_models import least_squares_weights


def residuals(count=3, rows=400, seed=2):
    random = np.random.default_rng(seed)
    return random.normal(size=(rows, count)) @ random.normal(size=(count, count))


def test_of_two_models_the_weight_is_that_of_least_squares_on_the_line_between_them():
    """w e1 + (1 - w) e2 is least at w = e2 (e2 - e1) / |e2 - e1|^2, or at an end of 0 to 1."""
    ends = 0
    for seed in range(20):
        both = residuals(2, seed=seed)
        between = both[:, 1] - both[:, 0]
        best = np.clip(both[:, 1] @ between / (between @ between), 0.0, 1.0)
        assert least_squares_weights(both)[0] == pytest.approx(best, abs=1e-6)
        ends += best in (0.0, 1.0)
    assert 0 < ends < 20


def test_no_other_weights_foretell_better():
    for seed in range(5):
        left = residuals(4, seed=seed)
        weights = least_squares_weights(left)
        assert weights.min() >= 0
        assert weights.sum() == pytest.approx(1.0)
        found = np.sum((left @ weights) ** 2)
        others = np.random.default_rng(seed).dirichlet(np.full(4, 0.5), 2000)
        assert found <= np.sum((left @ others.T) ** 2, axis=0).min() * (1 + 1e-9)


def test_models_that_say_the_same_share_and_units_do_not_matter():
    left = residuals(2)
    alike = least_squares_weights(np.repeat(left[:, :1], 3, axis=1))
    np.testing.assert_allclose(alike, 1 / 3, atol=1e-6)
    np.testing.assert_allclose(least_squares_weights(1e6 * left), least_squares_weights(left), atol=1e-7)
    np.testing.assert_allclose(least_squares_weights(0 * left), 0.5)


@pytest.fixture(scope="module")
def tied(springy, tmp_path_factory):
    """Two models of one data set, of which one knows what the muscle has."""
    folder = copied(springy, tmp_path_factory.mktemp("tied") / "m")
    for name, effect in (("right", "linear_spring"), ("other", "dead_band")):
        run("add", folder, effect, "--baseline", "--save", folder / f"{name}.toml", "--quiet")
    return folder


def simulated(tied, out, *more):
    record = out.parent / f"{out.name}.json"
    told = run("simulate", tied / "other.toml", "--also", tied / "right.toml", "--out", out, "--json", record, *more)
    return " ".join(told.output.split()), json.loads(record.read_text())["models"]


def test_what_several_models_say_stands_beside_the_data_set(tied, tmp_path):
    said, record = simulated(tied, tmp_path / "loop", "--pressure", "2 bar")
    table = pd.read_csv(record["file"])
    each = table[["force 1 [N]", "force 2 [N]"]].to_numpy()
    weights = [one["weight"] for one in record["weights"]]
    np.testing.assert_allclose(table["force [N]"], each @ weights, rtol=1e-6)
    np.testing.assert_allclose(table["force_low [N]"], each.min(1))
    np.testing.assert_allclose(table["force_high [N]"], each.max(1))
    own = pd.read_csv(tmp_path / "loop" / "loop.csv")
    np.testing.assert_allclose(table["force 1 [N]"], own["force [N]"], rtol=1e-6)
    apart = np.ptp(each, axis=1)
    assert record["most_apart_N"] == pytest.approx(apart.max(), abs=1e-5)
    assert record["rms_apart_N"] == pytest.approx(np.sqrt(np.mean(apart**2)), abs=1e-5)
    assert record["contraction"] == pytest.approx(own["displacement [mm]"][apart.argmax()] / 1e3 / LENGTH, abs=1e-5)
    assert weights[1] > 0.9  # the one that knows
    assert f"{tied / 'right.toml'} {100 * weights[1]:.0f} %" in said


def test_without_the_data_models_count_alike_and_the_reason_is_said(tied, tmp_path):
    away = tmp_path / "away"
    away.mkdir()
    for name in ("right.toml", "other.toml"):
        (away / name).write_bytes((tied / name).read_bytes())
    said, record = simulated(away, tmp_path / "out")
    assert [one["weight"] for one in record["weights"]] == [0.5, 0.5]
    assert record["why_equal"] == "there are no data beside the model file"
    assert "The mean counts them equally: there are no data beside the model file." in said


def test_one_model_is_told_of_no_others_and_forces_alone_are_compared(tied, tmp_path):
    record = tmp_path / "alone.json"
    run("simulate", tied / "right.toml", "--out", tmp_path / "alone", "--json", record)
    assert json.loads(record.read_text())["models"] is None
    assert not (tmp_path / "alone" / "loop_models.csv").exists()
    other = ("--also", tied / "other.toml")
    assert "imposes the force" in refused(
        "simulate", tied / "right.toml", *other, "--test", "step", "--pressure", "1 bar,2 bar", "--out", tmp_path / "x"
    )
    assert "no such model file" in refused(
        "simulate", tied / "right.toml", "--also", tied / "gone.toml", "--out", tmp_path / "x"
    )
    assert not (tmp_path / "x").exists()
