"""What a muscle computes, as functions that jax can trace: every language writes these, and nothing else."""

import math
import textwrap
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from fitting import showing
from fitting.errors import InputError, unknown_name
from fitting.exporting.draws import Draws, with_parameters
from fitting.exporting.force_error import ForceError, unknown_error
from fitting.exporting.settings import EXPORT
from fitting.exporting.traced import UnknownOperation
from fitting.version import program_version
from mckibben_jax.effect import name_of
from mckibben_jax.model import Model
from mckibben_jax.motion.stepping import Carried, begin, linearised, slow_force, step, step_parts
from mckibben_jax.muscle import quantities
from mckibben_jax.parameter import parameters
from mckibben_jax.state import State

WIDTH = 112  # of a line of words in the head of a file
RIG = ("contraction", "pressure", "rate", "pressure_rate", "time")  # what a state knows of the rig


@dataclass(frozen=True)
class Law:
    """A function to be written: its name, what jax traces, and example values of its arguments by name."""

    name: str
    function: Callable
    arguments: dict[str, Any]

    def source(self, whole: Model, language: str, write: Callable[[str, Callable, dict[str, Any]], str]) -> str:
        """What a language writes for it; InputError where an effect has an operation that the language lacks."""
        try:
            return write(self.name, self.function, self.arguments)
        except UnknownOperation as error:
            problem = f"an effect uses jax's operation '{error}', which has no form in {language}"
            cure = f"write a table instead (--to table), or leave one out: {', '.join(whole.names)}"
            raise InputError(problem, cure=cure) from None


NO_DATA = unknown_error("no data were given")


@dataclass(frozen=True)
class Told:
    """What is known of a model besides its values: the force error to expect, and draws of its parameters."""

    error: ForceError = NO_DATA
    draws: Draws | None = None

    def lines(self) -> list[str]:
        """In words."""
        words = [self.error.sentence]
        if self.draws is not None:
            each = ", ".join(self.draws.names)
            words.append(f"{len(self.draws.values)} draws of {each} are from {self.draws.origin}.")
        return [line for text in words for line in textwrap.wrap(text, WIDTH)]


NOTHING = Told()


def laws(whole: Model, names: Sequence[str] = ()) -> tuple[Law, ...]:
    """The laws of a muscle: start, step, parts (pull and dry friction of a step), force, linearised.

    The parameters in `names` are their first arguments; all others are written as the numbers that they are.

    The state goes in and comes out as numbers in this order: those of `RIG`, the direction of friction, the memories.
    InputError where an instrument looks back, which a single step cannot.
    """
    _refuse_what_looks_back(whole)
    one = jnp.zeros(())
    memories, structure = jax.tree.flatten(jax.eval_shape(lambda c, p: begin(whole, c, p).memories, one, one))
    place, rig = {"contraction": one, "pressure": one}, dict.fromkeys(RIG, one) | {"direction": one}
    way = place | {"direction": one, "rate": one}
    remembered = {n: jnp.zeros(a.shape) for n, a in zip(memory_names(whole), memories, strict=True)}
    stepped = rig | remembered | {"new_pressure": one, "displacement": one, "dt": one}

    def carried(given: Sequence[jax.Array]) -> Carried:
        rest = given[len(RIG) :]
        memory = jax.tree.unflatten(structure, rest[1 : 1 + len(memories)])
        return Carried(State(**dict(zip(RIG, given, strict=False))), rest[0], memory)

    def flat(after: Carried) -> list[jax.Array]:
        return [*(getattr(after.rig, name) for name in RIG), after.direction, *jax.tree.leaves(after.memories)]

    def advance(whole: Model, *given: jax.Array) -> list[jax.Array]:
        after, force = step(whole, carried(given), *given[-3:])
        return [*flat(after), force]

    def parts(whole: Model, *given: jax.Array) -> list[jax.Array]:
        after, pull, friction = step_parts(whole, carried(given), *given[-3:])
        return [*flat(after), pull, friction]

    def law(name: str, function: Callable, arguments: dict[str, Any]) -> Law:
        count, given = len(names), {argument_name(each): one for each in names}
        drawn = lambda *at: function(with_parameters(whole, names, at[:count]), *at[count:])  # noqa: E731
        return Law(name, drawn, given | arguments)

    return (
        law("_start", lambda m, *at: jax.tree.leaves(begin(m, *at).memories), place),
        law("_step", advance, stepped),
        law("_parts", parts, stepped),
        law("_force", lambda m, *at: [slow_force(m, *at)], way),
        law("_linearised", lambda m, *at: linearised(m, *at), way),
    )


def argument_name(name: str) -> str:
    """How a parameter is called in a law that has it as an argument."""
    return "p_" + name.replace(".", "_")


def memory_shapes(whole: Model) -> dict[str, tuple[int, ...]]:
    """The shape of each array that is remembered, by its name."""
    one = jnp.zeros(())
    arrays = jax.tree.leaves(jax.eval_shape(lambda c, p: begin(whole, c, p).memories, one, one))
    return {name: array.shape for name, array in zip(memory_names(whole), arrays, strict=True)}


def memory_names(whole: Model) -> list[str]:
    """A name for each array that is remembered: that of its effect."""
    one = jnp.zeros(())
    per_effect = jax.eval_shape(lambda c, p: begin(whole, c, p).memories, one, one)
    counts = [len(jax.tree.leaves(memory)) for memory in per_effect]
    return [
        f"{name}_memory" if count == 1 else f"{name}_memory_{number}"
        for name, count in zip(whole.names, counts, strict=True)
        for number in range(count)
    ]


def _refuse_what_looks_back(whole: Model) -> None:
    """Refuse an instrument whose reading hangs on earlier ones: a single step knows only the present."""
    time, signal = jnp.arange(EXPORT.window) * 1e-3, jnp.sin(jnp.arange(EXPORT.window))
    for index in whole.at("read"):
        effect = whole.effects[index]
        if np.any(np.asarray(jax.jacfwd(effect.read)(signal, time))[-1, :-1]):
            name = name_of(effect)
            raise InputError(
                f"{name} looks back along the run, which a single step cannot", cure=f"add --without {name}"
            )


def title(whole: Model, source: str, told: Told = NOTHING) -> str:
    """Where a muscle is from, its sizes, the parameters of its effects and what is known of them, for a file's head."""
    measured = {name: unit for name, (unit, _) in quantities().items() if getattr(whole.muscle, name) is not None}
    lines = [f"muscle.{name} = {showing.show(float(getattr(whole.muscle, name)), u)}" for name, u in measured.items()]
    straight = 1 - 1 / math.cos(float(whole.muscle.braid_angle))
    lines.append(f"The braid is straight at contraction {straight:.3g}: beyond, the law ends and numbers mean nothing")
    for effect in whole.effects:
        own = [f"{p.name} = {showing.show(float(getattr(effect, p.name)), p.unit)}" for p in parameters(effect)]
        lines.append(f"{name_of(effect)}: {', '.join(own) or 'no parameters'} ({effect.source})")
    text = "\n".join(["", *(f"    {line}" for line in lines), "", *told.lines(), ""])
    written = f"Written by mckibben {program_version()} from {source}"
    return f"{written}. All values are SI: Pa (gauge), m, N, s, rad.\n{text}".replace("\\", "/").replace('"""', "'''")


def without(whole: Model, names: Sequence[str]) -> Model:
    """A model without these effects."""
    for name in names:
        if name not in whole.names:
            raise unknown_name("effect in --without:", name, whole.names)
    return whole.drop(*names)
