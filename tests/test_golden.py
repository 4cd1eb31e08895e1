"""Every value computed once and for all from the review's equations and their corrections."""

import json
from pathlib import Path

import pytest
from golden import QUANTITIES, evaluate

ENTRIES = json.loads((Path(__file__).parent / "golden.json").read_text())["entries"]


@pytest.mark.parametrize("entry", ENTRIES, ids=lambda entry: f"{entry['id']}-{entry['quantity']}")
def test_golden_value(entry):
    value = evaluate(entry["quantity"], **entry["inputs"])
    assert abs(value - entry["value"]) <= entry.get("atol", 0.0) + entry["rtol"] * abs(entry["value"]), value


def test_every_quantity_is_reached_and_no_other():
    assert {entry["quantity"] for entry in ENTRIES} == set(QUANTITIES)
