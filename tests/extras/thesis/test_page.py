"""docs/thesis.md shows what `daq thesis` prints: every line of its blocks, in their order."""

import re
from pathlib import Path

import pytest

from daq.contracts.trace import Trace
from extras.thesis.command import as_text
from extras.thesis.reproduction import Reproduction, reproduce_thesis

PAGE = Path(__file__).parents[3] / "docs" / "thesis.md"
SLOW = "nelder_mead"
RELATIVE, ABSOLUTE = 0.02, 1e-7
"""How far a number may lie from the command's: where another processor rounds otherwise, a fit goes on from that."""
NUMBER = re.compile(r"[-+−]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")


def blocks() -> list[list[str]]:
    """The page's blocks of output, lines that stand for others left out."""
    found = re.findall(r"```text\n(.*?)```", PAGE.read_text("utf-8"), re.DOTALL)
    return [[line for line in block.splitlines() if line.strip() not in ("", "...")] for block in found]


def test_the_page_shows_what_the_command_prints(result: Reproduction) -> None:
    quick = [block for block in blocks() if not any(SLOW in line for line in block)]
    assert len(quick) >= 5
    for block in quick:
        compare(block, as_text(result).splitlines())


@pytest.mark.slow
def test_the_page_shows_what_the_command_prints_hill_climbing_included(ramp: Trace) -> None:
    whole = as_text(reproduce_thesis([ramp])).splitlines()
    for block in blocks():
        compare(block, whole)


def test_the_page_names_every_statement_that_is_not_borne_out(result: Reproduction) -> None:
    shown = "\n".join(line for block in blocks() for line in block)
    for check in result.failed:
        assert f"NO  {check.name}" in shown


def compare(block: list[str], output: list[str]) -> None:
    """Fails with the first line of the block that the rest of the output has not."""
    at = 0
    for line in block:
        found = next((k for k in range(at, len(output)) if alike(line, output[k])), None)
        assert found is not None, f"docs/thesis.md has a line that `daq thesis` does not print: {line}"
        at = found + 1


def alike(one: str, other: str) -> bool:
    """The same words, and numbers that are as good as equal; numbers of traces are left aside."""
    first, second = (re.sub(r"\b[0-9a-f]{12}\b", "TRACE", " ".join(line.split())) for line in (one, other))
    if NUMBER.sub("#", first) != NUMBER.sub("#", second):
        return False
    numbers = [[float(n.replace("−", "-")) for n in NUMBER.findall(line)] for line in (first, second)]
    return numbers[0] == pytest.approx(numbers[1], rel=RELATIVE, abs=ABSOLUTE)
