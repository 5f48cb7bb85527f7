"""A recording of percuss: its channels as tables and labelled arrays."""

from __future__ import annotations

import os
import tomllib
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic

from ._arrays import Times, pick, read_arrays
from ._errors import RecordingError
from ._file import File, sound
from ._measures import interfaces, measure, recorded, units_of
from ._tables import Columns, Maker, Table_co, read_columns

if TYPE_CHECKING:
    import xarray

RUN = "percuss.run"
MEASURES = "percuss.summary"
FORMAT = "2"
"""Major version of the format."""


class Recording(Generic[Table_co]):
    """A recording, see `percuss.open`. What is read of it is read when it is asked for; tables are kept.

    Everything that reads raises OSError, or `RecordingError` where the recording is damaged or has no such channel.
    """

    def __init__(self, path: str | os.PathLike[str], make: Maker[Table_co], folder: object = None) -> None:
        """
        Args:
            path: The file.
            make: Makes tables.
            folder: What keeps the folder of the file, as long as the recording is used.
        """
        self._file = File(path, MEASURES)
        self._make = make
        self._folder = folder
        self._columns: dict[str, Columns] = {}
        version = self._file.metadata.get(RUN, {}).get("format_version")
        if version is None or version.partition(".")[0] != FORMAT:
            found = "is no recording of percuss" if version is None else f"has format {version}, not {FORMAT}.x"
            raise RecordingError(f"{self._file.path} {found}; percuss-read reads it")

    def __repr__(self) -> str:
        return f"<percuss.Recording {self._file.path}: {self.metadata[RUN]['title']}>"

    @property
    def path(self) -> Path:
        """The file; that of a run without an output is there as long as this object."""
        return Path(self._file.path)

    @property
    def topics(self) -> dict[str, int]:
        """Number of messages by topic."""
        return dict(self._file.counts)

    @property
    def metadata(self) -> dict[str, dict[str, str]]:
        """The metadata records: `percuss.run`, `percuss.host`, `percuss.validity`, `percuss.summary`, `percuss.status`."""
        return self._file.metadata

    @cached_property
    def case(self) -> dict[str, Any]:
        """The complete case, with every default, as `percuss check --resolved` prints it."""
        text = self._file.attachment("case.resolved.toml")
        with sound(self._file.damaged("case.resolved.toml")):
            return tomllib.loads(text.decode())

    def units(self, topic: str) -> dict[str, str]:
        """Units of the fields of a topic, `{"force": "N", …}`; plain numbers have none."""
        return self._file.units(topic)

    @property
    def drag(self) -> Table_co:
        """Every step: `time`, `step`, `force` on the indenter, `contact_radius`."""
        return self._table("/drag")

    @property
    def velocity(self) -> Table_co:
        """Every step: `time`, `step`, `velocity` and `displacement` of the indenter into the target."""
        return self._table("/velocity")

    @property
    def energy(self) -> Table_co:
        """Every frame: `time`, `step` and the parts of the energy; of several layers also `layer_strain[0]` and so on."""
        return self._table("/energy")

    @property
    def events(self) -> Table_co:
        """What happened: `time`, `step`, `kind`, `text`, and where they apply, else NaN, `r`, `since`, `interface`."""
        return self._table("/event")

    @cached_property
    def warnings(self) -> list[str]:
        """What the run advises, as on its mesh or the limits of the theory, in the order of `events`."""
        if "/event" not in self.topics:
            return []
        events = self._read("/event")
        texts = events["text"][events["kind"] == "WARNING"]
        return [str(text).removeprefix("warning: ") for text in texts]

    @cached_property
    def summary(self) -> dict[str, float | None]:
        """What `percuss-read summary` measures, the same numbers, in `summary_units`; None for what the recording does not say.

        A whole recording of format 2.3 of a run that was finished has them as a record, and no message is read. Of all others, and where
        that record is damaged, they are computed from the messages.
        """
        validity = self.metadata.get("percuss.validity", {})
        with sound(self._file.damaged("its metadata")):
            if self._is_whole and MEASURES in self.metadata:
                return recorded(self.metadata[MEASURES], validity)
            drag, velocity, energy, events = (
                self._read(topic) if topic in self.topics else None for topic in ["/drag", "/velocity", "/energy", "/event"]
            )
            return measure(drag, velocity, energy, events, validity)

    @property
    def _is_whole(self) -> bool:
        """True for the recording of a run that was finished, of which nothing is known to be lost or cut out."""
        status = self.metadata.get("percuss.status", {})
        steps = int(status.get("last_step", -1)) + 1
        has_all = all(self.topics[topic] == steps for topic in ["/drag", "/velocity"] if topic in self.topics)
        return status.get("status") in ["completed", "stopped"] and has_all and "percuss.recovered" not in self.metadata

    @property
    def summary_units(self) -> dict[str, str]:
        """Units of `summary`; plain numbers have none."""
        drag, energy = (self.units(topic) if topic in self.topics else {} for topic in ["/drag", "/energy"])
        velocity = self.units("/velocity")
        stress = self.units("/interface/stress") if "/interface/stress" in self.topics else {}
        return units_of(
            velocity["time"],
            velocity["displacement"],
            velocity["velocity"],
            drag.get("force"),
            energy.get("kinetic"),
            stress.get("stress"),
            interfaces(self.metadata.get("percuss.validity", {})),
        )

    @property
    def probes(self) -> xarray.DataArray:
        """Stress under the indenter at `record.probes`, every step, over `time` and `r`."""
        return self._arrays("/probes", ["stress"], ["r"], None, 1)["stress"]

    @property
    def points(self) -> xarray.Dataset:
        """`displacement`, `velocity` and `stress` at `record.points`, every step, over `time` and `point` with coordinates `r`, `z`."""
        points = self._arrays("/points", ["displacement", "velocity", "stress"], ["point"], None, 1)
        metadata = self._file.channel("/points").metadata
        places = {name: [float(place) for place in metadata[name].split(",")] for name in ["r", "z"]}
        length = {"units": self._length}
        return points.drop_vars("point").assign_coords({name: ("point", places[name], length) for name in places})

    def line(self, number: int, t: Times = None, every: int = 1) -> xarray.DataArray:
        """Stress along a line of `record.lines`, over `time` and `z`, or `r` on a line of one depth; the other is a coordinate
        of its own. Times, errors and layers as of `field`.

        Args:
            number: The line, from 0 on.
            t: A time, a range of times or all. [time]
            every: Every so many messages.
        """
        topic = f"/line/{number}"
        fixed, _, place = self._file.channel(topic).metadata["line"].partition(" = ")
        line = self._arrays(topic, ["stress"], ["z" if fixed == "r" else "r"], t, every)["stress"]
        return line.assign_coords({fixed: ((), float(place), {"units": self._length})})

    def profile(self, t: Times = None, every: int = 1) -> xarray.DataArray:
        """Stress under the indenter over `r`, out to the largest radius that has been in contact; over `time` too, with 0 where
        there has been no contact yet, unless `t` is one time. Times and errors as of `field`.

        Args:
            t: A time, a range of times or all. [time]
            every: Every so many messages.
        """
        return self._arrays("/interface/stress", ["stress"], ["r"], t, every)["stress"]

    def field(self, name: str, t: Times = None, every: int = 1) -> xarray.DataArray:
        """A recorded field over `time`, `z` and `r`, in single precision; without the dimension `time` if `t` is one time.

        Only the chunks with the frames asked for are read. Select times if a recording is larger than the memory.

        In a target of several layers the depth of an interface stands twice in `z`, first for the layer above, then for the one
        below, as what jumps there stays a jump; so does z = 0 under an indenter that gives, whose rows come first. The coordinate
        `layer` tells them apart: 1, 2, … in the target, 0, -1, … in the indenter, up from its nose. Within one,
        `field.isel(z=field.layer == 2)`, depths are unique, as `sel(z=…, method="nearest")` needs them.

        Args:
            name: `displacement`, `velocity` or `stress`.
            t: A time: the nearest frame; `slice(a, b)`: the frames within, both ends included; None: all. [time]
            every: Of these, the first and every so many after it.

        Raises:
            ImportError: xarray is not installed.
            OSError: The file cannot be read.
            RecordingError: The field is not recorded, there is no frame at such a time, or the recording is damaged.
            ValueError: `every` is less than 1, or the range has a step.
        """
        return self._arrays(f"/field/{name}", ["values"], ["z", "r"], t, every)["values"].rename(name)

    def _read(self, topic: str) -> Columns:
        if topic not in self._columns:
            self._columns[topic] = read_columns(self._file, topic)
        return self._columns[topic]

    def _table(self, topic: str) -> Table_co:
        return self._make(self._read(topic), self.units(topic))

    @property
    def _length(self) -> str:
        return self.units("/velocity")["displacement"]

    def _arrays(self, topic: str, fields: list[str], dims: list[str], t: Times, every: int) -> xarray.Dataset:
        picks = pick(self._file, topic, t, every)
        arrays = read_arrays(self._file, topic, fields, dims, picks, self._length)
        return arrays if t is None or isinstance(t, slice) else arrays.isel(time=0)
