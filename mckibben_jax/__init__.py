"""McKibben muscles: what is measured at rest, what changes, the effects, and the model that a set of effects makes.

`model(Muscle(...), IdealCylinder(), CoulombFriction())` gives a `Model`; its `force` at a `State` is in newtons. All is
in SI units and radians, and differentiable by jax. Laws as plain functions are in `mckibben_jax.laws`, motions under a
load in `mckibben_jax.motion`, designs in `mckibben_jax.design`.

`mckibben_jax.model` and `mckibben_jax.parameter` are these two functions. The modules of the same names are reached by
`from mckibben_jax.model import ...` alone.
"""

from typing import TYPE_CHECKING, Any

from mckibben_jax.effect import Effect as Effect
from mckibben_jax.effect import Energy as Energy
from mckibben_jax.effect import Felt as Felt
from mckibben_jax.effect import Loss as Loss
from mckibben_jax.effect import Lost as Lost
from mckibben_jax.effect import Pulling as Pulling
from mckibben_jax.effect import Read as Read
from mckibben_jax.effect import name_of as name_of
from mckibben_jax.effect import title_of as title_of
from mckibben_jax.effects import *  # noqa: F403  the class of every effect: the library is listed there alone
from mckibben_jax.memory import Memory as Memory
from mckibben_jax.model import Model as Model
from mckibben_jax.model import contributions as contributions
from mckibben_jax.model import model as model
from mckibben_jax.model import with_effects as with_effects
from mckibben_jax.muscle import Muscle as Muscle
from mckibben_jax.parameter import parameter as parameter
from mckibben_jax.parameter import parameters as parameters
from mckibben_jax.state import State as State

if TYPE_CHECKING:
    from mckibben_jax.motion import release as release
    from mckibben_jax.motion import step_response as step_response
else:

    def __getattr__(name: str) -> Any:
        """Motions are loaded when they are asked for: they bring diffrax."""
        if name not in ("release", "step_response"):
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        from mckibben_jax import motion

        return getattr(motion, name)
