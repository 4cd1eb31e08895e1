"""What a design file orders of a sweep, and what is said where it is wrong."""

import pytest
from sweeping import BEST, FILE, GRID, SAMPLE, order

from fitting.designs.sweep_file import read_sweep
from fitting.errors import InputError


def test_words_of_a_sweep_may_stand_below_its_heading(tmp_path):
    text = FILE + '[sample]\nn = 100\noutputs = ["work"]\nkeep = "all"\n'
    (tmp_path / "design.toml").write_text(text)
    found = read_sweep(tmp_path / "design.toml")
    assert found.everything
    assert found.batch.columns == ("work_J",)
    assert found.batch.outputs == (("work", {"pressure": 5e5}),)


def test_one_quantity_at_several_places(tmp_path):
    listed = 'outputs = ["work", { quantity = "force", at = { contraction = 0, pressure = "5 bar" } }, "force"]'
    found = order(tmp_path, **{'outputs = ["force", "stroke", "work"]': listed}).batch
    assert found.columns == ("work_J", "force_N", "force_N_at_0.1_500000Pa")
    assert found.outputs[1][1] == {"contraction": 0.0, "pressure": 5e5}


REFUSED = {
    "neither": (SAMPLE, "", "neither [grid] nor [sample]"),
    "both": (SAMPLE, SAMPLE + GRID, "both [grid] and [sample]"),
    "no count": ("n = 5000", "seed = 1", "how many"),
    "half a design": ("n = 5000", "n = 0.5", "whole number"),
    "unknown output": ('"stroke", "work"]', '"strike"]', "did you mean 'stroke'"),
    "unknown keep": (BEST, '"some"', "what to keep"),
    "unknown by": ('by = "work"', 'by = "wrok"', "did you mean 'work'"),
    "no place": ('"stroke", "work"]', '"hysteresis_loss", "outer_radius"]', None),
    "axis": (SAMPLE, '[grid]\nradius = ["4 mm", "5 mm"]\n', "not from, to and n"),
    "falling axis": (SAMPLE, '[grid]\nradius = { from = "5 mm", to = "4 mm", n = 3 }\n', "does not rise"),
    "rings": (SAMPLE, '[grid]\nbraid_angle = { from = "20 deg", to = "95 deg", n = 3 }\n', "below 90 deg"),
    "histogram": (SAMPLE, SAMPLE + 'histogram = { of = "outer_radius" }\n', "no output"),
    "need": ('"stroke", "work"]', '"burst_pressure"]', "needs breaking_stress"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_a_wrong_file_is_refused_with_a_cure(tmp_path, case):
    old, new, message = REFUSED[case]
    if message is None:  # conditions that the objective gives are taken over
        assert order(tmp_path, **{old: new}).batch.outputs[-2][1] == {"contraction": 0.1}
        return
    with pytest.raises(InputError) as error:
        order(tmp_path, **{old: new})
    assert message in str(error.value)
    assert "Cure:" in str(error.value)
