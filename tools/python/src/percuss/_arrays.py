"""Messages that hold arrays, as labelled arrays with their positions, times and units."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ._errors import RecordingError
from ._file import File, sound

if TYPE_CHECKING:
    import xarray

Times = float | slice | None
"""A time, a range of times, or all. [time of the recording]"""


def pick(file: File, topic: str, t: Times, every: int) -> NDArray[np.intp]:
    """Numbers of the messages at some times, found by the index, to the nanosecond of log time.

    Args:
        file: The recording.
        topic: The topic.
        t: A time: the nearest message, of two that are equally near the earlier; a range: all messages within, both ends
            included; None: all messages.
        every: Of these, the first and every so many after it.

    Raises:
        ValueError: `every` is less than 1, or the range has a step.
        RecordingError: There is no message at such a time.
    """
    if every < 1:
        raise ValueError(f"every = {every} is not at least 1")
    log_times = file.index(topic).log_times
    if log_times.size == 0:
        raise RecordingError(f"{file.path} has no message of {topic}")
    with sound(file.damaged("percuss.run")):
        scale = 1e9 * float(file.metadata["percuss.run"]["playback_rate"])
    if not isinstance(t, slice):
        if t is None:
            return np.arange(0, log_times.size, every)
        at = np.floor(scale * t + 0.5)
        # as far before the first and after the last as the next one would be
        ends = 2 * log_times[[0, -1]] - log_times[[1, -2]] if log_times.size > 1 else log_times[[0, 0]]
        if not ends[0] <= at <= ends[1]:
            first, last = log_times[[0, -1]] / scale
            raise RecordingError(f"{file.path} has {topic} from {first:g} to {last:g}, not at {t:g}")
        return np.array([np.argmin(np.abs(log_times - at))])
    if t.step is not None:
        raise ValueError(f"{t} has a step: `every` takes every so many messages")
    first = 0 if t.start is None else np.searchsorted(log_times, np.floor(scale * t.start + 0.5), "left")
    stop = log_times.size if t.stop is None else np.searchsorted(log_times, np.floor(scale * t.stop + 0.5), "right")
    picks = np.arange(first, stop, every)
    if picks.size == 0:
        raise RecordingError(f"{file.path} has no message of {topic} from {t.start} to {t.stop}")
    return picks


def read_arrays(
    file: File, topic: str, fields: list[str], dims: list[str], picks: NDArray[np.intp], length: str
) -> xarray.Dataset:
    """Arrays of a topic over time and the positions of their elements. Where messages hold fewer elements than others, what
    they leave out is at rest, 0.

    Args:
        file: The recording.
        topic: The topic.
        fields: Fields of the same shape.
        dims: Names of its dimensions: one, or two for a matrix.
        picks: Numbers of the messages in ascending order.
        length: Unit of positions.

    Raises:
        ImportError: xarray is not installed.
        RecordingError: The file is damaged.
    """
    try:
        import xarray
    except ImportError as error:
        raise ImportError("arrays need xarray: pip install xarray") from error
    entries, units = file.channel(topic).metadata, file.units(topic)
    times, steps = np.empty(picks.size), np.empty(picks.size, np.uint64)
    kind = np.float32 if "values" in fields else np.float64
    stacks: dict[str, NDArray[Any]] = {field: np.zeros((picks.size, 0), kind) for field in fields}
    axes: list[NDArray[np.float64]] = []
    largest = -1
    for number, message in enumerate(file.messages(topic, picks)):
        times[number], steps[number] = message.time, message.step
        size = len(getattr(message, fields[0]))
        if size > largest:
            axes, largest = _axes(message, entries.get(f"axis.{fields[0]}"), size), size
        for field in fields:
            if size > stacks[field].shape[1]:
                # at least twice as wide as before: arrays that grow with the contact are moved few times
                stacks[field] = np.pad(stacks[field], ((0, 0), (0, size)))
            stacks[field][number, :size] = np.array(getattr(message, field), kind)
    coordinates: dict[str, Any] = {
        "time": ("time", times, {"units": units["time"]}),
        "step": ("time", steps),
    }
    for dim, axis in zip(dims, axes, strict=True):
        coordinates[dim] = (dim, axis, {} if dim == "point" else {"units": length})
        repeats = np.diff(axis) == 0.0
        if dim == "z" and repeats.any():
            layers = np.concatenate([[1], 1 + np.cumsum(repeats)])
            # the target begins at the last row with z = 0, behind the rows of an indenter that gives
            surface = np.searchsorted(axis, 0.0, "right") - 1
            coordinates["layer"] = (dim, layers + 1 - layers[surface])
    variables = {}
    for field in fields:
        values = stacks[field][:, :largest].reshape(picks.size, *(axis.size for axis in axes))
        attributes = {"units": units[field], "meaning": entries[f"meaning.{field}"]}
        variables[field] = (("time", *dims), values, attributes)
    return xarray.Dataset(variables, coordinates)


def _axes(message: Any, axis: str | None, size: int) -> list[NDArray[np.float64]]:
    """Positions by the text of an axis: numbers; or names of the fields with the first position and the distance, of a matrix
    also with their number, and of a list that stands for them where it has any. Without a text the number of every element."""
    if axis is None:
        return [np.arange(size, dtype=np.float64)]
    try:
        return [np.array([float(number) for number in axis.split(",") if number])]
    except ValueError:
        sides = [side.split(",") for side in axis.split(";")]
    axes = []
    for start, step, *names in sides:
        count = getattr(message, names.pop(0)) if len(sides) > 1 else size
        listed = np.array(getattr(message, names[0]) if names else [], np.float64)
        regular = getattr(message, start) + getattr(message, step) * np.arange(count)
        axes.append(listed if listed.size > 0 else regular)
    return axes
