"""Turns a recording of percuss into one of Rerun with a blueprint: the section, drag, velocity and probes against time, the log.

    pip install rerun-sdk==0.41.0 mcap
    python tools/viewers/rerun_view.py fig5.mcap      writes fig5.rrd
    rerun fig5.rrd

Rerun opens the .mcap file too, and shows images, transforms and logs of it; numbers in messages of other types only
through a blueprint, which says where in a message they are. A blueprint belongs to one version of Rerun.
"""

import argparse
import pathlib

import rerun as rr
import rerun.blueprint as rrb
from mcap.reader import make_reader
from rerun.blueprint.encodings import ComponentSourceKind, VisualizerComponentMapping

COLOURS = [0x0072B2FF, 0xD55E00FF, 0x009E73FF, 0xE69F00FF, 0xCC79A7FF, 0x56B4E9FF, 0x999999FF]


def line(schema, field, name, colour):
    """A line of a plot that takes its values from a field of the messages of an entity."""
    mapping = VisualizerComponentMapping(
        target="Scalars:scalars",
        source_kind=ComponentSourceKind.SourceComponent,
        source_component=f"{schema}:message",
        selector=field,
    )
    return rr.SeriesLines(names=[name], colors=[colour]).visualizer(mappings=[mapping])


def plot(name, origin, lines):
    return rrb.TimeSeriesView(
        name=name, origin=origin, overrides={origin: lines}, plot_legend=rrb.PlotLegend(visible=True)
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recording", type=pathlib.Path)
    parser.add_argument("-o", "--output", type=pathlib.Path, help="default: the name of the recording with .rrd")
    arguments = parser.parse_args()
    with open(arguments.recording, "rb") as file:
        summary = make_reader(file).get_summary()
    channels = {channel.topic: channel for channel in summary.channels.values()}

    def unit(topic, field):
        return channels[topic].metadata[f"unit.{field}"]

    plots = []
    if "/drag" in channels:
        plots.append(plot(f"Drag F [{unit('/drag', 'force')}]", "/drag", [line("percuss.Drag", ".force", "F", COLOURS[0])]))
    plots.append(
        plot(f"Velocity V [{unit('/velocity', 'velocity')}]", "/velocity", [line("percuss.Velocity", ".velocity", "V", COLOURS[1])])
    )
    if "/probes" in channels:
        radii = channels["/probes"].metadata["axis.stress"].split(",")
        lines = [
            line("percuss.Probes", f".stress[{i}]", f"r = {float(r):.4g}", COLOURS[i % len(COLOURS)])
            for i, r in enumerate(radii)
        ]
        plots.append(plot(f"Interface stress [{unit('/probes', 'stress')}]", "/probes", lines))
    views = [rrb.Horizontal(*plots), rrb.TextLogView(name="Log", origin="/log")]
    shares = [4, 2]
    if "/view/image" in channels:
        shown = channels["/view/image"].metadata["shows"]
        views.insert(0, rrb.Spatial2DView(name=f"Section, {shown}", origin="/view/image"))
        shares.insert(0, 3)
    blueprint = rrb.Blueprint(rrb.Vertical(*views, row_shares=shares), collapse_panels=True)
    output = arguments.output or arguments.recording.with_suffix(".rrd")
    rr.init(arguments.recording.stem)
    rr.save(output, default_blueprint=blueprint)
    rr.log_file_from_path(arguments.recording)
    rr.disconnect()
    print(output)


if __name__ == "__main__":
    main()
