"""Recordings of another writer through every verb of percuss-read, and its tables through other readers.

    python check_reader.py PATH-OF-PERCUSS-READ

Writes the same messages with the Python `mcap` package in every container it can make (no chunks, no compression,
lz4, zstd, without checksums, without a summary) and checks what percuss-read makes of them. Needs mcap,
mcap-protobuf-support, lz4, zstandard, numpy and pyarrow.
"""

import csv
import io
import itertools
import json
import math
import pathlib
import subprocess
import sys
import tempfile

import numpy
import pyarrow.parquet
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from mcap.writer import CompressionType, IndexType, Writer
from mcap_protobuf.schema import build_file_descriptor_set

reader = pathlib.Path(sys.argv[1]).resolve()


def read(*arguments, status=0):
    """Standard output of percuss-read, which must end with a status."""
    run = subprocess.run([reader, *map(str, arguments)], capture_output=True)
    text = run.stderr.decode()
    assert run.returncode == status, f"{arguments}: status {run.returncode}: {text} {run.stdout.decode()}"
    return run.stdout.decode()


def message_type():
    """message bench.Sample { double time = 1; double load = 2; repeated float strain = 3; string note = 4; }"""
    file = descriptor_pb2.FileDescriptorProto(name="bench.proto", package="bench", syntax="proto3")
    message = file.message_type.add(name="Sample")
    kinds = descriptor_pb2.FieldDescriptorProto
    for number, (name, kind, label) in enumerate(
        [
            ("time", kinds.TYPE_DOUBLE, kinds.LABEL_OPTIONAL),
            ("load", kinds.TYPE_DOUBLE, kinds.LABEL_OPTIONAL),
            ("strain", kinds.TYPE_FLOAT, kinds.LABEL_REPEATED),
            ("note", kinds.TYPE_STRING, kinds.LABEL_OPTIONAL),
        ],
        start=1,
    ):
        message.field.add(name=name, number=number, type=kind, label=label)
    pool = descriptor_pool.DescriptorPool()
    pool.Add(file)
    return message_factory.GetMessageClass(pool.FindMessageTypeByName("bench.Sample"))


Sample = message_type()
COUNT = 300


def load(k):
    return math.sin(0.1 * k) * 10


def write(path, **options):
    with open(path, "wb") as stream:
        writer = Writer(stream, **options)
        writer.start(profile="", library="python")
        schema = writer.register_schema(
            name="bench.Sample",
            encoding="protobuf",
            data=build_file_descriptor_set(Sample).SerializeToString(),
        )
        channel = writer.register_channel(
            topic="/bench",
            message_encoding="protobuf",
            schema_id=schema,
            metadata={"unit.load": "N", "unit.time": "s"},
        )
        plain = writer.register_channel(topic="/json", message_encoding="json", schema_id=0)
        writer.add_attachment(create_time=0, log_time=0, name="notes.txt", media_type="text/plain", data=b"hello")
        for k in range(COUNT):
            strain = [k + 0.5, k + 0.25]
            sample = Sample(time=0.1 * k, load=load(k), strain=strain, note=f"n{k}" if k % 2 else "")
            now = k * 100_000_000
            writer.add_message(channel_id=channel, log_time=now, publish_time=now, data=sample.SerializeToString(), sequence=k)
            if k % 50 == 0:
                writer.add_message(channel_id=plain, log_time=now, publish_time=now, data=b'{"k": 1}', sequence=k)
        writer.add_metadata("who", {"name": "python"})
        writer.finish()


def check(path):
    report = json.loads(read("verify", "--json", path))
    assert report["sound"] and report["messages"] == COUNT + 6, report
    info = json.loads(read("info", "--json", path))
    topics = {channel["topic"]: channel for channel in info["channels"]}
    assert info["complete"] and topics["/bench"]["messages"] == COUNT and topics["/bench"]["decodable"]
    rows = list(csv.reader(io.StringIO(read("trace", path, "--topic", "/bench"))))
    assert rows[0] == ["time [s]", "load [N]", "strain[0]", "strain[1]", "note"], rows[0]
    assert len(rows) == COUNT + 1
    for k, row in enumerate(rows[1:]):
        assert (float(row[0]), float(row[1]), float(row[3])) == (0.1 * k, load(k), k + 0.25), row
    lines = [json.loads(line) for line in read("cat", path, "--topic", "/bench", "--every", "100").splitlines()]
    assert [line["sequence"] for line in lines] == [0, 100, 200, COUNT - 1]
    assert lines[1]["message"]["load"] == load(100)
    assert "repeated float strain = 3;" in read("schema", path, "--topic", "/bench")
    assert read("export", path, "--attachment", "notes.txt") == "hello"
    # JSON without a schema is decoded too
    plain = list(csv.reader(io.StringIO(read("trace", path, "--topic", "/json"))))
    assert plain[0] == ["log_time [s]", "k"] and len(plain) > 2, plain
    assert all(float(row[1]) == 1.0 for row in plain[1:]), plain


with tempfile.TemporaryDirectory() as name:
    folder = pathlib.Path(name)
    containers = [
        {"use_chunking": chunks, "compression": compression, "enable_crcs": crcs, **more}
        for chunks, compression, crcs in itertools.product(
            [True, False], [CompressionType.NONE, CompressionType.LZ4, CompressionType.ZSTD], [True, False]
        )
        for more in (
            {"chunk_size": 2000},
            {"index_types": IndexType.NONE, "repeat_channels": False, "repeat_schemas": False},
            {"use_statistics": False, "use_summary_offsets": False},
        )
    ]
    paths = []
    for number, options in enumerate(containers):
        path = folder / f"{number}.mcap"
        write(path, **options)
        check(path)
        paths.append(path)
    assert json.loads(read("diff", "--json", *paths))["verdict"] == "within"

    numpy_path, archive_path, parquet_path = folder / "t.npy", folder / "t.npz", folder / "t.parquet"
    fields = ["--topic", "/bench", "--field", "load,strain[0]"]
    read("trace", paths[0], *fields, "-o", numpy_path)
    read("trace", paths[0], *fields, "-o", archive_path)
    read("trace", paths[0], paths[1], "--stack", "--topic", "/bench", "-o", parquet_path)
    matrix = numpy.load(numpy_path)
    assert matrix.shape == (COUNT, 3) and matrix[7, 1] == load(7)
    archive = numpy.load(archive_path)
    assert archive["strain[0]"].dtype == numpy.float32 and archive["load"][9] == load(9)
    table = pyarrow.parquet.ParquetFile(parquet_path)
    assert table.num_row_groups == 2 and table.metadata.num_rows == 2 * COUNT
    assert table.schema_arrow.metadata[b"unit.load"] == b"N"
    columns = table.read().to_pydict()
    assert columns["load"][COUNT + 3] == load(3) and columns["note"][1] == "n1"
    assert columns["file"][0] == str(paths[0])

    # half a file: what is sound comes out, and the loss is reported
    cut = folder / "cut.mcap"
    cut.write_bytes(paths[0].read_bytes()[:9000])
    read("verify", cut, status=1)
    rows = read("trace", cut, "--topic", "/bench", status=3).splitlines()
    assert 50 < len(rows) < COUNT
    read("recover", cut, "-o", folder / "whole.mcap", status=3)
    read("verify", folder / "whole.mcap")
    kept = read("trace", folder / "whole.mcap", "--topic", "/bench").splitlines()
    assert kept == rows
    print(f"{len(paths)} recordings of the Python writer: every verb agrees; NumPy and Parquet read what it writes")
