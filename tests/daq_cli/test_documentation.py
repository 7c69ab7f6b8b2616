"""docs/command-line.md shows every command there is, no other; what docs/your-robot.md types can be typed."""

import importlib
import pkgutil
import re
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import typer.main

import daq
from daq.contracts import exit_codes
from daq.contracts.errors import DaqError
from daq_cli.app.subcommands import subcommands
from tests.daq_cli.invoke import CommandLine

ROOT = Path(__file__).parents[2]
PAGE, YOUR_ROBOT = ((ROOT / "docs" / name).read_text("utf-8") for name in ("command-line.md", "your-robot.md"))
LINES = re.findall(r"^\$ daq (.*)$", YOUR_ROBOT, re.MULTILINE)
SHOWN = [shlex.split(text) for text in re.findall(r"^- .*: `daq ([^`]+)`$", PAGE, re.MULTILINE)]
EXAMPLES = [words for words in SHOWN if words[0] in subcommands()]
"""Of what is installed: the page also shows what is optional."""


def commands() -> dict[tuple[str, ...], Any]:
    """Every command that does something, by its words."""

    def below(words: tuple[str, ...], command: Any) -> Iterator[tuple[tuple[str, ...], Any]]:
        for name, sub in getattr(command, "commands", {}).items():
            yield from below((*words, name), sub)
        if not getattr(command, "commands", {}) or command.invoke_without_command:
            yield words, command

    found: dict[tuple[str, ...], Any] = {}
    for name, known in subcommands().items():
        found |= dict(below((name,), typer.main.get_command(importlib.import_module(known.module).app)))
    return found


COMMANDS = commands()


def command_of(words: list[str]) -> tuple[str, ...]:
    return next(tuple(words[:n]) for n in (3, 2, 1) if tuple(words[:n]) in COMMANDS)


def test_every_command_has_an_example() -> None:
    assert {command_of(words) for words in EXAMPLES} == set(COMMANDS)


@pytest.mark.parametrize("words", [*EXAMPLES, *map(shlex.split, LINES)], ids=" ".join)
def test_every_example_can_be_typed(words: list[str]) -> None:
    name = command_of(words)
    if name != ("mock",):  # its options are the mock's own
        with COMMANDS[name].make_context(" ".join(name), words[len(name) :], resilient_parsing=False) as context:
            assert context.command is COMMANDS[name]


def exit_codes_of_errors() -> set[int]:
    for module in pkgutil.walk_packages(daq.__path__, "daq."):
        if not module.name.endswith("__main__"):
            importlib.import_module(module.name)

    def below(kind: type[DaqError]) -> Iterator[type[DaqError]]:
        yield kind
        for sub in kind.__subclasses__():
            yield from below(sub)

    return {int(kind.exit_code) for kind in below(DaqError)}


def test_every_exit_code_is_explained() -> None:
    explained = {int(code) for code in re.findall(r"^\| (\d+) \|", PAGE, re.MULTILINE)}
    used = exit_codes_of_errors() | {code for code in vars(exit_codes).values() if isinstance(code, int)}
    assert explained == used


# ---- docs/your-robot.md: its settings are settings


(SETTINGS,) = re.findall(r"```toml\n(\[robot\]\n.*?)```", YOUR_ROBOT, re.DOTALL)


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
