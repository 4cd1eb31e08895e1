"""What the compiler of large programs is asked for, where it knows it."""

import jax
import jax.numpy as jnp
import pytest
from compiler_flags import LESS_OPTIMISED, OLDER_WAY, xla_flags

import mckibben_jax  # noqa: F401  (programs that are kept are named by its sources)
from fitting.compiled import compiler, traced
from fitting.compiled.traced import Kept


def test_the_installed_compiler_knows_all_options():
    assert compiler.compiler_options() == compiler.ASKED


def test_a_compiler_that_does_not_know_one_is_asked_for_the_others(monkeypatch):
    known = dict(compiler.ASKED)
    monkeypatch.setattr(compiler, "ASKED", {"xla_an_option_that_there_never_was": False, **known})
    assert compiler.compiler_options() == known


def test_another_device_is_not_asked(monkeypatch):
    monkeypatch.setattr(jax, "default_backend", lambda: "gpu")
    assert compiler.compiler_options() == {}


def test_programs_that_are_kept_are_compiled_with_them(monkeypatch):
    def doubled(values):
        return 2 * values

    monkeypatch.setattr(traced, "compiler_options", lambda: {"xla_an_option_that_there_never_was": False})
    with pytest.raises(RuntimeError, match="there_never_was"):
        Kept(doubled, like=0)(jnp.arange(3.0))


def test_tests_are_compiled_as_the_programs_of_users_and_studies_are_optimised_in_full(monkeypatch):
    asked = [f"--{option}={str(value).lower()}" for option, value in compiler.ASKED.items()]
    assert asked == [OLDER_WAY, LESS_OPTIMISED]
    monkeypatch.delenv("PYTEST_XDIST_WORKER", raising=False)
    monkeypatch.setenv("XLA_FLAGS", "--of-ones-own")
    monkeypatch.setattr("sys.argv", ["pytest", "-n", "2"])
    assert xla_flags().split() == ["--of-ones-own", *asked]
    monkeypatch.setattr("sys.argv", ["pytest", "-m", "slow"])
    assert xla_flags().split() == ["--of-ones-own", OLDER_WAY]
