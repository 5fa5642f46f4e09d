"""The messages of bags that rosbags refuses: record by record from the start of the file to the damage.

A recording that was broken off has no index, and a file that was cut has lost it. Formats: ROS bag 2.0
(http://wiki.ros.org/Bags/Format/2.0), MCAP (https://mcap.dev/spec, read by its own library), rosbag2's sqlite3.
"""

import io
import sqlite3
import struct
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

from depthsim.extras import load_extra
from depthsim.importing.packed import read_at_most, unpack

_MAGIC = b"#ROSBAG V2.0\n"
_MESSAGE, _CHUNK, _CONNECTION = 2, 5, 7
_LARGEST = 1 << 31


class Message(NamedTuple):
    """A message as it lies in a bag; ``time`` is when it was recorded [ns]."""

    topic: str
    kind: str
    time: int
    data: bytes


class Damaged(Exception):
    """Where a file is cut off or holds something else than its format says."""


def salvage(path: Path) -> Iterator[Message]:
    """The messages of one file in the order of the file; raises :class:`Damaged` at its damage, if it has any."""
    readers = {".bag": _ros1, ".mcap": _mcap, ".db3": _sqlite3}
    reader = readers.get(path.suffix.lower())
    if reader is None:
        raise Damaged("is not a format that can be read in part")
    try:
        yield from reader(path)
    except OSError as error:
        raise Damaged(str(error.strerror or error).lower()) from None


def _ros1(path: Path) -> Iterator[Message]:
    connections: dict[int, tuple[str, str]] = {}
    with path.open("rb") as file:
        if file.read(len(_MAGIC)) != _MAGIC:
            raise Damaged("is not a ROS bag of version 2.0")
        while (record := _record(file)) is not None:
            header, data, whole = record
            if header.get(b"op") == bytes([_CHUNK]):
                yield from _chunk(header, data, connections)
            else:
                yield from _take(header, data, connections)
            if not whole:
                raise Damaged("is cut off")


def _chunk(header: dict[bytes, bytes], data: bytes, connections: dict[int, tuple[str, str]]) -> Iterator[Message]:
    """The messages of a chunk, or of what there is of it."""
    how = header.get(b"compression", b"none")
    try:
        plain = unpack(how.decode("latin-1"), data)
    except ValueError as error:
        raise Damaged(f"has a chunk that {error}") from None
    inside = io.BytesIO(plain)
    while (record := _record(inside)) is not None:
        header, body, whole = record
        if not whole:
            return
        yield from _take(header, body, connections)


def _take(header: dict[bytes, bytes], data: bytes, connections: dict[int, tuple[str, str]]) -> Iterator[Message]:
    op = (header.get(b"op") or b"\0")[0]
    try:
        if op == _CONNECTION:
            (number,) = struct.unpack("<I", header[b"conn"])
            kind = _fields(data)[b"type"].decode()
            connections[number] = header[b"topic"].decode(), kind.replace("/", "/msg/", 1)
        elif op == _MESSAGE:
            (number,) = struct.unpack("<I", header[b"conn"])
            seconds, rest = struct.unpack("<II", header[b"time"])
            if number in connections:
                yield Message(*connections[number], seconds * 10**9 + rest, data)
    except (KeyError, struct.error, UnicodeDecodeError):
        raise Damaged("has a record that makes no sense") from None


def _record(file: BinaryIO) -> tuple[dict[bytes, bytes], bytes, bool] | None:
    """The header and the data of the next record, and whether it is whole; None at the end."""
    start = file.read(4)
    if not start:
        return None
    head = _sized(file, start)
    size = file.read(4)
    if head is None or len(size) < 4:
        return {}, b"", False
    (length,) = struct.unpack("<I", size)
    if length > _LARGEST:
        raise Damaged("has a record that makes no sense")
    data = read_at_most(file, length)
    return _fields(head), data, len(data) == length


def _sized(file: BinaryIO, start: bytes) -> bytes | None:
    if len(start) < 4:
        return None
    (length,) = struct.unpack("<I", start)
    if length > 1 << 20:
        raise Damaged("has a record that makes no sense")
    data = file.read(length)
    return data if len(data) == length else None


def _fields(header: bytes) -> dict[bytes, bytes]:
    """The name=value fields of a header."""
    fields, place = {}, 0
    while place + 4 <= len(header):
        (length,) = struct.unpack_from("<I", header, place)
        name, equals, value = header[place + 4 : place + 4 + length].partition(b"=")
        if not equals or place + 4 + length > len(header):
            raise Damaged("has a record that makes no sense")
        fields[name] = value
        place += 4 + length
    return fields


def _mcap(path: Path) -> Iterator[Message]:
    reader = load_extra("mcap.stream_reader", "ros")
    schemas: dict[int, str] = {}
    channels: dict[int, tuple[str, str]] = {}
    with path.open("rb") as file:
        stream = reader.StreamReader(_Bounded(file), emit_chunks=True, record_size_limit=path.stat().st_size)
        yield from _guarded(lambda: _mcap_records(_unpacked(stream.records, reader), schemas, channels))


class _Bounded:
    """A file for mcap, which asks for as many bytes as a length in the file says."""

    def __init__(self, file: BinaryIO) -> None:
        self._file = file

    def read(self, size: int) -> bytes:
        """So many bytes, or what there is."""
        return read_at_most(self._file, size)


def _unpacked(records: Iterator[Any], reader: Any) -> Iterator[Any]:
    """The records, those in chunks one by one."""
    for record in records:
        if type(record).__name__ == "Chunk":
            record.data, record.compression = unpack(record.compression, record.data), ""
            yield from reader.breakup_chunk(record)
        elif record is not None:
            yield record


def _mcap_records(
    records: Iterator[Any], schemas: dict[int, str], channels: dict[int, tuple[str, str]]
) -> Iterator[Message]:
    for record in records:
        name = type(record).__name__
        if name == "Schema":
            schemas[record.id] = record.name
        elif name == "Channel":
            channels[record.id] = record.topic, schemas.get(record.schema_id, "")
        elif name == "Message" and record.channel_id in channels:
            yield Message(*channels[record.channel_id], record.log_time, record.data)


def _guarded(start: Callable[[], Iterator[Message]]) -> Iterator[Message]:
    """Whatever a foreign reader raises on broken bytes means damage: they have no common base class."""
    messages = start()
    while True:
        try:
            message = next(messages)
        except StopIteration:
            return
        except OSError:
            raise
        except Exception as error:
            what = " ".join(str(error).split()) or type(error).__name__
            raise Damaged(f"is cut off or damaged ({what[:80]})") from None
        yield message


def _sqlite3(path: Path) -> Iterator[Message]:
    try:
        base = sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro&immutable=1", uri=True)
    except sqlite3.Error as error:
        raise Damaged(str(error)) from None
    try:
        base.execute("PRAGMA writable_schema=ON")  # else SQLite refuses a file that is shorter than it was
        topics = {number: (topic, kind) for number, topic, kind in base.execute("SELECT id, name, type FROM topics")}
        # By row, not by time: an index may lie behind the cut.
        for number, time, data in base.execute("SELECT topic_id, timestamp, data FROM messages NOT INDEXED"):
            if number in topics:
                message = Message(*topics[number], time, data)
                if [type(part) for part in message] != [str, str, int, bytes]:  # SQLite keeps any type in any column
                    raise Damaged("has a message that makes no sense")
                yield message
    except (sqlite3.Error, UnicodeDecodeError) as error:
        raise Damaged(f"is cut off or damaged ({error})") from None
    finally:
        base.close()
