"""A process holds as many compiled programs as memory and kernel bear; the least recently used go first."""

import jax
import jax.numpy as jnp
import pytest

from fitting.compiled import held
from fitting.compiled.held import Programs


@pytest.fixture(autouse=True)
def room(monkeypatch):
    """Room for three of the largest, and no others that other tests made."""
    monkeypatch.setattr(Programs, "every", type(Programs.every)())
    monkeypatch.setattr(held, "ROOM", 3 * held.UNWRITTEN)
    monkeypatch.setattr(held, "FEWEST", 3)


def test_the_least_recently_used_of_all_functions_goes():
    one, other = Programs(), Programs()
    one.put("a", abs)
    other.put("b", max)
    one.put("c", min)
    assert one.get("a") is abs  # used again: now b is the oldest
    one.put("d", sum)
    assert other.get("b") is None
    assert [one.get(name) for name in "acd"] == [abs, min, sum]


def test_small_programs_stay_where_a_large_one_would_need_room():
    """The plan of a next recording needs a dozen in turn: each was read from the disk again a hundred times."""
    programs = Programs()
    for i in range(30):
        programs.put(i, abs, held.UNWRITTEN // 10)
    assert len(programs) == 30
    programs.put("large", max)
    assert len(programs) == 21
    assert programs.get(9) is None
    assert programs.get(10) is abs


def test_a_few_programs_stay_however_large_they_are():
    """The program of a diagnosis grows with the data sets that are diagnosed together."""
    programs = Programs()
    for i in range(4):
        programs.put(i, abs, 3 * held.UNWRITTEN)
    assert [programs.get(i) for i in range(4)] == [None, abs, abs, abs]


def test_programs_go_where_the_kernel_has_few_mappings_left(monkeypatch):
    programs = Programs()
    monkeypatch.setattr(held, "allowed_mappings", lambda: 10)
    monkeypatch.setattr(held, "mappings", lambda: 1 + len(programs))
    programs.put("a", abs)
    programs.put("b", min)
    programs.put("c", max)
    assert programs.get("a") is None  # a fifth of ten is passed by two
    assert programs.get("c") is max


def test_what_goes_gives_its_mappings_back(monkeypatch):
    if not held.mappings():
        pytest.skip("the system does not say how many mappings a process has")
    programs, x = Programs(), jnp.arange(7.0)
    for i in range(3):
        program = jax.jit(lambda x, i=i: sum(jnp.sin(x + i * j) @ jnp.cos(x) for j in range(40)))
        program(x)
        programs.put(i, program)
        del program
    before = held.mappings()
    monkeypatch.setattr(held, "allowed_mappings", lambda: before - 1)
    programs.put("small", abs)
    assert held.mappings() < before
    assert len(programs) == 1


def test_where_the_system_says_nothing_the_number_alone_counts(monkeypatch, tmp_path):
    monkeypatch.setattr(held, "MAPPINGS", tmp_path / "none")
    monkeypatch.setattr(held, "ALLOWED", tmp_path / "none")
    programs = Programs()
    for i in range(5):
        programs.put(i, abs)
    assert len(programs) == 3
