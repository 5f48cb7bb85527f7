"""Tables and summaries are those of percuss-read, number by number, bit by bit."""

from __future__ import annotations

import json
import sys
import tomllib
from pathlib import Path
from typing import Any, assert_type

import numpy as np
import pandas
import percuss
import polars
import pyarrow.parquet
import pytest
import xarray
from conftest import RUNS, Programs
from numpy.typing import NDArray

TABLES = {"/drag": "drag", "/velocity": "velocity", "/energy": "energy", "/event": "events"}


def same(found: NDArray[Any], expected: NDArray[Any]) -> bool:
    """Equal bits; texts are equal."""
    return found.shape == expected.shape and found.astype(expected.dtype).tobytes() == expected.tobytes()


def traced(
    program: Programs, recording: Path, topic: str, folder: Path
) -> tuple[dict[str, NDArray[Any]], dict[str, str]]:
    """Columns of `percuss-read trace` and their units; without a value: NaN."""
    path = folder / "trace.parquet"
    program("percuss-read", "trace", recording, "--topic", topic, "-o", path, "--force")
    table = pyarrow.parquet.read_table(path)
    columns = {}
    for name in table.column_names:
        column = table[name].to_pandas()
        columns[name] = np.array(
            column.astype(float) if column.hasnans else column, str if column.dtype == object else None
        )
    entries = table.schema.metadata.items()
    return columns, {
        key.decode().removeprefix("unit."): unit.decode() for key, unit in entries if key.startswith(b"unit.")
    }


@pytest.mark.parametrize("topic", TABLES)
def test_tables(program: Programs, recording: Path, topic: str, tmp_path: Path) -> None:
    run = percuss.open(recording)
    if topic not in run.topics:
        assert topic != "/velocity"
        with pytest.raises(percuss.RecordingError, match=f"has no {topic}; it has .*/velocity"):
            getattr(run, TABLES[topic])
        return
    columns, units = traced(program, recording, topic, tmp_path)
    table: pandas.DataFrame = getattr(run, TABLES[topic])
    other: polars.DataFrame = getattr(percuss.open(recording, tables="polars"), TABLES[topic])
    plain: NDArray[np.void] = getattr(percuss.open(recording, tables="numpy"), TABLES[topic])
    dataset: xarray.Dataset = getattr(percuss.open(recording, tables="xarray"), TABLES[topic])
    assert list(table.columns) == other.columns == list(plain.dtype.names or ()) == list(columns)
    assert list(dataset.sizes) == ["time"] and set(dataset.coords) == {"time", "step"}
    assert list(dataset.variables) == list(columns)
    assert table.attrs["units"] == units
    assert {name: column.attrs["units"] for name, column in dataset.variables.items() if column.attrs} == units
    for name, column in columns.items():
        expected = column.astype(str) if column.dtype.kind in "OTU" else column
        for found in [table[name].to_numpy(), other[name].to_numpy(), plain[name], dataset[name].to_numpy()]:
            assert same(found.astype(str) if expected.dtype.kind == "U" else found, expected), name


def test_types(recordings: dict[str, Path]) -> None:
    assert_type(percuss.open(recordings["flat"]).drag, pandas.DataFrame)
    assert_type(percuss.open(recordings["flat"], tables="xarray").drag, xarray.Dataset)
    assert_type(percuss.open(recordings["flat"], tables="polars").drag, polars.DataFrame)
    assert_type(percuss.open(recordings["flat"], tables="numpy").drag, NDArray[np.void])
    assert isinstance(percuss.open(recordings["flat"], tables="numpy").drag, np.ndarray)


def test_summary(program: Programs, recording: Path) -> None:
    shown = json.loads(program("percuss-read", "summary", recording, "--format", "json"))
    [row] = shown["rows"]
    run = percuss.open(recording)
    assert run.summary == {name: number for name, number in row.items() if name not in ["file", "title"]}
    assert run.summary_units == shown["units"]


def test_every_measure_is_tested(recordings: dict[str, Path]) -> None:
    measured = {
        name
        for path in recordings.values()
        for name, number in percuss.open(path).summary.items()
        if number is not None
    }
    assert measured == set(percuss.open(recordings["laminate"]).summary)


def test_case(program: Programs, recordings: dict[str, Path]) -> None:
    case = percuss.open(recordings["laminate"]).case
    shown = program("percuss", "check", *RUNS["laminate"][1:], "--resolved")
    assert case == tomllib.loads(shown) and case["record"]["compression"] == "none"


def test_tables_of_nothing_installed(recordings: dict[str, Path], monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ["pandas", "polars", "xarray"]:
        monkeypatch.setitem(sys.modules, name, None)
    run = percuss.open(recordings["flat"])
    with pytest.raises(ImportError, match=r"pip install pandas, or .*numpy"):
        run.drag
    with pytest.raises(ImportError, match=r"pip install xarray"):
        run.profile(t=1)
    with pytest.raises(ImportError, match=r"pip install xarray"):
        percuss.open(recordings["flat"], tables="xarray").drag
    with pytest.raises(ImportError, match=r"pip install polars"):
        percuss.open(recordings["flat"], tables="polars").drag
    force = percuss.open(recordings["flat"], tables="numpy").drag["force"]
    assert force.max() == run.summary["peak_force"]


def test_unknown_tables(recordings: dict[str, Path]) -> None:
    with pytest.raises(ValueError, match='tables = "excel" is none of pandas, xarray, polars, numpy'):
        percuss.open(recordings["flat"], tables="excel")  # type: ignore[call-overload]
