"""Traced programs are found again by another process, and never where they could be wrong."""

import inspect
import shutil
import sys
import threading
import time
from pathlib import Path
from types import ModuleType

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import small_muscle

from fitting.compiled import held, store
from fitting.compiled import traced as keeping
from fitting.compiled.traced import Kept, kept
from fitting.diagnosis.lay_out import universe
from fitting.diagnosis.record import Diagnosis
from fitting.problem import sizes
from fitting.problem.thinning import thinned
from fitting.recordings.experiment import read_experiment
from mckibben_jax.effects import BladderNeoHookean, CoulombFriction, IdealCylinder, Tip


class Line(eqx.Module):
    """A structure of this module, whose source no digest covers."""

    slope: jax.Array


@pytest.fixture
def folder(tmp_path):
    """A store of compiled programs that only this test uses."""
    before = jax.config.jax_compilation_cache_dir
    jax.config.update("jax_compilation_cache_dir", str(tmp_path))
    yield tmp_path
    jax.config.update("jax_compilation_cache_dir", before)


class Counted:
    """A function that counts how often Python runs through it."""

    def __init__(self):
        self.times = 0

    def function(self):
        def scaled(values, factor=2):
            self.times += 1
            return {"sum": jnp.sum(values) * factor, "all": values * factor}

        return scaled

    def process(self):
        """The function as another process would find it: nothing is left in memory."""
        return Kept(self.function(), like={"sum": 0, "all": 0})


def test_what_one_process_traced_the_next_one_reads(folder):
    body, values = Counted(), np.arange(5.0)
    first, again = body.process()(values), body.process()(values)
    assert body.times == 1
    assert len(list(folder.glob("*.program"))) == 1
    assert float(first["sum"]) == float(again["sum"]) == 20.0
    np.testing.assert_array_equal(again["all"], 2 * values)


def test_other_shapes_types_and_plain_values_are_other_programs(folder):
    body = Counted()
    assert float(body.process()(np.arange(5.0))["sum"]) == 20.0
    assert float(body.process()(np.arange(6.0))["sum"]) == 30.0
    assert float(body.process()(np.arange(5.0), 3)["sum"]) == 30.0
    assert body.process()(np.arange(5))["all"].dtype == jnp.int64
    assert body.times == 4


def test_a_default_that_is_spelt_out_is_the_same_program(folder):
    body = Counted()
    body.process()(np.arange(5.0))
    assert float(body.process()(np.arange(5.0), factor=2)["sum"]) == 20.0
    assert body.times == 1


def test_other_sources_are_other_programs(folder, monkeypatch):
    body = Counted()
    body.process()(np.arange(5.0))
    monkeypatch.setattr(keeping, "_sources", lambda _: "changed")
    body.process()(np.arange(5.0))
    assert body.times == 2


@pytest.fixture
def copied(tmp_path, monkeypatch):
    """Both packages as a digest finds them, in files that a test may change."""
    for package in keeping.PACKAGES:
        home = Path(inspect.getfile(sys.modules[package]))
        shutil.copytree(home.parent, tmp_path / package, ignore=shutil.ignore_patterns("__pycache__"))
        monkeypatch.setitem(sys.modules, package, ModuleType(package))
        monkeypatch.setattr(sys.modules[package], "__file__", str(tmp_path / package / home.name), raising=False)
    return tmp_path


@pytest.mark.parametrize(
    ("file", "of_fits", "of_all"),
    [
        ("mckibben_jax/effects/felt.py", True, True),
        ("fitting/problem/residuals.py", True, True),
        ("fitting/precision.py", True, True),
        ("fitting/diagnosis/verdict.py", False, True),
        ("fitting/report/page/page.py", False, True),
        ("README.md", False, False),
    ],
)
def test_only_what_a_function_can_call_makes_other_programs(copied, file, of_fits, of_all):
    digest = keeping._sources.__wrapped__  # as another process would make it
    before = [digest(covered) for covered in (keeping.OF_FITS, keeping.PACKAGES)]
    with (copied / file).open("a") as changed:
        changed.write("# another word")
    after = [digest(covered) for covered in (keeping.OF_FITS, keeping.PACKAGES)]
    assert [one != other for one, other in zip(before, after, strict=True)] == [of_fits, of_all]


def test_fits_are_covered_by_what_they_can_call_and_other_functions_by_all():
    from fitting.least_squares import search
    from fitting.selftest import rehearse

    assert search.solve.covered == search.rows_and_slopes.covered == keeping.OF_FITS
    found = [one.covered for one in vars(rehearse).values() if isinstance(one, Kept) and "selftest" in one.called]
    assert found == [keeping.PACKAGES]


def test_a_class_of_a_room_above_is_not_kept_in_a_program_of_a_fit():
    assert keeping._plain(Diagnosis, keeping.PACKAGES) == "fitting.diagnosis.record.Diagnosis"
    with pytest.raises(keeping.Unkept):
        keeping._plain(Diagnosis, keeping.OF_FITS)


@pytest.mark.parametrize(
    "harm", [lambda b: b[: len(b) // 2], lambda b: b"", lambda b: b[:-1] + bytes([b[-1] ^ 1]), lambda b: b"x" * 99]
)
def test_a_torn_program_is_traced_again(folder, harm):
    body = Counted()
    body.process()(np.arange(5.0))
    (file,) = folder.glob("*.program")
    file.write_bytes(harm(file.read_bytes()))
    assert float(body.process()(np.arange(5.0))["sum"]) == 20.0
    assert body.times == 2
    body.process()(np.arange(5.0))
    assert body.times == 2  # it was written anew


def test_without_a_store_nothing_is_written(tmp_path, monkeypatch):
    monkeypatch.setattr(keeping, "_write", None)  # other tests may have switched a store on
    before = jax.config.jax_compilation_cache_dir
    jax.config.update("jax_compilation_cache_dir", None)
    monkeypatch.chdir(tmp_path)
    assert float(Counted().process()(np.arange(5.0))["sum"]) == 20.0
    jax.config.update("jax_compilation_cache_dir", before)
    assert not list(tmp_path.iterdir())


def test_where_nothing_can_be_written_it_goes_on(folder, monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(store, "write_replacing", full)
    assert float(Counted().process()(np.arange(5.0))["sum"]) == 20.0


def test_a_class_that_no_digest_covers_is_not_kept(folder):
    """A user's own effect may read otherwise tomorrow."""
    double = kept(like=0)(lambda line: 2 * line.slope)
    assert float(double(Line(jnp.asarray(3.0)))) == 6.0
    made = type("Tip", (Tip,), {"__module__": Tip.__module__})  # poses as one of the library
    assert float(kept(like=0)(lambda effect: 2 * effect.k)(made(k=3.0))) == 6.0
    assert not list(folder.glob("*.program"))


def test_a_function_among_the_arguments_is_not_kept(folder):
    apply = kept(like=0)(lambda do, x: do(x))
    assert float(apply(jnp.cos, jnp.asarray(0.0))) == 1.0
    assert not list(folder.glob("*.program"))


def test_two_workers_trace_once(folder):
    times = []

    def slow(x):
        times.append(1)
        time.sleep(0.2)
        return x + 1

    shared, found = Kept(slow, like=0), []
    workers = [threading.Thread(target=lambda: found.append(float(shared(np.array(1.0))))) for _ in range(2)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    assert found == [2.0, 2.0]
    assert len(times) == 1


def test_inside_another_trace_it_is_a_plain_function(folder):
    body = Counted()
    call = body.process()
    gradient = jax.grad(lambda values: call(values)["sum"])(jnp.arange(3.0))
    np.testing.assert_array_equal(gradient, [2.0, 2.0, 2.0])
    assert not list(folder.glob("*.program"))


def test_a_fit_by_a_kept_program_is_the_fit_without(folder, monkeypatch):
    """The whole of it: custom derivatives, linear algebra, loops and branches survive being written and read."""
    experiment = thinned(read_experiment("data/muscle_a"), 400)
    world = universe([experiment], [IdealCylinder(), CoulombFriction()], [Tip()])
    both = world.with_added(["tip"])
    from fitting.least_squares import search

    for one in (search.solve, search.rows_and_slopes):
        one.programs.clear()
    written = world.fit(both, world.start, ("tip",))
    assert list(folder.glob("*.program"))
    search.solve.programs.clear()
    with monkeypatch.context() as without:
        without.setattr(search.solve, "function", None)  # only what was written can answer
        read = world.fit(both, world.start, ("tip",))
    jax.config.update("jax_compilation_cache_dir", None)
    plain = world.fit(both, world.start, ("tip",))
    np.testing.assert_array_equal(read.rows, written.rows)
    np.testing.assert_allclose(read.vector, plain.vector, rtol=1e-6)
    assert read.cost == pytest.approx(plain.cost, rel=1e-9)


SHAPES = (  # pressures, repeats of a loop, points of a branch
    (3, 3, 120), (5, 2, 90), (2, 4, 150), (8, 2, 60), (4, 3, 77), (6, 1, 200), (10, 2, 45), (3, 5, 101), (7, 2, 95),
    (1, 3, 300),
)  # fmt: skip


def test_data_sets_of_any_shape_share_a_few_programs(tmp_path, monkeypatch):
    """Ten recordings with other numbers and lengths of runs, half of them of a muscle whose wall nobody measured.

    They end in the few shapes that there are for what a diagnosis reads.
    """
    from fitting.least_squares import search

    monkeypatch.setattr(held, "ROOM", 99 * held.UNWRITTEN)  # or none could be too many
    search.solve.programs.clear()
    programs = []
    for number, (pressures, repeats, points) in enumerate(SHAPES):
        rows = small_muscle.loops(pressures=np.linspace(1e5, 5e5, pressures), repeats=repeats, points=points)
        place = small_muscle.write(tmp_path / str(number), rows)
        if number % 2:
            text = (place / "muscle.toml").read_text().replace('wall_thickness = "0.6 mm"', "")
            (place / "muscle.toml").write_text(text.replace(" +/- 0.3 deg", " deg"))
        world = universe([read_experiment(place)], [IdealCylinder(), CoulombFriction()], [Tip(), BladderNeoHookean()])
        world.fit(world.with_added(()), world.start)
        programs.append(len(search.solve.programs))
    assert programs[-1] <= len(sizes.OF_A_DIAGNOSIS)
