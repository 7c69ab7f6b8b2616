"""Flattens nested data of any format to columns: `a.b` for a nested field, `a[2]` or `a[elbow]` for an element."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from daq.contracts.trace import Floats
from daq.traces.mapping.expression import Columns

NAMES = ("name", "names", "joint_names", "joint_name")
"""Fields of a message that name the elements of the others."""
MOST = 10_000
"""Largest number of columns for one array; a picture has more."""


def columns_of(found: Any) -> Columns:
    """Returns the columns of a tree of mappings, objects with fields, lists and arrays. Parts without numbers are left
    out."""
    columns: Columns = {}
    _add(columns, "", _plain(found))
    return columns


def _plain(found: Any) -> Any:
    """Converts a structure of MATLAB, or a record of NumPy, to a mapping; returns anything else unchanged."""
    fields = getattr(found, "_fieldnames", None)
    if fields is not None:
        return {name: getattr(found, name) for name in fields}
    if isinstance(found, np.ndarray) and found.dtype.names:
        return {name: found[name] for name in found.dtype.names}
    return found


def _add(columns: Columns, place: str, found: Any) -> None:
    found = _plain(found)
    if len(columns) > MOST:
        return
    if isinstance(found, Mapping):
        for name, value in found.items():
            if not str(name).startswith("__"):
                _add(columns, f"{place}.{name}".lstrip("."), value)
    elif isinstance(found, np.ndarray) and found.dtype != object:
        _add_array(columns, place, found)
    elif isinstance(found, Sequence) and not isinstance(found, str | bytes) and len(found):
        _add_list(columns, place, found)


def _add_list(columns: Columns, place: str, found: Sequence[Any]) -> None:
    if all(isinstance(each, Mapping) for each in found) and not _holds_series(found[0]):
        for name in dict.fromkeys(name for each in found for name in each):
            _add_field(columns, f"{place}.{name}".lstrip("."), [each.get(name) for each in found], _labels(found[0]))
    elif all(each is None or isinstance(each, int | float | str | bool) for each in found):
        values = _numbers(found)
        if np.isfinite(values).any():
            columns[place] = values
    elif all(_is_list(each) or each is None for each in found):
        width = max(len(each) for each in found if each is not None)
        if width <= MOST and all(each is None or len(each) == width for each in found):
            for index in range(width):
                _add(columns, f"{place}[{index}]", [None if each is None else each[index] for each in found])
            return
        for index, each in enumerate(found):
            _add(columns, f"{place}.{index}", each)
    else:
        for index, each in enumerate(found):
            _add(columns, f"{place}.{index}".lstrip("."), each)


def _add_field(columns: Columns, place: str, values: list[Any], labels: Sequence[str]) -> None:
    """Adds one field of many messages. labels: names of the elements of its lists."""
    if not labels or not _is_list(values[0]) or _is_list_of_text(values[0]):
        _add(columns, place, values)
        return
    empty: list[Any] = [np.nan] * len(labels)
    rows = [value if _is_list(value) and len(value) == len(labels) else empty for value in values]
    for index, label in enumerate(labels):
        _add(columns, f"{place}[{label}]", [row[index] for row in rows])


def _labels(message: Mapping[str, Any]) -> Sequence[str]:
    return next((message[name] for name in NAMES if _is_list_of_text(message.get(name))), ())


def _add_array(columns: Columns, place: str, found: np.ndarray[Any, Any]) -> None:
    """Adds a vector as it is; of a table the columns along its shorter side."""
    if found.dtype.kind not in "fiub":
        return
    values = np.squeeze(found)
    if values.ndim == 1:
        columns[place] = values.astype(np.float64)
    elif values.ndim == 2:
        tall = values if values.shape[0] >= values.shape[1] else values.T
        for index in range(min(tall.shape[1], MOST)):
            columns[f"{place}[{index}]"] = tall[:, index].astype(np.float64)


def _holds_series(found: Mapping[str, Any]) -> bool:
    """Whether one entry of a list is itself a record: it has long lists of numbers, of different lengths."""
    lengths = {len(value) for value in found.values() if _is_list(value) and not _is_list_of_text(value)}
    return bool(lengths) and max(lengths) > SERIES


SERIES = 64
"""Length from which a list in an entry counts as a record, not as one value per joint."""


def _is_list(value: Any) -> bool:
    return isinstance(value, list | tuple | np.ndarray)


def _is_list_of_text(value: Any) -> bool:
    return _is_list(value) and len(value) > 0 and all(isinstance(each, str) for each in value)


def _numbers(values: Sequence[Any]) -> Floats:
    return np.array([_number(value) for value in values], np.float64)


def _number(value: Any) -> float:
    try:
        return np.nan if value is None else float(value)
    except (ValueError, OverflowError):
        return np.nan
