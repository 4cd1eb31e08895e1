"""Recordings in ROS 2 bags (MCAP): topics on one set of rows, the same checks as of a CSV, and no ROS is needed."""

import io
import sys
from functools import partial

import numpy as np
import pytest
from folders import folder_of, loop_csv, only_run
from other_files import is_read_or_refused, read_as, refused_as, vectors

from fitting.errors import InputError
from fitting.recordings.tables import read_heads, read_table
from fitting.recordings.template import write_muscle_file

pytest.importorskip("mcap_ros2", reason="mcap-ros2-support is not installed: pip install 'mckibben-jax[ros]'")
pytestmark = pytest.mark.filterwarnings("error")

HEADER = """================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""
STATE = "std_msgs/Header header\nfloat64 pressure\nfloat64 contraction\nfloat64 force\nstring note\n" + HEADER
STAMPED = "std_msgs/Header header\nfloat64 data\n" + HEADER
PLAIN = "float64 data\n"
JOINT = "std_msgs/Header header\nstring[] name\nfloat64[] position\n" + HEADER
UNITS = 'units = { time = "s", pressure = "bar", contraction = "%", force = "N" }'
SEVERAL = f"""topic = "/load_cell"
columns = {{ force = "/load_cell.data", pressure = "/gauge.data", contraction = "position 0" }}
{UNITS}"""
EPOCH = 1_790_000_000  # s: clocks of robots count from 1970


def header(time):
    return {"stamp": {"sec": EPOCH + int(time), "nanosec": round(time % 1 * 1e9)}, "frame_id": ""}


def bag(topics, late=lambda time: 0.0):
    """The bytes of a bag: by topic the name of a type, its definition, times (s) and the fields of each message.

    The recorder notes each message `late(its stamp)` seconds after its stamp.
    """
    from mcap_ros2.writer import Writer

    out = io.BytesIO()
    writer = Writer(out)
    schemas = {name: writer.register_msgdef(kind, text) for name, (kind, text, *_) in topics.items()}
    rows = [
        (time, name, fields)
        for name, (_, _, times, each) in topics.items()
        for time, fields in zip(times, each, strict=True)
    ]
    for time, name, fields in sorted(rows, key=lambda row: row[:2]):
        at = round((EPOCH + time + late(time)) * 1e9)
        writer.write_message(name, schemas[name], fields, log_time=at, publish_time=at)
    writer.finish()
    return out.getvalue()


def one_topic():
    columns = vectors()
    names = ("pressure", "contraction", "force")
    each = [
        {"header": header(time), "note": "a", **{name: columns[name][k] for name in names}}
        for k, time in enumerate(columns["time"])
    ]
    return {"/muscle": ("lab_msgs/Muscle", STATE, columns["time"], each)}


def several_topics(stamped=True):
    """Force at the times of the loop, the gauge and the position at other ones."""
    columns = vectors()
    time = columns["time"]
    dense = np.arange(0, time[-1] + 0.02, 0.02)
    position = np.interp(dense, time, columns["contraction"])
    head = (lambda t: {"header": header(t)}) if stamped else lambda t: {}
    kind, text = ("lab_msgs/Stamped", STAMPED) if stamped else ("std_msgs/Float64", PLAIN)
    joint = [{"header": header(t), "name": ["x"], "position": [x]} for t, x in zip(dense, position, strict=True)]
    return {
        "/joint": ("sensor_msgs/JointState", JOINT, dense, joint),
        "/load_cell": (kind, text, time, [head(t) | {"data": f} for t, f in zip(time, columns["force"], strict=True)]),
        "/gauge": (kind, text, dense[::3], [head(t) | {"data": 2.0} for t in dense[::3]]),
    }  # fmt: skip


read, refused = partial(read_as, "loops.mcap"), partial(refused_as, "loops.mcap")


def test_a_topic_is_read_as_the_same_csv(tmp_path):
    (run,) = read(tmp_path, bag(one_topic())).recordings[0].runs
    (tmp_path / "csv").mkdir()
    _, expected = only_run(folder_of(tmp_path / "csv", loop_csv()))
    np.testing.assert_allclose(run.time, expected.time, atol=1e-6)
    for name in ("pressure", "contraction", "measured", "weight", "branch"):
        np.testing.assert_array_equal(getattr(run, name), getattr(expected, name))


@pytest.mark.parametrize("stamped", [True, False])
def test_other_topics_are_interpolated_at_the_messages_of_the_named_one(tmp_path, stamped):
    found = read(tmp_path, bag(several_topics(stamped), late=lambda time: 0.25), SEVERAL)
    (run,) = found.recordings[0].runs
    (tmp_path / "csv").mkdir()
    _, expected = only_run(folder_of(tmp_path / "csv", loop_csv()))
    np.testing.assert_array_equal(run.measured, expected.measured)
    within = run.weight > 0
    np.testing.assert_allclose(run.contraction[within], expected.contraction[within], atol=1e-9)
    np.testing.assert_allclose(run.time, expected.time, atol=1e-6)


def test_stamps_count_where_every_topic_has_them(tmp_path):
    """A recorder that notes messages late, some more than others, shifts nothing."""
    topics = several_topics()
    (tmp_path / "b.mcap").write_bytes(bag(topics, late=lambda time: 0.04 * np.sin(37 * time) ** 2))
    table = read_table(
        tmp_path / "b.mcap", {"force": "/load_cell.data"}, {"time": "s", "force": "N"}, {"topic": "/load_cell"}
    )
    np.testing.assert_allclose(table["time"], vectors()["time"], atol=1e-6)


def test_where_another_topic_has_no_message_there_is_no_reading(tmp_path):
    topics = several_topics()
    kind, text, times, each = topics["/gauge"]
    topics["/gauge"] = (kind, text, times[50:], each[50:])  # it begins at 3 s
    found = read(tmp_path, bag(topics), SEVERAL).recordings[0]
    (run,) = found.runs
    assert not run.weight[run.time < 2.9].any()
    assert any("no reading in '/gauge.data'" in note for note in found.notes)


def test_what_is_to_be_chosen_is_said(tmp_path):
    content = bag(several_topics())
    said = refused(tmp_path, content)
    assert "3 topics with numbers: /gauge, /joint, /load_cell" in said
    assert "add topic = " in said
    assert "did you mean '/load_cell'" in refused(tmp_path, content, SEVERAL.replace('"/load_cell"', '"/loadcell"'))


def test_init_guesses_the_topic_of_the_force(tmp_path):
    (tmp_path / "b.mcap").write_bytes(bag(several_topics()))
    assert 'topic = "/load_cell"' in write_muscle_file(tmp_path).read_text()
    assert read_heads(tmp_path / "b.mcap", {"topic": "/load_cell"})[0] == "time [s]"


def test_without_mcap_the_message_says_what_to_install(tmp_path, monkeypatch):
    content = bag(one_topic())
    monkeypatch.setitem(sys.modules, "mcap.reader", None)
    assert "pip install 'mckibben-jax[ros]'" in refused(tmp_path, content)


def test_a_bag_of_the_older_kind_says_how_to_convert_it(tmp_path):
    (tmp_path / "b.db3").write_bytes(b"SQLite format 3\0" + bytes(100))
    with pytest.raises(InputError, match="ros2 bag convert"):
        read_table(tmp_path / "b.db3")


def test_damaged_bags_end_in_one_message(tmp_path, capfd):
    """Cut off, bytes changed: read or refused, never anything else."""
    content, scatter, path = bag(one_topic()), np.random.default_rng(0), tmp_path / "f.mcap"
    for turn in range(150):
        damaged = bytearray(content)
        for place in scatter.integers(len(damaged) if turn % 2 else 3000, size=3):
            damaged[place] = int(scatter.integers(256))
        path.write_bytes(bytes(damaged[: int(scatter.integers(len(content)))] if turn % 5 == 0 else damaged))
        assert is_read_or_refused(path)
    assert capfd.readouterr() == ("", "")
