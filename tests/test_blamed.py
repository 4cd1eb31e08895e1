"""What a set of effects asks of the instruments that it blames, and when that is too much to be believed."""

from types import SimpleNamespace

import numpy as np
import pytest

from fitting.diagnosis.blamed import blamed, unbelieved
from fitting.diagnosis.outcomes import Reason, Why
from fitting.diagnosis.settings import VERDICT
from fitting.instruments.sources import ErrorKind, Source
from fitting.recordings.accuracy import Channel
from fitting.report.text.reasons import why_text
from mckibben_jax.effect import name_of
from mckibben_jax.effects import LIBRARY
from mckibben_jax.parameter import parameters

KINDS = {name_of(kind): kind for kind in LIBRARY}
VALUES = {"tip.k": 1.1, "force_offset.F_off": -150.0, "force_gain.g": -0.02, "pressure_offset.P_off": 900.0,
          "pressure_gain.g": 0.2, "contraction_offset.eps_off": 0.01, "time_delay.tau": 0.03}  # fmt: skip


def world(**changed):
    """One muscle of 300 mm; full scale is 1,000 N, the last reading a position."""
    values = VALUES | {name.replace("__", "."): value for name, value in changed.items()}
    of_effect = lambda effect: tuple(name for name in values if name.startswith(f"{effect}."))  # noqa: E731
    made = SimpleNamespace(
        effects=KINDS,
        layout=SimpleNamespace(names=tuple(values), of_effect=of_effect),
        lengths=np.array([0.3]),
        samples=SimpleNamespace(measured=np.array([0.0, 400.0, -1000.0, 5000.0])),
        in_newtons=np.arange(4) < 3,
    )
    return made, SimpleNamespace(vector=np.array(list(values.values())))


@pytest.mark.parametrize(
    ("effect", "channel", "kind", "size", "share"),
    [
        ("force_offset", Channel.FORCE, ErrorKind.ZERO, 150.0, 0.15),
        ("force_gain", Channel.FORCE, ErrorKind.GAIN, 0.02, 0.02),
        ("pressure_offset", Channel.PRESSURE, ErrorKind.ZERO, 900.0, None),
        ("pressure_gain", Channel.PRESSURE, ErrorKind.GAIN, 0.2, 0.2),
        ("contraction_offset", Channel.POSITION, ErrorKind.ZERO, 0.003, None),
        ("time_delay", Channel.TIME, ErrorKind.SKEW, 0.03, None),
    ],
)
def test_an_effect_that_is_an_error_of_an_instrument_says_of_which_and_how_large(effect, channel, kind, size, share):
    (found,) = blamed(world()[0], frozenset(["tip", effect]), world()[1])
    assert (found.effect, found.source.channel, found.source.kind) == (effect, channel, kind)
    assert found.size == pytest.approx(size)
    assert found.share == (share if share is None else pytest.approx(share))
    assert found.source.allowed == 0


def test_what_is_allowed_is_the_larger_of_what_all_runs_share_and_what_each_has():
    sources = [Source(Channel.FORCE, kind, allowed, 1.0) for kind, allowed in
               ((ErrorKind.ZERO, 0.5), (ErrorKind.ZERO_PER_RUN, 0.6), (ErrorKind.DRIFT, 7.0))]  # fmt: skip
    sources.append(Source(Channel.PRESSURE, ErrorKind.ZERO, 500.0, 1.0))
    given, fit = world()
    (found,) = blamed(given, frozenset(["force_offset"]), fit, sources)
    assert found.source.allowed == 0.6
    assert not found.source.presumed
    sources[1] = Source(Channel.FORCE, ErrorKind.ZERO_PER_RUN, 0.6, 1.0, presumed=True)
    (found,) = blamed(given, frozenset(["force_offset"]), fit, sources)
    assert found.source.presumed


def test_every_error_of_a_gauge_in_the_library_has_one_number_and_a_channel_that_can_be_stated():
    misreading = [kind for kind in LIBRARY if kind.misreads]
    assert {name_of(kind) for kind in misreading} == {name.split(".")[0] for name in VALUES} - {"tip"}
    for kind in misreading:
        assert Channel(kind.misreads[0])
        assert ErrorKind(kind.misreads[1])
        assert len(parameters(kind)) == 1


def test_beside_other_effects_no_load_cell_is_believed_to_be_off_by_a_tenth_of_full_scale():
    """Alone it may read anything: nobody has zeroed it."""

    def doubted(added, **changed):
        given, fit = world(**changed)
        return unbelieved(given, frozenset(added), fit, VERDICT.most_blamed)

    assert doubted(["tip", "force_offset"]) == ("force_offset",)
    assert doubted(["tip", "force_offset"], force_offset__F_off=-99.0) == ()
    assert doubted(["force_offset"]) == ()
    assert doubted(["tip", "pressure_gain"]) == ("pressure_gain",)
    assert doubted(["contraction_offset", "force_gain", "pressure_offset", "time_delay"]) == ()
    assert "off by more than a tenth of full scale" in why_text(Why(Reason.UNBELIEVED, ("force_offset",)))
