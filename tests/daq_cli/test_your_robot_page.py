"""docs/your-robot.md: what it types can be typed, and does what it says on a bench of servos."""

from __future__ import annotations

import json
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.daq_cli.invoke import CommandLine
from tests.daq_cli.test_documentation import COMMANDS, command_of

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "your-robot.md").read_text("utf-8")
LINES = re.findall(r"^\$ daq (.*)$", PAGE, re.MULTILINE)
(SETTINGS,) = re.findall(r"```toml\n(\[robot\]\n.*?)```", PAGE, re.DOTALL)
REFUSED = 4


@pytest.mark.parametrize("line", LINES)
def test_what_the_page_types_can_be_typed(line: str) -> None:
    words = shlex.split(line)
    name = command_of(words)
    if name != ("mock",):
        with COMMANDS[name].make_context(" ".join(name), words[len(name) :], resilient_parsing=False) as context:
            assert context.command is COMMANDS[name]


@pytest.fixture
def bench() -> Iterator[None]:
    """The bench that the page starts, in the folder of the settings that the page writes."""
    shutil.copytree(ROOT / "examples", "examples")
    Path("daq.toml").write_text(SETTINGS.replace("$PWD", str(Path.cwd())))
    command = [sys.executable, "-m", "mock_controller.servos", "--pty", "--link", "bench", "--owned"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        assert json.loads(process.stdout.readline())["ready"]
        yield
        process.communicate()


@pytest.mark.slow
@pytest.mark.against_the_clock
@pytest.mark.usefixtures("bench")
def test_the_page_s_afternoon(daq: CommandLine) -> None:
    typed = [line for line in LINES if not line.startswith("mock ")]
    said = [daq(*shlex.split(line)) for line in typed]
    refused = typed.index("run ramp --joints 1-2")
    assert [one.code for one in said] == [REFUSED if at == refused else 0 for at in range(len(typed))]
    assert "a drive is switched off and holds nothing" in said[refused].err
