"""The formula that an effect states is what it computes: read by sympy and evaluated beside the effect."""

import re
import xml.etree.ElementTree as ET

import jax.numpy as jnp
import numpy as np
import pytest
import sympy
from hypothesis import given
from hypothesis import strategies as st
from sympy.parsing.sympy_parser import (
    convert_xor,
    function_exponentiation,
    implicit_multiplication,
    parse_expr,
    standard_transformations,
)

from fitting.report.formula import FUNCTIONS, NotAFormula, formula_html, mathml, names_in, statements, tokens
from mckibben_jax.effect import SYMBOLS, Energy, Felt, Loss, Lost, Pull, Pulling, Read, name_of
from mckibben_jax.effects import LIBRARY, SUPPLIES
from mckibben_jax.laws.review import EQUATIONS
from mckibben_jax.muscle import Muscle
from mckibben_jax.parameter import parameters
from mckibben_jax.state import State

EVERY = (*LIBRARY, *SUPPLIES)
# An integral, a history or an implicit law: held against closed forms and integrators in tests of their own.
NOT_ALGEBRA = ("supply_lag", "radial_gap", "bladder_neo_hookean", "bladder_mooney_rivlin", "bladder_ogden",
               "presliding", "maxwell_slip", "mullins", "creep", "time_delay", "supply_orifice",
               "supply_delay")  # fmt: skip
WORDS = ["39", "46", "fatigue"]  # equations whose text is no formula or holds words

L0, R0, ALPHA0, T0, NU = 0.3, 7e-3, np.radians(20.0), 5e-4, 0.35
MUSCLE = Muscle(length=L0, radius=R0, braid_angle=ALPHA0, wall_thickness=T0, shear_modulus=0.5e6,
                strand_modulus=2e9, strand_poisson=NU)  # fmt: skip
P, P_RATE, RATE = 3e5, 2e4, 0.04
FRICTION, RUBBER, PULL = 20.0, -15.0, 250.0  # of the loss so far, and the pull of what lies behind


def geometry(eps):
    """The braid by its own law, numpy alone: what stands in formulas at a contraction."""
    alpha = np.arccos(np.cos(ALPHA0) * (1 - eps))
    r = R0 * np.sin(alpha) / np.sin(ALPHA0)
    length, bore = L0 * (1 - eps), np.sqrt(r**2 - (R0**2 - (R0 - T0) ** 2) / (1 - eps))
    surface = 2 * np.pi * R0 * L0 * np.sin(2 * ALPHA0) / np.sin(2 * alpha)
    strand = L0 / np.cos(ALPHA0)
    widening = R0 / np.sin(ALPHA0) * np.cos(ALPHA0) ** 2 * (1 - eps) * R0 / np.sin(ALPHA0) / r  # dr/d eps
    growth = RATE * np.pi * (2 * r * widening * length - r**2 * L0)  # m^3/s
    first, last = r / R0, 1 - eps
    thin = (R0 - T0) * T0  # r_i (r - r_i) (1 - eps) of a thin wall keeps this
    lambda1 = (r + np.sqrt(r**2 - 4 * thin / (1 - eps))) / 2 / (R0 - T0)
    i1, i2 = first**2 + last**2 + (first * last) ** -2 - 3, first**-2 + last**-2 + (first * last) ** 2 - 3
    return {
        "eps": eps, "l": length, "l0": L0, "r": r, "r0": R0, "r_i": bore, "alpha": alpha, "alpha0": ALPHA0,
        "S": surface, "B": strand, "alpha_f": ALPHA0, "t0": T0, "h0": T0 / R0, "lambda1": lambda1, "I1": i1 + 3,
        "I2": i2 + 3, "A": np.pi * (R0**2 - (R0 - T0) ** 2), "x": L0 * eps, "v": L0 * RATE, "P": P, "nu": NU,
        "E": 2e9, "F_f": FRICTION, "F": PULL, "F0": ideal(eps), "F_rubber": RUBBER, "L": 1000.0, "P_atm": 101325.0,
        "g": 9.80665, "pi": np.pi, "dV": growth, "dt": 1.0, "V": np.pi * r**2 * length,
    }  # fmt: skip


def value(text, known):
    """A formula of the program's as a number, by sympy: names stand for themselves, products need no sign."""
    names = {name: sympy.Symbol(f"s{k}") for k, name in enumerate(known)}
    functions = {"sin": sympy.sin, "cos": sympy.cos, "tan": sympy.tan, "sqrt": sympy.sqrt, "exp": sympy.exp,
                 "max": sympy.Max, "abs": sympy.Abs}  # fmt: skip
    text = re.sub(r"\|([^|]+)\|", r"abs(\1)", text).translate(str.maketrans("[]{}", "()()"))
    how = (*standard_transformations, convert_xor, function_exponentiation, implicit_multiplication)
    read = parse_expr(text, names | functions, how)
    assert not read.atoms(sympy.Symbol) - set(names.values()), f"unknown names in {text}"
    return float(read.subs({names[name]: number for name, number in known.items()}))


MAIN = ("E", "F", "P", "eps", "B", "F_f")  # what an effect gives; all else in its formula is said by the way


def said(kind, of, eps=0.12):
    """What the formula of an effect says of a quantity: the right side of `of -> ...` or `of = ...`."""
    known = geometry(eps) | {p.name: float(p.default) for p in parameters(kind)}
    asked = ""
    for statement in reversed(statements(kind.formula)):
        left, sign, right = re.split(r" (->|=|>|<=) ", statement)
        if left == of:
            asked = right
        elif left not in MAIN and sign == "=":
            known[left] = value(right, known)
    return value(asked, known)


def state(eps=0.12):
    return State(contraction=jnp.asarray(eps), pressure=jnp.asarray(P), rate=jnp.asarray(RATE),
                 pressure_rate=jnp.asarray(P_RATE), time=jnp.asarray(0.0))  # fmt: skip


def ideal(eps):
    return np.pi * R0**2 * P * (3 * (1 - eps) ** 2 / np.tan(ALPHA0) ** 2 - 1 / np.sin(ALPHA0) ** 2)


def those(base, letter):
    """The effects of a kind whose formula states a quantity."""
    stated = [kind for kind in EVERY if issubclass(kind, base) and name_of(kind) not in NOT_ALGEBRA]
    return pytest.mark.parametrize(
        "kind", [kind for kind in stated if re.search(rf"(^|, ){letter} (->|=) ", kind.formula)], ids=name_of
    )


AT = pytest.mark.parametrize("eps", [0.02, 0.12, 0.23])


@AT
@those(Energy, "E")
def test_the_energy_is_that_of_the_formula(kind, eps):
    assert said(kind, "E", eps) == pytest.approx(float(kind().energy(MUSCLE, state(eps))), rel=1e-9, abs=1e-12)


@AT
@those((Energy, Pulling), "F")
def test_the_pull_is_that_of_the_formula(kind, eps):
    """`F -> ...` adds to the pull so far; `F = ...` is the pull of the whole muscle, the gas included."""
    own = float(kind().force(MUSCLE, state(eps)))
    before = PULL if "F -> " in kind.formula else 0.0 if name_of(kind) == "ideal_cylinder" else ideal(eps)
    assert said(kind, "F", eps) == pytest.approx(before + own, rel=1e-9)


@AT
@those(Lost, "F_f")
def test_friction_grows_by_the_formula(kind, eps):
    assert said(kind, "F_f", eps) == pytest.approx(float(lost(kind, eps).size), rel=1e-9)


@AT
@those(Lost, "F")
def test_drag_is_that_of_the_formula(kind, eps):
    assert said(kind, "F", eps) == pytest.approx(PULL - float(lost(kind, eps).drag), rel=1e-9)


def lost(kind, eps):
    so_far = Loss(jnp.asarray(FRICTION), jnp.asarray(1.0), jnp.asarray(0.0), jnp.asarray(RUBBER))
    return kind().lose(MUSCLE, state(eps), so_far)


@AT
@those(Felt, "(P|eps|B)")
def test_what_is_felt_is_that_of_the_formula(kind, eps):
    felt = kind().felt(MUSCLE, state(eps), Pull(lambda _: jnp.asarray(PULL)))
    of = kind.formula.split(" ")[0]
    found = {"P": felt.pressure, "eps": felt.contraction, "B": L0 / np.cos(ALPHA0) * (1 + felt.stretch)}[of]
    assert said(kind, of, eps) == pytest.approx(float(found), rel=1e-9)


@those(Read, "F")
def test_what_is_read_is_that_of_the_formula(kind):
    read = float(kind().read(jnp.asarray(PULL), jnp.asarray(0.0)))
    assert said(kind, "F") == pytest.approx(read, rel=1e-4)  # the corner of a slack muscle is rounded


def test_every_effect_states_a_formula_and_most_of_them_were_evaluated():
    assert [name_of(kind) for kind in EVERY if not kind.formula] == []
    assert set(NOT_ALGEBRA) <= {name_of(kind) for kind in EVERY}
    assert len(NOT_ALGEBRA) < len(EVERY) / 3


@pytest.mark.parametrize("kind", EVERY, ids=name_of)
def test_a_formula_names_every_parameter_and_nothing_that_is_unexplained(kind):
    names, own = names_in(kind.formula), {p.name for p in parameters(kind)}
    assert own <= set(names)
    assert [name for name in names if name not in own and name not in SYMBOLS] == []


def test_no_symbol_is_explained_that_no_formula_uses():
    used = {name for kind in EVERY for name in names_in(kind.formula)}
    assert [name for name in SYMBOLS if name not in used] == []


# Typeset --------------------------------------------------------------------------------------------------------------


def drawn(formula, names=()):
    """A typeset formula as nested lists of tags and texts."""

    def plain(element):
        inner = [plain(child) for child in element]
        return (element.tag, *inner) if inner else element.text if element.text else element.tag

    return plain(ET.fromstring(mathml(formula, names)))


def test_fractions_powers_and_roots_are_drawn_as_such():
    above, below = ("mrow", "2", "a"), ("msup", "b", "2")
    assert drawn("2 a/b^2") == ("math", ("mfrac", above, below))
    assert drawn("sqrt(x)^3") == ("math", ("msup", ("msqrt", "x"), "3"))
    assert drawn("(a + b)/2") == ("math", ("mfrac", ("mrow", "a", "+", "b"), "2"))
    assert drawn("(K/2) x") == ("math", ("mrow", ("mfrac", "K", "2"), "x"))
    assert drawn("(K/2)^2")[1][0] == "msup"
    assert drawn("(K/2)^2")[1][1] == ("mrow", "(", ("mfrac", "K", "2"), ")")
    assert drawn("exp(K/2)")[1][2] == ("mrow", "(", ("mfrac", "K", "2"), ")")
    assert drawn("x^(n - 1)") == ("math", ("msup", "x", ("mrow", "n", "−", "1")))
    assert drawn("sin^2(alpha0)") == (
        "math", ("mrow", ("msup", "sin", "2"), ("mrow", "(", ("msub", "α", "0"), ")"))
    )  # fmt: skip
    assert drawn("tau dP_m/dt") == (
        "math", ("mrow", "τ", ("mfrac", ("mrow", "d", ("msub", "P", "m")), ("mrow", "d", "t")))
    )  # fmt: skip
    assert drawn("exp(-|v|/c)") == (
        "math", ("mrow", "exp", ("mrow", "(", ("mrow", "−", ("mfrac", ("mrow", "|", "v", "|"), "c")), ")"))
    )  # fmt: skip


@pytest.mark.parametrize("formula", ["F = F of 36", "a b)", "(a", "a ^", "a $ b", "4320 cycles at 25 %"])
def test_text_that_is_no_formula_is_refused(formula):
    with pytest.raises(NotAFormula):
        mathml(formula)


PIECES = [
    *"()[]{}|^/+-,=~<>'*_ $",
    " ",
    "->",
    "<=",
    "2",
    "1.5",
    "x",
    "P_m",
    "eps",
    "sin",
    "sqrt",
    "dV",
    "dt",
    "d ",
    "int",
    "F0",
]


@given(st.lists(st.sampled_from(PIECES), max_size=25).map("".join))
def test_any_text_becomes_well_formed_mathml_or_is_refused(text):
    try:
        assert ET.fromstring(mathml(text)).tag == "math"
    except NotAFormula:
        assert formula_html(text).startswith("<code>")


def test_text_of_an_own_effect_is_shown_as_it_stands():
    assert (
        formula_html("F -> F less <what the cord takes>") == "<code>F -&gt; F less &lt;what the cord takes&gt;</code>"
    )
    assert formula_html("F -> F + w", ["w"]).startswith("<math")


def test_all_formulas_are_typeset_but_for_a_few_texts():
    refused = [e.number for e in EQUATIONS if not _is_typeset(e.formula)]
    assert refused == WORDS
    for kind in EVERY:
        assert drawn(kind.formula, [p.name for p in parameters(kind)])[0] == "math"


def _is_typeset(formula):
    try:
        return bool(drawn(formula))
    except NotAFormula:
        return False


@pytest.mark.parametrize("kind", EVERY, ids=name_of)
def test_nothing_is_lost_in_typesetting(kind):
    """As many numbers and functions as in the text, and all its names; brackets and slashes may go."""
    text = kind.formula.replace("a_over_F0", "a/F0")
    element = ET.fromstring(mathml(kind.formula, [p.name for p in parameters(kind)]))
    numbers = [t.text for t in tokens(text) if t.kind == "number"]
    assert [each.text for each in element.iter("mn")] == numbers
    functions = [t.text for t in tokens(text) if t.text in FUNCTIONS and t.text != "sqrt"]
    assert [each.text for each in element.iter("mi") if each.text in FUNCTIONS] == functions
