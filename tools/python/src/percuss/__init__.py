"""Impact on elastic layers: runs, and their recordings as data frames and labelled arrays with units.

    import percuss

    run = percuss.run("fig5", mesh={"cells": 200})
    run = percuss.open("fig5.mcap")     # the same of a recording that is there
    run.drag                            # a data frame: time, step, force, contact_radius; units in attrs["units"]
    run.field("stress", t=2.5)          # an xarray.DataArray over z and r; units in attrs["units"]
    run.profile(t=2.5)                  # interface stress over r
    run.summary["peak_force"]           # what `percuss-read summary` measures
    run.warnings                        # what the run advises
    run.case["mesh"]["cells"]           # the complete case

All numbers are as they are recorded: dimensionless, or in SI if the case is physical. The file is open only while something is
read of it, and what is read is what is asked for.
"""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any, Literal, overload

import numpy
from numpy.typing import NDArray

from ._arrays import Times
from ._errors import CaseError, Error, Place, Problem, RecordingError, RunError
from ._recording import Recording
from ._run import Case, check, exact, run, sweep
from ._sweep import Sweep
from ._tables import maker

if TYPE_CHECKING:
    import pandas
    import polars
    import xarray

__all__ = [
    "Case",
    "CaseError",
    "Error",
    "Place",
    "Problem",
    "Recording",
    "RecordingError",
    "RunError",
    "Sweep",
    "Times",
    "check",
    "exact",
    "open",
    "run",
    "sweep",
]


@overload
def open(path: str | os.PathLike[str], tables: Literal["pandas"] = "pandas") -> Recording[pandas.DataFrame]: ...
@overload
def open(path: str | os.PathLike[str], tables: Literal["xarray"]) -> Recording[xarray.Dataset]: ...
@overload
def open(path: str | os.PathLike[str], tables: Literal["polars"]) -> Recording[polars.DataFrame]: ...
@overload
def open(path: str | os.PathLike[str], tables: Literal["numpy"]) -> Recording[NDArray[numpy.void]]: ...
def open(path: str | os.PathLike[str], tables: str = "pandas") -> Recording[Any]:
    """Opens a recording: reads its index and metadata, nothing else.

    Args:
        path: The recording, format 2.x; also an interrupted one, `.mcap.part`, that has an index.
        tables: What tables are: `pandas` data frames with units in `attrs["units"]`, `xarray` datasets over time with units in
            the `attrs` of each variable, `polars` data frames or structured `numpy` arrays; of the last two, `Recording.units`
            has the units.

    Raises:
        OSError: The file cannot be read.
        RecordingError: It is no recording of percuss of format 2.x, or has no index.
        ValueError: There are no such tables.
    """
    return Recording(path, maker(tables))
