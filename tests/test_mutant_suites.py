"""What mutation testing draws from and judges by is there: a file that had moved was left out without a word."""

from pathlib import Path

import pytest

from tests.mutants.suites import SUITES, Suite


@pytest.mark.parametrize("suite", SUITES, ids=lambda suite: suite.name)
def test_every_module_and_test_of_a_suite_is_there(suite):
    files = [str(file) for file in suite.files()]
    assert [name for name in suite.stages if not any(file.startswith(name) for file in files)] == []
    judges = {name for stages in suite.stages.values() for stage in stages for name in stage}
    assert [name for name in judges if not Path(name).exists()] == []


def test_a_module_that_has_moved_is_named():
    with pytest.raises(FileNotFoundError, match=r"gone\.py"):
        Suite("moved", ("mckibben_jax/gone.py",), {}).files()
