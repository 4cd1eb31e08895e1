"""Diagnosis of 10,000 samples in a fresh process: cold, warm, and how often something was compiled.

Run with `python -m pytest tests/benchmarks/test_diagnose_bench.py --benchmark-only`. Nothing is asserted about time;
that one compiled function serves every set of effects with as many free parameters is.
"""

import json
import os
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path

import pytest
from telling import tell

FIRST = (
    "tip", "dead_band", "pressure_offset", "supply_lag", "series_compliance", "ideal_cylinder", "bladder_neo_hookean",
    "bladder_mooney_rivlin", "end_stop", "coulomb_friction", "textile_friction", "constant_friction",
    "kinetic_friction", "presliding", "viscous_damping", "hill", "creep", "force_offset",
)  # fmt: skip
COMPILED = "/jax/core/compile/backend_compile_duration"
TOLD: list[str] = []


def main(folder: str, which: str) -> None:
    """What the fresh process does: diagnose twice, and print what it took as JSON."""
    began = time.perf_counter()
    import jax

    jax.config.update("jax_enable_x64", True)
    compiled: Counter = Counter()
    jax.monitoring.register_event_duration_secs_listener(
        lambda event, seconds, **about: compiled.update([about.get("fun_name", "")] if event == COMPILED else [])
    )
    from fitting.diagnosis.diagnose import diagnose
    from fitting.recordings.experiment import read_experiment
    from fitting.study.baseline import baseline
    from mckibben_jax.effect import name_of
    from mckibben_jax.effects import LIBRARY

    experiment = read_experiment(Path(folder))
    candidates = [kind() for kind in LIBRARY if name_of(kind) in FIRST] if which == "first" else None
    passes = []
    for _ in range(2):
        compiled.clear()
        wall, cpu = (time.perf_counter(), time.process_time()) if passes else (began, 0.0)  # cold: imports, reading too
        found = diagnose([experiment], baseline(), candidates=candidates)
        took = {"wall": time.perf_counter() - wall, "cpu": time.process_time() - cpu}
        passes.append({**took, "compiled": dict(compiled)})
    told = {"passes": passes, "fitted": len(found.tried), "explanations": found.explanations}
    print(json.dumps(told))


@pytest.fixture(scope="module", autouse=True)
def summary(request):
    """What was found, told once all is measured."""
    yield
    tell(request.config, TOLD)


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """Ten runs of 1,000 samples at five pressures and two speeds, the tip correction hidden in them."""
    from hidden.simulator import Muscle, Truth, rich, with_baseline, write

    truth = Truth(Muscle(), with_baseline(tip={"k": 1.15}))
    return write(rich(truth, seed=3), tmp_path_factory.mktemp("rich"))


def fresh(folder: Path, which: str) -> dict:
    """The same in a process of its own, with no compiled code kept from before."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith("JAX_")}
    command = [sys.executable, __file__, str(folder), which]
    told = subprocess.run(command, env=kept, cwd=Path(__file__).parents[2], capture_output=True, text=True, check=True)
    return json.loads(told.stdout.splitlines()[-1])


@pytest.mark.timeout(1800)
@pytest.mark.parametrize("which", ["first", "all"])
def test_diagnosis(benchmark, folder, which):
    """The first dozen and a half of effects, and the whole library."""
    benchmark.group = "diagnosis, cold and warm"
    found = benchmark.pedantic(fresh, (folder, which), rounds=1)
    cold, warm = found["passes"]
    by_name = cold["compiled"]
    benchmark.extra_info.update(found)
    TOLD.append(
        f"diagnosis of 10,000 samples, {which} effects: cold {cold['wall']:.1f} s ({cold['cpu']:.1f} s of processors), "
        f"warm {warm['wall']:.1f} s ({warm['cpu']:.1f} s); {found['fitted']} models fitted, "
        f"{sum(by_name.values())} compilations, of them {by_name.get('jit(solve)', 0)} of a fit; "
        f"warm {sum(warm['compiled'].values())}, of them {warm['compiled'].get('jit(solve)', 0)} of a fit"
    )
    assert found["explanations"] == [["tip"]]
    assert found["fitted"] > 20
    assert by_name["jit(solve)"] <= 3  # the baseline by itself, and two counts of free parameters
    assert not warm["compiled"].get("jit(solve)")


if __name__ == "__main__":
    main(*sys.argv[1:])
