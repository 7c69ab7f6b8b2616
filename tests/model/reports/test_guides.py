"""What the guides about models show is what the repository has."""

import re
from importlib import import_module
from pathlib import Path

import pytest
import typer.main

from daq.contracts.effects import effect_names
from daq.contracts.machine import load_machine, parse_machine
from daq_cli.app.subcommands import subcommands
from docs.extensions.machine_file import PARTS

ROOT = Path(__file__).parents[3]
PAGES = [ROOT / "docs" / name for name in ("modelling.md", "own-machine.md")]


def shown_commands(page: Path) -> list[list[str]]:
    """Words of every `daq` command in the code of a page."""
    blocks = re.findall(r"^```\w*\n(.*?)^```", page.read_text("utf-8"), re.DOTALL | re.MULTILINE)
    lines = [line for block in blocks for line in block.replace("\\\n", " ").splitlines()]
    commands = [re.sub(r"\s+#.*", "", line.removeprefix("$ ")) for line in lines]
    return [command.split()[1:] for command in commands if command.startswith("daq ")]


@pytest.mark.parametrize("page", [*PAGES, ROOT / "docs" / "own-effect.md"], ids=lambda page: page.name)
def test_every_option_of_a_shown_command_exists(page: Path) -> None:
    commands = shown_commands(page)
    assert commands
    for name, *words in commands:
        if name not in subcommands() and not (ROOT / "extras").exists():
            continue
        command = typer.main.get_command(import_module(subcommands()[name].module).app)
        if (inner := getattr(command, "commands", None)) is not None:
            command = inner[words[0]]
        known = {option for parameter in command.params for option in parameter.opts}
        assert {word for word in words if re.match(r"--?[a-z]", word)} <= known, name


def test_the_machine_file_of_the_guide_is_the_example() -> None:
    shown = re.findall(r"```toml\n(.*?)```", (ROOT / "docs" / "own-machine.md").read_text("utf-8"), re.DOTALL)
    assert shown == [(ROOT / "examples" / "single_axis.toml").read_text("utf-8")]
    assert len([line for line in shown[0].splitlines() if line]) <= 20
    assert parse_machine(shown[0]).modelled_joints == (1,)


@pytest.mark.parametrize("path", sorted((ROOT / "examples").glob("*.toml")), ids=lambda path: path.name)
def test_every_example_is_a_machine(path: Path) -> None:
    assert load_machine(str(path)).joints


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_effect_that_a_page_names_is_in_the_library(page: Path) -> None:
    text = page.read_text("utf-8")
    named = set(re.findall(r"`([a-z]+_[a-z_]+)`", text)) - {
        "dc_motor",
        "board_pid",
        "velocity_gains",
        "lab_data",
        "pwm_limit",
    }
    named -= {name for name in named if re.match(r"(set_point|position|drive|velocity)", name)}
    named -= {field for part in PARTS for field in part.model_fields}
    assert named <= set(effect_names())
