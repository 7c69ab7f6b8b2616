"""Writes traces as Parquet and netCDF files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from daq.contracts.errors import TraceError
from daq.contracts.extras import require_extra
from daq.contracts.trace import Trace
from daq.traces import disk

if TYPE_CHECKING:
    import xarray as xr

PARQUET, NETCDF = ".parquet", ".nc"


def export_table(trace: Trace, path: Path) -> Path:
    """Writes the table of `Trace.to_pandas` as Parquet, or the arrays of `Trace.to_xarray` as netCDF, by the suffix.

    Raises TraceError for another suffix or a file that cannot be written, MissingExtraError.
    """
    path = Path(path)
    if path.suffix.lower() not in (PARQUET, NETCDF):
        raise TraceError(f"{path}: tables are written as {PARQUET} and {NETCDF}")
    try:
        if path.suffix.lower() == PARQUET:
            require_extra("tables", f"{path}: Parquet", "pandas", "pyarrow")
            trace.to_pandas().to_parquet(path, engine="pyarrow")
        else:
            require_extra("tables", f"{path}: netCDF", "xarray", "scipy")
            _for_netcdf(trace.to_xarray()).to_netcdf(path, engine="scipy")
    except OSError as error:
        raise TraceError(f"{path}: cannot be written: {disk.reason(error)}") from error
    return path


def _for_netcdf(arrays: xr.Dataset) -> xr.Dataset:
    """Converts to the types of netCDF 3, which scipy writes: integers beyond 32 bits to float64, lists to text."""
    bounds = np.iinfo(np.int32)
    large = {
        name: variable.astype(np.float64)
        for name, variable in arrays.data_vars.items()
        if variable.dtype.kind == "i"
        and variable.size
        and not bounds.min <= variable.min() <= variable.max() <= bounds.max
    }
    lists = {name: " ".join(map(str, value)) for name, value in arrays.attrs.items() if isinstance(value, list)}
    return arrays.assign(large).assign_attrs(lists)
