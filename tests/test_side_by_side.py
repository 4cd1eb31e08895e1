"""All models side by side: errors and parameters, as the fits have them."""

import re

import pytest
from studied import as_read, two_steps

from fitting import units
from fitting.report.page.page import page
from fitting.report.text.bounds import allowed_note
from fitting.report.text.side_by_side import MEASURED, side_by_side
from fitting.study.stages import Stage


@pytest.fixture(scope="module")
def stages(study, diagnosis):
    return two_steps(study[1], diagnosis)


def test_each_model_has_a_column_with_its_own_errors_and_parameters(stages):
    heads, rows = side_by_side(("one", "two"), stages)
    assert heads == ("", MEASURED, "one", "two")
    table = {row[0]: row[1:] for row in rows}
    for column, stage in enumerate(stages, 1):
        c = stage.comparison
        assert units.to_si(table["error, root mean square"][column], c.unit) == pytest.approx(c.rmse, rel=0.01)
        for name in c.fit.free:
            told = table[f"⟦{name}⟧"][column]
            if name in c.fit.at_bound:
                value, note = told.split(", ")
                assert units.to_si(value, c.fit.layout.entry(name).unit) == pytest.approx(c.fit.values[name], rel=0.01)
                assert note == allowed_note(c.fit, name)
                continue
            value, error = units.measured(told, c.fit.layout.entry(name).unit)
            assert value == pytest.approx(c.fit.values[name], abs=0.5 * c.fit.error(name))
            assert error == pytest.approx(c.fit.error(name), rel=0.06)


def test_what_was_not_tested_or_held_out_is_said(study):
    _, c = study
    bare = Stage("bare", c.rmse, None, comparison=c)
    _, rows = side_by_side(("bare",), [bare])
    table = {row[0]: row[1:] for row in rows}
    assert table["on held-out runs"] == ("", "-")
    assert table["p in the test that nothing is missing"] == ("", "not tested")
    assert all(len(row) == 3 for row in rows)


def test_the_page_has_it_where_there_are_several_models(study, diagnosis, stages):
    text = page(*study, diagnosis, stages)
    table = text.split("All models side by side</h2>")[1].split("</section>")[0]
    heads = [as_read(head) for head in re.findall(r"<th[^>]*>(.*?)</th>", table)]
    assert heads[0] == MEASURED
    assert len(heads) == 3
    assert "⟦" not in "".join(heads)
    assert "side by side" not in page(*study, diagnosis)
