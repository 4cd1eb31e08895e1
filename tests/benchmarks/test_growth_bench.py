"""How the processor time of reading, fitting, comparing and testing grows with the size of the problem.

Run with `python -m pytest tests/benchmarks/test_growth_bench.py --benchmark-only`. Along each of four sizes everything
else stays as it is: samples (in 10 runs), runs (of 24,000 samples in 1,000 loops), free parameters (of one model of 20)
and effects among which the missing one is sought. Times are those of the process, all its threads counted, without the
first call, which compiles and stands apart. Nothing is asserted about time; that everything read, fitted and tested is
of the stated size is. Tables and exponents are printed at the end.
"""

import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hidden.simulator import TYPICAL, Muscle, Noise, Truth, dataset, loops, with_baseline, write
from telling import tell

from fitting.comparison.compare import compare
from fitting.diagnosis.diagnose import one_thread
from fitting.diagnosis.examine import Examiner
from fitting.diagnosis.lay_out import universe
from fitting.diagnosis.search import Search
from fitting.diagnosis.settings import DIAGNOSIS
from fitting.least_squares.fit import fit
from fitting.least_squares.record import Fit
from fitting.least_squares.search import rows_and_slopes
from fitting.least_squares.subset import subset_of
from fitting.problem.residuals import problem
from fitting.problem.thinning import thinned
from fitting.problem.unknowns import unknowns
from fitting.problem.varying import Varying
from fitting.recordings.experiment import read_experiment
from fitting.recordings.records import Experiment
from mckibben_jax import effects as library
from mckibben_jax.effect import name_of
from mckibben_jax.parameter import parameters

SAMPLES = (10**3, 10**4, 10**5, 3 * 10**5, 10**6)  # of which a diagnosis keeps about 3,500
RUNS = (1, 100, 250, 1000)
LOOPS, A_LOOP = 1000, 24  # loops, and samples of each, that are split into runs
PARAMETERS = (3, 6, 12, 20)
EFFECTS = (5, 10, 20, 40)
FEW = 2000  # samples where other things grow
MOST_ROUNDS, LONG = 5, 0.5  # warm rounds, and seconds of them that are enough

BASELINE = ("ideal_cylinder", "coulomb_friction")
FITTED = (*BASELINE, "tip", "force_offset")
SOUGHT = ("weight", "strand_bending", "bladder_schulte", "presliding", "time_delay")  # one or two of each stage
WIDE = (
    "ideal_cylinder", "pressure_offset", "pressure_gain", "contraction_offset", "dead_band", "series_compliance",
    "tip_pressure", "end_stop", "linear_spring", "textile_friction", "constant_friction", "kinetic_friction",
    "viscous_damping", "hill", "force_gain", "force_offset",
)  # fmt: skip
FREED = (  # of that model, in this order
    "textile_friction.f_s", "textile_friction.beta", "linear_spring.K", "force_offset.F_off", "tip_pressure.b_k",
    "viscous_damping.B", "contraction_offset.eps_off", "pressure_offset.P_off", "kinetic_friction.ratio",
    "kinetic_friction.v_s", "end_stop.K", "end_stop.eps_s", "dead_band.P_th", "constant_friction.F_c",
    "series_compliance.k_s", "hill.a_over_F0", "hill.b", "pressure_gain.g", "force_gain.g", "tip_pressure.a_k",
)  # fmt: skip
MEASURED = Muscle(shear_modulus=5e5, strand_width=3e-4, strand_modulus=2e9, strand_poisson=0.35)  # all that any needs
KINDS = {name_of(kind): kind for kind in library.LIBRARY}
COLUMNS = ("reading", "rows and slopes", "fit", "compare", "one by one", "the test")
FIRST_CALLS = "first calls"


@dataclass(frozen=True)
class Times:
    """Processor seconds of the first call, and least of the warm ones."""

    first: float
    warm: float


GROWN: dict[str, dict[int, dict[str, Times]]] = {}  # what grows, to its sizes, to what took how long


# What is measured, and what is told of it ----------------------------------------------------------------------------


def spent(run: Callable[[], object]) -> float:
    """Processor seconds of one call."""
    begun = time.process_time()
    run()
    return time.process_time() - begun


def timed(run: Callable[[], object]) -> Times:
    """The first call, then warm ones."""
    first, warm = spent(run), [spent(run)]
    while len(warm) < MOST_ROUNDS and sum(warm) < LONG:
        warm.append(spent(run))
    return Times(first, min(warm))


def exponent(sizes: list[int], seconds: list[float]) -> float:
    """Of the power law through the larger half of the sizes."""
    half = slice((len(sizes) - 1) // 2, None)
    return float(np.polyfit(np.log(sizes[half]), np.log(seconds[half]), 1)[0])


def kept(benchmark, along: str, size: int, measure: Callable[[], dict[str, Times]]) -> None:
    """Measure all at one size, once, and keep it for the table."""
    benchmark.group = f"growth with {along}"
    found = benchmark.pedantic(measure, rounds=1)
    GROWN.setdefault(along, {})[size] = found
    benchmark.extra_info.update({f"{what}_warm_cpu_s": times.warm for what, times in found.items()})
    benchmark.extra_info.update({f"{what}_first_cpu_s": times.first for what, times in found.items()})


def table(along: str) -> list[str]:
    """A Markdown table in milliseconds; its last line holds the exponents."""
    rows = GROWN[along]
    sizes = sorted(rows)
    columns = {what: [rows[size][what].warm for size in sizes] for what in COLUMNS if what in rows[sizes[0]]}
    columns[FIRST_CALLS] = [sum(t.first - t.warm for t in rows[size].values()) for size in sizes]
    lines = ["| " + " | ".join([along, *columns]) + " |", "|---" * (1 + len(columns)) + "|"]
    for i, size in enumerate(sizes):
        lines.append("| " + " | ".join([f"{size:,}", *(in_ms(column[i]) for column in columns.values())]) + " |")
    powers = [f"{exponent(sizes, column):.2f}" if len(sizes) > 2 else "" for column in columns.values()]
    return [*lines, "| " + " | ".join(["exponent", *powers]) + " |"]


def in_ms(seconds: float) -> str:
    """Milliseconds to three figures."""
    return f"{1e3 * seconds:,.0f}" if seconds >= 0.1 else f"{1e3 * seconds:.3g}"


@pytest.fixture(scope="module", autouse=True)
def summary(request):
    """The tables, told once all is measured."""
    yield
    for along in GROWN:
        tell(request.config, [f"processor time along {along}, ms, warm", *table(along), ""])


# The problems --------------------------------------------------------------------------------------------------------


def effects_of(names: Iterable[str]) -> list:
    """Effects at their defaults."""
    return [KINDS[name]() for name in names]


def known_but(freed: Iterable[str]) -> list:
    """The wide model at the values that are hidden in its data; the freed parameters at their defaults.

    All are arrays, so that what is compiled for one choice of parameters serves the next.
    """
    made = []
    for name in WIDE:
        values = {p.name: p.default for p in parameters(KINDS[name])}
        known = {key: value for key, value in TYPICAL.get(name, {}).items() if f"{name}.{key}" not in freed}
        made.append(KINDS[name](**{key: jnp.asarray(float(value)) for key, value in (values | known).items()}))
    return made


def recorded(folder: Path, effects: dict[str, dict[str, float]] | None = None, **protocol) -> Path:
    """Loops of a muscle that is as the baseline says (or has these effects), with white noise."""
    noise, truth = Noise(sd=0.6), Truth(MEASURED, effects or with_baseline())
    return write(dataset(truth, [loops(truth, noise=noise, seed=5, **protocol)], noise=noise), folder)


def judged(experiment: Experiment, present: Sequence, sought: Sequence[str], fix=()) -> tuple[Search, list[float]]:
    """What every diagnosis begins with: each effect refitted with the model, then the test; and when each was done."""
    begun = time.process_time()
    light = [thinned(experiment, DIAGNOSIS.samples)]
    world = universe(light, present, effects_of(sought), Varying(fix))
    base = world.fit(frozenset(world.base), world.start)
    with one_thread():
        no_fit: Any = None  # its errors are told in the end, to which this does not come
        search = Search(world, base, Examiner(world, base, 0), no_fit, lambda *_: None)
        search.fit_level([frozenset([name]) for name in world.candidates])
        refitted = time.process_time()
        search.examiner.adequacy(frozenset(), base, search.fits, limits=True)
    return search, [refitted - begun, time.process_time() - refitted]


def timed_test(experiment: Experiment, present: Sequence, sought: Sequence[str], fix=()) -> dict[str, Times]:
    """The two parts of it, each with its first call."""
    rounds: list[list[float]] = []
    while len(rounds) < 2 or (len(rounds) <= MOST_ROUNDS and sum(map(sum, rounds[1:])) < LONG):
        search, parts = judged(experiment, present, sought, fix)
        rounds.append(parts)
    assert set(search.world.candidates) == set(sought)
    assert len(search.fits) >= 0.9 * len(sought)  # what needs a rubber is not fitted where there is none
    return {what: Times(rounds[0][i], min(r[i] for r in rounds[1:])) for i, what in enumerate(COLUMNS[4:])}


def timed_fit(experiment: Experiment, effects: Sequence, fix=()) -> tuple[list[Fit], dict[str, Times]]:
    """Rows and slopes once, a fit from one start, and the comparison."""
    layout = unknowns([experiment], effects)
    given, _ = problem([experiment], layout)
    subset = subset_of(layout, layout.start, Varying(fix).names(layout))
    place = subset.place(subset.full)
    found: list[Fit] = []
    return found, {
        "rows and slopes": timed(lambda: jax.block_until_ready(rows_and_slopes(given, subset, place))),
        "fit": timed(lambda: found.append(fit([experiment], effects, fix=fix, starts=1))),
        "compare": timed(lambda: compare(found[0], [experiment])),
    }


def on_folder(folder: Path) -> dict[str, Times]:
    """All of it, as the commands do it."""
    times = {"reading": timed(lambda: read_experiment(folder))}
    experiment = read_experiment(folder)
    (found, *_), more = timed_fit(experiment, effects_of(FITTED))
    times |= more
    assert abs(found.values["tip.k"] - 1) < 5 * found.error("tip.k")  # there is none
    return times | timed_test(experiment, effects_of(BASELINE), SOUGHT)


# Along each size -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("count", SAMPLES)
def test_samples(benchmark, tmp_path, count):
    """Ten runs at five pressures and two speeds, sampled ever more densely."""
    folder = recorded(tmp_path, samples=count // 10)
    assert sum(len(run) for run in read_experiment(folder).recordings[0].runs) == count
    kept(benchmark, "samples", count, lambda: on_folder(folder))


@pytest.mark.parametrize("count", RUNS)
def test_runs(benchmark, tmp_path, count):
    """The same loops, split into ever more runs."""
    each = LOOPS // count
    turns, pressures = (0.0, 0.26) * each + (0.0,), tuple(np.resize((1e5, 2e5, 3e5, 4e5, 5e5), count))
    folder = recorded(tmp_path, pressures=pressures, speeds=(0.02,), turns=turns, samples=each * A_LOOP)
    assert [len(run) for run in read_experiment(folder).recordings[0].runs] == count * [each * A_LOOP]
    kept(benchmark, "runs", count, lambda: on_folder(folder))


@pytest.mark.parametrize("count", PARAMETERS)
def test_parameters(benchmark, tmp_path, count):
    """A muscle with sixteen effects, of whose parameters ever more are not known."""
    hidden = {name: TYPICAL.get(name, {}) for name in WIDE}
    experiment = read_experiment(recorded(tmp_path, hidden, samples=FEW // 10))
    effects = known_but(FREED[:count])
    layout = unknowns([experiment], effects)
    fix = tuple(name for name in layout.names if name not in FREED[:count])
    assert len(Varying(fix).names(layout)) == count

    def measure() -> dict[str, Times]:
        (found, *_), times = timed_fit(experiment, effects, fix)
        assert len(found.free) + len(found.held) == count
        return times | timed_test(experiment, effects, SOUGHT, fix)

    kept(benchmark, "free parameters", count, measure)


@pytest.mark.parametrize("count", EFFECTS)
def test_effects(benchmark, tmp_path, count):
    """Ever more of the library, printed rivals too, in an order in which kinds mix."""
    others = sorted(set(KINDS) - set(BASELINE))
    sought = [str(name) for name in np.random.default_rng(0).permutation(others)[:count]]
    assert len(sought) == count
    experiment = read_experiment(recorded(tmp_path, samples=FEW // 10))
    kept(benchmark, "effects", count, lambda: timed_test(experiment, effects_of(BASELINE), sought))
