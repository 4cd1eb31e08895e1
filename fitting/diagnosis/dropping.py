"""Whether an effect that was added early is still needed beside those that came after it.

A zero of the sensor of length may stand in for an end stop until the end stop is there. What nothing in the data asks
for any more is dropped: backward elimination, after the forward steps (Miller 2002, Subset Selection in Regression, 3).
A model that the test rejects keeps what still pays as much as a step must; an adequate one what the test asks for.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence

from fitting.diagnosis.candidate_fit import CandidateFit
from fitting.diagnosis.course import ModelOnTheWay, Step, values_of
from fitting.diagnosis.diagnose import concluded, one_thread
from fitting.diagnosis.judging import fitted
from fitting.diagnosis.search import Search
from fitting.diagnosis.step_rules import Fitted, StepRules, denials, denied_sizes, no_gain
from fitting.least_squares import held_out
from mckibben_jax.effect import name_of


def without_idle(
    here: ModelOnTheWay, added: Sequence[str], begin: Callable[..., Search], rules: StepRules
) -> ModelOnTheWay | None:
    """The model without those of its `added` effects that do not pay any more; None where each of them pays.

    Each must still lower the error on held-out runs by as much as a step must that adds it, and so must those together
    that go: two of which neither pays alone may pay as a pair. The one that is missed least goes first, and the others
    are asked again. `begin` as in `smaller_models`. Stated sizes that were confined are free again if the smaller model
    denies none: what made a fit deny them may be gone.
    """
    search, gone = here.search, list[str]()
    left = whole = fitted(search.world, search.base, search)
    while True:
        smaller = _least_missed(search, left, [name for name in added if name in left.fit.effects], rules)
        if smaller is None or not no_gain(smaller, whole, rules, False):
            break
        gone += left.fit.effects - smaller.fit.effects
        left = smaller
    if not gone:
        return None
    present = [effect for effect in here.present if name_of(effect) not in gone]
    values = values_of(search.world, left.fit.vector)
    free = begin(present, values, False)
    if not free.base.confined and denied_sizes(denials(free.world, free.base, rules)):
        free = begin(present, values, left.fit.confined)
    freed = left.fit.confined and not free.base.confined
    return ModelOnTheWay((), present, free, dropped=tuple(gone), freed=freed)


def _least_missed(search: Search, whole: Fitted, names: Iterable[str], rules: StepRules) -> Fitted | None:
    """Of a model without one of these effects, that which predicts held-out runs best where the effect does not pay."""
    sets = [whole.fit.effects - {name} for name in names]
    fits = [search.world.settled(effects, whole.fit.vector) for effects in sets if not search.world.lacking(effects)]
    idle = [smaller for fit in fits if no_gain(smaller := fitted(search.world, fit, search), whole, rules, False)]
    return min(idle, key=lambda smaller: smaller.held_out_rmse, default=None)


def smaller_models(
    here: ModelOnTheWay, adequate: bool, added: Sequence[str], begin: Callable[..., Search]
) -> Iterator[Step]:
    """One step for each effect that can go from a model, if it is `adequate`, of those that were `added` on the way.

    `begin(effects, values, confine)` prepares the search of another model.
    What instruments could stand in for only by erring far more than their accuracy is not dropped.
    """
    while adequate:
        with one_thread():
            smaller = not_needed(here.search, added)
        if smaller is None:
            return
        name = next(iter(here.search.base.effects - smaller.effects))
        present = [effect for effect in here.present if name_of(effect) != name]
        search = begin(present, values_of(here.search.world, smaller.vector), smaller.confined)
        with one_thread():
            result = search.run()
        found = concluded(result)
        if not result.base_is_adequate or found.is_strained:  # its own search may have ended elsewhere
            return
        here = ModelOnTheWay((), present, search, dropped=(name,))
        yield here.step(found)


def not_needed(search: Search, names: Sequence[str]) -> CandidateFit | None:
    """The model of a search without the one of these effects that it misses least; None where it needs each.

    It is not needed if the model without it passes the test that anything is missing, also where nothing but what it
    would change is looked for, and predicts held-out runs no worse than by a standard error, beyond what instruments
    can make of them.
    """
    fits = [_without(search, name) for name in names if name in search.base.effects]
    idle = [fit for fit in fits if fit is not None and _does_as_well(search, fit)]
    return min(idle, key=search.examiner.left, default=None)


def _without(search: Search, name: str) -> CandidateFit | None:
    """The model of a search without one effect, fitted as sets of effects are; None where another effect needs it."""
    effects = search.base.effects - {name}
    return None if search.world.lacking(effects) else search.seen.settled(effects, search.base.vector)


def _does_as_well(search: Search, smaller: CandidateFit) -> bool:
    """Whether nothing in the data asks for what a smaller model lacks."""
    examiner, lacks = search.examiner, search.base.effects - smaller.effects
    if examiner.adequacy(frozenset(), smaller, search.fits).why is not None:
        return False
    if examiner.against(smaller, [(lacks, search.alone)]) < examiner.flip_groups.level:
        return False
    left, whole = examiner.beyond_instruments(smaller), examiner.beyond_instruments(search.alone)
    fall, error = held_out.difference(left, whole, examiner.groups)
    return fall <= error
