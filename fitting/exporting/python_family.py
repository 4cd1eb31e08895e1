"""Draws of the parameters in a module of plain numpy: a table of them, and the choice of one."""

from string import Template

from fitting.exporting.draws import LENGTH, Draws, parameters_of
from mckibben_jax.model import Model


def family_in_python(whole: Model, draws: Draws) -> str:
    """The draws, the function that chooses one, and the laws with the parameters of the chosen one."""
    at = draws.names.index(LENGTH) if LENGTH in draws.names else None
    return _FAMILY.substitute(
        names="".join(f"    {name!r},\n" for name in draws.names),
        units=f"({', '.join(map(repr, draws.units))},)",
        fitted=f"np.array({parameters_of(whole, draws.names)})",
        draws="\n".join(f"    {row}," for row in draws.values.tolist()),
        scope="_now" if at is None else "_now, LENGTH",
        length="" if at is None else f"    LENGTH = _now[{at}]\n",
    )


_FAMILY = Template('''
PARAMETERS = (
$names)
UNITS = $units
FITTED = $fitted
DRAWS = np.array([  # one set of parameters in each row, in the order and the units above
$draws
])
_now = tuple(FITTED)


def use(draw=None):
    """From here on every function is that of this draw, 0 to len(DRAWS) - 1; None: of the fitted values.

    This is the only place where parameters are chosen. A `State` belongs to the draw that it was made with: begin anew
    with `start` after a change.
    """
    global $scope
    if draw is not None and not 0 <= draw < len(DRAWS):
        raise ValueError(f"draw is {draw}: there are draws 0 to {len(DRAWS) - 1}; use() takes the fitted values")
    _now = tuple(FITTED if draw is None else DRAWS[draw])
$length

def _start(*given):
    return _drawn_start(*_now, *given)


def _step(*given):
    return _drawn_step(*_now, *given)


def _parts(*given):
    return _drawn_parts(*_now, *given)


def _force(*given):
    return _drawn_force(*_now, *given)


def _linearised(*given):
    return _drawn_linearised(*_now, *given)
''')
