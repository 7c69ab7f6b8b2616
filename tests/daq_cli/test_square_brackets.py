"""Square brackets in a path or a name are printed as they are: they are no markup."""

from __future__ import annotations

from pathlib import Path

import pytest

from daq_cli.app.context import console, print_table
from tests.daq_cli.invoke import CommandLine


def test_square_brackets_in_a_path_are_printed_in_a_remark(capsys: pytest.CaptureFixture[str]) -> None:
    console().print("report: [raw]/page.html")
    assert capsys.readouterr().err == "report: [raw]/page.html\n"


def test_square_brackets_in_a_name_are_printed_in_a_table(capsys: pytest.CaptureFixture[str]) -> None:
    from rich.table import Table

    table = Table("[model]", box=None)
    table.add_row("[raw]")
    print_table(table)
    assert capsys.readouterr().out.split() == ["[model]", "[raw]"]


def test_square_brackets_in_a_file_name_are_printed_in_the_list_of_traces(daq: CommandLine, tmp_path: Path) -> None:
    (tmp_path / "[raw].mcap").write_bytes(b"no trace")
    assert "[raw].mc" in daq("traces", "ls", "--folder", tmp_path).out
