"""A ROS 2 bag in an MCAP file: the messages of one topic are the rows, other topics are interpolated at their times.

The file brings the definitions of its messages along, so that no ROS is needed. A definition says where numbers lie in
the bytes; nothing of it is run.
"""

import io
from collections.abc import Callable, Iterator
from contextlib import redirect_stderr
from pathlib import Path
from typing import Any

import numpy as np

from fitting.errors import InputError, unknown_name
from fitting.recordings.mat_variables import columns_of
from fitting.recordings.settings import TABLES
from fitting.recordings.source import Source
from fitting.recordings.table_text import bytes_of

FEWER = "keep the topics of the muscle alone: mcap filter bag.mcap -o small.mcap -y /load_cell -y /gauge"
LONGEST = 16  # numbers of an array in a message that become columns; chosen: images and scans are no columns
TEXTS = ("force", "load", "wrench")  # words in the name of the topic that is measured
Fields = dict[str, float]
Topic = list[tuple[float, float, Fields]]  # when each message was recorded and when it was stamped (s), its numbers


def bag_source(path: Path, topic: str | None) -> Source:
    """The messages of one topic as rows, with columns of the other topics; the time counts from the first message."""
    raw = bytes_of(path, FEWER)
    topics = _topics(raw, path)
    name = _chosen([*topics], topic, path)
    clock = _clock([topics[name], *(rows for other, rows in topics.items() if other != name)])
    times = {each: clock(rows) for each, rows in topics.items()}
    start = min(values[0] for values in times.values())
    columns: dict[str, Any] = {"time [s]": times[name] - start}
    for each, rows in topics.items():
        numbers = _numbers(rows)
        columns[each] = numbers if each == name else _between(times[each], numbers, times[name])
    found, _ = columns_of({key: value for key, value in columns.items() if isinstance(value, np.ndarray) or value})
    rows = np.arange(1, len(times[name]) + 1)
    return Source([*found], None, rows, raw, lambda: ([*found.values()], "."))


def measured_topic(path: Path) -> list[str]:
    """The topic that most likely holds the force; none where there is nothing to choose, or the file cannot be read."""
    try:
        topics = [*_topics(bytes_of(path, FEWER), path)]
    except InputError:
        return []
    likely = [name for name in topics if any(word in name.lower() for word in TEXTS)]
    return [(likely or topics)[0]] if len(topics) > 1 else []


def _chosen(topics: list[str], topic: str | None, path: Path) -> str:
    if not topics:
        raise InputError(
            "no topic of the bag has numbers", path, cure="record the topics of the load cell and the gauge"
        )
    if topic is not None:
        if topic not in topics:
            raise unknown_name("topic", topic, topics, path)
        return topic
    if len(topics) > 1:
        cure = f'add topic = "{topics[0]}" below file in muscle.toml: the topic of what was measured, the force'
        raise InputError(f"the bag has {len(topics)} topics with numbers: {', '.join(topics)}", path, cure=cure)
    return topics[0]


# ---------------------------------------------------------------------------------------------------- what mcap reads


def _topics(raw: bytes, path: Path) -> dict[str, Topic]:
    """The messages of every topic that has numbers, in the order of their time."""
    try:
        from mcap.reader import make_reader
        from mcap_ros2.decoder import DecoderFactory
    except ImportError:
        cure = "pip install 'mckibben-jax[ros]'; or save the topics as CSV"
        raise InputError("a ROS 2 bag needs mcap and mcap-ros2-support", path, cure=cure) from None
    try:
        with redirect_stderr(io.StringIO()):  # the decoder prints what is wrong with a definition, besides raising it
            reader = make_reader(io.BytesIO(raw), validate_crcs=True)
            _check_size(reader, path)
            found = _decoded(reader, DecoderFactory())
    except InputError:
        raise
    except Exception as error:  # mcap trusts its input: a damaged bag ends in any exception that there is
        problem = f"the bag is damaged or breaks off ({type(error).__name__})"
        raise InputError(problem, path, cure="'mcap recover' saves what can be read of it") from None
    return {name: rows for name, rows in found.items() if rows[0][2]}


def _decoded(reader: Any, factory: Any) -> dict[str, Topic]:
    """The messages of the topics whose messages are of ROS 2."""
    found: dict[str, Topic] = {}
    for schema, channel, message in reader.iter_messages():
        decoder = factory.decoder_for(channel.message_encoding, schema)
        if decoder is not None:
            decoded = decoder(message.data)
            row = message.log_time / 1e9, _stamp(decoded), dict(_fields(decoded))
            found.setdefault(channel.topic, []).append(row)
    return found


def _check_size(reader: Any, path: Path) -> None:
    """Refuse a bag that would unpack to more than a recording can be."""
    summary = reader.get_summary()
    size = sum(chunk.uncompressed_size for chunk in summary.chunk_indexes) if summary else 0
    if size > TABLES.unpacked_bytes:
        problem = f"the bag unpacks to more than {TABLES.unpacked_bytes / 1e6:g} MB"
        raise InputError(problem, path, value=f"{size / 1e6:.0f} MB", cure=FEWER)


def _stamp(message: Any) -> float:
    """The time in a message's header, s; 0 where it has none."""
    stamp = getattr(getattr(message, "header", None), "stamp", None)
    return 0.0 if stamp is None else float(stamp.sec) + float(stamp.nanosec) / 1e9


def _fields(message: Any, name: str = "") -> Iterator[tuple[str, float]]:
    """The numbers of a message by the path of their fields; those of short arrays by their places, from 0."""
    for key in getattr(message, "__slots__", ()):
        value, place = getattr(message, key), f"{name}.{key}" if name else key
        if key == "header":
            continue
        if isinstance(value, (int, float)):
            yield place, float(value)
        elif isinstance(value, (list, tuple)) and len(value) <= LONGEST:
            yield from ((f"{place} {at}", float(v)) for at, v in enumerate(value) if isinstance(v, (int, float)))
        else:
            yield from _fields(value, place)


# ------------------------------------------------------------------------------------------------- onto one set of rows


def _clock(topics: list[Topic]) -> Callable[[Topic], np.ndarray]:
    """How to tell the time of messages: by the stamps in their headers where all have one, else by the recorder."""
    stamped = all(stamp > 0 for rows in topics for _, stamp, _ in rows)
    return lambda rows: np.array([stamp if stamped else recorded for recorded, stamp, _ in rows])


def _numbers(rows: Topic) -> dict[str, np.ndarray]:
    """The fields that every message of a topic has."""
    names = [name for name in rows[0][2] if all(name in fields for _, _, fields in rows)]
    return {name: np.array([fields[name] for _, _, fields in rows]) for name in names}


def _between(at: np.ndarray, numbers: dict[str, np.ndarray], wanted: np.ndarray) -> dict[str, np.ndarray]:
    """Readings interpolated linearly; before the first and behind the last one there is none."""
    order = np.argsort(at, kind="stable")
    return {
        name: np.interp(wanted, at[order], values[order], left=np.nan, right=np.nan) for name, values in numbers.items()
    }
