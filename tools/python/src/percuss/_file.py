"""A recording on disk: index, metadata, attachments, messages of a channel. Knows no physics."""

from __future__ import annotations

import errno
import os
import struct
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import IO, Any, NamedTuple

import numpy as np
from google.protobuf.descriptor import Descriptor
from google.protobuf.message import DecodeError
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.reader import SeekingReader
from mcap.records import Attachment, Channel, Chunk, ChunkIndex, Message, Metadata, MetadataIndex
from mcap.stream_reader import breakup_chunk
from mcap_protobuf.decoder import DecoderFactory
from numpy.typing import NDArray
from zstandard import ZstdError

from ._errors import RecordingError

MAGIC = b"\x89MCAP0\r\n"
RECORD_HEADER = 9
"""Opcode and length of a record [bytes]."""
FOOTER_END = 20
"""Content of the last record, which ends with the checksum of the summary section [bytes]."""
BROKEN = (
    *(DecodeError, LookupError, McapError, MemoryError, OSError, OverflowError),
    *(RuntimeError, TypeError, ValueError, ZstdError, struct.error),
)
"""What reading damaged bytes raises: RuntimeError comes from lz4, OSError from places that no file has."""


@contextmanager
def sound(said: str) -> Iterator[None]:
    """Makes a RecordingError, which begins as said, of what reading damaged bytes raises; other errors of the system stay."""
    try:
        yield
    except BROKEN as error:
        if isinstance(error, RecordingError) or isinstance(error, OSError) and error.errno != errno.EINVAL:
            raise
        remedy = "`percuss-read recover` keeps what is sound"
        raise RecordingError(f"{said}: {str(error) or type(error).__name__}; {remedy}") from error


class Index(NamedTuple):
    """Where the messages of a channel are, in the order of the file."""

    log_times: NDArray[np.float64]
    """When they are [ns]."""
    chunks: list[tuple[ChunkIndex, int, int]]
    """The chunks with some: first of them and the one behind the last."""


class File:
    """An MCAP file with an index, open only while something is read of it. Making one reads the summary section and the metadata;
    messages are read chunk by chunk."""

    def __init__(self, path: str | os.PathLike[str], spare: str) -> None:
        """
        Args:
            path: The file.
            spare: A metadata record that counts as absent where it is damaged.

        Raises:
            OSError: The file cannot be read.
            RecordingError: It is no MCAP file, or one without an index, or index or metadata are damaged.
        """
        self.path = str(Path(path).absolute())
        self._factory = DecoderFactory()
        self._indexes: dict[str, Index] = {}
        self.metadata: dict[str, dict[str, str]] = {}
        with open(path, "rb") as stream, sound(f"{self.path} is no sound MCAP file"):
            reader = SeekingReader(stream)
            stream.seek(stream.seek(0, os.SEEK_END) - len(MAGIC))
            summary = reader.get_summary() if stream.read() == MAGIC and _verify_summary(stream) else None
            if summary is None or summary.statistics is None:
                remedy = "`percuss-read recover` makes a recording of it"
                raise RecordingError(f"{self.path} is cut off or has no index; {remedy}")
            for index in summary.metadata_indexes:
                try:
                    with sound(self.damaged(index.name)):
                        self.metadata[index.name] = _read_metadata(stream, index)
                except RecordingError:
                    if index.name != spare:
                        raise
        self._summary = summary
        self.channels: dict[str, Channel] = {channel.topic: channel for channel in summary.channels.values()}
        counts = summary.statistics.channel_message_counts
        self.counts: dict[str, int] = {topic: counts.get(channel.id, 0) for topic, channel in self.channels.items()}

    def __getstate__(self) -> dict[str, Any]:
        # types of messages are made again
        return self.__dict__ | {"_factory": DecoderFactory()}

    def attachment(self, name: str) -> bytes:
        """The bytes of an attachment.

        Raises:
            OSError: The file cannot be read.
            RecordingError: There is none of this name, or it is damaged.
        """
        for index in self._summary.attachment_indexes:
            if index.name == name:
                with open(self.path, "rb") as stream, sound(self.damaged(name)):
                    data = _content(stream, index.offset, index.length)
                    _verify(data[:-4], int.from_bytes(data[-4:], "little"))
                    attached: bytes = Attachment.read(ReadDataStream(BytesIO(data))).data
                    return attached
        raise RecordingError(f"{self.path} has no attachment {name}")

    def channel(self, topic: str) -> Channel:
        """The channel of a topic.

        Raises:
            RecordingError: There is none.
        """
        if topic not in self.channels:
            raise RecordingError(f"{self.path} has no {topic}; it has {', '.join(self.channels)}")
        return self.channels[topic]

    def units(self, topic: str) -> dict[str, str]:
        """Units of the fields of a topic; plain numbers have none."""
        entries = self.channel(topic).metadata.items()
        return {key.removeprefix("unit."): unit for key, unit in entries if key.startswith("unit.") and unit != "1"}

    def descriptor(self, topic: str) -> Descriptor:
        """The message type of a topic, from the file."""
        descriptor: Descriptor = self._decoder(self.channel(topic))(b"").DESCRIPTOR
        return descriptor

    def _decoder(self, channel: Channel) -> Callable[[bytes], Any]:
        with sound(self.damaged(f"type of {channel.topic}")):
            decoder = self._factory.decoder_for(channel.message_encoding, self._summary.schemas.get(channel.schema_id))
        if decoder is None:
            raise RecordingError(f"{self.path}: {channel.topic} is not protobuf")
        return decoder

    def index(self, topic: str) -> Index:
        """Where the messages of a topic are: reads the message index of every chunk, no message.

        Raises:
            OSError: The file cannot be read.
            RecordingError: There is no such topic, or an index is damaged.
        """
        if topic not in self._indexes:
            channel = self.channel(topic).id
            times: list[int] = []
            chunks: list[tuple[ChunkIndex, int, int]] = []
            with open(self.path, "rb") as stream:
                for chunk in self._summary.chunk_indexes:
                    if channel in chunk.message_index_offsets:
                        first = len(times)
                        times += self._read_times(stream, channel, chunk.message_index_offsets[channel])
                        chunks.append((chunk, first, len(times)))
            self._indexes[topic] = Index(np.array(times, np.float64), chunks)
        return self._indexes[topic]

    def _read_times(self, stream: IO[bytes], channel: int, offset: int) -> list[int]:
        with sound(self.damaged(f"index of messages at {offset} bytes")):
            stream.seek(offset + RECORD_HEADER)
            found, size = struct.unpack("<HI", stream.read(6))
            data = stream.read(size)
            if found != channel or len(data) != size:
                raise ValueError("it is another one")
            return [time for time, _ in struct.iter_unpack("<QQ", data)]

    def messages(self, topic: str, picks: NDArray[np.intp] | None = None) -> Iterator[Any]:
        """Messages of a topic, decoded, in the order of the file. Only their chunks are read, and their checksums verified.

        Args:
            topic: The topic.
            picks: Numbers of messages in ascending order; all of them if left out.

        Raises:
            OSError: The file cannot be read.
            RecordingError: There is no such topic, or a chunk is damaged.
        """
        channel, index = self.channel(topic), self.index(topic)
        decode = self._decoder(channel)
        with open(self.path, "rb") as stream, sound(self.damaged(topic)):
            for chunk, first, stop in index.chunks:
                wanted = np.arange(first, stop)
                if picks is not None:
                    wanted = picks[np.searchsorted(picks, first) : np.searchsorted(picks, stop)]
                if wanted.size > 0:
                    messages = self._read_chunk(stream, chunk, channel.id, index.log_times[first:stop])
                    yield from (decode(messages[number - first]) for number in wanted)

    def _read_chunk(
        self, stream: IO[bytes], index: ChunkIndex, channel: int, log_times: NDArray[np.float64]
    ) -> list[bytes]:
        with sound(self.damaged(f"chunk at {index.chunk_start_offset} bytes")):
            stream.seek(index.chunk_start_offset + RECORD_HEADER)
            records = breakup_chunk(Chunk.read(ReadDataStream(stream)), validate_crc=True)
            messages = [record for record in records if isinstance(record, Message) and record.channel_id == channel]
            if not np.array_equal(np.array([message.log_time for message in messages], np.float64), log_times):
                raise ValueError("it differs from its index")
        return [message.data for message in messages]

    def damaged(self, part: str) -> str:
        """How the text of an error begins where a part is damaged."""
        return f"{self.path} is damaged: {part}"


def _content(stream: IO[bytes], offset: int, length: int) -> bytes:
    """What is in a record of this length."""
    stream.seek(offset + RECORD_HEADER)
    return stream.read(length - RECORD_HEADER)


def _verify(data: bytes, checksum: int) -> None:
    """Compares a checksum; 0 is none."""
    if checksum not in [0, zlib.crc32(data)]:
        raise ValueError("its checksum is another one")


def _verify_summary(stream: IO[bytes]) -> bool:
    end = stream.seek(-len(MAGIC) - FOOTER_END, os.SEEK_END) + FOOTER_END - 4
    start, _, checksum = struct.unpack("<QQI", stream.read(FOOTER_END))
    stream.seek(start)
    _verify(stream.read(max(end - start, 0)), checksum)
    return True


def _read_metadata(stream: IO[bytes], index: MetadataIndex) -> dict[str, str]:
    """Entries of a metadata record, which percuss gives a checksum from format 2.3 on."""
    data = ReadDataStream(BytesIO(_content(stream, index.offset, index.length)))
    record = Metadata.read(data)
    entries: dict[str, str] = record.metadata
    texts = (f"{key}\0{text}\0" for key, text in sorted(entries.items()) if key != "checksum")
    checksum = f"{zlib.crc32(''.join(texts).encode()):08x}"
    is_whole = record.name == index.name and data.count == index.length - RECORD_HEADER
    if not is_whole or entries.get("checksum", checksum) != checksum:
        raise ValueError("its checksum is another one")
    return entries
