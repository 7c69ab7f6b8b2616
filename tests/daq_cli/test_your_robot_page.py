"""docs/your-robot.md: what it types can be typed, and its settings are settings."""

import re
import shlex
import tomllib
from pathlib import Path

import pytest

from daq.config.settings import RobotSettings
from daq.link.dialects import dialect_of
from tests.daq_cli.invoke import CommandLine
from tests.daq_cli.test_documentation import COMMANDS, command_of

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "your-robot.md").read_text("utf-8")
LINES = re.findall(r"^\$ daq (.*)$", PAGE, re.MULTILINE)
(SETTINGS,) = re.findall(r"```toml\n(\[robot\]\n.*?)```", PAGE, re.DOTALL)


@pytest.mark.parametrize("line", LINES)
def test_what_the_page_types_can_be_typed(line: str) -> None:
    words = shlex.split(line)
    name = command_of(words)
    if name != ("mock",):
        with COMMANDS[name].make_context(" ".join(name), words[len(name) :], resilient_parsing=False) as context:
            assert context.command is COMMANDS[name]


def test_the_page_s_settings_name_a_machine_and_a_dialect_that_exist() -> None:
    settings = RobotSettings.model_validate(tomllib.loads(SETTINGS.replace("$PWD", "/home"))["robot"])
    assert (ROOT / settings.machine).is_file()
    assert dialect_of(str(settings.port)).scale.joints == 2


def test_the_check_of_the_page_s_settings_speaks_of_its_dialect_and_of_no_memory_map(
    daq: CommandLine, tmp_path: Path
) -> None:
    settings = SETTINGS.replace("examples/", f"{ROOT}/examples/").replace("$PWD", str(tmp_path))
    (tmp_path / "daq.toml").write_text(settings)
    said = daq("--config", tmp_path / "daq.toml", "config", "check")
    assert said.code == 0, said.err
    assert "dialect:       dynamixel" in said.out
    assert "memory map:" not in said.out
    (tmp_path / "daq.toml").write_text(settings.replace("dynamixel", "nobodys"))
    daq("--config", tmp_path / "daq.toml", "config", "check").complains(2, "dialect 'nobodys' is unknown")
