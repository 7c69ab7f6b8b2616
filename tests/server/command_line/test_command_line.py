"""`daq --server URL`: what the local command does, with a service's robot."""

import json
import signal
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from daq.teaching.program import Program, load_program
from daq.traces.reader import read_trace
from tests.daq_cli.invoke import CommandLine, Said
from tests.daq_cli.person import at_a_terminal
from tests.server.other_user import environment_in
from tests.server.polling import until
from tests.server.service import DAQ, Service

RAMP = ["run", "ramp", "--joints", "1-3", "--amplitude", "3", "--duration", "0.2", "--settle", "0.1", "--hold", "0.1"]
Daq = Callable[..., Said]


@pytest.fixture
def daq(service: Service, here: CommandLine) -> Daq:
    """The same, with the service's address."""
    return lambda *words: here("--server", service.url, *words)


def test_a_run_does_what_the_local_command_does(daq: Daq, tmp_path: Path) -> None:
    said = daq(*RAMP)
    assert said.code == 0, said
    lines = said.out.splitlines()
    assert lines[0].startswith("complete: ")
    assert lines[0].endswith(" 0 missing")
    assert lines[1].startswith("link: retries 0, ")
    path = tmp_path / lines[2].removeprefix("trace: ")
    assert path.parent == tmp_path / "traces"
    trace = read_trace(path)
    assert trace.record.spec is not None
    assert trace.record.spec.joints == (1, 2, 3)
    assert f"complete: {len(trace)} samples" in lines[0]
    marks = [line.split("s  ", 1)[1] for line in said.err.splitlines() if " s  " in line]
    assert [mark.split(":")[0] for mark in marks] == ["waypoint", "waypoint", "ramp start", "ramp end"], said.err


def test_its_result_as_json_and_a_dry_run_are_the_same_too(
    daq: Daq, here: CommandLine, service: Service, tmp_path: Path
) -> None:
    result = json.loads(daq(*RAMP, "--json", "--folder", "elsewhere").out)
    assert (result["kind"], result["outcome"], result["missing"]) == ("finished", "complete", 0)
    assert Path(tmp_path, result["trace"]).parent == tmp_path / "elsewhere"
    before = service.robot.get("/experiments").json()["items"][0]["id"]
    assert daq(*RAMP, "--dry-run").out == here(*RAMP, "--dry-run").out
    assert service.robot.get("/experiments").json()["items"][0]["id"] == before


def _begun(service: Service, folder: Path, *words: str) -> subprocess.Popen[str]:
    """A ramp by the command line in a process of its own, which signals reach."""
    return subprocess.Popen(
        [*DAQ, "--server", service.url, *RAMP, *words],
        cwd=folder,
        env=environment_in(folder),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def test_ctrl_c_stops_the_arm_and_the_partial_trace_is_fetched(service: Service, tmp_path: Path) -> None:
    running = _begun(service, tmp_path, "--hold", "600")
    assert running.stderr is not None
    for line in running.stderr:
        if "ramp end" in line:
            break
    running.send_signal(signal.SIGINT)
    out, err = running.communicate(timeout=60)
    assert running.returncode == 6, err
    assert out.startswith("stopped: ")
    (trace,) = (line.removeprefix("trace: ") for line in out.splitlines() if line.startswith("trace: "))
    assert read_trace(tmp_path / trace).record.outcome == "stopped"
    assert service.until_arm("stopped")["queue"]["paused"]


def test_ctrl_c_takes_back_what_waits_and_stops_nobody_else(service: Service, tmp_path: Path) -> None:
    spec = {"trajectory": {"kind": "pause", "duration": 600}, "joints": [1]}
    others = service.robot.post("/experiments", json={"spec": spec}).json()["id"]
    service.until_recording(others)
    running = _begun(service, tmp_path)
    try:
        mine = until(service.robot, "/queue/experiments", bool, process=running)[0]["id"]
        running.send_signal(signal.SIGINT)
        _, err = running.communicate(timeout=60)
    finally:
        running.kill()
    assert running.returncode == 6, err
    assert service.robot.get(f"/experiments/{mine}").json()["state"] == "cancelled"
    assert service.robot.get(f"/experiments/{others}").json()["state"] == "running"
    service.robot.post(f"/experiments/{others}/cancel")
    service.end_of(others)


def test_a_paused_queue_is_told_and_nothing_is_left_lying_in_it(daq: Daq, service: Service) -> None:
    assert daq("queue", "pause").out.startswith("paused: somebody at the service's computer paused it")
    said = daq(*RAMP)
    assert said.code == 4
    assert "nothing was queued" in said.err
    assert said.out == ""
    assert service.robot.get("/queue").json()["queued"] == 0
    assert daq("queue", "resume").out.startswith("open: resumed by somebody at the service's computer")
    assert "open" in daq("queue", "show").out
    assert daq("queue", "schedules").out.startswith("no schedules: ")


def test_a_motion_beyond_the_limits_is_refused_as_at_ones_own_robot(daq: Daq) -> None:
    daq("run", "ramp", "--joints", "1", "--amplitude", "300").complains(4)
    daq("teach", "step", "--to", "2=400").complains(2, "2")


def test_stop_status_and_reset(daq: Daq, service: Service) -> None:
    assert "mock, tick" in daq("status").out
    stopped = daq("stop")
    assert stopped.code == 0, stopped
    assert stopped.out.startswith("ma2000: stopped, confirmed by the board: set points frozen at tick ")
    service.until_arm("stopped")
    assert "stopped" in daq("status").out
    assert json.loads(daq("status", "--json").out)["arm"] == "stopped"
    assert "takes set points again" in daq("reset").out
    assert daq("queue", "resume").code == 0


def test_gains_signals_and_gripper(daq: Daq) -> None:
    assert daq("gains", "set", "6=3/0/0").out == "joint 6: P 3  I 0  D 0, read back\n"
    assert "joint 6: P  3" in daq("gains", "show").out
    assert daq("gains", "set", "6=2/0/0").code == 0
    assert daq("io", "set", "3", "on").code == 0
    assert "outputs 00001000\n" in daq("io", "show").out
    assert daq("io", "set", "3", "off").code == 0
    assert "outputs 00000000\n" in daq("io", "show").out
    assert daq("io", "gripper", "close").code == 0
    assert daq("io", "show").out.endswith("gripper closed\n")
    assert daq("io", "gripper", "open").code == 0


def test_traces_are_listed_fetched_and_sent(daq: Daq, tmp_path: Path) -> None:
    assert daq(*RAMP, "--name", "for-the-list").code == 0
    newest = json.loads(daq("traces", "ls", "--json").out)[-1]
    assert (newest["name"], newest["state"]) == ("for-the-list", "finished")
    assert newest["trace_id"] in daq("traces", "ls").out
    (path,) = (tmp_path / "traces").iterdir()
    path.unlink()
    shown = daq("traces", "show", newest["trace_id"][:8])
    assert f"{newest['trace_id']}: ramp on ma2000" in shown.out
    assert path.is_file()
    assert "trustworthy" in daq("traces", "verify", "last").out
    table = "time,set_point_1,position_1\n" + "".join(f"{0.02 * i},0.1,{0.1 + 0.002 * i}\n" for i in range(50))
    (tmp_path / "rig.csv").write_text(table)
    sent = json.loads(daq("traces", "import", "rig.csv", "--json").out)
    said = daq("traces", "show", sent["trace"]).out
    assert "imported record of " in said
    assert "50 samples on joint" in said


def test_what_has_nothing_to_do_with_a_server_says_so(daq: Daq) -> None:
    for words in (("ports",), ("config", "show"), ("mock",), ("traces", "salvage"), ("design", "ma2000")):
        daq(*words).complains(2, "--server: `daq ")


def test_the_address_may_come_from_the_environment_which_does_not_concern_what_has_no_robot(
    here: CommandLine, service: Service, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("DAQ_SERVER", service.url)
    said = here("queue", "show")
    assert said.code == 0, said.err
    assert said.out.startswith("open: ")
    said = here("config", "check")
    assert said.code == 0, said.err


def test_wrong_addresses_are_one_line(here: CommandLine) -> None:
    for words, code, told in (
        (["--server", "arm.lab", "status"], 2, "write http://host:port"),
        (["--server", "http://127.0.0.1:1", "status"], 3, "not reached"),
        (["--server", "http://x", "--port", "mock://", "status"], 2, "give one of them"),
        (["queue", "show"], 2, "a service has"),
    ):
        here(*words).complains(code, told)


def test_a_step_and_a_program_to_their_end(daq: Daq, service: Service, tmp_path: Path) -> None:
    before = service.status()["sample"]["position"][1]
    said = daq("teach", "step", "--by", "2=-3")
    assert said.code == 0, said.err
    assert said.out == "done: 1 instructions\n"
    assert service.status()["sample"]["position"][1] < before - 0.02
    program = {"name": "there", "machine": "ma2000", "instructions": [{"kind": "relative", "angles": {"2": 0.05}}]}
    (tmp_path / "there.json").write_text(json.dumps(program))
    said = daq("teach", "program", "there.json")
    assert (said.code, said.out) == (0, "done: 1 instructions\n"), said.err
    assert service.robot.get("/control").json()["holder"] == "nobody"


def test_a_lead_leaves_its_path(daq: Daq, tmp_path: Path) -> None:
    said = daq("teach", "lead", "--joints", "1", "--seconds", "0.5", "-o", "path.json")
    assert said.code == 0, said.err
    assert said.out.startswith("path.json: ")
    path = json.loads((tmp_path / "path.json").read_text())
    assert path["joints"] == [1]
    assert len(path["times"]) > 5


def test_control_that_another_client_has_is_told(daq: Daq, service: Service) -> None:
    lease = service.robot.post("/control", json={}).json()["lease"]
    try:
        daq("teach", "step", "--by", "2=-3").complains(4, "has control of the robot")
    finally:
        service.robot.delete("/control", headers={"Control-Lease": lease})


def test_the_actual_gains_are_measured_at_the_servers_robot(daq: Daq) -> None:
    said = daq("calibrate", "gain", "--joints", "1", "--json")
    assert said.code == 0, said.err
    (found,) = json.loads(said.out)["gains"]
    assert (found["joint"], found["gain"] is not None) == (1, True)


# ---- in a terminal: keys drive the robot, and every key that stops, stops it


RIGHT = b"\x1b[C"


@pytest.mark.usefixtures("here")
def test_a_key_drives_a_joint_and_a_posture_is_kept(service: Service, tmp_path: Path) -> None:
    service.until_connected()
    before = service.status()["sample"]["position"][2]
    with at_a_terminal(["--server", service.url, "teach", "jog", "--program", "kept.json"]) as person:
        person.until(b"joint 1 ")
        person.type(b"3")
        person.until(b"joint 3 ")
        while abs(service.status()["sample"]["position"][2] - before) < 0.01:
            person.type(RIGHT)
        person.type(b"p")
        person.until(b"posture 1 kept")
        person.type(b"q")
        code = person.end()
    assert code == 0, person.seen
    assert service.robot.get("/control").json()["holder"] == "nobody"
    kept: Program = load_program(tmp_path / "kept.json")
    assert len(kept.instructions) == 1


@pytest.mark.usefixtures("here")
@pytest.mark.parametrize(
    ("words", "shown", "keys"),
    [
        (["program", "wait.json"], b"instruction 1 of 1: wait", b"\x03"),
        (["program", "wait.json"], b"instruction 1 of 1: wait", b"\x1a"),
        (["jog"], b"joint 1 ", RIGHT + b"\x03"),
    ],
    ids=["a program, by Ctrl-C", "a program, by Ctrl-Z", "a jog, by Ctrl-C"],
)
def test_what_moves_the_arm_is_stopped_with_the_keys_that_stop(
    service: Service, tmp_path: Path, words: list[str], shown: bytes, keys: bytes
) -> None:
    program = {"name": "wait", "instructions": [{"kind": "wait", "duration": 3600}]}
    (tmp_path / "wait.json").write_text(json.dumps(program))
    service.until_connected()
    with at_a_terminal(["--server", service.url, "teach", *words]) as person:
        person.until(shown)
        person.type(keys)
        code = person.end()
    assert code == 6, person.seen
    assert b"stopped, confirmed by the board" in person.seen
    service.until_arm("stopped")
