"""Files are envelopes: what was measured the same way is one recording, in however many files it came."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import chain

from fitting.recordings.records import Experiment, Recording


def without_envelopes(experiment: Experiment) -> Experiment:
    """The data set with one recording for each kind of test, position reading, stated noise and accuracy.

    Runs keep the order of their files, and so the order in which they were made.
    """
    alike: dict[tuple, list[Recording]] = {}
    for each in experiment.recordings:
        key = (each.test, each.position, each.noise, each.noise_source, each.accuracy)
        alike.setdefault(key, []).append(each)
    return replace(experiment, recordings=tuple(map(_one, alike.values())))


def _one(parts: Sequence[Recording]) -> Recording:
    first = parts[0]
    if len(parts) == 1:
        return first
    runs = tuple(chain.from_iterable(each.runs for each in parts))
    notes = tuple(dict.fromkeys(chain.from_iterable(each.notes for each in parts)))
    return replace(first, file=", ".join(each.file for each in parts), part="", runs=runs, notes=notes)
