"""The hidden-effect benchmark: how much is hidden, and the recordings that hide it."""

import numpy as np
import pytest
from hidden.simulator import NOISES, Noise, Truth, write
from hidden.study.cases import Case, plan
from hidden.study.changes import changed
from hidden.study.judge import hidden_of, judged, noise_sd
from hidden.study.mimicry import mimic
from hidden.study.protocols import OTHERS, PROTOCOLS, WHOLE
from hidden.study.sizes import RANGES, base_of, hiding, misfit, scaled, sized
from scipy.optimize import least_squares

from fitting.recordings.experiment import read_experiment

SIGMA = 0.6


@pytest.mark.parametrize("name", ["tip", "creep", "hertz_friction", "series_compliance", "screw_ripple"])
def test_a_size_is_what_a_refit_leaves(name):
    """Checked on the whole recording, the baseline refitted by scipy."""
    given = {name: sized("rich", name, 3.0, {}, SIGMA)}
    (recording,) = PROTOCOLS["rich"].recordings(hiding(base_of(given), given), Noise(sd=0.0))
    columns = recording.columns
    speed = np.abs(np.gradient(columns["displacement"], columns["time"]))
    kept = speed > 0.95 * np.where(columns["run"] < 5, 0.005, 0.02)

    def left(place):
        effects = {"ideal_cylinder": {}, "coulomb_friction": {"f_s": place[0]}}
        (other,) = PROTOCOLS["rich"].recordings(Truth(WHOLE, effects), Noise(sd=0.0))
        return (other.clean - recording.clean)[kept]

    found = least_squares(left, [0.01], x_scale=0.01, diff_step=1e-3)
    assert np.sqrt(np.mean(found.fun**2)) == pytest.approx(3.0, rel=0.1)


@pytest.mark.parametrize(
    ("protocol", "name"),
    [
        ("isometric", "supply_lag"),
        ("static map", "textile_friction"),
        ("static map without branches", "tip"),
        ("loops and static map", "creep"),  # only the loops show it
        ("loops and isometric", "supply_lag"),  # only the held lengths show it
    ],
)
def test_a_size_counts_every_recording(protocol, name):
    """Over all samples of the data, whichever recording shows the effect; friction refitted by scipy."""
    given = sized(protocol, name, 3.0, {}, SIGMA)
    assert given is not None
    hidden = PROTOCOLS[protocol].recordings(hiding(base_of([name]), {name: given}), Noise(sd=0.0))

    def left(place):
        effects = {"ideal_cylinder": {}, "coulomb_friction": {"f_s": place[0]}}
        plain = PROTOCOLS[protocol].recordings(Truth(WHOLE, effects), Noise(sd=0.0))
        return np.concatenate([(a.clean - b.clean)[steady(b)] for a, b in zip(plain, hidden, strict=True)])

    found = least_squares(left, [0.01], x_scale=0.01, diff_step=1e-3)
    assert np.sqrt(np.mean(found.fun**2)) == pytest.approx(3.0, rel=0.1)


def steady(recording):
    """Samples of loops at 0.01 m/s away from turning points; all of other recordings."""
    if recording.test != "loop":
        return np.ones(len(recording.clean), bool)
    return np.abs(np.gradient(recording.columns["displacement"], recording.columns["time"])) > 0.95 * 0.01


@pytest.mark.parametrize(
    ("protocol", "name"),
    [
        ("isometric", "creep"),
        ("isometric", "textile_friction"),
        ("static map", "viscous_damping"),
        ("static map without branches", "textile_friction"),
        ("sine loops", "supply_lag"),
    ],
)
def test_what_a_kind_of_recording_cannot_show_is_not_diagnosed(protocol, name):
    """Friction at rest, speed where nothing moves, a lag where the pressure is held."""
    assert judged(Case("kinds", (name,), 10.0, "sigma", "white", protocol, 0, 1), {})["visible"] is False


@pytest.mark.parametrize("protocol", OTHERS)
def test_every_kind_of_recording_is_written_and_read(protocol, tmp_path):
    """As the tests that it is said to be, with as many readings; the same seed gives the same folder."""
    truth = hiding(base_of(["tip"]), {"tip": {"k": 1.1}})
    first, again = (write(PROTOCOLS[protocol].data(truth, NOISES["ar"], 3), tmp_path / name) for name in "ab")
    read, made = read_experiment(first), PROTOCOLS[protocol].recordings(truth, NOISES["ar"], 3)
    assert [recording.test for recording in read.recordings] == [part.test for part in PROTOCOLS[protocol].parts]
    for recording, true in zip(read.recordings, made, strict=True):
        measured = np.concatenate([run.measured for run in recording.runs])
        assert len(measured) == len(true.clean), recording.test
        assert np.std(measured - true.clean) == pytest.approx(NOISES["ar"].sd, rel=0.3), recording.test
    assert all((again / path.name).read_bytes() == path.read_bytes() for path in first.iterdir())


def test_sizes_stay_where_a_search_may_go():
    """Otherwise the truth could not be found; and the shapes of the plan stay there too."""
    from mckibben_jax.effect import name_of
    from mckibben_jax.effects import LIBRARY
    from mckibben_jax.parameter import parameters

    declared = {f"{name_of(kind)}.{p.name}": (p.lower, p.upper) for kind in LIBRARY for p in parameters(kind)}
    for full, (low, high) in RANGES.items():
        if full in declared:
            assert declared[full][0] <= low < high <= declared[full][1], full
    for case in plan(1)[::7]:
        for name in case.hidden:
            for key, value in scaled(name, 1.0, case.shapes()[name]).items():
                low, high = declared.get(f"{name}.{key}", (-np.inf, np.inf))
                assert low <= value <= high, (case.id, key)


def test_what_no_size_would_show_is_said():
    """A held pressure never lags."""
    case = Case("single", ("supply_lag",), 5.0, "sigma", "white", "rich", 0, 1)
    assert hidden_of(case, {})[0] is None
    assert judged(case, {})["visible"] is False


def test_limits_are_taken_from_the_clean_case():
    """Three times what was printed."""
    case = Case("single", ("tip",), 3.0, "limit", "white", "rich", 0, 1)
    hidden, target = hidden_of(case, {"tip": 0.5})
    assert target == 1.5
    assert misfit("rich", hidden, noise_sd(NOISES["white"])) == pytest.approx(1.5, rel=0.03)


def test_exact_likes_are_told_by_the_simulator():
    """A gain of the force is a gain of the pressure; a tip is no spring."""
    gain = {"force_gain": sized("rich", "force_gain", 3.0, {}, SIGMA)}
    assert mimic("rich", gain, ["pressure_gain"], SIGMA) < 1e-3
    tip = {"tip": sized("rich", "tip", 3.0, {}, SIGMA)}
    assert mimic("rich", tip, ["linear_spring"], SIGMA) > 1.0


@pytest.mark.parametrize("change", ["other units", "shuffled"])
def test_said_in_another_way_it_reads_the_same(change, tmp_path):
    """Run by run, to the digits written."""
    data = PROTOCOLS["geometry to 1 %"].data(Truth(WHOLE, base_of(())), NOISES["white"], 3)
    before = read_experiment(write(data, tmp_path / "before"))
    after = read_experiment(changed(write(data, tmp_path / "after"), change, np.random.default_rng(1)))
    runs = {run.name: run for run in after.recordings[0].runs}
    assert set(runs) == {run.name for run in before.recordings[0].runs}
    for run in before.recordings[0].runs:
        np.testing.assert_allclose(runs[run.name].measured, run.measured, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(runs[run.name].contraction, run.contraction, rtol=1e-9, atol=1e-12)
    for key, (mean, error) in before.priors.items():
        assert after.priors[key] == pytest.approx((mean, error), rel=1e-9)
