"""The store of compiled code: bounded, and an entry that a full disk tore is never met again."""

import os
import resource
import subprocess
import sys

import pytest

from fitting.compiled import store
from fitting.compiled.store import prune

COMPUTES = """
import warnings
warnings.simplefilter("error")
from fitting.compiled.store import keep_compiled
keep_compiled()
import jax
asked = []
jax.monitoring.register_event_listener(lambda name, **_: asked.append(name.rsplit("/")[-1]))
print(float(jax.jit(lambda x: 2 * x)(21.0)), asked.count("cache_hits"), asked.count("cache_misses"))
"""


@pytest.fixture
def place(tmp_path, monkeypatch):
    """A store that only this test uses."""
    monkeypatch.setenv("MCKIBBEN_CACHE", str(tmp_path))
    return tmp_path


def process(room=resource.RLIM_INFINITY):
    """A process of its own that compiles one program, every file of it at most so large: value, found, compiled."""
    done = subprocess.run(
        [sys.executable, "-c", COMPUTES],
        capture_output=True,
        text=True,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (room, room)),
    )
    assert done.returncode == 0, done.stderr
    value, found, compiled = done.stdout.split()
    return float(value), int(found) > 0, int(compiled) > 0


def test_what_one_process_compiled_the_next_one_reads(place):
    assert process() == (42.0, False, True)
    assert list(place.glob("*.compiled"))
    assert process() == (42.0, True, False)


def test_a_full_disk_leaves_no_torn_entry(place):
    """jax would write half of one, and warn whenever it is read."""
    assert process(room=200) == (42.0, False, True)
    assert not list(place.iterdir())
    assert process() == (42.0, False, True)
    assert process() == (42.0, True, False)


def test_a_torn_entry_is_compiled_again_without_a_word(place):
    process()
    for entry in place.glob("*.compiled"):
        entry.write_bytes(entry.read_bytes()[:200])
    assert process() == (42.0, False, True)
    assert process() == (42.0, True, False)  # it was written anew


@pytest.mark.parametrize(
    "harm", [lambda b: b[:-1], lambda b: b"", lambda b: b[:-1] + bytes([b[-1] ^ 1]), lambda b: b"x" * 99]
)
def test_only_what_was_written_is_read(tmp_path, harm):
    file = tmp_path / "entry"
    assert store.read(file) is None
    store.write(file, b"content")
    assert store.read(file) == b"content"
    file.write_bytes(harm(file.read_bytes()))
    assert store.read(file) is None


def test_what_is_read_is_deleted_last(tmp_path):
    for name in ("used", "unused", "neither"):
        store.write(tmp_path / name, bytes(100))
        os.utime(tmp_path / name, (1e9, 1e9))
    store.read(tmp_path / "used")
    prune(tmp_path, most=300)
    assert [entry.name for entry in tmp_path.iterdir()] == ["used"]


def test_a_store_that_grows_too_large_loses_its_oldest_half(tmp_path):
    """Nothing below the limit; above it the oldest entries until half of what is allowed is left."""
    for age in range(10):
        (tmp_path / f"program{age}").write_bytes(bytes(100))
        os.utime(tmp_path / f"program{age}", (1e9 - age, 1e9 - age))
    prune(tmp_path, most=1000)
    assert len(list(tmp_path.iterdir())) == 10
    prune(tmp_path, most=999)
    assert {entry.name for entry in tmp_path.iterdir()} == {f"program{age}" for age in range(4)}
