"""What a posterior says of many recordings: what is alike is said once."""

from types import SimpleNamespace

import pytest

from fitting.instruments.sources import ErrorKind, Source
from fitting.posterior.noise import RecordingNoise
from fitting.posterior.record import inside_text
from fitting.posterior.warnings import find_warnings, notes
from fitting.recordings.accuracy import Channel

WHITE, REMEMBERED = RecordingNoise(("size",), (1.0,)), RecordingNoise(("size", "remembered", "memory"), (1.0, 0.4, 7.0))


def noise_notes(*noises: RecordingNoise) -> list[str]:
    """The notes on the noise of recordings a.csv, b.csv and so on."""
    labels = [f"{letter}.csv" for letter, _ in zip("abcdefg", noises, strict=False)]
    target = SimpleNamespace(instruments=None)
    setup = SimpleNamespace(labels=labels, noise=noises, target=target, samples=[], integration="", idle=())
    said = notes(SimpleNamespace(samples=[], held=()), setup, (), SimpleNamespace(), 20)
    return [note for note in said if note.startswith("noise of")]


def test_noise_that_is_alike_is_said_once():
    white = "white (the residual shows nothing else)"
    assert noise_notes(WHITE) == [f"noise of a.csv: {white}"]
    assert noise_notes(WHITE, WHITE, WHITE) == [f"noise of every recording: {white}"]
    some = noise_notes(WHITE, REMEMBERED, WHITE, WHITE)
    assert some[0] == f"noise of a.csv, c.csv and d.csv: {white}"
    assert some[1].startswith("noise of b.csv: 40 % fades over 7 readings")


@pytest.mark.parametrize(
    ("channel", "times", "said"),
    [
        (Channel.FORCE, 8.2, ["these values need the load cell to err by 8 times what is allowed"]),
        (None, 16.0, ["these values need friction to differ from run to run by 16 times what is allowed"]),
        (Channel.FORCE, 3.0, []),
    ],
)
def test_what_no_instrument_can_have_done_is_a_warning(channel, times, said):
    """However good the chains are."""
    setup = SimpleNamespace(labels=(), noise=(), stated=(), priors={})
    fitted = SimpleNamespace(converged=True, free=())
    source = Source(channel, ErrorKind.GAIN_PER_RUN, 0.01, 0.01)
    found = find_warnings(fitted, {}, setup, None, (source, times))
    assert [warning.partition(":")[0] for warning in found] == said


@pytest.mark.parametrize(
    ("shares", "said"),
    [
        ({"a.csv": [0.9]}, "90 % of a.csv"),
        ({"a.csv": [0.9, 0.8], "b.csv": [0.7]}, "85 % of a.csv (80 to 90 % by run); 70 % of b.csv"),
        ({name: [0.8 + 0.05 * i] for i, name in enumerate("abcd")}, "88 % of the readings (80 to 95 % by file)"),
    ],
)
def test_how_much_the_band_holds_is_said_in_one_line(shares, said):
    bands = [SimpleNamespace(file=file, inside=each) for file, runs in shares.items() for each in runs]
    assert inside_text(SimpleNamespace(bands=bands)) == said
