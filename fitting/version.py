"""Which program this is, and what it stands on: for files and reports that want to be reproduced."""

import platform
import sys
from importlib.metadata import PackageNotFoundError, version

NAME = "mckibben-jax"
UNDERNEATH = ("jax", "equinox", "optimistix", "diffrax", "numpy", "scipy")


def program_version() -> str:
    """The program's version."""
    return _version(NAME)


def versions() -> dict[str, str]:
    """The program, the interpreter and the libraries that a result depends on."""
    return {
        NAME: program_version(),
        "python": platform.python_version(),
        **{name: _version(name) for name in UNDERNEATH},
        "system": f"{platform.system()} {platform.machine()}",
    }


def command_line() -> str:
    """What was typed, as far as it can be told."""
    return " ".join(["mckibben", *sys.argv[1:]])


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "unknown"
