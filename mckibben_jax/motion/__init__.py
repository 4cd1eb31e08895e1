"""Muscles that move a load: releases, steps of pressure, slow sweeps under a hung load, and one step at a time."""

from typing import TYPE_CHECKING, Any

from mckibben_jax.motion.stepping import begin as begin
from mckibben_jax.motion.stepping import slow_force as slow_force
from mckibben_jax.motion.stepping import step_parts as step_parts

if TYPE_CHECKING:
    from mckibben_jax.motion.motion import release as release
    from mckibben_jax.motion.motion import step_response as step_response
else:

    def __getattr__(name: str) -> Any:
        """Loaded when asked for: the equation of motion brings diffrax, which slow sweeps do without."""
        if name not in ("release", "step_response"):
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        from mckibben_jax.motion import motion

        return getattr(motion, name)
