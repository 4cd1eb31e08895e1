"""How XLA compiles what tests evaluate: two thirds of the time of tests is compiling."""

import os
import sys
from importlib.metadata import version

# As the largest programs are for users (`fitting/compiled/compiler.py`, which loads JAX and so comes too late).
OLDER_WAY = "--xla_cpu_use_fusion_emitters=false"
# Without any optimisation compiling takes less still, and sampling so much longer that it is lost.
LESS_OPTIMISED = "--xla_backend_optimization_level=1"


def xla_flags() -> str:
    """The value of XLA_FLAGS for tests. Studies and benchmarks run long: what is small is optimised in full.

    XLA ends a process where it does not know a flag, so only the pinned version gets them. Workers of pytest-xdist
    inherit those of the process that starts them.
    """
    given = os.environ.get("XLA_FLAGS", "")
    if "PYTEST_XDIST_WORKER" in os.environ or not version("jaxlib").startswith("0.10."):
        return given
    runs_long = not {"slow", "--benchmark-only"}.isdisjoint(sys.argv)
    return " ".join(flag for flag in (given, OLDER_WAY, "" if runs_long else LESS_OPTIMISED) if flag)
