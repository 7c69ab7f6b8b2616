"""`daq run`: what it does, prints, and ends with; stopped in every way a person has."""

import json
import os
import signal
import subprocess
from contextlib import nullcontext
from datetime import UTC, datetime
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from daq.contracts.experiment import ExperimentSpec
from daq.traces.reader import read_trace
from daq_cli.robot.experiment import RunOptions, carry_out, cron_of
from tests.daq_cli.invoke import CommandLine
from tests.daq_cli.person import at_a_terminal

LONG = ["run", "ramp", "--hold", "600", "--folder", "traces"]


def test_a_run_is_recorded_and_printed_as_json(daq: CommandLine, port: str) -> None:
    said = daq("--port", port, "run", "ramp", "--joints", "1-3", "--folder", "traces", "--json", "--hold", "0.2")
    assert said.code == 0, said.err
    result = json.loads(said.out)
    assert (result["outcome"], result["missing"]) == ("complete", 0)
    trace = read_trace(Path(result["trace"]))
    assert trace.record.spec is not None
    assert trace.record.spec.joints == (1, 2, 3)
    assert len(trace) == result["samples"]


def test_a_run_is_recorded_and_printed_for_people(daq: CommandLine, port: str) -> None:
    said = daq("--port", port, "run", "step", "--joints", "3", "--folder", "traces", "--hold", "0.2")
    assert said.code == 0
    lines = said.out.splitlines()
    assert lines[0].startswith("complete: ")
    assert lines[1].startswith("link: retries 0, ")
    trace = lines[2].removeprefix("trace: ")
    assert Path(trace).is_file()
    told = " ".join(said.out.split())
    assert all(what in told for what in ("overshoot", "rise time", "largest error")), "what was seen"
    assert any(line.startswith("     3 ") and "°" in line for line in lines), "of the joint that moved"
    assert lines[-3:] == [
        f"picture: daq traces plot {trace}",
        f"next:    daq fit {trace} -o model.json",
        "         daq serve    # the same in a browser",
    ]


def test_a_dry_run_connects_to_nothing_and_leaves_nothing(
    daq: CommandLine, monkeypatch: pytest.MonkeyPatch, empty_folder: Path
) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise AssertionError("a dry run starts no process")

    monkeypatch.setattr(subprocess, "Popen", refuse)
    said = daq("--port", "serial:///dev/nowhere", "run", "ramp", "--dry-run")
    assert said.code == 0, said.err
    assert "nothing was sent" in said.out
    data = json.loads(daq("--port", "serial:///dev/nowhere", "run", "ramp", "--dry-run", "--json").out)
    assert data["violations"] == []
    assert data["preview"]["period"] == 0.02
    assert not list(empty_folder.iterdir())


def test_an_experiment_is_read_from_json_and_toml(daq: CommandLine) -> None:
    Path("one.json").write_text(json.dumps({"trajectory": {"kind": "pause", "duration": 1}, "joints": [2]}))
    assert "pause: " in daq("run", "spec", "one.json", "--dry-run").out
    Path("two.toml").write_text('joints = [2]\n[trajectory]\nkind = "pause"\nduration = -1\n')
    daq("run", "spec", "two.toml", "--dry-run").complains(2, "experiment two.toml", "greater than 0", "-1")


@pytest.mark.parametrize("keys", [b"\x03\x03", b"\x1a"], ids=["Ctrl-C twice", "Ctrl-Z"])
def test_ctrl_c_and_ctrl_z_stop_the_arm(keys: bytes) -> None:
    with at_a_terminal(["--port", "mock://?pty=1&seed=3", *LONG]) as person:
        person.until(b"ramp starts")
        person.type(keys)
        code = person.end()
    assert code == 6, person.seen
    assert b"stopped: " in person.seen
    assert b"confirmed" in person.seen
    (path,) = Path("traces").iterdir()
    assert read_trace(path).record.outcome == "stopped"


def test_a_stop_from_another_terminal_ends_the_run(daq: CommandLine) -> None:
    with at_a_terminal(["--port", "mock://?pty=1&seed=3", *LONG]) as person:
        person.until(b"ramp starts")
        said = daq("stop", "--json")
        code = person.end()
    assert said.code == 0
    (answer,) = json.loads(said.out)
    assert (answer["robot"], answer["delivered"], answer["confirmed"]) == ("ma2000", True, True)
    assert code == 6
    assert b"on request, by STOP on the page or daq stop" in person.seen


def test_a_command_line_that_is_killed_leaves_an_interrupted_trace() -> None:
    with at_a_terminal(["--port", "mock://?pty=1&seed=3", *LONG]) as person:
        person.until(b"ramp starts")
        children = Path(f"/proc/{person.process.pid}/task/{person.process.pid}/children").read_text().split()
        (acquisition,) = [os.pidfd_open(int(child)) for child in children]
        try:
            person.process.send_signal(signal.SIGKILL)
            signal_of_end(acquisition)
        finally:
            os.close(acquisition)
    (path,) = Path("traces").iterdir()
    assert read_trace(path).record.outcome == "interrupted"


def signal_of_end(handle: int) -> None:
    import select

    assert select.select([handle], [], [], 30)[0], "the acquisition process outlived its parent"


@pytest.mark.parametrize(
    ("words", "cron", "said"),
    [
        (("2:05", None), "5 2 * * *", "first on 2026-11-30 at 02:05"),
        ((None, "0 2 * * 1-5"), "0 2 * * 1-5", "first on 2026-11-30 at 02:05"),
        ((None, "0 2 1 * 1"), "0 2 1 * 1", "on days 1 of the month and on every weekday 1"),
    ],
)
def test_a_schedule_says_when_it_runs_and_how_it_is_cancelled(
    capsys: pytest.CaptureFixture[str], words: tuple[str | None, str | None], cron: str, said: str
) -> None:
    asked: list[str] = []

    def create(_spec: object, *, cron: str) -> Any:
        asked.append(cron)
        first = datetime(2026, 11, 30, 2, 5).astimezone().astimezone(UTC)
        return SimpleNamespace(id="7f", cron=cron, zone="Europe/London", next=first)

    service = SimpleNamespace(schedules=SimpleNamespace(create=create))
    robot: Any = SimpleNamespace(service=lambda _what: nullcontext(service))
    carry_out(robot, ExperimentSpec(), RunOptions(None, dry_run=False, yes=False, json=False, cron=cron_of(*words)))
    told = capsys.readouterr().out
    assert asked == [cron]
    assert told.startswith(f"schedule 7f: {cron} (Europe/London)")
    assert said in told
    assert told.endswith("`daq queue schedules` lists, `unschedule` cancels\n")
