"""What all that computes needs: 64 bits, and compiled code kept from one call to the next."""

import sys
import warnings

from fitting.compiled.store import keep_compiled


def use_64_bit() -> None:
    """Let jax compute with the 64-bit numbers that fits need, and keep compiled programs on disk for the next time.

    Call it once, before any other use of jax: importing the program changes no setting of jax.
    """
    import jax

    jax.config.update("jax_enable_x64", True)
    keep_compiled()


def prepare() -> None:
    """The same for a command, which says in its report what matters and shows no warnings of libraries."""
    if not sys.warnoptions:
        warnings.simplefilter("ignore")
    use_64_bit()
