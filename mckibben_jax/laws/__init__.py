"""Laws of the review and of the gas, as plain functions of numbers and arrays: they know no effect.

`braid` has the geometry of the braid and the ideal force; `rubber` the wall of the tube; `working_pressure` least
pressure, burst and fatigue; `textile` friction between strands; `biology` Hill's law and natural muscle; `reynolds`
motion near rest; `gas` and `valve` the supply. `review` is the table of the review's equations: `review.lookup("25")`.
"""

from mckibben_jax.laws import biology as biology
from mckibben_jax.laws import braid as braid
from mckibben_jax.laws import gas as gas
from mckibben_jax.laws import review as review
from mckibben_jax.laws import reynolds as reynolds
from mckibben_jax.laws import rubber as rubber
from mckibben_jax.laws import textile as textile
from mckibben_jax.laws import valve as valve
from mckibben_jax.laws import working_pressure as working_pressure
