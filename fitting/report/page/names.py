"""Effects and parameters on the page: the name for readers first, the identifier small beside it."""

import re
from collections.abc import Callable, Iterable, Mapping
from functools import cached_property
from html import escape

from markupsafe import Markup

from mckibben_jax.effect import Effect, title_of
from mckibben_jax.muscle import quantities
from mckibben_jax.parameter import parameters

JOIN = r"(?: \+ |, |; | = | in place of | or )"
# what stands behind an effect's name in a sentence: 'weight' and 'tip' are also words of English
END = r"(?!\w|\.\w)"  # a name ends here; a full stop may follow
SAID = r"(?= (?:is|was|are|were) missing| explains?| lowers| added| could take|: \d| \+ )"


class Names:
    """What readers call the effects of a library and their parameters.

    `html(text)` gives the text as HTML in which every effect and parameter has its name for readers, with the
    identifier that files and commands use behind it; `plain(text)` gives the names for readers alone.
    """

    def __init__(self, library: Mapping[str, type[Effect]]) -> None:
        self._library = library

    @cached_property
    def _parameters(self) -> dict[str, str]:
        """Full name to meaning, of every parameter and every size of the muscle."""
        own = {f"{name}.{p.name}": p.meaning for name, kind in self._library.items() for p in parameters(kind)}
        return own | {f"muscle.{name}": name.replace("_", " ") for name in quantities()}

    @cached_property
    def _pattern(self) -> re.Pattern[str]:
        """Every name in a text: parameters, identifiers with an underscore, and plain words where they are named."""
        plain = _any(name for name in self._library if "_" not in name)
        parts = (
            rf"(?:{_any(self._parameters)})(?:@\w+)?{END}",
            rf"(?:{_any(name for name in self._library if '_' in name)}){END}",
            rf"(?:{plain}){SAID}",
            rf"(?<= \+ )(?:{plain})(?!\w)",
        )
        return re.compile(rf"(?<![\w./])(?:{'|'.join(parts)})")

    @cached_property
    def _listing(self) -> re.Pattern[str]:
        """A text of nothing but names: 'tip', '+ tip', 'tip, creep', 'tip 0.98', 'tip: explains the data'."""
        name = rf"(?:{_any(self._library)})"
        return re.compile(rf"(?P<names>(?:[+-] )?{name}(?:{JOIN}{name})*)(?P<rest>(?: \d\.\d+|: .*)?)")

    @cached_property
    def _names(self) -> re.Pattern[str]:
        return re.compile(rf"(?<!\w)(?:{_any(self._library)})(?!\w)")

    def html(self, text: str) -> Markup:
        """The text as HTML; what is no name is escaped."""
        return Markup(self._replaced(text, escape, self._marked))  # escaped part by part

    def plain(self, text: str) -> str:
        """The text with the names for readers alone."""
        return self._replaced(text, str, self._title)

    def _replaced(self, text: str, other: Callable[[str], str], name: Callable[[str], str]) -> str:
        listing = self._listing.fullmatch(text)
        if listing:
            rest = self._replaced(listing["rest"], other, name) if listing["rest"] else ""
            return _replaced(self._names, listing["names"], other, name) + rest
        return _replaced(self._pattern, text, other, name)

    def _title(self, name: str) -> str:
        known = self._library.get(name)
        return self._parameters[name.split("@")[0]] if known is None else title_of(known)

    def _marked(self, name: str) -> str:
        return f'{escape(self._title(name))} <small class="id">{escape(name)}</small>'


def _any(names: Iterable[str]) -> str:
    """A pattern of any of these names, the longest first; one that never fits where there are none."""
    return "|".join(map(re.escape, sorted(names, key=len, reverse=True))) or r"(?!)"


def _replaced(pattern: re.Pattern[str], text: str, other: Callable[[str], str], name: Callable[[str], str]) -> str:
    """The text with every match renamed and all that lies between treated by `other`."""
    parts, end = [], 0
    for match in pattern.finditer(text):
        parts += [other(text[end : match.start()]), name(match[0])]
        end = match.end()
    return "".join([*parts, other(text[end:])])
