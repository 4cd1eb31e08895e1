"""How far a piece of work is, for whoever waits."""

from collections.abc import Callable

Progress = Callable[[str, float], None]  # what is being done, and the share that is done, from 0 to 1
