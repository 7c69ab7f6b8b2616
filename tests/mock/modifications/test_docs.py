"""The page about the mock tells every effect with its bounds, and the sizes that secrets draw."""

from __future__ import annotations

from pathlib import Path

import pytest

from mock_controller.hidden.sizes import LATER_SIZES, OPEN_SIZES, SHARED_SIZES, SizeRange
from mock_controller.modifications.parameter import fields_of
from mock_controller.modifications.registry import known_modifications

PAGE = (Path(__file__).parents[3] / "docs" / "mock.md").read_text("utf-8")


@pytest.mark.parametrize("size", SHARED_SIZES + LATER_SIZES + OPEN_SIZES, ids=lambda size: size.effect)
def test_the_page_has_the_effect_as_it_is(size: SizeRange) -> None:
    (row,) = [line for line in PAGE.splitlines() if line.startswith(f"| `{size.effect}` |")]
    for key, field in fields_of(known_modifications()[size.effect]).items():
        if key != "joint":
            assert f"`{key}` {field.metadata['low']:g} to {field.metadata['high']:g}" in row
    for joint in size.joints if size.acts_on_joints else (1,):
        low, high = size.ranges[joint - 1]
        assert f"{low:g}–{high:g}" in row
