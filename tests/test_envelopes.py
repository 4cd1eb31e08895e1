"""Files are envelopes: splitting, order, names of runs, units and a shifted clock change no verdict."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hidden.instruments import LABORATORY
from hidden.simulator import Muscle, Noise, Truth, dataset, loops, with_baseline, write
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fitting.diagnosis.diagnose import diagnose
from fitting.recordings.envelopes import without_envelopes
from fitting.recordings.experiment import read_experiment
from mckibben_jax.effects import CoulombFriction, Creep, IdealCylinder, Tip, ViscousDamping

CANDIDATES = [Tip(), ViscousDamping(), Creep()]
PROTOCOL = {"pressures": (1e5, 3e5, 5e5), "speeds": (0.005, 0.02), "samples": 400}


def made(hidden, seed=3):
    truth, noise = Truth(Muscle(), with_baseline(**hidden)), Noise(phi=0.7)
    return dataset(
        truth, [loops(truth, noise=noise, seed=seed, instruments=LABORATORY, **PROTOCOL)], noise=noise, seed=seed
    )


def answer(folder):
    """Verdict, p and limits of a data set."""
    found = diagnose([read_experiment(folder)], [IdealCylinder(), CoulombFriction()], candidates=CANDIDATES)
    return found.verdict, found.explanations, found.p_value, {k: v.detection_limit for k, v in found.effects.items()}


@pytest.fixture(scope="module", params=[{}, {"viscous_damping": {"B": 60.0}}], ids=["clean", "viscous damping"])
def original(request, tmp_path_factory):
    folder = write(made(request.param), tmp_path_factory.mktemp("one"))
    return folder, answer(folder)


def run_blocks(folder):
    """The lines of each run, and the head."""
    head, *lines = (folder / "loops.csv").read_text().splitlines()
    numbers = np.array([int(line.split(",")[0]) for line in lines])
    return head, [
        [line for line, number in zip(lines, numbers, strict=True) if number == one] for one in np.unique(numbers)
    ]


def rewritten(folder, place, files, name, shift, kilo):
    """The same runs in other files, under other names, by another clock and with the force in kN."""
    head, runs = run_blocks(folder)
    head = head.replace("force [N]", "force [kN]") if kilo else head
    at = head.split(",").index("force [kN]" if kilo else "force [N]")

    def line_of(line):
        cells = line.split(",")
        cells[0], cells[1] = name + cells[0], f"{float(cells[1]) + shift:.5f}"
        cells[at] = f"{float(cells[at]) * 1e-3:.6f}" if kilo else cells[at]
        return ",".join(cells)

    toml = (folder / "muscle.toml").read_text()
    entry = toml[toml.index("[[recording]]") :]
    for number, wanted in enumerate(files):
        lines = [line_of(line) for one in wanted for line in runs[one]]
        (place / f"part{number}.csv").write_text("\n".join([head, *lines]) + "\n")
    parts = "\n".join(entry.replace("loops.csv", f"part{number}.csv") for number in range(len(files)))
    (place / "muscle.toml").write_text(toml[: toml.index("[[recording]]")] + parts)
    return place


@settings(max_examples=3, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    cuts=st.sets(st.integers(1, 5), max_size=5), name=st.sampled_from(["", "7", "90"]),
    shift=st.sampled_from([0.0, 1000.0]), kilo=st.booleans(),
)  # fmt: skip
def test_envelopes_change_no_answer(original, tmp_path_factory, cuts, name, shift, kilo):
    folder, (verdict, explanations, p, limits) = original
    edges = [0, *sorted(cuts), 6]
    files = [list(range(a, b)) for a, b in pairwise(edges)]
    other = answer(rewritten(folder, tmp_path_factory.mktemp("other"), files, name, shift, kilo))
    assert other[:2] == (verdict, explanations)
    assert other[2] == pytest.approx(p, abs=0.01 if kilo else 0.002)
    for effect, limit in limits.items():
        assert other[3][effect] == pytest.approx(limit, rel=0.05 if kilo else 1e-3)


def test_twice_as_many_readings_change_no_verdict(original, tmp_path):
    """Every second reading left out: the same verdict, limits within a third."""
    folder, (verdict, explanations, _, limits) = original
    head, runs = run_blocks(folder)
    (tmp_path / "loops.csv").write_text("\n".join([head, *(line for run in runs for line in run[::2])]) + "\n")
    (tmp_path / "muscle.toml").write_text((folder / "muscle.toml").read_text())
    found = answer(tmp_path)
    assert found[:2] == (verdict, explanations)
    for effect, limit in limits.items():
        assert found[3][effect] == pytest.approx(limit, rel=0.5)


def test_what_was_read_by_another_instrument_stays_apart(original):
    """Two recordings of unlike noise are two, of the same noise one, with all runs in order."""
    recording = read_experiment(original[0]).recordings[0]
    experiment = read_experiment(original[0])
    half = len(recording.runs) // 2
    parts = [replace(recording, runs=recording.runs[:half]), replace(recording, runs=recording.runs[half:])]
    (one,) = without_envelopes(replace(experiment, recordings=tuple(parts))).recordings
    assert one.runs == recording.runs
    parts[1] = replace(parts[1], noise=2.0)
    assert len(without_envelopes(replace(experiment, recordings=tuple(parts))).recordings) == 2
