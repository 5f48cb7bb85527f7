"""Reads recordings of percuss with an independent program: Python, the `mcap` and `mcap-protobuf-support` packages.

    check_recording.py PLANE.mcap TRACE.csv

PLANE.mcap is a run of a plane flat punch on a half-space (`percuss run fig4 --set geometry=plane`), TRACE.csv the
drag `percuss-read trace` makes of it. Every message is decoded through the descriptors in the file, all checksums
are on, the drag is compared with the closed form F = V0 (1 + c_s t/2) for t > 0.2, and the trace with the messages.
"""

import csv
import json
import sys
from collections import Counter

from mcap.reader import NonSeekingReader, make_reader
from mcap_protobuf.decoder import DecoderFactory

SHEAR_WAVE_SPEED = 0.5
# waves of the edge that the mesh does not resolve are damped in the first steps
FROM, TOLERANCE = 0.2, 3e-6
ROUNDING = 1e-12


def check(condition, message):
    if not condition:
        sys.exit(f"check_recording: {message}")


def decode(path):
    """All messages as (topic, log time, publish time, message), read twice: by index and from start to end."""
    runs = []
    for reader_of in (make_reader, NonSeekingReader):
        with open(path, "rb") as stream:
            reader = reader_of(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
            decoded = [
                (channel.topic, message.log_time, message.publish_time, proto)
                for _, channel, message, proto in reader.iter_decoded_messages()
            ]
            runs.append(decoded)
    check(Counter(row[0] for row in runs[0]) == Counter(row[0] for row in runs[1]), "readers disagree")
    return runs[0]


def main(recording, trace):
    messages = decode(recording)
    counts = Counter(row[0] for row in messages)

    with open(recording, "rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        summary = reader.get_summary()
        check(summary is not None, "there is no summary")
        metadata = {record.name: record.metadata for record in reader.iter_metadata()}
        attachments = {record.name: record for record in reader.iter_attachments()}
    total = summary.statistics.message_count
    check(total == len(messages), f"{len(messages)} of {total} messages were decoded")
    check(metadata["percuss.status"]["status"] == "completed", metadata["percuss.status"])
    check({"case.toml", "case.resolved.toml", "layout.json"} <= set(attachments), "attachments are missing")
    check(all(a.log_time == 0 and a.create_time == 0 for a in attachments.values()), "attachments have times")

    run = metadata["percuss.run"]
    steps, rate = int(run["steps"]), float(run["playback_rate"])
    check(counts["/drag"] == counts["/velocity"] == counts["/probes"] == steps + 1, counts)
    last = 0
    for topic, log_time, publish_time, proto in messages:
        check(log_time == publish_time, f"{topic}: log and publish time differ")
        check(log_time >= last, f"{topic}: time runs backwards")
        last = log_time
        if proto.DESCRIPTOR.full_name.startswith("percuss."):
            check(log_time == round(1e9 * rate * proto.time), f"{topic}: log time is not that of the step")

    with open(trace, encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    drags = [proto for topic, _, _, proto in messages if topic == "/drag"]
    check(len(rows) == len(drags), "the trace has another number of rows")
    worst = 0.0
    for row, drag in zip(rows, drags):
        check(float(row["time [R/c_p]"]) == drag.time, "times of the trace differ")
        check(float(row["force [Rγc_p²]"]) == drag.force, "drag of the trace differs")
        if FROM < drag.time < 2 / SHEAR_WAVE_SPEED:
            worst = max(worst, abs(drag.force - (1 + SHEAR_WAVE_SPEED * drag.time / 2)))
    check(worst <= TOLERANCE, f"the drag is off the closed form by {worst}")

    stress = [proto for topic, _, _, proto in messages if topic == "/interface/stress"]
    check(len(stress) == len(drags), "there is not one interface stress per step")
    for proto, drag in zip(stress, drags):
        force = sum(proto.stress) * proto.dr
        check(abs(force - drag.force) <= ROUNDING * max(1, drag.force), "the drag is not the sum of the stress")
    print(json.dumps({"messages": len(messages), "topics": len(counts), "largest_drag_error": worst}))


if __name__ == "__main__":
    main(*sys.argv[1:])
