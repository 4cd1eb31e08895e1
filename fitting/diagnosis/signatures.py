"""How rows would change if missing effects were switched on."""

from collections.abc import Mapping, Sequence

import numpy as np

from fitting.diagnosis.candidate_fit import CandidateFit
from fitting.diagnosis.universe import Universe

Shape = Mapping[str, float]  # values (SI) of an effect's parameters, by full name


def signatures(world: Universe, fit: CandidateFit, wanted: Sequence[tuple[str, Shape]]) -> np.ndarray:
    """How the rows would change if missing effects were switched on: d(rows)/d(switch) at 0, (rows, effects).

    `wanted` names effects, each with the values of its shape. A rival in the model is switched off as much as the new
    one is switched on. The slopes of many switches are found together: what one effect's shape is does not matter to
    another's switch.
    """
    columns = np.full((len(world.samples), len(wanted)), np.nan)
    for some in _rounds(wanted, world.settings.padded[0]):
        columns[:, some] = _slopes(world, fit, dict(wanted[i] for i in some))
    replaced = {name: world.with_added([name], fit.effects) for name, _ in wanted}
    outgoing = {old for name in replaced for old in fit.effects - replaced[name]}
    off = dict(zip(sorted(outgoing), _slopes(world, fit, {key: {} for key in sorted(outgoing)}).T, strict=True))
    for i, (added, _) in enumerate(wanted):
        columns[:, i] -= sum((off[old] for old in fit.effects - replaced[added]), np.zeros(len(columns)))
    return columns


def _rounds(wanted: Sequence[tuple[str, Shape]], most: int) -> list[list[int]]:
    """Positions of what is looked at together: no effect twice, and no more than there is room for."""
    rounds: list[list[int]] = []
    for i, (added, _) in enumerate(wanted):
        free = (r for r in rounds if len(r) < most and all(wanted[k][0] != added for k in r))
        found = next(free, None)
        if found is None:
            rounds.append([i])
        else:
            found.append(i)
    return rounds


def _slopes(world: Universe, fit: CandidateFit, turned: Mapping[str, Shape]) -> np.ndarray:
    """d(rows)/d(switch) of some effects, each at its own shape, beside the effects of a fit: (rows, effects)."""
    if not turned:
        return np.zeros((len(world.samples), 0))
    vector = fit.vector.copy()
    for shape in turned.values():
        vector[world.layout.at(shape)] = list(shape.values())
    first = len(vector) + 1
    names = list(world.effects)
    at = [first + names.index(name) for name in turned]
    subset = world.subset(fit.effects, at, vector, beside=list(turned))
    found = world.looked_at(subset)
    return np.asarray(found.slopes)[world.real][:, : len(turned)]
