"""What every command that computes needs: 64 bits, and compiled code kept from one call to the next."""

import sys
import warnings

from fitting.compiled.store import keep_compiled


def prepare() -> None:
    """Switch on 64 bits and the store of compiled code."""
    import jax

    if not sys.warnoptions:
        warnings.simplefilter("ignore")  # what matters is said in the report
    jax.config.update("jax_enable_x64", True)
    keep_compiled()
