"""How the benchmarks tell what they measured."""

import contextlib
from collections.abc import Iterable

import pytest


def tell(config: pytest.Config, lines: Iterable[str]) -> None:
    """Lines on the terminal, past pytest's capture."""
    reporter = config.pluginmanager.get_plugin("terminalreporter")
    capture = config.pluginmanager.get_plugin("capturemanager")
    with capture.global_and_fixture_disabled() if capture else contextlib.nullcontext():
        reporter.ensure_newline()
        for line in lines:
            reporter.write_line(line)
