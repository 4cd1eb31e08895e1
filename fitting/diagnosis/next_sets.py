"""Sets of effects that are worth a fit for what their effects are, whatever has been fitted of them."""

from collections.abc import Sequence

from fitting.diagnosis.universe import Universe


def pairs_with_needs(world: Universe) -> list[frozenset[str]]:
    """Pairs of an effect that needs another and the simplest that give it.

    Neither may help by itself: rubber makes a muscle push that hangs slack, which without rubber nothing shows.
    """
    pairs = list[frozenset[str]]()
    for name in world.candidates:
        lacking = set(world.lacking(world.with_added([name])))
        giving = [other for other in world.candidates if lacking & set(world.effects[other].gives)]
        fewest = min((len(world.layout.of_effect(other)) for other in giving), default=0)
        pairs += [frozenset({name, g}) for g in giving if len(world.layout.of_effect(g)) == fewest]
    return pairs


def simpler(world: Universe, sets: Sequence[frozenset[str]]) -> list[frozenset[str]]:
    """Sets with one member in place of a relative that has more numbers."""
    each = [(added, name) for added in sets for name in sorted(added)]
    made = [added - {name} | {other} for added, name in each for other in simpler_relatives(world, name)]
    return list(dict.fromkeys(made))


def simpler_relatives(world: Universe, name: str) -> list[str]:
    """Candidates of an effect's family that have fewer numbers."""
    family, count = world.effects[name].family, len(world.layout.of_effect(name))
    relatives = [other for other in world.candidates if family and world.effects[other].family == family]
    return [other for other in relatives if len(world.layout.of_effect(other)) < count]
