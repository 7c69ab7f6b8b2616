"""Imports Parquet, data sets of lerobot, MATLAB's .mat, NumPy's .npz and JSON as traces, by a mapping of columns."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from daq.contracts.errors import DaqError, TraceError
from daq.contracts.extras import require_extra
from daq.contracts.import_choice import Choice
from daq.contracts.trace import Trace
from daq.contracts.trace_limits import DEFAULT_TRACE_LIMITS, TraceLimits
from daq.traces.description import Description, read_file
from daq.traces.mapping.expression import Columns, Table
from daq.traces.mapping.mapped_trace import mapped_trace
from extras.formats.tables.flat import columns_of
from extras.formats.tables.mat_process import read_mat

PARQUET_MAGIC = b"PAR1"
SUFFIXES = (".parquet", ".mat", ".npz", ".json")
INFO = Path("meta") / "info.json"
"""Description of a data set of lerobot."""


def is_table(path: Path, first: bytes) -> bool:
    """Whether a file is a table by its first bytes or its name; a folder is one if it is a data set of lerobot."""
    return first.startswith(PARQUET_MAGIC) or path.suffix.lower() in SUFFIXES or (path / INFO).is_file()


def import_table(path: Path, limits: TraceLimits = DEFAULT_TRACE_LIMITS, choice: Choice | None = None) -> Trace:
    """Returns the trace in a table, whose columns the choice or the TOML beside it names.

    Raises TraceError with one line, MissingExtraError.
    """
    path = Path(path)
    description, _ = Description.read(path if path.name else path.resolve(), limits)

    def beside(file: str) -> Columns:
        return _columns(path.parent / file, limits)

    table = Table(str(path), _columns(path, limits), beside)
    return mapped_trace(path, table, description.over(choice or Choice()), description, limits)


def _columns(path: Path, limits: TraceLimits) -> Columns:
    """Returns the columns of a file or of a data set. Raises TraceError, MissingExtraError."""
    try:
        if path.is_dir():
            return _data_set(path, limits)
        if path.suffix.lower() == ".json":
            return columns_of(json.loads(read_file(path, limits.file_bytes, "file_bytes")))
        read_file(path, limits.file_bytes, "file_bytes")
        if path.suffix.lower() == ".npz":
            with np.load(path, allow_pickle=False) as found:
                return columns_of({name: found[name] for name in found.files if found[name].dtype.kind in "fiub"})
        if path.suffix.lower() == ".mat":
            require_extra("tables", f"{path}: MATLAB's files", "scipy")
            return read_mat(path)
        info = [folder / INFO for folder in path.absolute().parents[:3] if (folder / INFO).is_file()]
        return _parquet([path], _features(info[0], limits) if info else {}, limits)
    except (DaqError, MemoryError):
        raise
    except Exception as error:  # a damaged file makes its libraries raise any exception
        raise TraceError(f"{path}: cannot be read: {' '.join(str(error).split())[:200]}") from error


def _data_set(path: Path, limits: TraceLimits) -> Columns:
    """Returns the rows of all episodes of a data set of lerobot, version 2 or 3."""
    names = _features(path / INFO, limits)
    files = sorted((path / "data").glob("**/*.parquet"))
    if not files:
        raise TraceError(f"{path}: has no Parquet file in {path / 'data'}")
    return _parquet(files, names, limits)


def _features(info: Path, limits: TraceLimits) -> dict[str, tuple[str, ...]]:
    """Returns the names of the elements of each feature in a data set of lerobot."""
    said = json.loads(read_file(info, limits.metadata_bytes, "metadata_bytes"))
    features: dict[str, Any] = said.get("features", {})
    return {name: _names(feature.get("names")) for name, feature in features.items()}


def _names(found: Any) -> tuple[str, ...]:
    """Returns the names of a feature's elements, in either notation."""
    if isinstance(found, dict):
        found = next(iter(found.values()), ())
    while isinstance(found, list) and len(found) == 1 and isinstance(found[0], list):
        found = found[0]
    return tuple(map(str, found)) if isinstance(found, list) else ()


def _parquet(files: list[Path], names: dict[str, tuple[str, ...]], limits: TraceLimits) -> Columns:
    """names: of the elements of a column that holds several."""
    require_extra("tables", f"{files[0]}: Parquet", "pyarrow")
    import pyarrow
    import pyarrow.parquet

    columns: Columns = {}
    rows = sum(pyarrow.parquet.read_metadata(file).num_rows for file in files)
    if rows > limits.records:
        raise TraceError(f"{files[0]}: {rows} rows; up to {limits.records} are read (traces.limits.records)")
    tables = [pyarrow.parquet.ParquetFile(file).read() for file in files]
    whole = pyarrow.concat_tables(tables, promote_options="default").combine_chunks()
    for name, column in zip(whole.column_names, whole.columns, strict=True):
        kind = column.type
        if pyarrow.types.is_timestamp(kind):
            stamps = column.cast(pyarrow.timestamp("ns")).cast(pyarrow.int64())
            columns[name] = stamps.to_numpy().astype(np.float64) / 1e9
        elif pyarrow.types.is_floating(kind) or pyarrow.types.is_integer(kind) or pyarrow.types.is_decimal(kind):
            columns[name] = column.cast(pyarrow.float64()).to_numpy()
        elif pyarrow.types.is_list(kind) or pyarrow.types.is_fixed_size_list(kind) or pyarrow.types.is_struct(kind):
            found = columns_of({name: column.to_pylist()})
            called = names.get(name, ())
            for key, values in found.items():
                index = key.removeprefix(f"{name}[").removesuffix("]")
                known = index.isdecimal() and int(index) < len(called)
                columns[f"{name}[{called[int(index)]}]" if known else key] = values
    return columns
