"""A thousand runs, and a million readings, by the command: the right effect, in memory that a laptop has."""

import json
import resource
import subprocess
import sys

import pytest
from hidden.instruments import Channel, Instruments
from hidden.simulator import Muscle, Noise, Truth, dataset, loops, with_baseline, write

NOISE = Noise(sd=0.6, phi=0.7)
STIFFNESS = 400.0  # N/m: 31 N at the end of the stroke
INSTRUMENTS = Instruments(pressure=Channel(noise=150.0), force=Channel(gain_per_run=0.003))
MEMORY = 2.5e9  # bytes
SHAPES = {
    "a thousand runs": {
        "pressures": tuple(1e5 + 4e5 * k / 99 for k in range(100)),
        "speeds": tuple(0.005 + 0.002 * k for k in range(10)),
        "turns": (0.0, 0.26, 0.0),
        "samples": 60,
    },
    "a million readings": {"pressures": (1e5, 2e5, 3e5, 4e5, 5e5), "speeds": (0.005, 0.02), "samples": 100_000},
}


@pytest.mark.slow
@pytest.mark.parametrize("shape", SHAPES)
def test_a_large_recording_is_diagnosed_rightly_in_bounded_memory(tmp_path, shape):
    """Of a thousand runs an earlier version named another effect, after six minutes and 4 GB."""
    truth = Truth(Muscle(), with_baseline(linear_spring={"K": STIFFNESS}))
    recording = loops(truth, noise=NOISE, seed=1, instruments=INSTRUMENTS, **SHAPES[shape])
    write(dataset(truth, [recording], "Large", NOISE, 1), tmp_path / "large")
    told = tmp_path / "told.json"
    order = ["diagnose", str(tmp_path / "large"), "--baseline", "--quiet", "--json", str(told)]
    subprocess.run([sys.executable, "-m", "fitting.cli", *order], check=True)
    said = json.loads(told.read_text(encoding="utf-8"))
    assert (said["verdict"], said["explanations"]) == ("missing", [["linear_spring"]])
    value, error = said["effects"]["linear_spring"]["estimate"]["K"]
    assert abs(value - STIFFNESS) < 4 * error
    assert 1024 * resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss < MEMORY
