"""The folder of a sweep: its summary as a table, its recordings."""

from __future__ import annotations

import csv
import json
from contextlib import suppress
from functools import cached_property
from pathlib import Path
from typing import Any, Generic

import numpy as np
from numpy.typing import NDArray

from ._errors import RecordingError
from ._recording import Recording
from ._tables import Columns, Maker, Table_co


class Sweep(Generic[Table_co]):
    """A sweep, see `percuss.sweep`."""

    def __init__(self, path: Path, make: Maker[Table_co], folder: object = None) -> None:
        """
        Args:
            path: The folder.
            make: Makes tables.
            folder: What keeps the folder, as long as the sweep is used.
        """
        self.path = path.absolute()
        """The folder; that of a sweep without an output is there as long as this object and recordings of it."""
        self._make = make
        self._folder = folder

    def __repr__(self) -> str:
        return f"<percuss.Sweep {self.path}>"

    @property
    def summary(self) -> Table_co:
        """A row for each case: its number in `case`, what varies, its `status`, what `percuss-read summary` measures, NaN for what
        the recording does not say, and in `warnings` the subjects of what it is warned of."""
        return self._make(self._columns, self.summary_units)

    @cached_property
    def summary_units(self) -> dict[str, str]:
        """Units of `summary`; plain numbers have none."""
        heads = (head.rstrip("]").partition(" [") for head in self._rows[0])
        return {name: unit for name, _, unit in heads if unit}

    def recording(self, case: int) -> Recording[Table_co]:
        """The recording of a case.

        Args:
            case: Number of the case, from 1 on.

        Raises:
            RecordingError: It has not been kept.
        """
        files = {}
        with open(self.path / "manifest.jsonl", encoding="utf-8") as journal:
            for line in journal:
                # a line replaces those before it; of a damaged one the case has been computed again
                with suppress(ValueError):
                    entry = json.loads(line)
                    files[entry["case"]] = entry.get("file")
        if files.get(case) is None:
            raise RecordingError(f"{self.path} has no recording of case {case}")
        return Recording(self.path / files[case], self._make, self._folder)

    @cached_property
    def _rows(self) -> list[list[str]]:
        with open(self.path / "summary.csv", encoding="utf-8", newline="") as file:
            return list(csv.reader(file))

    @cached_property
    def _columns(self) -> Columns:
        names = [head.partition(" [")[0] for head in self._rows[0]]
        return {name: _column(name, cells) for name, *cells in zip(names, *self._rows[1:], strict=True)}


def _column(name: str, cells: list[str]) -> NDArray[Any]:
    """Numbers where all cells are, else texts."""
    if name == "case":
        return np.array(cells, np.uint64)
    try:
        # a column of texts may be empty
        return np.array([float(cell or "nan") for cell in cells] if name not in ["status", "warnings"] else cells)
    except ValueError:
        return np.array(cells)
