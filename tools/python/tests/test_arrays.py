"""Labelled arrays are those of percuss-read, number by number, bit by bit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import percuss
import pytest
import xarray
from conftest import Programs
from test_tables import same, traced


def test_fields(program: Programs, recording: Path, tmp_path: Path) -> None:
    run = percuss.open(recording)
    recorded = [
        topic.removeprefix("/field/") for topic, count in run.topics.items() if count > 0 and "/field/" in topic
    ]
    assert recorded == (run.case["record"]["fields"] if recording.stem not in ["cone", "exact"] else [])
    for name in recorded:
        field = run.field(name)
        topic = f"/field/{name}"
        assert field.dims == ("time", "z", "r") and field.dtype == np.float32 and field.name == name
        assert field.sizes["time"] == run.topics[topic]
        assert field.attrs["units"] == run.units(topic)["values"]
        for axis in ["time", "r", "z"]:
            assert field[axis].attrs["units"] == run.units(topic)[{"time": "time"}.get(axis, f"{axis}0")]
        for number in [0, field.sizes["time"] // 2, -1]:
            frame = field[number]
            path = tmp_path / "field.npz"
            time = repr(float(frame.time))
            program("percuss-read", "export", recording, "--topic", topic, f"--at-time={time}", "-o", path, "--force")
            expected = np.load(path)
            assert same(frame.values, expected["values"]), time
            assert same(frame.z.values, expected["z"]) and same(frame.r.values, expected["r"])
            xarray.testing.assert_identical(run.field(name, t=float(frame.time)), frame)


def test_profiles(program: Programs, recording: Path, tmp_path: Path) -> None:
    run = percuss.open(recording)
    columns, units = traced(program, recording, "/interface/stress", tmp_path)
    profiles = run.profile()
    assert same(profiles.time.values, columns.pop("time")) and same(profiles.step.values, columns.pop("step"))
    expected = np.array(list(columns.values())).T
    # messages leave out nodes without contact so far; closed forms say NaN where they do not hold
    assert same(profiles.values, expected if recording.stem == "exact" else np.nan_to_num(expected, nan=0.0))
    assert profiles.attrs["units"] == units["stress[0]"] and profiles.r.attrs["units"] == run.summary_units["depth"]
    middle = len(expected) // 2
    profile = run.profile(t=float(profiles.time[middle]))
    assert same(profile.values, expected[middle, : profile.size]) and np.isnan(expected[middle, profile.size :]).all()
    assert same(profile.r.values, profiles.r.values[: profile.size])
    # near the contact cells are alike on a graded mesh, too
    even = profiles.r.values[0] + np.arange(profiles.r.size) * float(run.metadata["percuss.run"]["dr"])
    assert profiles.r.values == pytest.approx(even, rel=1e-12)


def test_growing_contact_is_padded(recordings: dict[str, Path]) -> None:
    profiles = percuss.open(recordings["cone"]).profile()
    widths = [percuss.open(recordings["cone"]).profile(t=float(time)).size for time in profiles.time[[0, 1, -1]]]
    assert widths[0] < widths[1] < widths[2] == profiles.sizes["r"]
    assert profiles[0, : widths[0]].all() and not profiles[0, widths[0] :].any()


def test_probes(program: Programs, recording: Path, tmp_path: Path) -> None:
    run = percuss.open(recording)
    columns, _ = traced(program, recording, "/probes", tmp_path)
    probes = run.probes
    assert same(probes.time.values, columns.pop("time")) and same(probes.step.values, columns.pop("step"))
    assert probes.dims == ("time", "r") and same(
        probes.values, np.array(list(columns.values())).T.reshape(probes.shape)
    )
    assert probes.sizes["r"] == len(columns) == len(run.case["record"]["probes"])
    if run.metadata["percuss.run"]["units"] == "dimensionless":
        assert [f"stress@r={radius:g}" for radius in probes.r.values] == list(columns)
        assert list(probes.r.values) == run.case["record"]["probes"]


@pytest.mark.parametrize("name", ["ball", "ball-2.1", "laminate"])
def test_points(program: Programs, recordings: dict[str, Path], name: str, tmp_path: Path) -> None:
    run = percuss.open(recordings[name])
    columns, units = traced(program, recordings[name], "/points", tmp_path)
    points = run.points
    assert same(points.time.values, columns.pop("time")) and same(points.step.values, columns.pop("step"))
    stacked = [points[field].values.T for field in ["displacement", "velocity", "stress"]]
    assert same(np.concatenate(stacked), np.array(list(columns.values())))
    assert {points[field].attrs["units"] for field in points} == set(units.values()) - {"s"}
    places = {"ball": [(0.0, 0.01), (0.005, 0.0)], "laminate": [(0.0, 0.003), (0.0, 0.00376)]}
    assert list(zip(points.r.values, points.z.values)) == places[name.partition("-")[0]]
    assert points.r.attrs["units"] == points.z.attrs["units"] == "m"


@pytest.mark.parametrize("name", ["ball", "ball-2.1", "laminate"])
def test_lines(program: Programs, recordings: dict[str, Path], name: str, tmp_path: Path) -> None:
    run = percuss.open(recordings[name])
    lines = [topic for topic in run.topics if topic.startswith("/line/")]
    assert len(lines) == len(run.case["record"]["lines"])
    for number, topic in enumerate(lines):
        columns, _ = traced(program, recordings[name], topic, tmp_path)
        line = run.line(number)
        assert same(line.time.values, columns.pop("time")) and same(line.step.values, columns.pop("step"))
        assert same(line.values, np.array(list(columns.values())).T)
        assert line.dims == (("time", "z") if number == 0 else ("time", "r"))
        assert line.coords["r" if number == 0 else "z"].item() == (0.0 if number == 0 else 0.002)
    along = run.line(0)
    end = layers(run)[-1]["bottom"] if name == "laminate" else 0.02
    assert along.z.values[0] == 0.0 and lower_face(run, along.z.values) == pytest.approx(end, rel=1e-12)


def layers(run: percuss.Recording[object]) -> list[dict[str, float]]:
    entries = run.metadata["percuss.run"]
    numbers = range(1, int(entries.get("layers", 0)) + 1)
    return [{key: float(entries[f"layer.{n}.{key}"]) for key in ["top", "bottom", "rows"]} for n in numbers]


def lower_face(run: percuss.Recording[object], depths: np.ndarray) -> float:
    """Depth of the lower face of a layer with these rows of nodes, if it is the last one."""
    # a free back lies half a row of cells below the last row of nodes
    overhang = 0.5 if run.metadata["percuss.run"].get("back") == "free" else 0.0
    return float(depths[-1] + overhang * (depths[-1] - depths[-2]))


def test_interfaces_stand_twice(recordings: dict[str, Path]) -> None:
    run = percuss.open(recordings["laminate"])
    for array in [run.field("stress", t=1e-5), run.line(0)]:
        assert list(np.unique(array.layer)) == [1, 2, 3]
        for number, layer in enumerate(layers(run), start=1):
            part = array.isel(z=array.layer == number)
            assert part.z.values[0] == pytest.approx(layer["top"], abs=1e-12)
            last = lower_face(run, part.z.values) if number == 3 else part.z.values[-1]
            assert last == pytest.approx(layer["bottom"], abs=1e-12)
            assert part.indexes["z"].is_unique
            assert part.sel(z=layer["bottom"], method="nearest").layer == number
    assert "layer" not in percuss.open(recordings["ball"]).field("stress", t=1e-5).coords


def test_layers_of_an_indenter_that_gives() -> None:
    striker = {"layer": [{"thickness": "4 mm", "material": "pmma"}, {"thickness": "10 mm", "material": "steel"}]}
    case = {
        "title": "two layers on two layers",
        "model": "elastic",
        "target": {"layer": [{"thickness": "3 mm", "material": "glass"}, {"thickness": "2 mm", "material": "pmma"}]},
        "indenter": {"shape": "sphere", "radius": "5 mm", "nose_radius": "5 mm", "body": striker},
        "impact": {"velocity": "5 m/s"},
        "mesh": {"contact_cells": 8},
        "run": {"end_time": "1 us"},
        "record": {"frames": 2, "lines": [{"r": "0 mm"}]},
    }
    run = percuss.run(case)
    ends = {-1: [-0.014, -0.004], 0: [-0.004, 0], 1: [0, 0.003], 2: [0.003, 0.005]}
    for array in [run.field("stress", t=1e-6), run.line(0)]:
        assert list(np.unique(array.layer)) == list(ends)
        for number, (top, bottom) in ends.items():
            part = array.isel(z=array.layer == number)
            # recorded out to a depth only
            assert number == -1 or part.z.values[0] == pytest.approx(top, abs=1e-12)
            assert part.z.values[-1] == pytest.approx(bottom, abs=1e-12) and part.indexes["z"].is_unique
            assert -0.0141 < part.z.values[0]


def test_selected_times(recordings: dict[str, Path]) -> None:
    run = percuss.open(recordings["flat"])
    frames = run.field("stress")
    times = frames.time.values
    xarray.testing.assert_identical(run.field("stress", t=slice(times[3], times[9])), frames[3:10])
    xarray.testing.assert_identical(run.field("stress", t=slice(times[3] + 1e-6, times[9] - 1e-6)), frames[4:9])
    xarray.testing.assert_identical(run.field("stress", t=slice(None, times[5]), every=2), frames[0:6:2])
    xarray.testing.assert_identical(run.field("stress", t=slice(times[30], None)), frames[30:])
    xarray.testing.assert_identical(run.field("stress", every=7), frames[::7])
    gap = times[4] - times[3]
    assert run.field("stress", t=times[3] + 0.4 * gap).time == times[3]
    assert run.field("stress", t=times[3] + 0.6 * gap).time == times[4]
    # a quarter of a step is a whole number of nanoseconds here
    steps = run.profile().time.values
    assert run.profile(t=(steps[6] + steps[7]) / 2).time == steps[6]


def test_times_that_are_not_there(recordings: dict[str, Path]) -> None:
    run = percuss.open(recordings["flat"])
    for time in [-1.0, 7.0, float("nan"), float("inf")]:
        with pytest.raises(percuss.RecordingError, match="has /field/stress from 0 to 6, not at "):
            run.field("stress", t=time)
    with pytest.raises(percuss.RecordingError, match="no message of /field/stress from 7 to None"):
        run.field("stress", t=slice(7, None))
    with pytest.raises(ValueError, match="every = 0 is not at least 1"):
        run.field("stress", every=0)
    with pytest.raises(ValueError, match="has a step"):
        run.field("stress", t=slice(0, 1, 2))
    with pytest.raises(percuss.RecordingError, match="has no /field/strain; it has .*/field/stress"):
        run.field("strain")
    with pytest.raises(percuss.RecordingError, match="has no message of /field/stress"):
        percuss.open(recordings["cone"]).field("stress")
