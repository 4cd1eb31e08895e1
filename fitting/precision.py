"""Fits need 64 bits; a library must not switch them on behind its user's back, so it asks."""

import jax


class PrecisionError(RuntimeError):
    """Raised where 32-bit numbers would give wrong error bars."""


def require_x64() -> None:
    """Refuse to work in 32 bits, naming the line to paste."""
    if not jax.config.read("jax_enable_x64"):
        raise PrecisionError(
            "fitting needs 64-bit numbers: call fitting.use_64_bit() before any other use of jax, "
            'or jax.config.update("jax_enable_x64", True)'
        )
