"""Reads the view channels and the layout of a recording as viewers do.

    check_views.py RUN.mcap [PLOTJUGGLER.xml]

Decodes every message with the Python libraries of MCAP, compares the schemas with those that are published, checks what
viewers need (see below), resolves every path of the layouts, and lets Rerun convert the file. Needs the PyPI packages mcap,
mcap-protobuf-support, foxglove-schemas-protobuf, pillow and rerun-sdk.
"""

import collections
import importlib
import io
import json
import re
import subprocess
import sys
import tempfile
import xml.etree.ElementTree

import PIL.Image
from google.protobuf import descriptor_pb2
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

WIDTH = {1: 1, 2: 1, 3: 2, 4: 2, 5: 4, 6: 4, 7: 4, 8: 8}


def fields(file):
    """Fields and values of all messages and enumerations of a file, by name, number and type."""
    found = set()

    def enumeration(kind, path):
        for value in kind.value:
            found.add((path + kind.name, value.name, value.number))

    def message(kind, path):
        path += kind.name
        for field in kind.field:
            found.add((path, field.name, field.number, field.type, field.label, field.type_name))
        for inner in kind.nested_type:
            message(inner, path + ".")
        for inner in kind.enum_type:
            enumeration(inner, path + ".")

    for kind in file.message_type:
        message(kind, "")
    for kind in file.enum_type:
        enumeration(kind, "")
    return found


def same_as_published(schema):
    """Every file of a foxglove schema has the fields of the published one."""
    count = 0
    for file in descriptor_pb2.FileDescriptorSet.FromString(schema.data).file:
        if file.package != "foxglove":
            continue
        name = file.name.rsplit("/", 1)[-1].removesuffix(".proto")
        official = descriptor_pb2.FileDescriptorProto()
        importlib.import_module(f"foxglove_schemas_protobuf.{name}_pb2").DESCRIPTOR.CopyToProto(official)
        assert fields(file) == fields(official), (name, fields(file) ^ fields(official))
        count += 1
    return count


def check_grid(grid):
    assert grid.fields and len(grid.data) % grid.row_stride == 0 and grid.data
    assert grid.cell_stride * grid.column_count <= grid.row_stride
    for field in grid.fields:
        assert field.offset + WIDTH[field.type] <= grid.cell_stride
    assert grid.cell_size.x > 0 and grid.cell_size.y > 0 and grid.pose.orientation.w == 1


def check_image(image):
    assert image.format == "png"
    picture = PIL.Image.open(io.BytesIO(image.data))
    picture.load()
    assert picture.width >= 1200 and len(picture.convert("RGB").getcolors(1 << 20)) > 20


def check_scene(scene):
    ids = [entity.id for entity in scene.entities]
    assert len(ids) == len(set(ids)) and ids
    for entity in scene.entities:
        assert entity.frame_id in ("world", "indenter")
        for line in entity.lines:
            assert len(line.points) >= 2 and line.HasField("pose") and line.HasField("color")
        for triangles in entity.triangles:
            assert len(triangles.points) % 3 == 0 and triangles.points


def check_tf(transforms):
    for transform in transforms.transforms:
        assert transform.HasField("translation") and transform.HasField("rotation")
        assert (transform.parent_frame_id, transform.child_frame_id) == ("world", "indenter")


def check_profile(profile):
    lengths = {len(profile.r), len(profile.stress), len(profile.displacement), len(profile.indenter)}
    assert len(lengths) == 1 and 2 <= lengths.pop() <= 500


CHECKS = {
    "/view/field": check_grid,
    "/view/image": check_image,
    "/view/scene": check_scene,
    "/view/fronts": check_scene,
    "/view/tf": check_tf,
    "/view/profile": check_profile,
}


def stamps(message):
    """All time stamps of a message of viewers."""
    if hasattr(message, "timestamp"):
        yield message.timestamp
    for name in ("entities", "transforms"):
        for inner in getattr(message, name, []):
            yield inner.timestamp


def resolves(path, samples):
    """True if a message path of a layout finds something in the messages of its topic."""
    topic, _, rest = path.partition(".")
    value = samples.get(topic)
    if value is None:
        return False
    for name, index in re.findall(r"(\w+)(?:\[([^\]]*)\])?", rest):
        if name not in value.DESCRIPTOR.fields_by_name:
            return False
        value = getattr(value, name)
        if index == ":":
            return len(value) > 0
        if index:
            if int(index) >= len(value):
                return False
            value = value[int(index)]
    return isinstance(value, (int, float))


def check_layout(layout, samples):
    """Every panel is placed once, every topic and path is there."""
    placed = []

    def walk(node):
        if isinstance(node, str):
            placed.append(node)
        else:
            assert node["direction"] in ("row", "column") and 0 < node["splitPercentage"] < 100
            walk(node["first"])
            walk(node["second"])

    walk(layout["layout"])
    panels = layout["configById"]
    assert sorted(placed) == sorted(panels), (placed, list(panels))
    assert {"3D", "Plot", "RosOut"} == {name.split("!")[0] for name in panels}
    paths = 0
    for panel in panels.values():
        wanted = [path["value"] for path in panel.get("paths", [])]
        wanted += [panel["xAxisPath"]["value"]] if "xAxisPath" in panel else []
        for path in wanted:
            assert resolves(path, samples), f"{path} leads nowhere"
        paths += len(wanted)
        for topic, settings in panel.get("topics", {}).items():
            assert topic in samples and settings["visible"], topic
            if settings.get("colorMode") == "rgba-fields":
                names = {field.name for field in samples[topic].fields}
                assert {"red", "green", "blue", "alpha"} <= names, names
    return paths


def check_plotjuggler(path, samples):
    """Every curve is a number that PlotJuggler makes of the messages: topic/field or topic/field[index]."""
    root = xml.etree.ElementTree.parse(path).getroot()
    curves = [curve.get("name") for curve in root.iter("curve")]
    assert curves
    for curve in curves:
        topic, _, field = curve.rpartition("/")
        assert resolves(f"{topic}.{field}", samples), curve
    return len(curves)


# What Rerun makes of the messages it understands by itself.
UNDERSTOOD = {"/log": "TextLog:text", "/view/image": "EncodedImage:blob", "/view/tf": "Transform3D:translation"}


def check_rerun(path, counts):
    """Rerun converts the file; every topic is an entity with all of its messages."""
    with tempfile.TemporaryDirectory() as folder:
        converted = f"{folder}/run.rrd"
        done = subprocess.run(["rerun", "mcap", "convert", path, "-o", converted], capture_output=True, text=True)
        said = done.stdout + done.stderr
        # it exits with 0 even where it fails
        assert done.returncode == 0 and "ERROR" not in said, said
        skipped = [line for line in said.splitlines() if re.search(r"skip|unsupported|failed|not supported", line, re.I)]
        assert not skipped, skipped
        printed = subprocess.run(["rerun", "rrd", "print", converted], capture_output=True, text=True, check=True)
    rows, columns = collections.Counter(), collections.defaultdict(set)
    for line in printed.stdout.splitlines():
        found = re.search(r" with (\d+) rows .* - (/\S+) - data columns: \[(.*)\]", line)
        # the first chunk of an entity says what its channel is
        if found and "McapChannel:topic" not in found[3]:
            rows[found[2]] += int(found[1])
            columns[found[2]].update(found[3].split())
    for topic, count in counts.items():
        assert rows[topic] == count, f"Rerun has {rows[topic]} of {count} messages of {topic}: {said}"
        wanted = UNDERSTOOD.get(topic, ":message")
        assert any(column.endswith(wanted) for column in columns[topic]), (topic, columns[topic])
    return sum(rows[topic] for topic in counts)


def main():
    path = sys.argv[1]
    samples, counts, compared = {}, collections.Counter(), {}
    with open(path, "rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        for schema, channel, record, message in reader.iter_decoded_messages():
            counts[channel.topic] += 1
            samples[channel.topic] = message
            if schema.name.startswith("foxglove.") and schema.name not in compared:
                compared[schema.name] = same_as_published(schema)
            for stamp in stamps(message):
                assert stamp.seconds * 10**9 + stamp.nanos == record.log_time == record.publish_time
            if channel.topic in CHECKS:
                CHECKS[channel.topic](message)
        attachments = {attachment.name: attachment.data for attachment in reader.iter_attachments()}
    views = [topic for topic in counts if topic.startswith("/view")]
    assert sorted(views) == sorted(CHECKS), views
    assert len({counts[topic] for topic in views}) == 1, "one message of each a frame"
    print(f"{sum(counts[topic] for topic in views)} messages of {len(views)} view channels decoded")
    print(f"schemas as published: {', '.join(sorted(compared))} with {sum(compared.values())} files")
    paths = check_layout(json.loads(attachments["layout.json"]), samples)
    print(f"layout.json: all {paths} paths lead to numbers")
    for layout in sys.argv[2:]:
        print(f"{layout}: all {check_plotjuggler(layout, samples)} curves lead to numbers")
    total = check_rerun(path, counts)
    print(f"Rerun: entities for all {len(counts)} topics with all {total} messages")


main()
