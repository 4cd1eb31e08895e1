"""Units: what people write becomes SI, what they mistype is refused with a cure."""

import math

import pytest

from fitting import showing, units
from fitting.errors import InputError

pytestmark = pytest.mark.filterwarnings("error")


@pytest.mark.parametrize(
    ("text", "si", "value"),
    [
        ("300 mm", "m", 0.3),
        ("300mm", "m", 0.3),
        ("20 deg", "rad", math.radians(20)),
        ("20 °", "rad", math.radians(20)),
        ("0.54 MPa", "Pa", 0.54e6),
        ("5 bar", "Pa", 5e5),
        ("2 kgf", "N", 19.6133),
        ("100 N/mm", "N/m", 1e5),
        ("1.5 N s/m", "N*s/m", 1.5),
        ("12 %", "1", 0.12),
        ("1.12", "1", 1.12),
        (1.5, "1", 1.5),
        ("0.8e-9 1/Pa", "1/Pa", 0.8e-9),
        ("-3e1 ms", "s", -0.03),
    ],
)
def test_values_become_si(text, si, value):
    assert units.to_si(text, si) == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize("text", ["7.0 +/- 0.1 mm", "7.0 mm +/- 100 um", "7 mm ± 0.01 cm", "7.0+-0.1 mm"])
def test_uncertain_values(text):
    assert units.measured(text, "m") == pytest.approx((7e-3, 1e-4))


def test_an_exact_value_has_no_error():
    assert units.measured("7.0 mm", "m") == (7e-3, None)


@pytest.mark.parametrize(
    ("text", "si", "said"),
    [
        ("300", "m", ("radius has no unit", "'300'", 'as in "300 mm"')),
        (300, "m", ("radius has no unit", "'300'")),
        (True, "m", ("not a value with a unit", "'True'")),
        ("300 mm", "rad", ("'mm' cannot be the unit of an angle", "20 deg")),
        ("20 %", "rad", ("cannot be the unit of an angle",)),
        ("20 deg", "1", ("cannot be the unit of a plain number",)),
        ("3 mpa", "Pa", ("'mpa' is not a unit", "did you mean 'MPa'?")),
        ("3 furlongz", "m", ("'furlongz' is not a unit", "mm, deg, kPa")),
        ("seven mm", "m", ("not a number with a unit", "'seven mm'")),
        ("1e999 mm", "m", ("not finite",)),
        ("7 +/- 0 mm", "m", ("uncertainty of radius is not positive", "exact value")),
        ("7 +/- -1 mm", "m", ("not positive",)),
        ("7 +/- 1 +/- 1 mm", "m", ("more than one '+/-'",)),
        ("1 __import__('os')", "m", ("is not a unit",)),
    ],
)
def test_what_cannot_be_read_is_refused_with_a_cure(text, si, said):
    with pytest.raises(InputError) as caught:
        units.measured(text, si, "radius")
    message = str(caught.value)
    assert all(part in message for part in said), message
    assert caught.value.cure


def test_a_hung_mass_is_weighed():
    assert units.load_factor("kg") == 9.80665
    assert units.load_factor("g") == pytest.approx(9.80665e-3)
    assert units.load_factor("kN") == pytest.approx(1000)
    with pytest.raises(InputError, match="cannot be the unit of a force"):
        units.load_factor("mm")


@pytest.mark.parametrize(
    ("value", "si", "error", "shown"),
    [
        (0.00702, "m", 0.00002, "7.020 +/- 0.020 mm"),
        (math.radians(20.125), "rad", math.radians(0.31), "20.12 +/- 0.31 deg"),
        (5.4e5, "Pa", None, "540 kPa"),
        (1.37e6, "Pa", None, "1.37 MPa"),
        (123.4567, "N", 12.0, "123 +/- 12 N"),
        (0.0123, "s", None, "12.3 ms"),
        (1.12, "1", 0.01, "1.120 +/- 0.010"),
        (3.0, "N*s/m", None, "3 N*s/m"),
    ],
)
def test_values_are_shown_in_engineering_units(value, si, error, shown):
    assert showing.show(value, si, error) == shown


def test_a_unit_can_be_imposed():
    assert showing.show(2.5e5, "Pa", unit="bar") == "2.5 bar"


@pytest.mark.parametrize("si", ["m", "rad", "Pa", "N", "kg", "s", "1", "N/m", "N*s/m", "m/s", "1/s"])
@pytest.mark.parametrize("value", [1 / 3, 12345.678, -2e-4])
def test_what_is_written_reads_back(value, si):
    assert units.to_si(showing.write(value, si), si) == pytest.approx(value, rel=1e-9)


@pytest.mark.parametrize("si", ["m", "rad", "Pa", "N", "1", "N/m"])
def test_what_is_shown_with_an_error_reads_back(si):
    value, error = units.measured(showing.show(0.5, si, 0.01), si)
    assert value == pytest.approx(0.5, abs=0.005)
    assert error == pytest.approx(0.01, rel=0.05)


@pytest.mark.parametrize(("written", "meant"), [
    ("Newton", "N"), ("Newtons", "N"), ("Millimeter", "mm"), ("KPA", "kPa"), ("Bar", "bar"), ("PSI", "psi"),
])  # fmt: skip
def test_names_of_units_are_known_in_capitals(written, meant):
    assert units.factor(written, meant) == 1.0


@pytest.mark.parametrize("written", ["barg", "bar(g)", "bar (g)", "bar (gauge)", "bar(rel)"])
def test_what_a_gauge_reads_is_a_pressure(written):
    assert units.factor(written, "Pa") == units.factor("bar", "Pa")


@pytest.mark.parametrize("written", ["bara", "bar(a)", "bar (abs)", "BAR(A)"])
def test_absolute_pressure_is_said_elsewhere(written):
    with pytest.raises(InputError, match="write 'bar', and for a column of absolute readings pressure = \"absolute\""):
        units.factor(written, "Pa")


def test_a_decimal_comma_is_told_to_be_a_point():
    with pytest.raises(InputError, match="point"):
        units.to_si("6,95 mm", "m", "radius")


@pytest.mark.parametrize(("written", "meant"), [("psii", "psi"), ("inhc", "inch"), ("MPA", "MPa")])
def test_a_misspelt_unit_gets_the_nearest(written, meant):
    with pytest.raises(InputError) as told:
        units.factor(written, "m")
    assert f"did you mean '{meant}'?" in str(told.value)


@pytest.mark.parametrize(
    ("stated", "own"),
    [
        ([{"Pa": "psig", "N": "lbf", "m": "in"}, {"Pa": "psi"}], {"Pa": "psi", "N": "lbf", "m": "in"}),
        ([{"Pa": "kPa", "N": "kN", "m": "cm"}], {}),
        ([{"Pa": "MPa"}], {"Pa": "MPa"}),
        ([{"Pa": "psi"}, {"Pa": "bar"}], {}),
    ],
)
def test_units_that_are_not_the_usual_ones_are_kept(stated, own):
    assert showing.own_units(stated) == own


def test_values_are_shown_in_own_units_and_written_in_the_usual_ones():
    with showing.spoken({"Pa": "bar", "N": "lbf"}):
        values = ((3e5, "Pa"), (3e9, "Pa"), (2.0, "N"), (1600, "N/m"), (0.1, "1"))
        shown = [showing.show(value, si) for value, si in values]
        assert showing.write(3e5, "Pa") == "300 kPa"
    assert shown == ["3 bar", "3 GPa", "0.4496 lbf", "359.7 lbf/m", "0.1"]
    assert showing.show(3e5, "Pa") == "300 kPa"


@pytest.mark.parametrize(("count", "said"), [(0, "0 runs"), (1, "1 run"), (2, "2 runs"), (8710, "8,710 runs")])
def test_one_thing_is_said_in_the_singular(count, said):
    assert showing.counted(count, "run") == said
