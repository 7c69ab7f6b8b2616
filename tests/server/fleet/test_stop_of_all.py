"""The stop of all arms at the stop listener, and its result, which is as good as the worst."""

import threading
from pathlib import Path

import httpx
import pytest

from daq.contracts.service.robot import FleetStopResult, StopResult
from server.stopping.arm import together
from server.stopping.listener import Asked, OnStop, Stop
from tests.server.stopping.test_stop_listener import listener_of

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

    def on_stop(robot: str, result: StopResult, asked: Asked) -> None:
        told.append((robot, result.confirmed, asked.caller.name))

    answer = stop_of_all(tmp_path, dict.fromkeys(("a", "b", "c"), stop), on_stop)
    assert answer.confirmed
    assert list(answer.robots) == ["a", "b", "c"]
    assert sorted(told) == [(name, True, "local") for name in ("a", "b", "c")]


def stop_of_all(folder: Path, stops: dict[str, Stop], on_stop: OnStop) -> FleetStopResult:
    """The answer of a stop listener of these arms to the stop of all."""
    with listener_of(folder, stops, on_stop) as (host, port):
        answer = httpx.post(f"http://{host}:{port}/api/v1/fleet/stop", timeout=60)
    return FleetStopResult.model_validate(answer.json())


def test_a_stop_is_told_before_a_slower_arm_has_answered(tmp_path: Path) -> None:
    told: dict[str, threading.Event] = {name: threading.Event() for name in ("slow", "quick")}

    def slow() -> StopResult:
        return FROZEN if told["quick"].wait(10) else LOST

    answer = stop_of_all(tmp_path, {"slow": slow, "quick": lambda: FROZEN}, lambda name, *_: told[name].set())
    assert answer.confirmed
    assert told["slow"].is_set()


def test_a_stop_that_cannot_be_told_is_answered_all_the_same(tmp_path: Path) -> None:
    def fails(*_: object) -> None:
        raise ValueError("no reader")

    assert stop_of_all(tmp_path, {"a": lambda: FROZEN, "b": lambda: FROZEN}, fails).confirmed


def test_all_arms_are_stopped_though_no_thread_can_be_started(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    start, refused = threading.Thread.start, list[str]()

    def seldom(thread: threading.Thread) -> None:
        if thread.name == "stop" or "process_request" in thread.name:
            refused.append(thread.name)
            raise RuntimeError("can't start new thread")
        start(thread)

    monkeypatch.setattr(threading.Thread, "start", seldom)
    told: list[str] = []
    names = ("a", "b", "c")
    answer = stop_of_all(tmp_path, dict.fromkeys(names, lambda: FROZEN), lambda name, *_: told.append(name))
    assert list(answer.robots) == sorted(told) == list(names)
    assert answer.confirmed
    assert len(refused) == 3  # the request's own, and those of two arms


def test_one_arm_that_does_not_confirm_is_named_and_the_stop_of_the_only_arm_reads_as_ever() -> None:
    found = together({"left": FROZEN, "right": LOST})
    assert (found.delivered, found.confirmed, found.seconds) == (False, False, 0.9)
    assert found.detail == "not confirmed: right (no link). Use the emergency stop. Confirmed: left."
    assert found.text == "left: stopped, confirmed by the board; right: stop NOT DELIVERED: no link. Use it."
    assert together({"ma2000": FROZEN}).text == FROZEN.text
    assert together({"left": FROZEN, "right": FROZEN}).detail == "all 2 arms hold their set points."
