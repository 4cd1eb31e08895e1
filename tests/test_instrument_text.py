"""What a user reads of instruments that may err, and of what would have been seen where nothing is missing."""

import dataclasses

import pytest
from studied import nothing_missing, seen_through

from fitting.diagnosis.findings import Blamed
from fitting.diagnosis.outcomes import Reason, Verdict, Why
from fitting.instruments.sources import ErrorKind, Source
from fitting.recordings.accuracy import Channel
from fitting.report.page.parts import as_text
from fitting.report.text.amounts import amount
from fitting.report.text.diagnosis import diagnosis_report
from fitting.report.text.instrument_answers import asked_texts, checklist, explaining_text, rival_texts
from fitting.report.text.limits import would_have_shown


def test_instruments_that_would_explain_it_stand_beside_the_effect_the_least_unlikely_first(diagnosis):
    told = seen_through(diagnosis, Verdict.MISSING)
    gain, ruler = rival_texts(told)
    assert gain == (
        "An instrument could also explain it only if the gain of the load cell differs by 1.8 % from run to run "
        "(known to 0.1 %)."
    )
    assert (
        ruler == "An instrument could also explain it only if the gain of the position reading is off by 4 % "
        "(taken as exact)."
    )
    words = " ".join(as_text(diagnosis_report(told)).split())
    assert words.index(f"OR {gain}") < words.index(ruler)
    assert "also" not in rival_texts(dataclasses.replace(told, explanations=()))[0]


def test_the_checklist_begins_with_what_would_explain_it_and_leaves_out_what_is_nothing(diagnosis):
    told = checklist(seen_through(diagnosis, Verdict.MISSING).instruments)
    assert told == [
        ("load cell", "gain, from run to run", "1.5 %", "0.1 %", "at 1.8 %"),
        ("position reading", "gain", "3 %", "taken as exact", "at 4 %"),
        ("pressure gauge", "zero", "0.45 kPa", "0.5 kPa", "no"),
    ]


def test_an_accuracy_that_nobody_stated_is_said_to_be_presumed(diagnosis):
    told = seen_through(diagnosis, Verdict.MISSING)
    guessed = [dataclasses.replace(a, source=dataclasses.replace(a.source, presumed=True)) for a in told.instruments]
    told = dataclasses.replace(told, instruments=tuple(guessed))
    gain, ruler = rival_texts(told)
    assert gain.endswith("(presumed to be known to 0.1 %).")
    assert ruler.endswith("(taken as exact).")
    assert [cells[3] for cells in checklist(told.instruments)] == [
        "0.1 %, presumed",
        "taken as exact",
        "0.5 kPa, presumed",
    ]


def test_what_instruments_explain_names_the_errors_at_work(diagnosis):
    within = nothing_missing(diagnosis, Verdict.WITHIN_INSTRUMENTS)
    said = explaining_text(within)
    assert said.startswith("Most likely, the zero of the pressure gauge is off by 0.45 kPa (known to 0.5 kPa).")
    assert said.endswith(
        "The readings ask for far more than the accuracy: the gain of the load cell differs by 1.5 % from run to run "
        "(known to 0.1 %). Check this first."
    )
    assert "position" not in said  # it has no accuracy to be within
    assert f"LIKELY {said}" in " ".join(as_text(diagnosis_report(within)).split())
    missing = dataclasses.replace(within, verdict=Verdict.MISSING, unexplained=within.beyond_noise)
    assert explaining_text(missing) == ""


def test_instruments_that_make_most_of_a_misfit_are_named_though_they_do_not_explain_all(diagnosis):
    """363 gf of loops were a delay of the load cell, of which no line said a word: 60 gf were called unexplained."""
    told = seen_through(diagnosis, Verdict.NOT_IN_LIBRARY)
    misfit = told.beyond_noise
    most = dataclasses.replace(told, unexplained=0.4 * misfit)
    assert explaining_text(most) == (
        f"Errors of the instruments can make all but {amount(0.4 * misfit, 'N', 2)} of the misfit of "
        f"{amount(misfit, 'N')}. Most likely, the zero of the pressure gauge is off by 0.45 kPa (known to 0.5 kPa)."
    )
    assert explaining_text(dataclasses.replace(told, unexplained=0.6 * misfit)) == ""
    assert explaining_text(dataclasses.replace(most, instruments=())) == ""
    assert explaining_text(dataclasses.replace(most, verdict=Verdict.NOTHING)) == ""


def test_nothing_detectable_says_what_would_have_been_seen_and_what_stays_open(diagnosis):
    words = " ".join(as_text(diagnosis_report(nothing_missing(diagnosis))).split())
    assert "from 0.2 N: end_stop from 0.31 N: viscous_damping" in words
    still_open = "OPEN Spring in parallel (linear_spring) below 6.1 N. "
    assert f"{still_open}Errors of the instruments within their accuracy could hide it." in words
    assert "NOT IT" not in words
    within = " ".join(as_text(diagnosis_report(nothing_missing(diagnosis, Verdict.WITHIN_INSTRUMENTS))).split())
    assert "OPEN Spring in parallel (linear_spring) below 6.1 N. " in within
    assert "could hide" not in within
    assert "LIMITS" not in as_text(diagnosis_report(diagnosis))


@pytest.mark.parametrize("many", [1, 5])
def test_the_verdict_names_a_few_effects_of_which_too_little_shows_and_open_names_all(diagnosis, many):
    d = nothing_missing(diagnosis, Verdict.INCONCLUSIVE)
    spring = d.effects["linear_spring"]
    faint = {f"effect_{k}": dataclasses.replace(spring, name=f"effect_{k}") for k in range(many)}
    why = Why(Reason.FAINT, tuple(faint))
    d = dataclasses.replace(d, why=why, faint=(), effects=d.effects | faint)
    words = " ".join(as_text(diagnosis_report(d)).split())
    assert ("effect_3 and 1 more." in words) == (many == 5)
    said = "effect_0 below 6.1 N" if many == 1 else "effect_0, effect_1, effect_2, effect_3, effect_4 each below 6.1 N"
    assert f"OPEN {said}" in words
    assert words.count("below 6.1 N") == 1


def test_an_error_of_the_same_kind_in_several_recordings_is_said_once(diagnosis):
    """Each recording has a zero of its own: three of them filled three lines."""
    within = seen_through(diagnosis, Verdict.WITHIN_INSTRUMENTS)
    again = tuple(dataclasses.replace(each, found=0.9 * each.found) for each in within.instruments)
    said = explaining_text(dataclasses.replace(within, instruments=(*within.instruments, *again)))
    assert "is off by 0.45 kPa (known to 0.5 kPa), and likewise in 1 recording more." in said
    assert "(known to 0.1 %), and likewise in 1 recording more. Check this first." in said


def test_limits_of_one_step_stand_together_under_the_largest(diagnosis):
    d = nothing_missing(diagnosis)
    near = dataclasses.replace(d.effects["viscous_damping"], name="near", detection_limit=0.43)
    shown = would_have_shown(dataclasses.replace(d, effects=d.effects | {"near": near}))
    assert shown == [("0.2 N", ["end_stop"]), ("0.43 N", ["viscous_damping", "near"])]


def blaming(d, channel, kind, size, allowed):
    """A diagnosis whose explanation stands for an error of an instrument."""
    among = tuple(sorted(d.explanations[0]))
    blamed = Blamed("force_gain", among, Source(channel, kind, allowed, allowed), size, None)
    return dataclasses.replace(d, blamed=(blamed,))


def test_who_blames_an_instrument_is_told_what_that_asks_of_it(diagnosis):
    load_cell = blaming(diagnosis, Channel.FORCE, ErrorKind.GAIN, 0.02, 0.001)
    assert asked_texts(load_cell) == [
        "This holds only if the gain of the load cell is off by 2 % (known to 0.1 %, 20 times as much is asked). "
        "Check this before you believe it."
    ]
    assert f"CHECK {asked_texts(load_cell)[0]}" in " ".join(as_text(diagnosis_report(load_cell)).split())
    ruler = blaming(diagnosis, Channel.POSITION, ErrorKind.ZERO, 0.003, 0.0)
    assert "the zero of the position reading is off by 3 mm (taken as exact)." in asked_texts(ruler)[0]
    two = dataclasses.replace(ruler, explanations=(*ruler.explanations, ("tip",)))
    assert asked_texts(two)[0].startswith("The likeliest of these holds only if")
    late = blaming(diagnosis, Channel.TIME, ErrorKind.SKEW, 0.02, 0.0)
    assert "only if force and the other channels are read 20 ms apart (taken as exact)" in asked_texts(late)[0]
    assert asked_texts(blaming(diagnosis, Channel.PRESSURE, ErrorKind.ZERO, 450.0, 500.0)) == []


@pytest.mark.parametrize(
    ("sets", "sizes", "told"),
    [
        ([("weight",), ("force_offset", "tip")], [105.0], ["⟦force_offset⟧ + ⟦tip⟧ holds only if {}105 N"]),
        (
            [("weight",), ("force_offset", "tip"), ("creep", "force_offset")],
            [105.0, 90.0],
            ["Every explanation with ⟦force_offset⟧ holds only if {}90 N"],
        ),
        (
            [("force_offset",), ("force_offset", "tip")],
            [30.0, 105.0],
            ["The likeliest of these holds only if {}30 N"],
        ),
        ([("weight",), ("force_offset", "tip")], [6.0], []),
    ],
)
def test_an_explanation_that_is_not_the_likeliest_says_what_it_asks_too(diagnosis, sets, sizes, told):
    zero = Source(Channel.FORCE, ErrorKind.ZERO, 6.4, 6.4)
    blaming = [names for names in sets if "force_offset" in names]
    asked = tuple(
        Blamed("force_offset", *(names, zero, size, None)) for names, size in zip(blaming, sizes, strict=True)
    )
    found = asked_texts(dataclasses.replace(diagnosis, explanations=tuple(sets), blamed=asked))
    assert len(found) == len(told)
    for text, words in zip(found, told, strict=True):
        assert text.startswith(words.format("the zero of the load cell is off by "))
