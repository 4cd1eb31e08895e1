"""Strict settings for every test: 64 bit, a warning raised by our own code is an error, and compiled programs are
dropped before they take too much memory. Beside them what several files of tests look at."""

import gc
import os
import resource
from pathlib import Path

from compiler_flags import xla_flags

os.environ["XLA_FLAGS"] = xla_flags()  # XLA reads them once, as early as JAX is imported

import jax
import pytest
import scipy.linalg  # noqa: F401  (it has a BLAS of its own, and only what is loaded can be limited)
from threadpoolctl import threadpool_limits

from fitting import use_64_bit
from fitting.compiled.held import allowed_mappings, mappings

# Where one of these is passed after a file of tests, its compiled programs are dropped. The share is below that from
# which the library itself lets programs go.
SHARE_OF_MAPPINGS = 0.15
MOST_MEMORY = 2.5e9  # bytes, of each of two workers

use_64_bit()  # with the store of compiled programs: what one file of tests has compiled, the next ones load
threadpool_limits(1, "blas")  # as a diagnosis does: on small matrices a second thread costs a hundredfold
os.environ["OPENBLAS_NUM_THREADS"] = "1"  # and in the processes that tests start
# JAX makes so many objects while it traces that Python looked for unreachable ones in an eighth of the time.
gc.set_threshold(50_000, *gc.get_threshold()[1:])

# Files that take a minute and more: they begin first, so that no worker waits for another one's at the end.
LONGEST = (
    "test_notebooks.py", "test_workbench_browser.py", "test_hidden_study.py", "test_page.py", "test_each.py",
    "test_kept.py", "test_diagnose.py", "test_search.py", "test_posterior.py", "test_export_draws.py", "test_cli.py",
    "test_static_maps.py", "test_faults.py", "test_posterior_studies.py", "test_flips.py", "test_export.py",
    "test_export_c.py", "test_positions.py", "test_sweep_cluster.py", "test_shooting.py", "test_define.py",
)  # fmt: skip


def pytest_collection_modifyitems(items):
    order = {name: place for place, name in enumerate(LONGEST)}
    items.sort(key=lambda item: order.get(item.path.name, len(order)))  # stable: the others keep their places


def pytest_configure(config):
    config.addinivalue_line("filterwarnings", r"error:::(mckibben_jax|fitting)(\..*)?")


def pytest_collection_finish():
    gc.collect()
    gc.freeze()  # what was imported stays: the garbage collector need not look at it again


@pytest.fixture(scope="module", autouse=True)
def compiled_programs_are_dropped():
    """A process that would hold the programs of all tests ends in the compiler: Linux grants it 65,530 mappings.

    What a file of tests traced and compiled serves the next one, too, until it takes much memory. The garbage
    collector does not look at it before then, which would take a fifth of the time.
    """
    yield
    if mappings() > SHARE_OF_MAPPINGS * allowed_mappings() or memory() > MOST_MEMORY:
        gc.unfreeze()
        jax.clear_caches()
    gc.collect()
    gc.freeze()


def memory():
    """Bytes of memory that this process occupies; 0 where the system does not say, as `mappings` does."""
    try:
        return int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize()
    except OSError:
        return 0


@pytest.fixture(scope="session")
def study(tmp_path_factory):
    """A data set with a nasty name: its task, its comparison. Immutable, and fitted once for all files of tests."""
    from studied import compared

    return compared(tmp_path_factory.mktemp("study"))


@pytest.fixture(scope="session")
def diagnosis(study):
    """A diagnosis of it as `diagnose` would give it."""
    from studied import spring_missing

    return spring_missing(study[1])


@pytest.fixture(scope="session")
def springy(tmp_path_factory):
    """Repeated loops of a muscle with an elastic pull that the baseline lacks. A folder that nobody writes into."""
    from small_muscle import loops, write

    return write(tmp_path_factory.mktemp("springy") / "small", loops(lambda eps, *_: 400.0 * eps, points=40, repeats=2))
