"""What could stand in for an effect of the model: the tie that is left when one of several likes was added."""

from collections.abc import Mapping, Sequence

import numpy as np

from fitting.diagnosis.candidate_fit import CandidateFit
from fitting.diagnosis.equivalent import plausible
from fitting.diagnosis.nuisance import Nuisance
from fitting.diagnosis.settings import VERDICT, VerdictSettings
from fitting.diagnosis.signatures import signatures
from fitting.diagnosis.universe import Universe
from fitting.full_names import owner_of
from fitting.least_squares import held_out


def substitutes(
    world: Universe,
    base: CandidateFit,
    fits: Mapping[frozenset[str], CandidateFit],
    unseen: Sequence[str],
    noise: float,
    settings: VerdictSettings = VERDICT,
) -> tuple[tuple[str, str], ...]:
    """Pairs of an effect of the model and one that would predict the same of these data in its place.

    `unseen` are candidates of which these data show nothing: those that the model's own parameters absorb. Only with
    as few fitted numbers is one a substitute; with more it could be anything. `noise` in standard deviations.
    """
    wanted = [(name, shape) for name in unseen for shape in world.shapes(name)]
    columns = signatures(world, base, wanted)
    copied = world.mimicking(base)
    found = []
    for mine in sorted(base.effects):
        others = np.array([owner_of(name) != mine for name in base.free], bool)
        if others.all():
            continue
        left = _share_left(base, columns, others)
        taken = (name for (name, _), share in zip(wanted, left, strict=True) if share > settings.taken)
        for name in dict.fromkeys(taken):
            effects = base.effects - {mine} | {name}
            if world.lacking(effects) or len(world.free(effects)) > len(base.free):
                continue
            alone = fits.get(frozenset([name]), base)
            followed = copied.fit(effects, alone.vector, [name])
            near = held_out.rms(followed.rows) < settings.followed * noise
            if near and plausible(world, frozenset([name]), followed):
                found.append((mine, name))
    return tuple(found)


def _share_left(base: CandidateFit, columns: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Of each column's square, what some of the model's parameters leave; nothing where it is no number."""
    known = np.nan_to_num(columns)
    alone = Nuisance(base.slopes[:, others], base.prior_rows, base.prior_slopes[:, others])
    left = np.sum(alone.project_out(known) ** 2, axis=0)
    return np.where(np.isfinite(columns).all(axis=0), left / np.maximum(np.sum(known**2, axis=0), 1e-300), 0.0)
