"""The tables of a batch agree with each other."""

import sys
from pathlib import Path

import pytest

from extras.lab.batches.folder import write_parquet


def test_no_parquet_of_an_earlier_run_stays_where_none_can_be_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    table = tmp_path / "table.parquet"
    assert write_parquet([{"trace": "a"}], table) == table
    monkeypatch.delitem(sys.modules, "pyarrow")
    monkeypatch.setattr(sys, "path", [])
    assert write_parquet([{"trace": "a"}], table) is None
    assert not table.exists()
