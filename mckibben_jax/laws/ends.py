"""The ends of a bare braid: an inextensible net under pressure whose ends are held at the radius of the fittings.

Its shape is exact. Let s be the place along the net at rest, b = 1/cos(alpha0), k = tan(alpha0)/r0. The strands keep
their length, z'^2 + r'^2 + k^2 r^2 = b^2, and the potential of a pull T is -int (P pi r^2 + T) z' ds. It does not name
s, so that (P pi r^2 + T)(b^2 - k^2 r^2)/z' is the same all along (Beltrami). In the middle, at the radius R and the
contraction e, the derivative by r vanishes, which is the ideal law (eq 10). With y = k^2 (R^2 - r^2)/(1 - e)^2 there is

    z' = (1 - e)(1 - y/2)(1 + y),    r'^2 = (1 - e)^2 y^2 (1 + y)(3 - y)/4.

So the ends lose no pull as such: the middle pulls as an ideal muscle that is contracted more than the whole. Not in
Tondu 2012, whose factor k of the contraction ('Tip effects') stands for this.
"""

import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.typing import ArrayLike

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(12)


def held_ends_length(contraction: ArrayLike, radius: ArrayLike, braid_angle: ArrayLike) -> Array:
    """By how much (m) both ends of a net are longer than if they were contracted as its middle, by `contraction`.

    2 int (1 - y)/sqrt((1 + y)(3 - y)) dr from r0 to R, which is 2/sqrt(3) (R - r0) for small contractions and grows
    more slowly then. No pressure is in it, no length, and no pull. `radius` r0 (m) is that of the fittings and of the
    braid at rest, `braid_angle` alpha0 (rad). Valid for contractions of the middle from 0 to below 0.5, in a muscle
    that is several times `held_ends_reach` long at either end. Arrays are broadcast.
    """
    contraction, radius, angle = jnp.broadcast_arrays(*map(jnp.asarray, (contraction, radius, braid_angle)))
    k, middle = jnp.tan(angle) / radius, 1 - contraction
    widest = jnp.sqrt(1 / jnp.cos(angle) ** 2 - middle**2) / k
    grown = widest - radius
    r = radius[..., None] + grown[..., None] * (_NODES + 1) / 2
    y = (k[..., None] / middle[..., None]) ** 2 * (widest[..., None] ** 2 - r**2)
    return grown * jnp.sum(_WEIGHTS * (1 - y) / jnp.sqrt((1 + y) * (3 - y)), axis=-1)


def held_ends_reach(contraction: ArrayLike, radius: ArrayLike, braid_angle: ArrayLike) -> Array:
    """Distance (m) from a fitting over which the radius comes within 1/e of the middle's: R/(sqrt(3) tan^2(alpha)).

    `contraction`, present radius R and present angle alpha are those of the middle; `radius` and `braid_angle` are as
    above. Some four radii at 20 deg, and no more than one at 40 deg.
    """
    cosine = jnp.cos(braid_angle) * (1 - jnp.asarray(contraction))
    sine = jnp.sqrt(1 - cosine**2)
    return radius * sine / jnp.sin(braid_angle) * cosine**2 / (jnp.sqrt(3.0) * sine**2)


def held_ends_factor(contraction: ArrayLike, length: ArrayLike, radius: ArrayLike, braid_angle: ArrayLike) -> Array:
    """The factor k by which the middle is contracted more than the whole muscle, of rest length `length` (m).

    The pull is that of the ideal muscle at k eps, with eps the contraction of the whole; `contraction` (not 0) is that
    of the middle, k eps. Near rest 1/(1 - 2 r0/(sqrt(3) l0 tan^2(alpha0))).
    """
    whole = jnp.asarray(contraction) - held_ends_length(contraction, radius, braid_angle) / length
    return contraction / whole
