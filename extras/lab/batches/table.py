"""Rows as tables in files: CSV, and Parquet where `pyarrow` is installed."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from daq.contracts.extras import is_installed
from daq.contracts.whole_file import replacing
from extras.lab.batches.columns import Columns


def write_csv(rows: Sequence[Columns], path: Path) -> Path:
    """Writes CSV as RFC 4180 describes it, with a line of names; an empty cell where a row has no value."""
    with replacing(path, synced=False) as part, part.open("w", encoding="utf-8", newline="") as stream:
        table = csv.DictWriter(stream, _names(rows), restval="")
        table.writeheader()
        table.writerows(rows)
    return path


def write_parquet(rows: Sequence[Columns], path: Path) -> Path | None:
    """Writes Parquet. Returns None where `pyarrow` is not installed (extra `tables`), and removes an older table."""
    if not is_installed("pyarrow"):
        path.unlink(missing_ok=True)
        return None
    import pyarrow
    from pyarrow import parquet

    columns: dict[str, Any] = {name: pyarrow.array([row.get(name) for row in rows]) for name in _names(rows)}
    with replacing(path, synced=False) as part:
        parquet.write_table(pyarrow.table(columns), part)
    return path


def _names(rows: Sequence[Columns]) -> list[str]:
    """The names of all columns, in the order in which the rows have them."""
    return list(dict.fromkeys(name for row in rows for name in row))
