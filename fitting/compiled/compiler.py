"""How XLA compiles the large programs of fits.

On processors it has two ways to write out fused loops. The newer one makes a module of each; for the largest program of
a diagnosis the older one was measured to take 40 instead of 54 CPU seconds, 0.5 instead of 1.3 GB and 1,380 instead of
3,320 memory mappings. With the first level of optimisation instead of the third it took an eighth to a sixth less. What
comes of either runs as fast.
"""

from functools import cache
from typing import Any

import jax

# Names are those of XLA's flags.
ASKED: dict[str, Any] = {"xla_cpu_use_fusion_emitters": False, "xla_backend_optimization_level": 1}


def compiler_options() -> dict[str, Any]:
    """What XLA is asked for, as far as it knows these options; nothing on other devices."""
    if jax.default_backend() != "cpu":
        return {}
    return {option: value for option, value in ASKED.items() if is_known(option, value)}


@cache
def is_known(option: str, value: Any) -> bool:
    """Whether this XLA has an option."""
    try:
        jax.jit(lambda x: x).lower(0.0).compile(compiler_options={option: value})
    except RuntimeError:  # "No such compile option"
        return False
    return True
