"""The messages of a ROS 1 or ROS 2 bag, whole or damaged."""

import re
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

from depthsim.errors import InputError
from depthsim.extras import load_extra
from depthsim.importing.packed import unpack
from depthsim.importing.salvage import Damaged, Message, salvage
from depthsim.yamlfile import read_mapping

_SUFFIXES = (".bag", ".mcap", ".db3")


class BagFile:
    """One .bag, .mcap or .db3 file, a folder with several, or a rosbag2 folder.

    ros1: whether messages are in ROS 1's serialisation. topics: the type of each topic. damage: after
    :meth:`messages` has ended, what is wrong with which file, if anything is.
    """

    def __init__(self, source: Path) -> None:
        load_extra("rosbags", "ros")
        self.source = source
        self.files = _files(source)
        self.ros1 = self.files[0].suffix.lower() == ".bag"
        self.damage: tuple[Path, str] | None = None
        whole = [source] if _has_list(source) else self.files
        self._parts = [_Indexed.open(part, self.ros1) for part in whole]
        if None in self._parts and whole == [source]:  # the list of files is damaged, or one of them is
            whole = self.files
            self._parts = [_Indexed.open(part, self.ros1) for part in whole]
        self._places = whole
        self.topics: dict[str, str] = {}
        for part, place in zip(self._parts, whole, strict=True):
            self.topics |= part.topics if part is not None else _topics(place)

    def messages(self, topics: set[str]) -> Iterator[Message]:
        """The messages of some topics, about in the order of time. After a fault some may come twice."""
        for part, place in zip(self._parts, self._places, strict=True):
            if part is not None:
                try:
                    yield from part.messages(topics)
                    continue
                except Damaged:
                    pass
            for file in self.files if place == self.source and place.is_dir() else [place]:
                try:
                    yield from (message for message in salvage(file) if message.topic in topics)
                except Damaged as damage:
                    self.damage = file, str(damage)
                    return

    def close(self) -> None:
        """Close the files."""
        for part in self._parts:
            if part is not None:
                part.close()


class _Indexed:
    """A part of a bag that rosbags can open."""

    def __init__(self, reader: Any) -> None:
        self._reader = reader
        known = [item for item in reader.connections if isinstance(item.topic, str) and isinstance(item.msgtype, str)]
        self.topics = {item.topic: item.msgtype for item in known}
        self._packed = getattr(reader, "compression_mode", None) == "message"
        if self._packed:  # unpacked here, with a bound, which rosbags has not
            reader.storage.metadata = reader.storage.metadata._replace(compression_mode=None)

    @classmethod
    def open(cls, path: Path, ros1: bool) -> "_Indexed | None":
        """None for what rosbags refuses, in whatever way."""
        module = load_extra("rosbags.rosbag1" if ros1 else "rosbags.rosbag2", "ros")
        try:
            reader = module.Reader(path)
            reader.open()
            return cls(reader)
        except InputError:
            raise
        except Exception:  # rosbags lets struct, database and key errors of broken files out as they are
            return None

    def messages(self, topics: set[str]) -> Iterator[Message]:
        wanted = [item for item in self._reader.connections if isinstance(item.topic, str) and item.topic in topics]
        if not wanted:
            return
        stream = self._reader.messages(connections=wanted)
        while True:
            try:
                connection, time, data = next(stream)
            except StopIteration:
                return
            except Exception as error:
                raise Damaged(str(error)) from None
            if not isinstance(data, bytes | bytearray | memoryview):  # SQLite keeps any type in any column
                raise Damaged("has a message that makes no sense")
            yield Message(connection.topic, connection.msgtype, time, self._plain(bytes(data)))

    def _plain(self, data: bytes) -> bytes:
        if not self._packed:
            return data
        try:
            return unpack("zstd", data)
        except ValueError as error:
            raise Damaged(f"has a message that {error}") from None

    def close(self) -> None:
        with suppress(Exception):  # rosbags takes what metadata.yaml has under `files` for a list
            self._reader.close()


def _has_list(source: Path) -> bool:
    """Whether a folder has a metadata.yaml that may be read: rosbags' own reader of YAML knows no bound of size."""
    try:
        return bool(read_mapping(source / "metadata.yaml", "a metadata.yaml"))
    except InputError:
        return False


def _topics(file: Path) -> dict[str, str]:
    """The topics of a file that has no index."""
    topics: dict[str, str] = {}
    try:
        for message in salvage(file):
            topics[message.topic] = message.kind
    except Damaged as damage:
        if not topics:
            raise InputError(file, "", str(damage), "record it again, or give another file") from None
    return topics


def _files(source: Path) -> list[Path]:
    if source.is_file():
        return [source]

    def natural(file: Path) -> list[Any]:
        return [int(part) if part.isdecimal() else part for part in re.split(r"(\d+)", file.name)]

    # .mcap.zstd and .db3.zstd are whole files in themselves, which rosbags unpacks.
    files = [file for file in source.iterdir() if file.name.removesuffix(".zstd").lower().endswith(_SUFFIXES)]
    if not files:
        raise InputError(source, "", "names no .mcap or .db3 that is there", "give the whole folder of the bag")
    return sorted(files, key=natural)
