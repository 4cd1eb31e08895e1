"""Dry friction of a braid that stands behind a spring: it sticks until what drives it has changed by twice its size.

Without friction the braid stands at eps_0, where pull and spring agree: P(eps_0) = K (eps_0 - reading), with K the
stiffness of the spring in N per contraction. Friction of the size Q holds it anywhere within -+ Q/(K - P') of eps_0
(P' = dP/deps, negative): it stands still until eps_0 has moved so far that the end of this band takes it along, as in
Prandtl's play. The spring then pulls with K (eps - reading), which is less than P(eps_0) by

    f = K (eps_0 - eps), |f| <= Q K/(K - P'),

and while the braid stands f changes as the drive K eps_0 = P(eps_0) + K reading does. To first order in Q/K.
"""

import jax
import jax.numpy as jnp
from jaxtyping import ArrayLike


def share_felt(spring: ArrayLike, slope: ArrayLike) -> jax.Array:
    """K/(K - P'), the share of a friction force of the braid that is felt behind the spring; in (0, 1].

    `spring` K and `slope` P' in N per contraction. A pull that rises with contraction counts as one that does not: a
    spring so soft that the muscle would snap is nothing that a recording shows.
    """
    return jnp.asarray(spring) / (spring + jnp.maximum(-jnp.asarray(slope), 0.0))


def played(drive: jax.Array, most: jax.Array, sliding: jax.Array, time: jax.Array) -> jax.Array:
    """Friction along a run (samples,), N: it follows the `drive` (N) within `most` (N) to either side.

    It begins as it is while `sliding` (N). A new run begins where the time goes back.
    """
    begins = jnp.concatenate([jnp.ones(1, bool), jnp.diff(time) < 0])
    moved = jnp.diff(drive, prepend=drive[:1])

    def follow(before: jax.Array, along: tuple[jax.Array, ...]) -> tuple[jax.Array, jax.Array]:
        begun, step, width, first = along
        now = jnp.clip(jnp.where(begun, first, before + step), -width, width)
        return now, now

    return jax.lax.scan(follow, jnp.zeros_like(sliding[0]), (begins, moved, most, sliding), unroll=2)[1]
