"""Whether a model may take the place of a smaller one: what a step of a discovery must do, and what it may not."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fitting.diagnosis.candidate_fit import CandidateFit
from fitting.diagnosis.estimates import estimates
from fitting.diagnosis.findings import Fault, Objection
from fitting.diagnosis.universe import Universe
from fitting.full_names import owner_of
from fitting.least_squares import held_out
from fitting.least_squares.starts import STARTS


@dataclass(frozen=True)
class StepRules:
    """What a step must do to be kept."""

    errors: float = 1.0  # standard errors by which the held-out mean square must fall: the one-standard-error rule
    # (Hastie, Tibshirani & Friedman, The Elements of Statistical Learning, 7.10)
    share: float = 0.1  # of the held-out error that a step must remove: less is not worth a parameter to a mechanician
    plain: float = 0.5  # of the squared held-out error that a leading effect removes: it leaves less than it removes
    denied: float = 3.0  # standard errors from a stated size: one honest measurement in 370 lies farther away
    absurd: float = 5.0  # standard errors from a stated size, of which nobody thinks that it was read so; chosen
    absent: float = 3.0  # standard errors from 0, from which a value is not 0 by chance, as above
    known: float = 1.0  # standard errors that a value must reach: a smaller one may as well be zero
    spare: int = 5  # readings more than fitted numbers; as for any verdict
    rounding: float = 1e-6  # relative, of an error in sample that counts as the same
    steps: int = 6  # most of them whose effects stand; measured muscles ask for three or four
    longest: int = 12  # most of them in all, with those whose effects were dropped again; chosen
    enough: float = 0.01  # of full scale: what most users of a muscle can live with; chosen
    pairs: int = 8  # of effects that are tried together where none is kept alone


RULES = StepRules()


@dataclass(frozen=True)
class Fitted:
    """One fitted model among its candidates, with its rows on held-out runs (rows,) and their groups (rows,)."""

    world: Universe
    fit: CandidateFit
    left_out: np.ndarray
    groups: np.ndarray
    beyond: Callable[[], np.ndarray]  # gives the same beyond what instruments can make of them

    @property
    def rmse(self) -> float:
        """Error in sample, N."""
        return self.world.rmse(self.fit.rows)

    @property
    def held_out_rmse(self) -> float:
        """Error on held-out runs, N."""
        return self.world.rmse(self.left_out)

    @cached_property
    def in_errors(self) -> dict[str, float]:
        """The size of every effect's parameters that the data see, in standard errors, by full name.

        What stands at its bound has none.
        """
        found, layout = estimates(self.world, self.fit, sorted(self.fit.effects)), self.world.layout
        size_of = lambda name, known: layout.entry(name).size_of(known.value)  # noqa: E731
        return {name: size_of(name, each) / each.error for name, each in found.items() if np.isfinite(each.error)}


def objections(
    before: Fitted, after: Fitted, rules: StepRules = RULES, adequate: bool = False, alike: Fitted | None = None
) -> tuple[Objection, ...]:
    """Every reason against a step from one model to a larger one; none: the step is kept.

    `alike` is the smaller model fitted with the stated sizes confined as in the larger one, if they are not in
    `before`: only then are costs comparable.
    `adequate`: the larger model passes the test that anything is missing, and the smaller does not. Then the effect is
    identified however little it removes: the tenth is not asked for, and one known parameter of an effect is enough.
    """
    poor = no_gain(before, after, rules, adequate)
    others = unsound(before, after, rules, adequate, alike)
    return (*others, Objection(poor)) if poor else others


def unsound(
    before: Fitted, after: Fitted, rules: StepRules = RULES, adequate: bool = False, alike: Fitted | None = None
) -> tuple[Objection, ...]:
    """Every reason against a model beside another, but that it does not pay on held-out runs; as `objections`."""
    return (
        *_rising(before, after, rules, before if alike is None else alike),
        *_few(after, rules),
        *_bounds(before, after, rules),
        *denials(after.world, after.fit, rules),
        *_unknown(before, after, rules, adequate),
    )


def no_gain(before: Fitted, after: Fitted, rules: StepRules, adequate: bool) -> Fault | None:
    """Why a step does not pay on held-out runs; None where it does."""
    if not _falls(before.left_out, after.left_out, before, rules):
        return Fault.NO_GAIN
    if not adequate and after.held_out_rmse > (1 - rules.share) * before.held_out_rmse:
        return Fault.SMALL_GAIN
    return None


def is_no_worse_beyond(before: Fitted, after: Fitted, why: Sequence[Objection], rules: StepRules) -> bool:
    """Whether nothing speaks against a step but that runs left out do not show its gain, nor predict it worse.

    The latter beyond errors that instruments may make, behind which a gain hides: whether they or all readings together
    show it there, the verdict has seen.
    """
    only_gain = {objection.reason for objection in why} == {Fault.NO_GAIN}
    return only_gain and not _falls(after.beyond(), before.beyond(), before, rules)


def _falls(worse: np.ndarray, better: np.ndarray, model: Fitted, rules: StepRules) -> bool:
    fall, error = held_out.difference(worse, better, model.groups)
    return fall > rules.errors * error


def _bounds(before: Fitted, after: Fitted, rules: StepRules) -> tuple[Objection, ...]:
    """Parameters at the end of their range that were not there in the smaller model; not sizes that are confined.

    Nor what the larger model finds to be 0, if in the smaller one it may be 0 by chance, as a friction that the points
    of a map hardly show; or if the smaller one could not tell it: where strands stretch, a muscle that is held at one
    length moves inside, and data that show no friction then say so.
    """
    sizes, known = after.world.from_stated(after.fit) if after.fit.confined else (), before.in_errors
    ends = [name for name in after.fit.at_bound if name not in before.fit.at_bound and name not in sizes]
    may_be_absent = {n for n in ends if known.get(n, rules.absent) < rules.absent or _is_untold(before, n)}
    return tuple(Objection(Fault.BOUND, n) for n in ends if not (n in may_be_absent and _is_absent(after, n)))


def _is_untold(model: Fitted, name: str) -> bool:
    """Whether a parameter is free in a model whose readings it does not change."""
    if name not in model.fit.free:
        return False
    moves = np.linalg.norm(model.fit.slopes, axis=0)
    return bool(moves[model.fit.free.index(name)] <= STARTS.blind * moves.max())


def _is_absent(model: Fitted, name: str) -> bool:
    """Whether a parameter is 0, and may be no less."""
    layout = model.world.layout
    return bool(model.fit.vector[layout.at([name])[0]] == layout.entry(name).lower == 0.0)


def denials(world: Universe, fit: CandidateFit, rules: StepRules) -> tuple[Objection, ...]:
    """Stated sizes from which a model is too far, however far a smaller one was from them."""
    return tuple(
        Objection(Fault.DENIES, name, z) for name, z in world.from_stated(fit).items() if abs(z) > rules.denied
    )


def denied_sizes(why: Sequence[Objection]) -> tuple[str, ...]:
    """The stated sizes that objections are about."""
    return tuple(dict.fromkeys(w.about for w in why if owner_of(w.about) == "muscle"))


def _unknown(before: Fitted, after: Fitted, rules: StepRules, adequate: bool) -> tuple[Objection, ...]:
    """Values smaller than their errors that the smaller model has not, or knows; see `objections` on `adequate`."""
    sizes, old = after.in_errors, before.in_errors
    vague_before = {name for name in before.fit.free if old.get(name, 0.0) < rules.known}  # or not seen at all
    certain = {owner_of(name) for name, z in sizes.items() if z >= rules.known} if adequate else set()
    vague = {n: z for n, z in sizes.items() if z < rules.known and n not in vague_before}
    return tuple(Objection(Fault.UNKNOWN, n, z) for n, z in vague.items() if owner_of(n) not in certain)


def _rising(before: Fitted, after: Fitted, rules: StepRules, alike: Fitted) -> tuple[Objection, ...]:
    limit = 1 + rules.rounding
    rises = after.rmse > limit * before.rmse or after.fit.cost > limit * alike.fit.cost
    return (Objection(Fault.RISES, size=after.rmse / before.rmse - 1),) if rises else ()


def _few(after: Fitted, rules: StepRules) -> tuple[Objection, ...]:
    spare = len(after.world.samples) - len(after.fit.free)
    return (Objection(Fault.FEW, size=spare),) if spare < rules.spare else ()
