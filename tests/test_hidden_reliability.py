"""How often the truth stands, of records made up for the purpose; and one recording of the study itself."""

from collections import Counter

from hidden.study.reliability import STATED, answer, curves, observed, page, plan


def told(p, protocol="rich", instruments="exact", hidden=()):
    """A record of this study."""
    return {"p": p, "protocol": protocol, "instruments": instruments, "hidden": list(hidden)}


def test_every_recording_has_noise_of_its_own_and_one_in_six_hides_nothing():
    cases = list(plan(12, 1))
    seeds = Counter(str(case.recording_seed()) for case in cases)
    assert len(cases) == 4 * 3 * 12
    assert max(seeds.values()) == 1
    assert sum(not case.hidden for case in cases) == len(cases) / 6


def test_the_truth_stands_where_its_p_value_reaches_what_is_left_of_the_chance():
    evenly = [told((i + 0.5) / 100) for i in range(100)]
    assert [observed(evenly, chance) for chance in (0.5, 0.9)] == ["50%", "90%"]
    assert observed([told(0.0), *evenly[:40]], 0.8) == "49%, too few"
    assert observed([told(0.1)], 0.9) == "100%"


def test_each_protocol_and_each_kind_have_a_row():
    done = [told(0.3), told(0.3, instruments="laboratory"), told(1.0, "poor", "laboratory", ["tip"])]
    rows = {row[0]: row[1:] for row in curves(done)}
    assert rows["all"][0] == "3"
    assert rows["rich"] == ("2", *("0%" if chance < 0.7 else "100%" for chance in STATED))
    assert rows["poor, laboratory"][1] == "100%"
    assert "3 recordings, in 1 of which one effect is hidden. In 0 others" in page(done, "command", "")


def test_the_model_that_made_a_recording_stands():
    """Conical ends of three times the noise: without them the baseline would be rejected."""
    case = next(case for case in plan(12, 1) if case.hidden == ("conical_ends",))
    found = answer(case, {}, False)
    assert not found["rejected"]
    assert found["level"] <= found["p"] <= 1.0
