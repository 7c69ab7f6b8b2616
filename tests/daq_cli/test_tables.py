"""Tables as traces, and names of files that are no text, on the command line."""

from __future__ import annotations

import json
from pathlib import Path

from daq.traces.reader import read_trace
from tests.daq.traces.samples import write
from tests.daq_cli.invoke import CommandLine


def test_a_table_is_shown_plotted_verified_and_exported_as_it_is(daq: CommandLine, tmp_path: Path) -> None:
    path = tmp_path / "RIG.CSV"
    path.write_text("time,position_1,drive_1\n0,0,1\n0.1,1,1\n20.1,1,1\n0.2")
    shown = daq("traces", "show", path).out
    assert "at most 20 s (after 0.1 s); it has no ticks, so whether some are missing is not known" in shown
    assert "its last row has no line end" in shown
    assert "is CSV: it has no checksums" in daq("traces", "verify", path).out
    assert daq("traces", "plot", path, "-o", tmp_path / "a.png").code == 0
    assert daq("traces", "export", path, "-o", tmp_path / "b.csv").code == 0
    daq("traces", "export", path).complains(2, "is CSV already; name the file to write with -o")
    made = json.loads(daq("traces", "import", path, "--drive-unit", "Nm", "--json").out)
    assert read_trace(Path(made["file"])).record.drive_unit == "N·m"


def test_names_of_files_that_are_no_text_are_listed_as_json_that_reads_back(daq: CommandLine, tmp_path: Path) -> None:
    trace = write(tmp_path / "a.mcap", 3)
    named = tmp_path / "b\udcff.mcap"
    trace.rename(named)
    listed = daq("traces", "ls", "--folder", tmp_path, "--json").out
    listed.encode("utf-8")
    assert json.loads(listed)[0]["path"] == str(named)
