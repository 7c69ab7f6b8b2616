"""The control port's commands, without a port; options from command line and file."""

import json
import re
from pathlib import Path
from typing import Any

import pytest

from firmware_protocol.commands import Advance, SetGains, Stop, WriteSetPoints
from mock_controller.__main__ import main
from mock_controller.control import Control
from mock_controller.device import build_device
from mock_controller.options import Options, read_options
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
    snapshots = bench.say("snapshots", after=newest.tick - 2)["snapshots"]
    assert [snapshot["tick"] for snapshot in snapshots] == [newest.tick - 1, newest.tick]
    assert snapshots[-1]["time_us"] == newest.time_us
    assert snapshots[-1]["set_points"] == list(newest.set_points)
    assert snapshots[-1]["set_points"][0] == 520
    assert snapshots[-1]["positions"] == list(newest.positions)
    assert bench.say("snapshots", after=newest.tick)["snapshots"] == []
    assert bench.say("snapshots", after="yesterday")["ok"] is False


def test_process_inputs_and_supply_line_can_be_set(bench: Bench) -> None:
    assert bench.say("inputs", bits=5)["ok"]
    bench.host.ask(Advance(20_000))
    assert bench.host.board.memory.values("process_inputs") == [5]
    assert bench.say("brown_out")["ok"]
    assert not bench.host.board.powered
    assert bench.say("disconnect", seconds=1.5)["ok"]
    assert bench.say("disconnect")["ok"]
    assert bench.say("reconnect")["ok"]
    assert bench.say("kill")["ok"]
    assert bench.process.asked == [("disconnect", 1.5), ("disconnect", None), "reconnect", "kill"]


def test_commands_and_modifications_are_listed_as_in_the_guide(bench: Bench) -> None:
    guide = (Path(__file__).parents[3] / "docs" / "mock.md").read_text("utf-8")
    table = guide.partition("## The control port")[2].partition("\n## ")[0]
    assert set(re.findall(r"^\| `(\w+)` \|", table, re.MULTILINE)) - {"do"} == set(bench.say("help")["commands"])
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


# ---- Options; what cannot be is one line


def test_arguments_win_over_defaults() -> None:
    options = read_options(["--tcp", "127.0.0.1:0", "--start", "1,2,3,4,5,6", "--gains", "3,1,0", "--no-sample"])
    assert options == Options(tcp="127.0.0.1:0", start=(1, 2, 3, 4, 5, 6), gains=(3, 1, 0), sample=False)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ([], "no address: give --pty or --tcp HOST:PORT"),
        (["--pty", "--tcp", "127.0.0.1:0"], "pty and tcp: give only one of them"),
        (["--tcp", "127.0.0.1:0", "--link", "x"], "link: a name for the pseudo-terminal needs --pty"),
        (["--pty", "--baud", "fast"], "argument --baud: invalid int value: 'fast'"),
        (["--pty", "--baud", "0"], "baud: input should be greater than or equal to 300, is 0"),
        (["--pty", "--start", "1,2,3"], "start: "),
        (["--pty", "--start", "1,2,3,4,5,1000"], "start 5: input should be less than 1000, is '1000'"),
        (["--pty", "--gains", "2,0,21"], "gains 2: input should be less than or equal to 20, is '21'"),
        (["--pty", "--gains", "2,0"], "gains 2: field required"),
        (["--pty", "--seed", "-1"], "seed: input should be greater than or equal to 0, is -1"),
        (["--pty", "--colour"], "unrecognized arguments: --colour"),
        (["--tcp", "nonsense"], "tcp: 'nonsense': write HOST:PORT"),
        (["--tcp", "127.0.0.1:70000"], "tcp: '127.0.0.1:70000': write HOST:PORT"),
        (["--tcp", "127.0.0.1:0", "--control", "here"], "control: 'here': write HOST:PORT"),
        (["--pty", "--fault", "flop"], "fault 'flop': not known"),
        (["--pty", "--fault", "flip:rate=2"], "fault flip: rate is 2, allowed are 0.0 to 1.0"),
        (["--pty", "--modify", "gremlin"], "modification 'gremlin': not known"),
        (["--pty", "--modify", "payload:mass"], "modification payload: 'mass': write parameter=value"),
        (["--pty", "--plant", "missing.toml"], "plant: missing.toml: No such file or directory"),
        (["--pty", "--board", "missing.toml"], "board: missing.toml: No such file or directory"),
        (["--pty", "--memory-map", "missing.toml"], "memory-map: missing.toml: No such file or directory"),
        (["--pty", "--link", "missing/folder/arm"], "link: missing/folder/arm: No such file or directory"),
    ],
)
def test_wrong_options_are_one_line_and_exit_code_2(
    arguments: list[str],
    words: str,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(arguments) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.startswith(f"mock_controller: {words}")
    assert said.err.count("\n") == 1


def test_start_posture_gains_and_hidden_effects_reach_board_and_arm() -> None:
    chosen = Options(
        tcp="x", start=(100, 400, 500, 600, 500, 500), gains=(4, 1, 2), modify=("payload:mass=0.5,offset=0.1",)
    )
    device = build_device(chosen, lambda _: None)
    memory = device.board.memory
    assert chosen.start is not None
    assert all(abs(at - wanted) <= 3 for at, wanted in zip(memory.values("set_point"), chosen.start, strict=True))
    assert [memory.values(name)[0] for name in ("gain_p", "gain_i", "gain_d")] == [4, 1, 2]
    assert device.board.plant.parameters.rigid_body.m_load == pytest.approx(1.250307 + 0.5)
    assert device.modifications == ("payload:mass=0.5,offset=0.1",)


@pytest.mark.parametrize("word", ["--help", "--help-faults"])
def test_help_explains_and_leaves(word: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as left:
        read_options([word])
    assert left.value.code == 0
    assert "--lock-step" in (text := capsys.readouterr().out) or "busy_memory" in text
