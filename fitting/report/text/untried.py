"""What could not be tested for lack of a measurement, where another effect may be named in its place."""

from fitting.diagnosis.outcomes import NOTHING_MISSING, Reason
from fitting.diagnosis.record import Diagnosis
from mckibben_jax.effect import name_of
from mckibben_jax.effects import LIBRARY
from mckibben_jax.muscle import quantities

RUBBER = "rubber"


def untried_texts(d: Diagnosis) -> list[str]:
    """That laws of rubber could not be tried for lack of a size, where the model has none and something is missing.

    Most muscles are stiffer than their braid by their rubber, so that another effect would be named for it.
    """
    present = d.baseline.layout.templates[0].effects
    if d.verdict in NOTHING_MISSING or any(RUBBER in effect.gives for effect in present):
        return []
    laws = [name_of(kind) for kind in LIBRARY if RUBBER in kind.gives and not (kind.rival or kind.on_request)]
    reasons = [d.effects[name].why for name in laws if name in d.effects]
    needs = [why.names for why in reasons if why and why.reason is Reason.NEEDS and {*why.names} <= {*quantities()}]
    if not needs:
        return []
    sizes = " and ".join(f"{name} ({quantities()[name][1]})" for name in min(needs, key=len))
    return [
        f"Laws of the rubber wall could not be tried: muscle.toml does not state {sizes}. Rubber is what most muscles "
        "have besides the ideal cylinder, and what it does may be laid on another effect: state it first."
    ]
