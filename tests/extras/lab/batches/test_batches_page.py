"""docs/batches.md: its commands do what the page says, on a folder of traces."""

import csv
import re
import shlex
from pathlib import Path

import pytest

import ma2000
from tests.daq_cli.invoke import CommandLine
from tests.extras.lab.batches.traces import folder_of_traces

PAGE = Path(__file__).parents[4].joinpath("docs", "batches.md").read_text("utf-8")
COMMANDS = re.findall(r"^\$ daq (.+)$", PAGE, re.MULTILINE)


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_the_commands_of_the_page_give_a_table_each(daq: CommandLine) -> None:
    folder_of_traces(Path("traces"), 2)
    assert len(COMMANDS) >= 5
    for command in COMMANDS:
        words = shlex.split(command)
        said = daq(*words, "--executor", "local://1")
        assert said.code == 0, (command, said.err)
        out = Path(words[words.index("--out") + 1])
        with (out / "table.csv").open(encoding="utf-8", newline="") as stream:
            rows = list(csv.DictReader(stream))
        assert [row["state"] for row in rows] == ["done", "done"]
        assert len(list((out / "answers").iterdir())) == 2
    answer = next(Path("fits", "answers").iterdir())
    assert daq("simulate", answer, "traces/000.mcap").code == 0
    found = ma2000.batch("simulate", "traces", "simulated", executor="local://1")
    assert (len(found.rows), found.failed) == (2, {})
