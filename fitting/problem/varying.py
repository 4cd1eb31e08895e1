"""What varies in a fit: one record that every function which fits takes whole."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

from fitting.full_names import listed
from fitting.problem.unknowns import Unknown, Unknowns


@dataclass(frozen=True)
class Varying:
    """What varies, by full names: what is asked for beside what varies anyway.

    Parameters of effects vary, and so does whatever has a prior. `free` lets a quantity of the muscle vary too, `fix`
    holds what would vary, `own` gives each data set a value of its own.
    """

    fix: Sequence[str] = ()
    free: Sequence[str] = ()
    own: Sequence[str] = ()

    def names(self, layout: Unknowns) -> tuple[str, ...]:
        """The names of all unknowns that vary, in the order of the vector."""
        return tuple(entry.name for entry in layout.entries if self.varies(entry))

    def varies(self, entry: Unknown) -> bool:
        """Whether one unknown varies."""
        asked = not entry.name.startswith("muscle.") or entry.prior is not None or listed(entry.name, self.free)
        return asked and not self.holds(entry.name)

    def holds(self, name: str) -> bool:
        """Whether a name is held fixed on request."""
        return listed(name, self.fix)

    def fixing(self, *names: str) -> "Varying":
        """The same with these names held too."""
        return replace(self, fix=(*self.fix, *names))

    def among(self, names: set[str]) -> "Varying":
        """The same without names that these are not among."""
        return Varying(*(tuple(n for n in part if n in names) for part in (self.fix, self.free, self.own)))

    @property
    def keywords(self) -> dict[str, Any]:
        """As arguments of the functions in `fitting` that users call."""
        return asdict(self)


AS_DECLARED = Varying()
