"""Messages of plain fields as columns, and columns as tables of pandas, polars or numpy."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from google.protobuf.descriptor import FieldDescriptor
from numpy.typing import NDArray

from ._file import File

if TYPE_CHECKING:
    import pandas
    import polars
    import xarray

Table_co = TypeVar("Table_co", covariant=True)
Columns = dict[str, NDArray[Any]]
Maker = Callable[[Columns, dict[str, str]], Table_co]
"""Makes a table of columns, the first of which tells rows apart, and their units."""

TYPES: dict[int, type[np.generic]] = {
    FieldDescriptor.CPPTYPE_DOUBLE: np.float64,
    FieldDescriptor.CPPTYPE_UINT64: np.uint64,
    FieldDescriptor.CPPTYPE_ENUM: np.str_,
    FieldDescriptor.CPPTYPE_STRING: np.str_,
}


def read_columns(file: File, topic: str) -> Columns:
    """The fields of a topic over all messages, time first: what a message leaves out is NaN, names stand for the numbers of an
    enum, and lists have a column for every element, `layer_strain[0]`.

    Raises:
        OSError: The file cannot be read.
        RecordingError: There is no such topic, or it is damaged.
    """
    fields = sorted(file.descriptor(topic).fields, key=lambda field: field.name != "time")
    rows = [[_value(message, field) for field in fields] for message in file.messages(topic)]
    columns: Columns = {}
    for number, field in enumerate(fields):
        values = [row[number] for row in rows]
        if field.is_repeated:
            columns |= {f"{field.name}[{n}]": np.array(part, np.float64) for n, part in enumerate(zip(*values, strict=True))}
        else:
            columns[field.name] = np.array(values, np.float64 if field.has_presence else TYPES[field.cpp_type])
    return columns


def _value(message: Any, field: FieldDescriptor) -> Any:
    value = getattr(message, field.name)
    if field.is_repeated:
        return list(value)
    if field.has_presence and not message.HasField(field.name):
        return math.nan
    if field.enum_type is not None:
        known = field.enum_type.values_by_number.get(value)
        return str(value) if known is None else known.name
    return value


def to_numpy(columns: Columns, units: dict[str, str]) -> NDArray[np.void]:
    """A structured array; units have no place in it."""
    length = len(next(iter(columns.values())))
    table = np.empty(length, [(name, column.dtype) for name, column in columns.items()])
    for name, column in columns.items():
        table[name] = column
    return table


def to_pandas(columns: Columns, units: dict[str, str]) -> pandas.DataFrame:
    """A data frame with `units` by column in its `attrs`.

    Raises:
        ImportError: pandas is not installed.
    """
    try:
        import pandas
    except ImportError as error:
        text = 'tables need pandas: pip install pandas, or percuss.open(…, tables="numpy")'
        raise ImportError(text) from error
    table = pandas.DataFrame(columns)
    table.attrs["units"] = _units_by_column(columns, units)
    return table


def to_xarray(columns: Columns, units: dict[str, str]) -> xarray.Dataset:
    """Arrays over the first column and, where there is one, `step`, each with `units` in its `attrs`.

    Raises:
        ImportError: xarray is not installed.
    """
    try:
        import xarray
    except ImportError as error:
        raise ImportError("these tables need xarray: pip install xarray") from error
    over = next(iter(columns))
    known = _units_by_column(columns, units)
    arrays = {name: (over, column, {"units": known[name]} if name in known else {}) for name, column in columns.items()}
    return xarray.Dataset(arrays).set_coords([name for name in [over, "step"] if name in columns])


def _units_by_column(columns: Columns, units: dict[str, str]) -> dict[str, str]:
    return {name: unit for name in columns if (unit := units.get(name.partition("[")[0])) is not None}


def to_polars(columns: Columns, units: dict[str, str]) -> polars.DataFrame:
    """A data frame; units have no place in it.

    Raises:
        ImportError: polars is not installed.
    """
    try:
        import polars
    except ImportError as error:
        raise ImportError("these tables need polars: pip install polars") from error
    return polars.DataFrame(columns)


def maker(tables: str) -> Maker[Any]:
    """What makes tables of this name.

    Raises:
        ValueError: There are no such tables.
    """
    makers: dict[str, Maker[Any]] = {"pandas": to_pandas, "xarray": to_xarray, "polars": to_polars, "numpy": to_numpy}
    if tables not in makers:
        raise ValueError(f'tables = "{tables}" is none of {", ".join(makers)}')
    return makers[tables]
