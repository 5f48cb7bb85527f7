"""Recordings of format 2.1, from those of 2.2 with one layer: their messages are the same, byte for byte. What 2.2 added to types
and metadata is taken away."""

from __future__ import annotations

from pathlib import Path

from google.protobuf.descriptor_pb2 import FileDescriptorSet
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer

ADDED = {
    "FieldSlice": ["z"],
    "LineSlice": ["s"],
    "Energy": ["layer_strain", "layer_kinetic"],
    "Event": ["interface"],
}


def former_schema(data: bytes) -> bytes:
    files = FileDescriptorSet.FromString(data)
    for file in files.file:
        for message in file.message_type:
            for field in [field for field in message.field if field.name in ADDED.get(message.name, [])]:
                if field.HasField("oneof_index"):
                    # that of an optional field, the last one
                    assert field.oneof_index == len(message.oneof_decl) - 1
                    del message.oneof_decl[field.oneof_index]
                message.field.remove(field)
            for kinds in message.enum_type:
                for kind in [kind for kind in kinds.value if kind.name == "LAYER_TENSION"]:
                    kinds.value.remove(kind)
    return files.SerializeToString()


def former_metadata(metadata: dict[str, str], added: list[str]) -> dict[str, str]:
    kept = {key: text for key, text in metadata.items() if key.partition(".")[2] not in added}
    axes = {"axis.values": "z0,dz,nz;r0,dr,nr", "axis.stress": "s0,ds"} if added else {}
    return kept | {key: text for key, text in axes.items() if key in kept}


def write_former(new: Path, old: Path) -> None:
    """Writes a recording of format 2.1."""
    with open(new, "rb") as source, open(old, "wb") as target:
        reader = make_reader(source)
        summary = reader.get_summary()
        assert summary is not None
        writer = Writer(target, chunk_size=1 << 20, compression=CompressionType.ZSTD)
        writer.start(profile="", library="percuss/0.1.0")
        names = {identifier: schema.name.rpartition(".")[2] for identifier, schema in summary.schemas.items()}
        schemas = {
            schema.id: writer.register_schema(schema.name, schema.encoding, former_schema(schema.data))
            for schema in summary.schemas.values()
        }
        channels = {}
        for channel in summary.channels.values():
            metadata = former_metadata(channel.metadata, ADDED.get(names[channel.schema_id], []))
            schema = schemas[channel.schema_id]
            channels[channel.id] = writer.register_channel(channel.topic, channel.message_encoding, schema, metadata)
        for _, channel, message in reader.iter_messages(log_time_order=False):
            writer.add_message(
                channels[channel.id], message.log_time, message.data, message.publish_time, message.sequence
            )
        for attachment in reader.iter_attachments():
            writer.add_attachment(0, 0, attachment.name, attachment.media_type, attachment.data)
        for record in reader.iter_metadata():
            if record.name == "percuss.summary":
                continue
            entries = {key: text for key, text in record.metadata.items() if key not in ["checksum", "numerics"]}
            if record.name == "percuss.run":
                assert entries["format_version"] == "2.3"
                entries["format_version"] = "2.1"
            writer.add_metadata(record.name, entries)
        writer.finish()
