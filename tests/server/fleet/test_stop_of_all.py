"""The stop of all arms at the stop listener, and its result, which is as good as the worst."""

from __future__ import annotations

import socket
import threading
from pathlib import Path

import httpx

from daq.contracts.service.robot import FleetStopResult, StopResult
from server.access.caller import Caller
from server.access.stop_gate import StopGate
from server.access.tokens import KnownTokens, TokenStore
from server.stopping.arm import together
from server.stopping.listener import StopListener
from server.store.engine import Store
from tests.server.clocks import HandClock

FROZEN = StopResult(delivered=True, confirmed=True, tick=7, seconds=0.1, text="stopped, confirmed by the board")
LOST = StopResult(
    delivered=False, confirmed=False, seconds=0.9, note="no link", text="stop NOT DELIVERED: no link. Use it."
)


def test_all_arms_are_stopped_at_the_same_time_and_every_stop_is_told(tmp_path: Path) -> None:
    at_once = threading.Barrier(3)
    told: list[tuple[str, bool, str]] = []

    def stop() -> StopResult:
        at_once.wait(60)  # nobody gets further before all are asked
        return FROZEN

    def on_stop(robot: str, result: StopResult, caller: Caller) -> None:
        told.append((robot, result.confirmed, caller.name))

    store = Store(f"sqlite:///{tmp_path / 'service.sqlite'}")
    gate = StopGate(KnownTokens(TokenStore(store), HandClock()), True, (), 8300)
    with socket.create_server(("127.0.0.1", 0)) as door:
        url = f"http://127.0.0.1:{door.getsockname()[1]}/api/v1/fleet/stop"
        listener = StopListener(door, gate, dict.fromkeys(("a", "b", "c"), stop), on_stop)
        answer = FleetStopResult.model_validate(httpx.post(url, timeout=60).json())
        listener.close()
    store.close()
    assert answer.confirmed
    assert list(answer.robots) == ["a", "b", "c"]
    assert told == [(name, True, "local") for name in ("a", "b", "c")]


def test_one_arm_that_does_not_confirm_is_named() -> None:
    found = together({"left": FROZEN, "right": LOST})
    assert (found.delivered, found.confirmed, found.seconds) == (False, False, 0.9)
    assert found.detail == "not confirmed: right (no link). Use the emergency stop. Confirmed: left."
    assert found.text == "left: stopped, confirmed by the board; right: stop NOT DELIVERED: no link. Use it."


def test_the_stop_of_the_only_arm_reads_as_ever() -> None:
    assert together({"ma2000": FROZEN}).text == FROZEN.text
    assert together({"left": FROZEN, "right": FROZEN}).detail == "all 2 arms hold their set points."
