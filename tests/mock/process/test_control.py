"""The control port's commands, without a port."""

import json
import re
from pathlib import Path
from typing import Any

import pytest

from firmware_protocol.commands import Advance, SetGains, Stop, WriteSetPoints
from mock_controller.control import Control
from tests.mock.host import LockStepHost


class RecordedProcess:
    """Remembers what was asked of the process."""

    def __init__(self) -> None:
        self.asked: list[object] = []

    def disconnect(self, seconds: float | None) -> None:
        self.asked.append(("disconnect", seconds))

    def reconnect(self) -> None:
        self.asked.append("reconnect")

    def kill(self) -> None:
        self.asked.append("kill")

    def clock(self) -> dict[str, Any]:
        return {"mode": "none"}

    def lost_bytes(self) -> int:
        return 0


class Bench:
    def __init__(self) -> None:
        self.host = LockStepHost()
        self.process = RecordedProcess()
        self.control = Control(self.host.device, self.process)

    def say(self, command: str, **more: object) -> dict[str, Any]:
        line = self.control.execute(json.dumps({"do": command, **more}).encode())
        assert line.endswith(b"\n")
        answer = json.loads(line)
        assert isinstance(answer, dict)
        return answer


@pytest.fixture
def bench() -> Bench:
    return Bench()


def test_state_shows_what_is_in_the_board(bench: Bench) -> None:
    bench.host.ask(SetGains(3, 7, 1, 2))
    bench.host.ask(WriteSetPoints(((1, 520),)))
    bench.host.ask(Advance(50_000))
    bench.host.ask(Stop())
    bench.host.ask(Advance(50_000))
    state = bench.say("state")
    assert state["ok"] is True
    assert state["tick"] == 6
    assert state["frozen"] is True
    assert state["set_points"] == bench.host.board.memory.values("set_point")
    assert state["gains"][2] == [7, 1, 2]
    stop = state["stop"]
    assert stop["count"] == 1
    assert stop["frozen_us"] - stop["received_us"] == 120
    assert (stop["first_used_us"], stop["first_used_tick"]) == (60_000, 4)
    assert state["clock"] == {"mode": "none"}


def test_faults_are_switched_listed_and_counted(bench: Bench) -> None:
    on = bench.say("fault_on", fault="drop:rate=1,direction=to_host")
    assert (on["ok"], on["label"], on["rate"]) == (True, "drop", 1.0)
    assert bench.host.replies(Advance(0)) == []
    assert [entry["label"] for entry in bench.say("fault_list")["faults"]] == ["drop"]
    assert bench.say("fault_off", fault="drop") == {"ok": True, "ended": ["drop"]}
    bench.host.ask(Advance(0))
    counts = bench.say("counts")
    assert counts["faults"] == {"drop": {"to_host": 1}}
    assert counts["bridge"]["frames_received"] == counts["bridge"]["frames_sent"] == 2
    assert counts["bridge"]["answered"] == {"Hello": 1, "Advance": 2}


def test_snapshots_are_the_boards_own_record(bench: Bench) -> None:
    bench.host.ask(WriteSetPoints(((1, 520),)))
    bench.host.ask(Advance(90_000))
    newest = bench.host.board.snapshots.newest()
    assert newest is not None
    snapshots = bench.say("snapshots", after=newest.tick - 2)["snapshots"]
    assert [snapshot["tick"] for snapshot in snapshots] == [newest.tick - 1, newest.tick]
    assert snapshots[-1]["time_us"] == newest.time_us
    assert snapshots[-1]["set_points"] == list(newest.set_points)
    assert snapshots[-1]["set_points"][0] == 520
    assert snapshots[-1]["positions"] == list(newest.positions)
    assert bench.say("snapshots", after=newest.tick)["snapshots"] == []
    assert bench.say("snapshots", after="yesterday")["ok"] is False


def test_supply_line_and_process_can_fail(bench: Bench) -> None:
    assert bench.say("brown_out")["ok"]
    assert not bench.host.board.powered
    assert bench.say("disconnect", seconds=1.5)["ok"]
    assert bench.say("disconnect")["ok"]
    assert bench.say("reconnect")["ok"]
    assert bench.say("kill")["ok"]
    assert bench.process.asked == [("disconnect", 1.5), ("disconnect", None), "reconnect", "kill"]


def test_process_inputs_can_be_set(bench: Bench) -> None:
    assert bench.say("inputs", bits=5)["ok"]
    bench.host.ask(Advance(20_000))
    assert bench.host.board.memory.values("process_inputs") == [5]


def test_the_guide_lists_every_command(bench: Bench) -> None:
    guide = (Path(__file__).parents[3] / "docs" / "mock.md").read_text("utf-8")
    table = guide.partition("## The control port")[2].partition("\n## ")[0]
    assert set(re.findall(r"^\| `(\w+)` \|", table, re.MULTILINE)) - {"do"} == set(bench.say("help")["commands"])


def test_commands_and_modifications_are_listed(bench: Bench) -> None:
    assert "state" in bench.say("help")["commands"]
    assert all(bench.say("help")["commands"].values())
    assert bench.say("modifications") == {"ok": True, "modifications": []}


@pytest.mark.parametrize(
    "line",
    [
        b"",
        b"{",
        b"\xff\xfe",
        b"[]",
        b"7",
        b'{"do": 3}',
        b'{"do": "dance"}',
        b'{"do": "fault_on"}',
        b'{"do": "fault_on", "fault": "flop"}',
        b'{"do": "fault_off", "fault": "flip"}',
        b'{"do": "inputs", "bits": 256}',
        b'{"do": "inputs", "bits": true}',
        b'{"do": "disconnect", "seconds": -1}',
        b"[" * 100_000,
        b'{"do": "disconnect", "seconds": NaN}',
    ],
)
def test_what_cannot_be_done_is_answered_by_one_line(bench: Bench, line: bytes) -> None:
    answer = bench.control.execute(line)
    assert answer.count(b"\n") == 1
    assert json.loads(answer)["ok"] is False
    assert bench.process.asked == []
