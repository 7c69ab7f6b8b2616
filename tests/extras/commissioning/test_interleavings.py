"""A step of `daq commission` at a port that others stop and reset meanwhile: nothing moves that nobody released."""

from __future__ import annotations

from contextlib import nullcontext
from types import SimpleNamespace
from typing import Any

import pytest

from extras.commissioning.command import by_command
from tests.server.interleaved import Scene
from tests.server.test_interleavings import (
    ALL,
    SOON,
    People,
    checked,
    command_line,
    virtual,  # noqa: F401 - a fixture
)


def _commissioning(seed: int) -> Scene:
    scene = command_line(seed)
    consent = SimpleNamespace(require=lambda *_: scene.world.step())
    bench: Any = SimpleNamespace(consent=consent, call=SimpleNamespace(port="wire"), scene=scene)
    People(scene).does("commission", lambda: by_command.stop(bench))
    return scene


@pytest.mark.parametrize("seeds", [SOON, pytest.param(ALL, marks=pytest.mark.slow)])
def test_nothing_moves_after_a_confirmed_stop(seeds: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(by_command, "connected", lambda bench: nullcontext(bench.scene.controller))
    monkeypatch.setattr(by_command, "replace", lambda consent, **_: consent)
    interleavings, motions = checked(_commissioning, seeds)
    assert interleavings > 0.9 * seeds
    assert motions > 0
