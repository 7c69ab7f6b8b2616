"""Reads a trace's record from its metadata, which another program may have written."""

from __future__ import annotations

import json
import math
import re

from pydantic import ValidationError

from daq.contracts.errors import TraceError
from daq.contracts.trace import TRACE_FORMAT, TraceRecord
from daq.contracts.trace_limits import TraceLimits
from daq.traces import layout
from firmware_protocol.invalid import first_invalid

_JOINT = re.compile(r"[1-9][0-9]?")
_NUMBER = re.compile(r"[A-Za-z0-9_-]{1,64}")
"""Permitted ID of a trace, which becomes part of file names and addresses."""
_SHOWN = 40
"""Most characters of a wrong text in an error message."""
_MOST_SAMPLES = 2**31 - 1
"""Most samples: the largest integer of all supported databases; more than a year at 50 Hz."""


class NewerTraceError(TraceError):
    """A trace written by a newer version of this software."""


def record_of(start: dict[str, str], end: dict[str, str] | None, origin: str) -> TraceRecord:
    """Returns the record of a trace, from the metadata at its start and (if it has one) its end.

    Raises TraceError, which names the version if it is newer than this one.
    """
    try:
        fields = layout.json_object(start["record"])
        version = fields.get("format", 0)
        if isinstance(version, int) and version > TRACE_FORMAT:
            raise NewerTraceError(
                f"{origin}: has format {str(version)[:_SHOWN]} of a newer version; this one reads up to {TRACE_FORMAT}"
            )
        if end is not None:
            fields |= {"outcome": end["outcome"] or None, "counters": layout.json_object(end["counters"])}
        record = TraceRecord.model_validate_json(json.dumps(fields, allow_nan=False))
    except KeyError as error:
        raise TraceError(f"{origin}: its metadata is not that of a trace: {error} is missing") from error
    except (ValueError, RecursionError) as error:
        raise TraceError(f"{origin}: its metadata is not that of a trace: {one_line(error)}") from error
    if not _NUMBER.fullmatch(record.trace_id):
        raise TraceError(f"{origin}: its ID {record.trace_id[:_SHOWN]!r} must be letters, digits, - and _")
    if record.created.tzinfo is None:
        raise TraceError(f"{origin}: created = {record.created.isoformat()} has no time zone")
    return record


def joints_of(start: dict[str, str], limits: TraceLimits, origin: str) -> tuple[int, ...]:
    """Returns the joints of a trace, in the order of its columns. Raises TraceError."""
    text = start.get("joints", "")
    # Check the length before splitting: the text may list millions.
    words = text.split() if len(text) <= 3 * limits.joints else [text[:_SHOWN]]
    joints = tuple(int(word) for word in words if _JOINT.fullmatch(word))
    if not 1 <= len(joints) <= limits.joints or len(joints) != len(words) or len(set(joints)) != len(joints):
        raise TraceError(
            f"{origin}: joints = {text[:_SHOWN]!r} are not 1 to {limits.joints} different numbers of joints"
            " (traces.limits.joints)"
        )
    return joints


def signals_of(start: dict[str, str], origin: str) -> frozenset[str]:
    """Returns the names of a trace's signals. Raises TraceError."""
    if "signals" not in start:
        raise TraceError(f"{origin}: its metadata is not that of a trace: 'signals' is missing")
    return frozenset(start["signals"].split())


def extent_of(end: dict[str, str], origin: str) -> tuple[int, float]:
    """Returns the number of samples, and the time (s) between the first and the last, from the metadata at the end.

    Raises TraceError.
    """
    try:
        samples, duration = int(end["samples"][:_SHOWN]), float(end["duration"][:_SHOWN])
    except (KeyError, ValueError) as error:
        raise TraceError(f"{origin}: its metadata is not that of a trace: samples or duration: not a number") from error
    if not 0 <= samples <= _MOST_SAMPLES or not 0 <= duration < math.inf:
        raise TraceError(f"{origin}: its metadata is not that of a trace: {samples} samples in {duration} s")
    return samples, duration


def one_line(error: Exception) -> str:
    """Returns the error in one line, with the field for pydantic's errors."""
    if isinstance(error, ValidationError):
        first = first_invalid(error)
        return f"{'.'.join(str(part)[:_SHOWN] for part in first.place)}: {first.message}"
    return " ".join(str(error).split())
