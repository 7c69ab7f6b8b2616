"""Converts traces to pandas tables and xarray datasets, with units and metadata as attributes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from daq.contracts.extras import require_extra
from daq.contracts.machine import joint_names
from daq.contracts.recorded import Recorded

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr


BY_JOINT = ("position", "set_point", "error", "drive", "velocity", "power_raw")
BY_SAMPLE = ("tick", "host_time", "status", "taken")


def units_of(trace: Recorded) -> dict[str, str]:
    """Unit of each signal; `rad or m` if joints of both kinds are mixed."""
    length = _unit_of_position(trace)
    own = {"position": length, "set_point": length, "error": length, "velocity": f"({length})/s"}
    if " " not in length:
        own["velocity"] = f"{length}/s"
    drive = trace.drive_unit
    counted = {"power_raw": "DAC counts", "tick": "1", "status": "1", "taken": "1"}
    return own | {"time": "s", "host_time": "s", "drive": drive} | counted


def attributes_of(trace: Recorded) -> dict[str, Any]:
    """Metadata of the trace, in types that every file format supports."""
    record = trace.record
    found = {
        "trace_id": record.trace_id,
        "created": record.created.isoformat(),
        "source": record.source,
        "robot": record.robot,
        "outcome": record.outcome,
        "period": record.period,
        "software": record.software,
        "operator": record.operator,
        "notes": record.notes,
        "joints": list(trace.joints),
        "joint_names": list(joint_names(trace.record.machine, trace.joints)),
    }
    return {name: value for name, value in found.items() if value is not None}


def to_pandas(trace: Recorded) -> pd.DataFrame:
    """Returns one row per sample, indexed by time (s), and one column per signal and joint, named as in CSV:
    `position_1`.

    `attrs` has the units by column, and the trace's metadata. Raises MissingExtraError.
    """
    require_extra("tables", "to_pandas()", "pandas")
    import pandas as pd

    columns: dict[str, Any] = {}
    units, known = {"time": "s"}, units_of(trace)
    for name in (*BY_JOINT, *BY_SAMPLE):
        values = getattr(trace, name)
        if values is None:
            continue
        parts = (
            {name: values} if name in BY_SAMPLE else {f"{name}_{j}": values[:, c] for c, j in enumerate(trace.joints)}
        )
        columns |= parts
        units |= dict.fromkeys(parts, known[name])
    frame = pd.DataFrame(columns, index=pd.Index(trace.time, name="time"))
    frame.attrs = attributes_of(trace) | {"units": units}
    return frame


def to_xarray(trace: Recorded) -> xr.Dataset:
    """Returns signals over `time` (s) and `joint` (numbers, with names), with their units. Raises MissingExtraError."""
    require_extra("tables", "to_xarray()", "xarray")
    import xarray as xr

    units = units_of(trace)
    found = {}
    for name in (*BY_JOINT, *BY_SAMPLE):
        values = getattr(trace, name)
        if values is not None:
            found[name] = (("time", "joint")[: values.ndim], values, {"units": units[name]})
    coordinates = {
        "time": ("time", trace.time, {"units": "s"}),
        "joint": ("joint", list(trace.joints)),
        "joint_name": ("joint", list(joint_names(trace.record.machine, trace.joints))),
    }
    return xr.Dataset(found, coordinates, attributes_of(trace))


def is_prismatic(trace: Recorded, joint: int) -> bool:
    """Whether a joint is prismatic; False if the machine is unknown."""
    machine = trace.record.machine
    return machine is not None and joint <= len(machine.joints) and machine.joint(joint).kind == "prismatic"


def _unit_of_position(trace: Recorded) -> str:
    kinds = {is_prismatic(trace, joint) for joint in trace.joints}
    return "rad or m" if len(kinds) > 1 else ("m" if kinds == {True} else "rad")
