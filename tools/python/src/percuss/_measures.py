"""What is measured of an impact, as `percuss-read summary` does: the same numbers bit for bit."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import count, takewhile
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from ._tables import Columns

Number = float | None

RATIOS = ["yield_ratio", "tensile_ratio"]
TRACTIONS = ["tension", "shear", "ratio"]
PARTS = ["", "_r", "_time"]
PLACES = ["", "_r", "_z", "_time"]


def measure(
    drag: Columns | None,
    velocity: Columns | None,
    energy: Columns | None,
    events: Columns | None,
    validity: Mapping[str, str],
) -> dict[str, Number]:
    """What is measured, in the units of the columns; what they do not say is None, never 0.

    Args:
        drag: Columns `time`, `force`, `contact_radius`.
        velocity: Columns `time`, `velocity`, `displacement`.
        energy: Columns `time`, `kinetic`, `strain`.
        events: Columns `time`, `kind`, `since`.
        validity: The metadata record `percuss.validity`.
    """
    extension, separation = _story(events)
    first = depth = speed = None
    if velocity is not None:
        speeds = velocity["velocity"]
        first = next((float(value) for value in speeds[np.isfinite(speeds)]), None)
        depth = _largest(velocity["displacement"])
        speed = _at(separation, velocity["time"], speeds)

    def said(key: str) -> Number:
        text = validity.get(key)
        return None if text is None else float(text)

    impact = said("impact_velocity")
    first = first if impact is None else impact
    rebound = speed if speed is not None and first is not None and speed * first < 0.0 else None
    restitution = None if rebound is None or first is None else -rebound / first
    loss = said("mesh_loss")
    corrected = None if restitution is None or loss is None else sqrt(restitution * restitution + loss)
    left = None if energy is None else _at(separation, energy["time"], energy["kinetic"] + energy["strain"])

    return _contact(drag) | {
        "depth": depth,
        "rebound_velocity": rebound,
        "restitution": restitution,
        "restitution_mesh_corrected": corrected,
        "t_ext": extension,
        "energy_left": left,
        "largest_strain": said("largest_strain"),
        "largest_strain_r": said("largest_strain.r"),
        "largest_strain_z": said("largest_strain.z"),
        "largest_strain_time": said("largest_strain.time"),
        **{
            f"{ratio}{part}": said(f"{ratio}{part.replace('_', '.')}")
            for ratio in RATIOS
            for part in PLACES
        },
        **{
            f"{interface}.{traction}{part}": said(f"{interface}.{traction}{part.replace('_', '.')}")
            for interface in interfaces(validity)
            for traction in TRACTIONS
            for part in PARTS
        },
    }


def recorded(numbers: Mapping[str, str], validity: Mapping[str, str]) -> dict[str, Number]:
    """What the run itself has measured.

    Args:
        numbers: The metadata record `percuss.summary`.
        validity: The metadata record `percuss.validity`.
    """
    names = measure(None, None, None, None, validity)
    return {name: float(numbers[name]) if name in numbers else None for name in names}


def interfaces(validity: Mapping[str, str]) -> list[str]:
    """Names of the interfaces of layers whose largest tractions are measured, of the target and of the indenter."""
    return [
        name
        for body in ["", "indenter."]
        for name in takewhile(
            lambda name: f"{name}.tension" in validity, (f"{body}interface.{number}" for number in count(1))
        )
    ]


def units_of(
    time: str | None,
    length: str | None,
    speed: str | None,
    force: str | None,
    energy: str | None,
    stress: str | None,
    layered: list[str],
) -> dict[str, str]:
    """Units of what is measured, from those of the quantities and the names of the interfaces; plain numbers have none."""
    impulse = None if force is None or time is None else f"{force}·{time}"
    units = {
        "peak_force": force,
        "peak_time": time,
        "impulse": {"N·s": "N s", "N/m·s": "N s/m"}.get(impulse or "", impulse),
        "contact_duration": time,
        "contact_radius": length,
        "depth": length,
        "rebound_velocity": speed,
        "t_ext": time,
        "energy_left": energy,
        "largest_strain_r": length,
        "largest_strain_z": length,
        "largest_strain_time": time,
        **{f"{ratio}{part}": unit for ratio in RATIOS for part, unit in zip(PLACES[1:], [length, length, time])},
        **{
            f"{interface}.{traction}{part}": unit
            for interface in layered
            for traction in TRACTIONS
            for part, unit in zip(PARTS, [None if traction == "ratio" else stress, length, time])
        },
    }
    return {name: unit for name, unit in units.items() if unit is not None}


def _story(events: Columns | None) -> tuple[Number, Number]:
    """When the interface first needed tension, and when contact ended for good."""
    extension = separation = None
    if events is not None:
        for time, kind, since in zip(events["time"], events["kind"], events["since"]):
            if kind == "EXTENSION" and extension is None:
                extension = float(time if np.isnan(since) else since)
            elif kind == "SEPARATION":
                separation = float(time if np.isnan(since) else since)
            elif kind == "RECONTACT":
                separation = None
    return extension, separation


def _contact(drag: Columns | None) -> dict[str, Number]:
    """Peak, impulse Σ ½·(F_n + F_{n−1})·(t_n − t_{n−1}), duration and radius of the contact."""
    names = ["peak_force", "peak_time", "impulse", "contact_duration", "contact_radius"]
    measures: dict[str, Number] = dict.fromkeys(names)
    if drag is None:
        return measures
    radius = drag["contact_radius"]
    known = np.isfinite(drag["force"])
    time, force = drag["time"][known], drag["force"][known]
    if force.size > 0:
        peak = int(np.argmax(force))
        measures["peak_force"], measures["peak_time"] = float(force[peak]), float(time[peak])
    if force.size > 1:
        # accumulated one by one: a pairwise sum has other bits
        terms = 0.5 * (force[1:] + force[:-1]) * (time[1:] - time[:-1])
        measures["impulse"] = float(np.add.accumulate(terms)[-1])
    touches = drag["time"][(known & (drag["force"] != 0.0)) | (np.isfinite(radius) & (radius > 0.0))]
    if touches.size > 0:
        measures["contact_duration"] = float(touches[-1] - touches[0])
    measures["contact_radius"] = _largest(radius)
    return measures


def _largest(values: NDArray[np.float64]) -> Number:
    finite = values[np.isfinite(values)]
    return float(finite.max()) if finite.size > 0 else None


def _at(at: Number, time: NDArray[np.float64], values: NDArray[np.float64]) -> Number:
    """A quantity at one time, linear between the times at which it is known."""
    known = np.isfinite(values)
    time, values = time[known], values[known]
    if at is None:
        return None
    after = int(np.searchsorted(time, at))
    if after == time.size:
        return None
    if time[after] == at:
        return float(values[after])
    if after == 0:
        return None
    start, first = time[after - 1], values[after - 1]
    return float(first + (values[after] - first) * (at - start) / (time[after] - start))
