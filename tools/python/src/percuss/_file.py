"""A recording on disk: index, metadata, attachments, messages of a channel. Knows no physics."""

from __future__ import annotations

import os
import struct
from collections.abc import Callable, Iterator
from typing import IO, Any, NamedTuple

import numpy as np
from google.protobuf.descriptor import Descriptor
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.reader import SeekingReader
from mcap.records import Channel, Chunk, ChunkIndex, Message, MessageIndex
from mcap.stream_reader import CRCValidationError, StreamReader, breakup_chunk
from mcap_protobuf.decoder import DecoderFactory
from numpy.typing import NDArray
from zstandard import ZstdError

from ._errors import RecordingError

MAGIC = b"\x89MCAP0\r\n"
RECORD_HEADER = 9
"""Opcode and length of a record [bytes]."""
BROKEN = (McapError, CRCValidationError, ZstdError, RuntimeError, UnicodeDecodeError, struct.error)
"""What reading a damaged record raises: RuntimeError comes from lz4."""


class Index(NamedTuple):
    """Where the messages of a channel are, in the order of the file."""

    log_times: NDArray[np.float64]
    """When they are [ns]."""
    chunks: list[tuple[ChunkIndex, int, int]]
    """The chunks with some: first of them and the one behind the last."""


class File:
    """An MCAP file with an index, open only while something is read of it. Making one reads the summary section and the metadata;
    messages are read chunk by chunk."""

    def __init__(self, path: str | os.PathLike[str]) -> None:
        """
        Raises:
            OSError: The file cannot be read.
            RecordingError: It is no MCAP file, or one without an index.
        """
        self.path = os.fspath(path)
        self._factory = DecoderFactory()
        self._indexes: dict[str, Index] = {}
        try:
            with open(path, "rb") as stream:
                reader = SeekingReader(stream)
                size = stream.seek(0, os.SEEK_END)
                stream.seek(size - len(MAGIC))
                summary = reader.get_summary() if stream.read() == MAGIC else None
                if summary is None or summary.statistics is None:
                    remedy = "`percuss-read recover` makes a recording of it"
                    raise RecordingError(f"{self.path} is cut off or has no index; {remedy}")
                self.metadata: dict[str, dict[str, str]] = {
                    record.name: record.metadata for record in reader.iter_metadata()
                }
        except BROKEN as error:
            raise RecordingError(f"{self.path} is no sound MCAP file: {error}") from error
        self._summary = summary
        self.channels: dict[str, Channel] = {channel.topic: channel for channel in summary.channels.values()}
        counts = summary.statistics.channel_message_counts
        self.counts: dict[str, int] = {topic: counts.get(channel.id, 0) for topic, channel in self.channels.items()}

    def attachment(self, name: str) -> bytes:
        """The bytes of an attachment.

        Raises:
            OSError: The file cannot be read.
            RecordingError: There is none of this name.
        """
        with open(self.path, "rb") as stream:
            for attachment in SeekingReader(stream).iter_attachments():
                if attachment.name == name:
                    return attachment.data
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
                        times += self._read_times(stream, chunk.message_index_offsets[channel])
                        chunks.append((chunk, first, len(times)))
            self._indexes[topic] = Index(np.array(times, np.float64), chunks)
        return self._indexes[topic]

    def _read_times(self, stream: IO[bytes], offset: int) -> list[int]:
        stream.seek(offset)
        try:
            record = next(StreamReader(stream, skip_magic=True).records)
        except BROKEN as error:
            raise self._damaged("index of messages", offset, error) from error
        if not isinstance(record, MessageIndex):
            raise self._damaged("index of messages", offset, type(record).__name__)
        return [time for time, _ in record.records]

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
        with open(self.path, "rb") as stream:
            for chunk, first, stop in index.chunks:
                wanted = np.arange(first, stop)
                if picks is not None:
                    wanted = picks[np.searchsorted(picks, first) : np.searchsorted(picks, stop)]
                if wanted.size > 0:
                    messages = self._read_chunk(stream, chunk, channel.id)
                    if len(messages) != stop - first:
                        raise self._damaged("chunk", chunk.chunk_start_offset, "it differs from its index")
                    yield from (decode(messages[number - first]) for number in wanted)

    def _read_chunk(self, stream: IO[bytes], index: ChunkIndex, channel: int) -> list[bytes]:
        stream.seek(index.chunk_start_offset + RECORD_HEADER)
        try:
            records = breakup_chunk(Chunk.read(ReadDataStream(stream)), validate_crc=True)
        except BROKEN as error:
            raise self._damaged("chunk", index.chunk_start_offset, error) from error
        return [record.data for record in records if isinstance(record, Message) and record.channel_id == channel]

    def _damaged(self, part: str, offset: int, cause: object) -> RecordingError:
        remedy = "`percuss-read recover` keeps what is sound"
        return RecordingError(f"{self.path} is damaged: {part} at {offset} bytes: {cause}; {remedy}")
