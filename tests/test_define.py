"""A user's own effect in one line: its grammar, its values and slopes, and everything that must be refused."""

import string
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import sympy
import test_effects as conformance
from benches import MUSCLE
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from small_muscle import loops, write

from fitting.errors import InputError
from fitting.library import expression as define_expression
from fitting.library.library import library
from fitting.library.line import EXAMPLE, VARIABLES, effect_from_line
from fitting.model_files.model_file import read_model
from fitting.model_files.writer import write_model
from fitting.study.request import Request
from fitting.study.task import fit_task, task_of
from mckibben_jax.effect import name_of
from mckibben_jax.parameter import parameters
from mckibben_jax.state import State

LINES = (
    EXAMPLE,
    "bump = A*exp(-((eps - c)/w)^2), A = 10 N (-60..60), c = 13 % (2..25), w = 0.04 (0.01..0.1)",
    "cubic = -K*(P/P1)**2*(eps/e1)**3, K = 60 N (0..200), P1 = 5 bar, e1 = 0.2",
    "damper = -B*v, B = 0.5 N s/mm (0..5)",
    "stripes = -A*sin(pi*x/p)**2*sign(v), A = 15 N (0..50), p = 60 mm (30..90)",
    "stop = -K*max(x - x0, 0), K = 2 N/mm (0..20), x0 = 40 mm (10..60)",
    "rub = -mu*P*S*tanh(v/v0), mu = 0.01 (0..1), v0 = 5 mm/s (1..50)",
    "drift = a*sqrt(t/t1)*cos(alpha), a = 1 N (-5..5), t1 = 1 s",
    "gain = g*F0*(P/P1)**n, g = 0.05 (-0.5..0.5), P1 = 3 bar, n = 0.7 (0.1..2)",
    "wide = K*abs(r - r1)*log(1 + P/P1), K = 3 kN/m (0..9), r1 = 9 mm (5..15), P1 = 1 MPa",
)
every_line = pytest.mark.parametrize("line", LINES, ids=lambda line: line.split(" ")[0])


# ------------------------------------------------------------------------------------------- an effect like any other


@every_line
@pytest.mark.parametrize(
    "check",
    [
        conformance.test_an_effect_says_what_it_is_where_it_comes_from_and_when_to_suspect_it,
        conformance.test_a_parameter_declares_unit_meaning_and_a_range_that_holds_its_values,
        conformance.test_its_parameters_are_all_that_varies,
        conformance.test_it_is_present_with_its_switch_at_one,
        conformance.test_a_switch_in_between_blends_without_and_with,
        conformance.test_force_and_slopes_are_finite_in_the_awkward_places,
        conformance.test_force_and_slopes_are_finite_at_the_ends_of_every_range,
        conformance.test_slopes_are_those_of_finite_differences,
        conformance.test_compiled_and_batched_is_the_same_as_one_run_step_by_step,
    ],
    ids=lambda check: check.__name__.removeprefix("test_"),
)
def test_a_defined_effect_passes_what_every_effect_must(line, check):
    check(effect_from_line(line))


@pytest.mark.parametrize("line", LINES[1:], ids=lambda line: line.split(" ")[0])
def test_a_defined_effect_is_recovered_from_where_a_search_starts(line):
    """But for the ripple: a pitch off by a quarter is many turns off along the stroke."""
    conformance.test_it_is_recovered_from_its_own_data_from_where_a_search_starts(effect_from_line(line))


@every_line
def test_a_defined_effect_is_absent_with_its_switch_at_zero(line):
    for runs in ("visible", "hard"):
        conformance.test_it_is_absent_with_its_switch_at_zero_and_when_not_live(effect_from_line(line), runs)


@pytest.mark.parametrize("line", [line for line in LINES if not effect_from_line(line).constants])
def test_the_force_changes_as_a_newton_when_the_units_change(line):
    for seed in (1, 2):
        conformance.test_the_force_changes_as_a_newton_when_the_units_change(effect_from_line(line), seed)


# ---------------------------------------------------------------------------------------------------- against algebra


def symbolic(line):
    """Formula, parameters and constants as sympy reads them."""
    kind = effect_from_line(line)
    names = {name: sympy.Symbol(name, positive=name != "v") for name in (*VARIABLES, *kind.law.names)}
    spelled = {"min": sympy.Min, "max": sympy.Max, "abs": sympy.Abs}
    formula = sympy.sympify(kind.law.text, locals={**names, **spelled})
    return kind, formula.subs({names[key]: value for key, value in kind.constants.items()}), names


@every_line
def test_values_and_slopes_are_those_of_computer_algebra(line):
    kind, formula, names = symbolic(line)
    random = np.random.default_rng(4)
    declared = parameters(kind)
    for _ in range(5):
        eps, pressure, rate, time = random.uniform((0.02, 5e4, 0.01, 1.0), (0.3, 6e5, 2.0, 50.0))
        state = State(eps, pressure, rate=rate, time=time)
        values = np.array([p.default for p in declared]) * random.uniform(0.8, 1.2, len(declared))

        def force(values, state=state):
            return kind(**{p.name: value for p, value in zip(declared, values, strict=True)}).force(MUSCLE, state)

        at = {names[name]: float(variable.at(MUSCLE, state)) for name, variable in VARIABLES.items()}
        at |= {names[p.name]: float(value) for p, value in zip(declared, values, strict=True)}
        slopes = [sympy.diff(formula, names[p.name]) for p in declared]
        np.testing.assert_allclose(force(jnp.asarray(values)), float(formula.subs(at)), rtol=1e-10)
        expected = [float(slope.subs(at)) for slope in slopes]
        np.testing.assert_allclose(jax.jacfwd(force)(jnp.asarray(values)), expected, rtol=1e-9, atol=1e-12)


def test_along_the_state_the_slope_is_the_closed_form():
    """Of A sin(2 pi l0 eps / p): (2 pi l0 A / p) cos(...)."""
    screw = effect_from_line(EXAMPLE)(A=8.0, p=0.012)
    slope = jax.grad(lambda eps: screw.force(MUSCLE, State(eps, 1e5)))(0.1234)
    turn = 2 * np.pi * 0.3 / 0.012
    np.testing.assert_allclose(slope, 8 * turn * np.cos(turn * 0.1234), rtol=1e-12)


@pytest.mark.parametrize(
    ("formula", "expected"),
    [
        ("-2**2", -4), ("2**3**2", 512), ("2^2", 4), ("1 - 2 - 3", -4), ("8/4/2", 1), ("-(3 - 5)*2", 4),
        ("max(1, 3, 2)", 3), ("min(1, 3, 2)", 1), ("abs(-7)", 7), ("sign(-0.5)", -1), ("4**(1/2)", 2), ("4**-0.5", 0.5),
        ("(-8)**(1/3)", 0), ("sqrt(-4)", 0), ("atan(1)*4 - pi", 0), ("1e-3*.5e+3", 0.5), ("log(exp(2))", 2), ("+3", 3),
    ],
)  # fmt: skip
def test_precedence_and_functions(formula, expected):
    np.testing.assert_allclose(float(define_expression.read_expression(formula, ()).value({})), expected, atol=1e-15)


def test_the_units_of_values_and_ranges():
    declared = {p.name: p for p in parameters(effect_from_line(LINES[3]))}
    assert (declared["B"].default, declared["B"].lower, declared["B"].upper) == (500.0, 0.0, 5000.0)
    assert declared["B"].unit == "N s/m"
    bump = {p.name: p for p in parameters(effect_from_line(LINES[1]))}
    np.testing.assert_allclose([bump["c"].default, bump["c"].lower, bump["c"].upper], [0.13, 0.02, 0.25])
    assert effect_from_line(LINES[2]).constants == {"P1": 5e5, "e1": 0.2}
    angle = {p.name: p for p in parameters(effect_from_line("s = A*alpha/a, A = 1 N (0..9), a = 20 deg (10..30)"))}
    np.testing.assert_allclose(angle["a"].default, np.radians(20))


def test_the_same_line_is_the_same_class_however_it_is_spaced():
    assert effect_from_line(EXAMPLE) is effect_from_line("  " + EXAMPLE.replace(",", ",  "))
    assert name_of(effect_from_line(EXAMPLE)) == "screw"


def test_only_hidden_shapes_are_sought_from_several_places():
    starts = {p.name: len(p.starts) for line in LINES[:2] for p in parameters(effect_from_line(line))}
    assert starts == {"A": 1, "p": 4, "c": 4, "w": 4}


# ------------------------------------------------------------------------------------------------------ what is refused

DEFINED_A = "A = 1 N (0..2)"
REFUSED = {
    "empty": ("", ("is empty", "screw =")),
    "no equals sign": ("screw", ("no equals sign",)),
    "no formula": ("s =", ("no formula",)),
    "no formula but values": (f"s = , {DEFINED_A}", ("no formula",)),
    "library name": (f"tip = A, {DEFINED_A}", ("'tip' is taken", "my_tip")),
    "name of the muscle": (f"muscle = A, {DEFINED_A}", ("'muscle' is taken",)),
    "capital name": (f"Screw = A, {DEFINED_A}", ("name cannot be used", "'Screw'", "small letter")),
    "name with digits first": (f"2s = A, {DEFINED_A}", ("name cannot be used",)),
    "name with a dot": (f"a.b = A, {DEFINED_A}", ("name cannot be used",)),
    "reserved name": (f"lambda = A, {DEFINED_A}", ("name cannot be used",)),
    "unicode name": (f"größe = A, {DEFINED_A}", ("name cannot be used",)),
    "misspelt function": ("s = A*sinn(x/p), A = 1 N (0..2), p = 1 mm (1..2)", ("'sinn(x/p)'", "mean 'sin'")),
    "misspelt variable": (f"s = A*alfa, {DEFINED_A}", ("unknown name 'alfa'", "mean 'alpha'")),
    "unknown name": (f"s = A + B, {DEFINED_A}", ("unknown name 'B'", "B = 1 N (0..10)")),
    "function without argument": (f"s = A*sin, {DEFINED_A}", ("'sin' has no argument",)),
    "two arguments": (f"s = A*sin(eps, eps), {DEFINED_A}", ("one argument, not 2",)),
    "one argument": (f"s = A*min(eps), {DEFINED_A}", ("two or more",)),
    "calling a variable": (f"s = A*eps(3), {DEFINED_A}", ("unknown function 'eps'",)),
    "keyword argument": (f"s = A*sin(x=3), {DEFINED_A}", ("character 8", "'='")),
    "no unit": ("s = A*eps, A = 1 (0..2)", ("no force", "plain numbers", "A = 1 N")),
    "wrong dimension": ("s = A*eps, A = 1 mm (0..2)", ("no force", "in m, not in N")),
    "sum of different units": (f"s = A + P, {DEFINED_A}", ("N and Pa", "'A + P'")),
    "max of different units": (f"s = A*max(x, v), {DEFINED_A}", ("m and m/s", "'max(x, v)'")),
    "sine of a length": (f"s = A*sin(x), {DEFINED_A}", ("plain number is needed", "in m", "'sin(x)'")),
    "power with a unit": (f"s = A*2**x, {DEFINED_A}", ("plain number is needed", "'x'")),
    "free power of a unit": (f"s = A*x**eps, {DEFINED_A}", ("plain number is needed", "'x'")),
    "unknown unit": ("s = A, A = 1 Nn (0..2)", ("'Nn' is not a unit",)),
    "case of a unit": ("s = A, A = 1 n (0..2)", ("s: A: ",)),
    "kelvin": ("s = A, A = 1 K (0..2)", ("no place in mechanics",)),
    "hostile unit": ("s = A, A = 1 10**10**10 (0..2)", ("'10**10**10' is not a unit",)),
    "no number": ("s = A, A = N (0..2)", ("not a number",)),
    "not finite": ("s = A, A = 1e999 N (0..1e999)", ("too large",)),
    "outside": ("s = A, A = 3 N (0..2)", ("outside its range", "between 0 and 2")),
    "reversed": ("s = A, A = 1 N (2..0)", ("holds nothing",)),
    "empty range": ("s = A, A = 1 N (1..1)", ("holds nothing",)),
    "range with units": ("s = A, A = 1 N (0 N..2 N)", ("cannot be read", "A = 1 N (lower..upper)")),
    "range of one": ("s = A, A = 1 N (2)", ("cannot be read",)),
    "text behind the range": ("s = A, A = 1 N (0..2) m", ("cannot be read",)),
    "twice": (f"s = A, {DEFINED_A}, {DEFINED_A}", ("'A' is given twice",)),
    "unused": (f"s = A, {DEFINED_A}, B = 2 N (0..3)", ("'B' does not stand in the formula",)),
    "parameter is a variable": ("s = P, P = 1 N (0..2)", ("gauge pressure", "P_1")),
    "parameter is a function": ("s = exp, exp = 1 N (0..2)", ("means something already",)),
    "parameter is a key": ("s = define, define = 1 N (0..2)", ("means something already",)),
    "parameter is reserved": ("s = lambda, lambda = 1 N (0..2)", ("cannot be called this",)),
    "parameter is private": ("s = __x, __x = 1 N (0..2)", ("cannot be called this",)),
    "unicode parameter": ("s = μ, μ = 1 N (0..2)", ("cannot be called this", "'μ'")),
    "unicode sign": (f"s = A·eps, {DEFINED_A}", ("character 2", "'·'")),
    "missing sign": (f"s = 2eps*A, {DEFINED_A}", ("'2e'", "2*x")),
    "open bracket": (f"s = A*(eps, {DEFINED_A}", ("not closed",)),
    "closed bracket": (f"s = A*eps), {DEFINED_A}", ("not open",)),
    "two signs": (f"s = A*/eps, {DEFINED_A}", ("cannot be read at its character 3",)),
    "empty value": (f"s = A,, {DEFINED_A}", ("'' is not a value",)),
    "attribute": (f"s = A.real, {DEFINED_A}", ("cannot stand", "'A.real'")),
    "condition": (f"s = A if eps else 1, {DEFINED_A}", ("cannot stand",)),
    "boolean": (f"s = A*True, {DEFINED_A}", ("cannot stand", "'True'")),
    "modulo": (f"s = A%2, {DEFINED_A}", ("cannot stand", "'%'")),
    "floor division": (f"s = A//2, {DEFINED_A}", ("cannot stand", "'A//2'")),
    "import": ("s = __import__('os')", ("cannot stand",)),
    "lambda": (f"s = (lambda eps)(A), {DEFINED_A}", ("cannot be read",)),
    "huge power": (f"s = A*eps**99, {DEFINED_A}", ("power is too high", "20 at most")),
    "tower of powers": (f"s = A*9**9**9, {DEFINED_A}", ("no finite number",)),
    "huge number": (f"s = A*1e999, {DEFINED_A}", ("number is too large",)),
    "long number": (f"s = A*{'9' * 390}, {DEFINED_A}", ("number is too large",)),
    "deep brackets": (f"s = {'(' * 40}A{')' * 40}, {DEFINED_A}", ("30 deep",)),
    "deep signs": (f"s = {'-' * 300}A, {DEFINED_A}", ("30 operations deep",)),
    "long formula": (f"s = A{'*eps' * 150}, {DEFINED_A}", ("characters", "400 are allowed")),
    "long line": ("s = " + "x" * 5000, ("characters", "1000 are allowed")),
    "many values": ("s = A, " + ", ".join(f"a{i} = 1 (0..2)" for i in range(20)), ("20 values",)),
    "always zero": (f"s = A*0, {DEFINED_A}", ("zero everywhere",)),
    "zero to begin with": ("s = A, A = 0 N (-2..2)", ("zero everywhere", "typical values")),
    "never finite": (f"s = A/0, {DEFINED_A}", ("no finite number",)),
    "log of a negative": (f"s = A*log(-1 - eps**2), {DEFINED_A}", ("no finite number",)),
    "two lines": (f"s = A\n+ ;import os, {DEFINED_A}", ("cannot stand",)),
    "null": ("s = A\x00, " + DEFINED_A, ("cannot stand",)),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_an_effect_is_refused_with_place_and_cure(case):
    line, said = REFUSED[case]
    with pytest.raises(InputError) as caught:
        library(define=[line])
    message = str(caught.value)
    assert all(part in message for part in said), message
    assert message.startswith("--define")
    assert caught.value.cure


def test_two_lines_of_one_name_are_refused():
    with pytest.raises(InputError, match="'s' is defined already"):
        library(define=["s = A, A = 1 N (0..2)", "s = A, A = 1 N (0..3)"])
    assert "s" in library(define=["s = A, A = 1 N (0..2)"] * 2)


# ------------------------------------------------------------------------------------------------------------- any text


def tries(count):
    return settings(max_examples=count, deadline=None, suppress_health_check=list(HealthCheck), derandomize=True)


WORDS = [*VARIABLES, "A", "p", "q", "pi", "sin", "sqrt", "abs", "min", "max", "sign", "lambda", "os", "1", "0", "2.5",
         "1e9", "1e999", ".5", "+", "-", "*", "/", "**", "^", "(", ")", ",", "..", "=", " ", ".", "[", "]", "%", "N",
         "mm", "Pa/s", "'", '"', "µ", "\n", "_", "if", "not", "A = 1 N (0..2)", "p = 2 mm (1..5)"]  # fmt: skip


def refused_or_sound(line):
    """Either one clear message, or an effect with finite declarations."""
    refused, kind = None, None
    try:
        kind = effect_from_line(line)
    except InputError as error:
        refused = error
    if kind is None:
        assert refused.problem
        assert refused.cure
    else:
        assert all(np.isfinite([p.lower, p.default, p.upper]).all() for p in parameters(kind))


@tries(4000)
@given(st.lists(st.sampled_from(WORDS), max_size=25).map("".join))
def test_words_in_any_order_never_end_in_a_traceback(text):
    refused_or_sound(f"s = {text}, A = 1 N (0..2), p = 2 mm (1..5)")


@tries(3000)
@given(st.text(max_size=60))
def test_any_text_never_ends_in_a_traceback(text):
    refused_or_sound(text)


@tries(3000)
@given(
    st.sampled_from(LINES),
    st.lists(st.tuples(st.integers(0, 99), st.integers(0, 4), st.sampled_from(string.printable)), max_size=4),
)
def test_damaged_lines_never_end_in_a_traceback(line, wounds):
    for place, gone, added in wounds:
        at = place % len(line)
        line = line[:at] + added + line[at + gone :]
    refused_or_sound(line)


def formulas():
    """Formulas that are plain numbers, of any shape."""
    leaves = st.sampled_from(["eps", "x/p", "v/u", "P/Q", "alpha", "2", "0.5", "A/B"])
    two = lambda inner: st.tuples(inner, st.sampled_from("+-*/"), inner).map(lambda t: f"({t[0]} {t[1]} {t[2]})")  # noqa: E731
    one = lambda inner: st.tuples(st.sampled_from(["sin", "tanh", "abs", "exp", "sqrt"]), inner).map(  # noqa: E731
        lambda t: f"{t[0]}({t[1]})"
    )
    return st.recursive(leaves, lambda inner: two(inner) | one(inner), max_leaves=8)


@tries(1500)
@given(formulas())
def test_sound_formulas_are_read_and_are_what_python_makes_of_them(formula):
    """The one place where a formula is evaluated as Python: the test's own, as a second opinion."""
    names = {
        "p": 0.01,
        "u": 0.02,
        "Q": 3e5,
        "A": 2.0,
        "B": 3.0,
        "x": 0.05,
        "eps": 0.17,
        "v": 0.01,
        "P": 2e5,
        "alpha": 0.5,
    }
    read = define_expression.read_expression(formula, tuple(names))
    with np.errstate(all="ignore"):
        found = read.value({name: np.asarray(value) for name, value in names.items()}, np)
        known = {"sin": np.sin, "tanh": np.tanh, "abs": np.abs, "exp": np.exp}
        try:
            expected = eval(formula, {}, {**names, **known, "sqrt": lambda x: np.sqrt(max(x, 0.0))})
        except ZeroDivisionError:
            return
    if np.isfinite(expected):
        np.testing.assert_allclose(found, expected, rtol=1e-12)


# ------------------------------------------------------------------------------------------------ in a study, in a file


@pytest.fixture(scope="module")
def study(tmp_path_factory) -> Path:
    """Loops with a ripple of 8 N every 12 mm."""
    return write(tmp_path_factory.mktemp("screw"), loops(lambda eps, *_: 8 * np.sin(2 * np.pi * eps * 250 / 12)))


def asked(folder, **more):
    names = ("ideal_cylinder", "coulomb_friction", "screw")
    return Request(data=(str(folder),), starts=4, define=(EXAMPLE,), effects=names, **more)


def test_a_defined_effect_is_fitted_saved_and_read_back_without_its_line(study):
    task = task_of(asked(study))
    fit = fit_task(task)
    np.testing.assert_allclose([-fit.values["screw.A"], fit.values["screw.p"]], [8, 0.012], rtol=0.02)
    assert write_model(study / "model.toml", fit, task.experiments) is None
    assert f'define = "{EXAMPLE}"' in (study / "model.toml").read_text()
    again = task_of(Request(data=(str(study),)))
    assert type(again.effects[1]) is effect_from_line(EXAMPLE)
    assert again.library["screw"] is effect_from_line(EXAMPLE)
    assert again.known["screw.p"] == pytest.approx(fit.values["screw.p"])


@pytest.mark.parametrize(
    ("entry", "said"),
    [
        ('name = "screw"', ("unknown effect 'screw'", "--define")),
        ('name = "screw"\ndefine = "other = A, A = 1 N (0..2)"', ("row 3", "does not define 'screw'")),
        ('name = "screw"\ndefine = 3', ("row 3", "does not define 'screw'")),
        ('name = "tip"\ndefine = "tip = A, A = 1 N (0..2)"', ("row 3", "'tip' is taken")),
        ('name = "screw"\ndefine = "screw = A*q, A = 1 N (0..2)"', ("row 3", "unknown name 'q'")),
        ('name = "screw"\ndefine = "screw = A, A = 1 N (0..2)"\nA = "3 N"', ("row 4", "outside its range")),
    ],
)
def test_a_model_file_with_a_bad_definition_is_refused_with_its_row(tmp_path, entry, said):
    path = tmp_path / "model.toml"
    path.write_text(f"[[effect]]\n{entry}\n")
    with pytest.raises(InputError) as caught:
        read_model(path, library())
    message = str(caught.value)
    assert all(part in message for part in ("model.toml", *said)), message
    assert caught.value.cure


def test_a_model_file_and_the_command_line_must_not_define_one_name_twice(tmp_path):
    path = tmp_path / "model.toml"
    path.write_text('[[effect]]\nname = "s"\ndefine = "s = A, A = 1 N (0..2)"\n')
    assert name_of(read_model(path, library(define=["s = A, A = 1 N (0..2)"])).effects[0]) == "s"
    with pytest.raises(InputError, match="defined already"):
        read_model(path, library(define=["s = A, A = 1 N (0..3)"]))
