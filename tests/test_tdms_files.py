"""Recordings in TDMS files of LabVIEW: channels with their units and times, the same checks as of a CSV."""

import io
import sys
from functools import partial

import numpy as np
import pytest
from folders import folder_of, loop_csv, only_run
from other_files import full_columns, read_as, refused_as, vectors

from fitting.errors import InputError
from fitting.recordings.tables import read_heads, read_table
from fitting.recordings.template import write_muscle_file

nptdms = pytest.importorskip("nptdms", reason="npTDMS is not installed: pip install 'mckibben-jax[tdms]'")
pytestmark = pytest.mark.filterwarnings("error")
read, refused = partial(read_as, "loops.tdms"), partial(refused_as, "loops.tdms")


def tdms(groups):
    """The bytes of a file: by group, channels by name with their readings, and the properties of each."""
    out = io.BytesIO()
    with nptdms.TdmsWriter(out) as writer:
        for group, channels in groups.items():
            for name, (values, properties) in channels.items():
                writer.write_segment([nptdms.ChannelObject(group, name, np.asarray(values), properties)])
    return out.getvalue()


def with_units(step=None):
    """The loop as a group, with units where LabVIEW keeps them; with `step` (s) as waveforms, without times."""
    wave = {} if step is None else {"wf_increment": step, "wf_start_offset": 0.0}
    found = {}
    for head, values in full_columns().items():
        name, unit = head.removesuffix("]").split(" [")
        found[name] = values, {"unit_string": unit, **wave}
    if step is not None:
        del found["time"]
    return found


def expected(tmp_path):
    (tmp_path / "csv").mkdir()
    return only_run(folder_of(tmp_path / "csv", loop_csv()))[1]


def test_a_group_is_read_as_the_same_csv(tmp_path):
    (run,) = read(tmp_path, tdms({"Monday": with_units()}), "").recordings[0].runs
    true = expected(tmp_path)
    for name in ("time", "pressure", "contraction", "measured", "weight", "branch"):
        np.testing.assert_array_equal(getattr(run, name), getattr(true, name))


def test_a_waveform_brings_its_times_along(tmp_path):
    step = float(np.diff(vectors()["time"][:2])[0])
    (run,) = read(tmp_path, tdms({"Monday": with_units(step)}), "").recordings[0].runs
    np.testing.assert_allclose(run.time, expected(tmp_path).time, atol=1e-9)


def test_the_units_of_labview_are_known(tmp_path):
    columns = with_units()
    columns["force"] = columns["force"][0], {"unit_string": "Newton"}
    (run,) = read(tmp_path, tdms({"Monday": columns}), "").recordings[0].runs
    np.testing.assert_array_equal(run.measured, expected(tmp_path).measured)


def test_a_channel_of_moments_counts_from_the_first_one(tmp_path):
    columns = with_units()
    seconds, _ = columns["time"]
    columns["time"] = np.datetime64("2026-11-25T10:00:00", "us") + (1e6 * seconds).astype("timedelta64[us]"), {}
    (run,) = read(tmp_path, tdms({"Monday": columns}), "").recordings[0].runs
    np.testing.assert_allclose(run.time, expected(tmp_path).time, atol=1e-6)


def test_of_several_groups_one_is_named(tmp_path):
    content = tdms({"slack": with_units(), "3 bar": with_units()})
    said = refused(tmp_path, content, "")
    assert "2 groups with readings: slack, 3 bar" in said
    assert 'add group = "slack"' in said
    assert "did you mean '3 bar'" in refused(tmp_path, content, 'group = "3bar"')
    assert len(read(tmp_path, content, 'group = "3 bar"').recordings[0].runs) == 1


def test_init_makes_a_recording_of_every_group(tmp_path):
    (tmp_path / "b.tdms").write_bytes(tdms({"slack": with_units(), "3 bar": with_units()}))
    written = write_muscle_file(tmp_path).read_text()
    assert 'group = "slack"' in written
    assert 'group = "3 bar"' in written
    assert read_heads(tmp_path / "b.tdms", {"group": "3 bar"})[0] == "time [s]"


@pytest.mark.parametrize(
    ("values", "reason"),
    [
        (np.zeros(7), "it has 7 readings, and 'time' has 202"),
        (["a"] * 202, "it holds no numbers"),
    ],
)
def test_why_a_channel_is_no_column_is_said_where_it_is_wanted(tmp_path, values, reason):
    columns = with_units() | {"force": (values, {})}
    assert reason in refused(tmp_path, tdms({"Monday": columns}), "")


def test_a_group_for_another_kind_of_file_is_refused(tmp_path):
    folder_of(tmp_path, loop_csv(), more='group = "Monday"')
    with pytest.raises(InputError, match="only a TDMS file has a group"):
        only_run(tmp_path)


def test_without_nptdms_the_message_says_what_to_install(tmp_path, monkeypatch):
    content = tdms({"Monday": with_units()})
    monkeypatch.setitem(sys.modules, "nptdms", None)
    assert "pip install 'mckibben-jax[tdms]'" in refused(tmp_path, content, "")


def test_a_file_that_says_it_holds_a_billion_readings_is_refused(tmp_path):
    """The count of a raw data index is written over; nothing of that size is ever kept in memory."""
    content = bytearray(tdms({"Monday": {"force": (np.arange(1000.0), {})}}))
    at = content.index((1000).to_bytes(8, "little"))
    content[at : at + 8] = (10**9).to_bytes(8, "little")
    refused(tmp_path, bytes(content), "")


def test_damaged_files_end_in_one_message(tmp_path, capfd):
    """Cut off, bytes changed: read or refused, never anything else."""
    content, scatter, path = tdms({"Monday": with_units()}), np.random.default_rng(0), tmp_path / "f.tdms"
    for turn in range(150):
        damaged = bytearray(content)
        for place in scatter.integers(len(damaged) if turn % 2 else 300, size=3):
            damaged[place] = int(scatter.integers(256))
        path.write_bytes(bytes(damaged[: int(scatter.integers(len(content)))] if turn % 5 == 0 else damaged))
        try:
            read_table(path)
        except InputError as error:
            assert error.cure  # noqa: PT017
    assert capfd.readouterr() == ("", "")
