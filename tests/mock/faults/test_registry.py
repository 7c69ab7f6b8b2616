"""Faults as they are asked for, and one clear line for what cannot be."""

import inspect
import re
from pathlib import Path

import pytest

from mock_controller.faults.fault import FaultError, fields_of
from mock_controller.faults.registry import FAULTS, describe, parse_fault, table

NAMES = (
    "flip",
    "drop",
    "duplicate",
    "delay",
    "split",
    "junk",
    "stall",
    "disconnect",
    "busy_memory",
    "stuck_potentiometer",
    "noisy_potentiometer",
    "stalled_joint",
    "brown_out",
)


def test_every_fault_has_a_name_a_line_and_parameters_that_are_explained() -> None:
    assert tuple(FAULTS) == NAMES
    text = table()
    for name, kind in FAULTS.items():
        assert f"{name}: {kind.summary()}" in text
        assert describe(parse_fault(name))["name"] == name


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("flop", "fault 'flop': not known; there are flip, drop"),
        ("", "fault '': not known"),
        ("flip:rat=1", "fault flip: no parameter 'rat=1'; write parameter=value with start, duration"),
        ("flip:0.01", "fault flip: no parameter '0.01'"),
        ("flip:rate=lots", "fault flip: rate is 'lots', must be a number"),
        ("flip:rate=1.5", "fault flip: rate is 1.5, allowed are 0.0 to 1.0"),
        ("flip:rate=nan", "fault flip: rate is nan, allowed are 0.0 to 1.0"),
        ("flip:bits=0", "fault flip: bits is 0, allowed are 1 to 64"),
        ("flip:bits=1.5", "fault flip: bits is '1.5', must be a whole number"),
        ("drop:direction=up", "fault drop: direction is 'up', allowed are both, to_controller, to_host"),
        ("stalled_joint:joint=7", "fault stalled_joint: joint is 7, allowed are 1 to 6"),
        ("delay:ms=-1", "fault delay: ms is -1, allowed are 0.0 to 60000.0"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(text: str, words: str) -> None:
    with pytest.raises(FaultError) as caught:
        parse_fault(text)
    assert str(caught.value).startswith(words)
    assert "\n" not in str(caught.value)


def test_the_guide_lists_every_fault_and_its_parameters() -> None:
    guide = (Path(__file__).parents[3] / "docs" / "mock.md").read_text("utf-8")
    listed = dict(re.findall(r"^\| `(\w+)` \|[^|]*\|([^|]*)\|[^|]*\|$", guide, re.MULTILINE))
    assert tuple(listed) == NAMES
    for name, kind in FAULTS.items():
        own = set(inspect.get_annotations(kind)) - {"name"}
        named = set(re.findall(r"`(\w+)`", listed[name]))
        assert named <= set(fields_of(kind))
        assert own - named <= {"duration"}
