"""Which effects look alike in some data, as groups with names: who could be taken for whom."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from fitting.diagnosis.record import Diagnosis
from fitting.report.settings import ADVICE
from fitting.report.text.names import mark


@dataclass(frozen=True)
class Group:
    """Effects that leave nearly the same trace; `least` is the smallest cosine between any two of them."""

    names: tuple[str, ...]
    least: float


def cosines(d: Diagnosis, names: Sequence[str]) -> np.ndarray:
    """How alike each two of these effects look (n, n): 1 on the diagonal, NaN where nobody knows."""
    known = np.array([[1.0 if a == b else d.effects[a].similar.get(b, np.nan) for b in names] for a in names])
    return np.where(np.isfinite(known), known, known.T) if len(names) else np.zeros((0, 0))


def groups(d: Diagnosis) -> list[Group]:
    """Groups of at least two in which every effect is like every other, those of what is named first."""
    from scipy.cluster.hierarchy import fcluster, linkage
    from scipy.spatial.distance import squareform

    names = [e.name for e in d.effects.values() if e.similar]
    if len(names) < 2:
        return []
    alike = np.nan_to_num(cosines(d, names))
    apart = squareform(np.clip(1 - alike, 0, 1), checks=False)
    label = fcluster(linkage(apart, "complete"), 1 - ADVICE.similar, "distance")
    members = [np.flatnonzero(label == k) for k in np.unique(label)]
    found = [Group(tuple(names[i] for i in own), float(alike[np.ix_(own, own)].min())) for own in members]
    named = {*named_by(d)}
    return sorted((g for g in found if len(g.names) > 1), key=lambda g: (not named & {*g.names}, -g.least))


def named_by(d: Diagnosis) -> list[str]:
    """Every effect that the verdict names."""
    leading = () if d.leading is None else d.leading.effects
    return list(dict.fromkeys(name for names in (*d.explanations, leading) for name in names))


def groups_html(found: Sequence[Group], of_verdict: Sequence[str], named: Callable[[str], str]) -> str:
    """The groups as lists of names; what the verdict names stands out. `named` makes HTML of the names of effects."""
    return f'<ul class="alike">{"".join(_item(group, of_verdict, named) for group in found)}</ul>'


def _item(group: Group, of_verdict: Sequence[str], named: Callable[[str], str]) -> str:
    words = (f"<b>{named(mark(n))}</b>" if n in of_verdict else f"<span>{named(mark(n))}</span>" for n in group.names)
    how = "the same trace" if group.least > 0.9995 else f"similarity of at least {group.least:.2f}"
    return f"<li>{' '.join(words)} <i>{how}</i></li>"
