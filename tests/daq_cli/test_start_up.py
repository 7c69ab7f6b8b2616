"""`daq --help` starts fast because it loads little; which modules it loads is tested, not how long that takes."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

NOT_FOR_HELP = {"rich", "pydantic", "pydantic_settings", "numpy", "serial", "mcap", "platformdirs", "zstandard", "yaml"}

PROGRAM = """
import json, sys
sys.argv = ["daq", *{words!r}]
from daq_cli import main
try:
    main()
except SystemExit:
    pass
print(json.dumps(sorted({{name.partition(".")[0] for name in sys.modules}})), file=sys.stderr)
"""


def loaded(*words: str) -> set[str]:
    run = subprocess.run(
        [sys.executable, "-c", PROGRAM.format(words=list(words))], check=True, capture_output=True, timeout=60
    )
    return set(json.loads(run.stderr.splitlines()[-1]))


@pytest.mark.parametrize("words", [["--help"], []], ids=["help", "nothing"])
def test_help_loads_no_library_that_only_commands_need(words: list[str]) -> None:
    assert loaded(*words) & NOT_FOR_HELP == set()


def test_a_stop_loads_no_more_than_it_needs() -> None:
    """It must be quick: no numbers, no traces, no colours."""
    assert loaded("stop") & {"numpy", "mcap", "rich", "serial", "scipy", "matplotlib"} == set()


def test_a_stop_is_asked_for_before_the_command_line_is_loaded() -> None:
    program = """import sys, daq_cli.app.early_stop as early
early.ask()
print('typer' in sys.modules, 'pydantic' in sys.modules)"""
    run = subprocess.run([sys.executable, "-c", program], check=True, capture_output=True, text=True, timeout=60)
    assert run.stdout.split() == ["False", "False"]
