"""A model is a muscle and a set of effects, each with a switch: read( pull(felt) - lost(felt) )."""

from collections.abc import Callable, Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import ArrayLike

from mckibben_jax.effect import Effect, Loss, Pull, blend, name_of
from mckibben_jax.effects import ORDER
from mckibben_jax.laws.shape import direction_of_path
from mckibben_jax.laws.sticking import played, share_felt
from mckibben_jax.memory import Memory, remember
from mckibben_jax.muscle import Muscle
from mckibben_jax.state import State

SLOPE_STEP = 1e-4  # of contraction, of a difference to its middle
Memories = tuple[Any, ...]  # one per effect; None where nothing is remembered


class Model(eqx.Module):
    """A muscle with its effects, kept in library order so that the order of adding changes nothing.

    `switches` holds one number in [0, 1] per effect: 0 is exact absence, 1 presence. `live`, if given, says which
    effects are evaluated at all: one compiled function then serves every subset of a large set of effects.
    """

    muscle: Muscle
    effects: tuple[Any, ...]  # of `Effect`, each with the one method of its stage
    switches: jax.Array
    live: jax.Array | None = None

    # What happens to one state -------------------------------------------------------------------------------------

    def feel(self, index: int, state: State, rates_matter: ArrayLike = True) -> State:
        """The state after one felt effect; rates are pushed through it. `rates_matter` as of `Pull`."""
        effect, pull = self.effects[index], self._pull_behind(index, rates_matter)
        if effect.states_rates:
            felt = effect.felt(self.muscle, state, pull)
        else:
            felt = _with_rates(lambda s: effect.felt(self.muscle, s, pull), state)
        return blend(self.switches[index], state.replace(memory=None), felt.replace(memory=None))

    def _pull_behind(self, index: int, rates_matter: ArrayLike = True) -> Pull:
        """The frictionless pull as a function of the state that this felt effect hands on.

        Effects behind it that remember are left out. Everything is computed, what is not live being switched off: this
        goes into a root search, where branches cost more than they save, and no rates are needed.
        """

        def pull(state: State) -> jax.Array:
            for later in self.at("felt"):
                effect = self.effects[later]
                if later > index and not isinstance(effect, Memory):
                    change = lambda s, e=effect, i=later: blend(  # noqa: E731
                        self.switches[i], s, e.felt(self.muscle, s, self._pull_behind(i))
                    )
                    state = self.when_live(later, change, state)
            return self.pull(state)[0]

        return Pull(pull, rates_matter)

    def pull(self, felt: State, memories: Memories | None = None) -> tuple[jax.Array, jax.Array]:
        """The pull at a felt state, N: all of it, and the part of the rubber alone.

        Stored effects that remember are left out where no memories are given.
        """
        total, elastic = jnp.zeros_like(felt.contraction), jnp.zeros_like(felt.contraction)
        for index in self.at("stored"):
            effect = self.effects[index]
            if memories is None and isinstance(effect, Memory):
                continue
            known = felt if memories is None else felt.replace(memory=memories[index])
            zero = jnp.zeros_like(total)
            part = self.when_live(
                index, lambda _, e=effect, i=index, s=known: self.switches[i] * e.force(self.muscle, s), zero
            )
            total = total + part
            elastic = elastic + part if "rubber" in effect.gives else elastic
        return total, elastic

    def lose(self, index: int, felt: State, loss: Loss) -> Loss:
        """The loss after one more effect."""
        changed = self.effects[index].lose(self.muscle, felt, loss)
        return blend(self.switches[index], loss, changed)

    def loss_before(self, felt: State, elastic: jax.Array) -> Loss:
        """No loss yet, along the direction in which the braid moves."""
        zero = jnp.zeros_like(elastic)
        return Loss(zero, direction_of_path(self.muscle, felt), zero, elastic)

    # What happens along a run --------------------------------------------------------------------------------------

    def felt(self, run: State, rates_matter: ArrayLike = True) -> State:
        """The felt states of a run (every field with a leading axis of samples); `rates_matter` as of `Pull`."""
        for index in self.at("felt"):
            feel = lambda r, i=index: jax.vmap(lambda s: self.feel(i, s, rates_matter))(self._recall(i, r))  # noqa: E731
            run = self.when_live(index, feel, run)
        return run

    @property
    def knows_rates(self) -> ArrayLike:
        """Whether speed or pressure rate, more than their signs, stand in the law of any effect that is evaluated."""
        known = [effect.knows_rates for effect in self.effects]
        return any(known) if self.live is None else jnp.any(self.live & jnp.asarray(known))

    def lost(self, felt: State, elastic: jax.Array) -> Loss:
        """The losses along a run of felt states."""
        loss = jax.vmap(self.loss_before)(felt, elastic)
        for index in self.at("lost"):
            loss = self.when_live(
                index, lambda x, i=index: jax.vmap(lambda s, y: self.lose(i, s, y))(self._recall(i, felt), x), loss
            )
        return loss

    def force(self, run: State) -> jax.Array:
        """The force that the instrument shows along a run, N."""
        run = self.supplied(run)
        felt = self.felt(run, self.knows_rates)
        total, elastic = jax.vmap(self.pull)(felt, self._recall_stored(felt))
        loss = self.lost(felt, elastic)
        friction = self._friction(run, felt, total, loss)
        return self.show(total - friction - loss.drag, run.time, "force")

    def _friction(self, run: State, felt: State, total: jax.Array, loss: Loss) -> jax.Array:
        """Dry friction along a run as the rig feels it, N: behind a spring the braid sticks where its path turns."""
        friction = loss.size * loss.direction
        for index in self.at("felt"):
            spring = self.effects[index].spring(self.muscle)
            if spring is not None:
                behind = lambda f, i=index, k=spring: blend(  # noqa: E731
                    self.switches[i], f, self._sticking(i, k, run, felt, total, loss)
                )
                friction = self.when_live(index, behind, friction)
        return friction

    def _sticking(
        self, index: int, spring: jax.Array, run: State, felt: State, total: jax.Array, loss: Loss
    ) -> jax.Array:
        """Dry friction along a run behind a spring (N per contraction), N.

        Where friction itself gives way elastically, it has come less far at every turn: that counts then.
        """
        share = share_felt(spring, self._steepness(index, run.replace(contraction=run.contraction + total / spring)))
        sliding = loss.size * loss.direction * share
        held = played(total + spring * run.contraction, loss.size * share, sliding, felt.time)
        way = jax.vmap(lambda state: direction_of_path(self.muscle, state))(felt)
        return jnp.where(way > 0, jnp.minimum(held, sliding), jnp.where(way < 0, jnp.maximum(held, sliding), held))

    def _steepness(self, index: int, run: State) -> jax.Array:
        """Slope of the frictionless pull behind a felt effect over the contraction of `run`, N."""
        pull = self._pull_behind(index)
        ends = (run.replace(contraction=run.contraction + way * SLOPE_STEP) for way in (1.0, -1.0))
        beyond, before = (jax.vmap(pull)(end) for end in ends)
        return (beyond - before) / (2 * SLOPE_STEP)

    def supplied(self, run: State) -> State:
        """The run with what the supply makes of its pressure channel: a delay shifts the pressure and its rate."""
        if not any(self.effects[index].channel == "pressure" for index in self.at("read")):
            return run
        shown = (self.show(signal, run.time, "pressure") for signal in (run.pressure, run.pressure_rate))
        return run.replace(**dict(zip(("pressure", "pressure_rate"), shown, strict=True)))

    def show(self, signal: jax.Array, time: jax.Array, channel: str) -> jax.Array:
        """What the instrument of a channel makes of a run's signal."""
        for index in self.at("read"):
            effect = self.effects[index]
            if effect.channel == channel:
                signal = self.when_live(
                    index, lambda s, e=effect, i=index: blend(self.switches[i], s, e.read(s, time)), signal
                )
        return signal

    def _recall(self, index: int, run: State) -> State:
        effect = self.effects[index]
        return run.replace(memory=remember(effect, self.muscle, run)) if isinstance(effect, Memory) else run

    def _recall_stored(self, felt: State) -> Memories:
        """What every stored effect remembers along a run, None where nothing is remembered."""
        remembers = lambda i: i in self.at("stored") and isinstance(self.effects[i], Memory)  # noqa: E731
        return tuple(remember(e, self.muscle, felt) if remembers(i) else None for i, e in enumerate(self.effects))

    # What happens at one instant, memories carried along ------------------------------------------------------------

    def start_memories(self, state: State) -> Memories:
        """The memories at the first instant of a run, one per effect; None where nothing is remembered."""
        memories: list[Any] = [None] * len(self.effects)
        for index in (*self.at("felt"), *self.at("stored"), *self.at("lost")):
            effect = self.effects[index]
            memories[index] = effect.start(self.muscle, state) if isinstance(effect, Memory) else None
            state = self._felt_by(index, state, memories[index])
        return tuple(memories)

    def advance_memories(self, memories: Memories, before: State, after: State) -> Memories:
        """The memories after moving from one state of the rig to the next."""
        advanced = list(memories)
        for index in (*self.at("felt"), *self.at("stored"), *self.at("lost")):
            effect, then = self.effects[index], (before, after)
            if isinstance(effect, Memory):
                advanced[index] = self.when_live(
                    index, lambda m, e=effect, s=then: e.advance(self.muscle, m, *s), memories[index]
                )
            before = self._felt_by(index, before, memories[index])
            after = self._felt_by(index, after, advanced[index])
        return tuple(advanced)

    def felt_now(self, state: State, memories: Memories) -> State:
        """What the braid feels of one state of the rig."""
        for index in self.at("felt"):
            state = self._felt_by(index, state, memories[index])
        return state

    def lost_now(self, felt: State, elastic: jax.Array, memories: Memories, direction: jax.Array) -> Loss:
        """The loss at one felt state, were the braid to slide in this direction (-1, 0 or 1)."""
        zero = jnp.zeros_like(elastic)
        loss = Loss(zero, direction, zero, elastic)
        for index in self.at("lost"):
            known = felt.replace(memory=memories[index])
            loss = self.when_live(index, lambda x, i=index, s=known: self.lose(i, s, x), loss)
        return loss

    def _felt_by(self, index: int, state: State, memory: Any) -> State:
        if self.effects[index].stage != "felt":
            return state
        return self.when_live(index, lambda s: self.feel(index, s.replace(memory=memory)), state)

    # The set of effects --------------------------------------------------------------------------------------------

    def at(self, stage: str) -> tuple[int, ...]:
        """Positions of the effects of one stage, in the order in which they act."""
        return tuple(i for i, effect in enumerate(self.effects) if effect.stage == stage)

    def when_live(self, index: int, change: Callable[[Any], Any], value: Any) -> Any:
        """`change(value)`, or `value` untouched where the effect is not live (then nothing of it is computed)."""
        if self.live is None:
            return change(value)
        return jax.lax.cond(self.live[index], change, lambda v: v, value)

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the effects."""
        return tuple(name_of(effect) for effect in self.effects)

    def __getitem__(self, name: str) -> Any:
        return self.effects[self.names.index(name)]

    def add(self, *effects: Effect) -> "Model":
        """A model with these effects too; a rival of the same family is replaced."""
        return model(self.muscle, *with_effects(self.effects, effects))

    def drop(self, *names: str) -> "Model":
        """A model without the effects of these names."""
        return model(self.muscle, *(effect for effect in self.effects if name_of(effect) not in names))

    def missing_needs(self, effect: Effect | type[Effect]) -> tuple[str, ...]:
        """What an effect needs and this model, and muscle, do not have."""
        given = {thing for other in self.effects for thing in other.gives}
        return tuple(need for need in effect.needs if need not in given and getattr(self.muscle, need, None) is None)

    def cite(self) -> dict[str, str]:
        """The source of every effect, by name."""
        return {name_of(effect): effect.source for effect in self.effects}


def model(muscle: Muscle, *effects: Effect) -> Model:
    """A model from effects in any order."""
    ordered = tuple(sorted(effects, key=_place))
    return Model(muscle, ordered, jnp.ones(len(ordered)))


def contributions(given: Model, run: State) -> dict[str, jax.Array]:
    """How much force each effect accounts for along a run, N: with all of them minus without this one."""
    whole = given.force(run)
    return {name: whole - given.drop(name).force(run) for name in given.names}


def _place(effect: Effect) -> tuple[int, int, str]:
    stages: Sequence[str] = ("felt", "stored", "lost", "read")
    listed = ORDER.index(type(effect)) if type(effect) in ORDER else len(ORDER)  # a user's own come last
    return stages.index(effect.stage), listed, name_of(effect)


def with_effects(present: Sequence[Effect], added: Sequence[Effect]) -> tuple[Effect, ...]:
    """Effects with others added, each in turn in place of its rivals: of two rivals that are added the last stays."""
    result = tuple(present)
    for new in added:
        result = (*(old for old in result if not _replaces(new, old)), new)
    return result


def _replaces(new: Effect, old: Effect) -> bool:
    return name_of(new) == name_of(old) or (new.family is not None and new.family == old.family)


def _with_rates(change: Callable[[State], State], state: State) -> State:
    def place(contraction: jax.Array, pressure: jax.Array, stretch: jax.Array) -> tuple[jax.Array, ...]:
        felt = change(state.replace(contraction=contraction, pressure=pressure, stretch=stretch))
        return felt.contraction, felt.pressure, felt.stretch

    at = (state.contraction, state.pressure, state.stretch)
    (contraction, pressure, stretch), rates = jax.jvp(place, at, (state.rate, state.pressure_rate, state.stretch_rate))
    moved = state.replace(contraction=contraction, pressure=pressure, stretch=stretch)
    return moved.replace(rate=rates[0], pressure_rate=rates[1], stretch_rate=rates[2])
