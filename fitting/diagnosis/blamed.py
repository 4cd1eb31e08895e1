"""Errors of instruments that a set of effects stands for: how large each is, beside its accuracy and full scale."""

from collections.abc import Sequence

import numpy as np

from fitting.diagnosis.candidate_fit import CandidateFit
from fitting.diagnosis.findings import Blamed
from fitting.diagnosis.universe import Universe
from fitting.instruments.sources import ErrorKind, Source
from fitting.recordings.accuracy import Channel

PER_RUN = {ErrorKind.ZERO: ErrorKind.ZERO_PER_RUN, ErrorKind.GAIN: ErrorKind.GAIN_PER_RUN}


def blamed(
    world: Universe, added: frozenset[str], fit: CandidateFit, sources: Sequence[Source] = ()
) -> tuple[Blamed, ...]:
    """What a fitted set asks of each instrument that it blames; `sources` have the accuracies."""
    found = dict(zip(world.layout.names, fit.vector, strict=True))
    full_scale = float(np.max(np.abs(world.samples.measured[world.in_newtons])))
    errors = []
    for name in sorted(added):
        misreads = world.effects[name].misreads
        if misreads is None:
            continue
        channel, kind = Channel(misreads[0]), ErrorKind(misreads[1])
        size = max(abs(float(found[each])) for each in world.layout.of_effect(name))
        size *= float(np.max(world.lengths)) if channel is Channel.POSITION else 1.0  # of a contraction
        share = size if kind is ErrorKind.GAIN else size / full_scale if channel is Channel.FORCE else None
        errors.append(Blamed(name, tuple(sorted(added)), _most_allowed(sources, channel, kind), size, share))
    return tuple(errors)


def _most_allowed(sources: Sequence[Source], channel: Channel, kind: ErrorKind) -> Source:
    """An error that all runs share, with its accuracy or that of each run alone, the larger; 0: taken as exact."""
    kinds = (kind, PER_RUN.get(kind))
    known = (source for source in sources if source.channel is channel and source.kind in kinds)
    most = max(known, key=lambda source: source.allowed, default=Source(channel, kind, 0.0, 0.0))
    return Source(channel, kind, most.allowed, most.allowed, most.presumed)


def unbelieved(world: Universe, added: frozenset[str], fit: CandidateFit, most: float) -> tuple[str, ...]:
    """Errors of instruments that are too large to be believed where other effects have to help them explain the data.

    A load cell that nobody has zeroed may read anything, and explains all by itself. Beside other effects a zero of a
    quarter of full scale is a number that bends a model to the data.
    """
    if len(added) < 2:
        return ()
    errors = blamed(world, added, fit)
    return tuple(each.effect for each in errors if each.share is not None and each.share > most)
