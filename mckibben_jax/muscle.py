"""The muscle: what is measured at rest, before any effect is presumed. No effect ever changes it."""

import dataclasses
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp

from mckibben_jax.parameter import as_scalar


def _measured(unit: str, meaning: str, **default: Any) -> Any:
    return eqx.field(converter=as_scalar, metadata={"unit": unit, "meaning": meaning}, **default)


class Muscle(eqx.Module):
    """A McKibben muscle as measured at rest, in SI units and radians.

    `length` is that of the braid between the fittings, `radius` where the braid lies, `braid_angle` from the long
    axis. What was not measured is None, and effects that need it say so.
    """

    length: jax.Array = _measured("m", "braid length at rest between the fittings, l0")
    radius: jax.Array = _measured("m", "radius at rest where the braid lies, r0")
    braid_angle: jax.Array = _measured("rad", "braid angle at rest from the long axis, alpha0")
    wall_thickness: jax.Array | None = _measured("m", "thickness of the whole rubber wall, t0", default=None)
    wall_outside: jax.Array = _measured("m", "rubber outside an embedded braid", default=0.0)
    shear_modulus: jax.Array | None = _measured("Pa", "shear modulus of the rubber, G", default=None)
    mooney_c10: jax.Array | None = _measured("Pa", "Mooney-Rivlin constant C10", default=None)
    mooney_c01: jax.Array | None = _measured("Pa", "Mooney-Rivlin constant C01", default=None)
    strand_width: jax.Array | None = _measured("m", "diameter of a strand, D", default=None)
    strand_modulus: jax.Array | None = _measured("Pa", "Young's modulus of a strand", default=None)
    strand_poisson: jax.Array | None = _measured("1", "Poisson's ratio of a strand", default=None)
    breaking_stress: jax.Array | None = _measured("Pa", "breaking stress of the rubber", default=None)
    moving_mass: jax.Array = _measured("kg", "mass that moves besides the load", default=0.0)

    @property
    def outer_radius(self) -> jax.Array:
        """Outer radius of the rubber at rest, m."""
        return self.radius + self.wall_outside

    @property
    def inner_radius(self) -> jax.Array:
        """Radius of the bore at rest, m; needs the wall thickness."""
        return self.outer_radius - self.wall_thickness

    @property
    def turns(self) -> jax.Array:
        """Turns of one strand around the muscle, N (eq 13)."""
        return self.length * jnp.tan(self.braid_angle) / (2 * jnp.pi * self.radius)

    def lacks(self, name: str) -> bool:
        """Whether this measurement is missing."""
        return getattr(self, name) is None


def quantities() -> dict[str, tuple[str, str]]:
    """Every measurement a muscle may carry: name to (unit, meaning)."""
    return {f.name: (f.metadata["unit"], f.metadata["meaning"]) for f in dataclasses.fields(Muscle)}
