"""How far a piece of work is, for whoever waits."""

from collections.abc import Callable

Progress = Callable[[str, float], None]  # what is being done, and the share that is done, from 0 to 1


def unwatched(_words: str, _share: float) -> None:
    """For work that nobody waits for."""


def part_of(progress: Progress, begin: float, end: float) -> Progress:
    """The progress of a part of the work, which takes the whole from one share to another."""
    return lambda words, share: progress(words, begin + (end - begin) * share)
