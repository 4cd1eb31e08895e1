"""What the compiler of large programs is asked for, where it knows it."""

import jax
import jax.numpy as jnp
import pytest

from fitting.compiled import compiler, traced
from fitting.compiled.traced import Kept


def test_the_installed_compiler_knows_the_option():
    assert compiler.compiler_options() == {compiler.NEWER: False}


def test_a_compiler_that_does_not_know_it_is_not_asked(monkeypatch):
    monkeypatch.setattr(compiler, "NEWER", "xla_an_option_that_there_never_was")
    assert compiler.compiler_options() == {}


def test_another_device_is_not_asked(monkeypatch):
    monkeypatch.setattr(jax, "default_backend", lambda: "gpu")
    assert compiler.compiler_options() == {}


def test_programs_that_are_kept_are_compiled_with_it(monkeypatch):
    def doubled(values):
        return 2 * values

    monkeypatch.setattr(traced, "compiler_options", lambda: {"xla_an_option_that_there_never_was": False})
    with pytest.raises(RuntimeError, match="there_never_was"):
        Kept(doubled, like=0)(jnp.arange(3.0))
