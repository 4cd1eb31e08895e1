"""Names of effects and parameters in texts: marked, so that each medium says them in its own way.

A sentence is plain text in which names stand in marks: `f"{mark('tip')} is missing."` is "⟦tip⟧ is missing.". The
terminal prints "Tip correction (tip) is missing.", the page sets the identifier small, and JSON has "tip is missing.".
"""

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cached_property

from fitting.full_names import common
from fitting.library.library import library
from fitting.report.settings import SHOWN
from mckibben_jax.effect import Effect, title_of
from mckibben_jax.muscle import quantities
from mckibben_jax.parameter import parameters

MARKED = re.compile(r"⟦([^⟦⟧]+)⟧")


def mark(name: str) -> str:
    """The name of an effect ('tip') or the full name of a parameter ('tip.k') for a text."""
    return f"⟦{name}⟧"


def marked(names: Iterable[str], joint: str = ", ") -> str:
    """Several names in a row."""
    return joint.join(map(mark, names))


def listed(names: Sequence[str]) -> str:
    """Names in a list. A long one has identifiers alone: with names for readers too it would fill the terminal."""
    return marked(names) if len(names) <= SHOWN.named else ", ".join(names)


def identifiers(text: str) -> str:
    """The text with the names that files and commands use, as machines read it."""
    return MARKED.sub(r"\1", text)


def readable(text: str) -> str:
    """The text as the terminal says it: the program's own effects by their names for readers and for commands."""
    return Names().spoken(text)


class Names:
    """What readers call the effects of a library, the program's own unless one is given, and their parameters."""

    def __init__(self, of: Mapping[str, type[Effect]] | None = None) -> None:
        self._given = of

    @cached_property
    def _called(self) -> dict[str, str]:
        """What readers call every effect, every parameter and every size of the muscle."""
        known = library() if self._given is None else self._given
        own = {f"{name}.{p.name}": p.meaning for name, kind in known.items() for p in parameters(kind)}
        sizes = {f"muscle.{name}": name.replace("_", " ") for name in quantities()}
        return sizes | own | {name: title_of(kind) for name, kind in known.items()}

    def called(self, name: str) -> str:
        """What readers call an effect or a parameter; of one that nobody knows, its identifier."""
        return self._called.get(common(name), name)

    def plain(self, text: str) -> str:
        """The text with the names for readers alone."""
        return self.replaced(text, self.called)

    def spoken(self, text: str) -> str:
        """The text as the terminal says it: 'Tip correction (tip) is missing.'"""
        return self.replaced(text, self._spoken)

    def _spoken(self, name: str) -> str:
        called = self.called(name)
        return name if called == name else f"{called} ({name})"

    def replaced(self, text: str, name: Callable[[str], str], other: Callable[[str], str] = str) -> str:
        """The text with every name treated by `name`, and all that lies between by `other`."""
        parts = MARKED.split(text)  # text, name, text, name, ..., text
        return "".join(name(part) if number % 2 else other(part) for number, part in enumerate(parts))
