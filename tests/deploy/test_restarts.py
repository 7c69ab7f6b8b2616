"""A container that is killed or ended leaves whole traces. These tests end the service that the other files use."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import httpx
import pytest

from daq.traces.reader import read_trace
from tests.deploy.composition import Composition
from tests.repository.tracked import ROOT
from tests.server.polling import until

FIRST = [sys.executable, str(ROOT / "deploy" / "first_process.py")]
LONG = {"trajectory": {"kind": "ramp", "amplitude": 0.05, "duration": 60.0}, "joints": [2]}


@pytest.mark.timeout(240)
def test_a_killed_service_leaves_a_whole_trace_before_its_container_ends(
    running: Composition, api: httpx.Client
) -> None:
    made = api.post("/experiments", json={"spec": LONG}).json()["id"]
    service = running.processes["service"]
    until(api, f"/experiments/{made}", lambda one: " of " in one["progress_text"], {"wait": 0.2}, service)
    first = running.processes.pop("service")
    children = Path(f"/proc/{first.pid}/task/{first.pid}/children").read_text("utf-8").split()
    (serving,) = (int(child) for child in children if b"serve" in Path(f"/proc/{child}/cmdline").read_bytes())
    os.kill(serving, signal.SIGKILL)
    assert first.wait(30) == 128 + signal.SIGKILL
    traces = running.folder / "data" / "traces"
    assert list(traces.rglob("*.part")) == []

    running.start("service")  # as `restart: unless-stopped` does
    running.until_healthy("service")
    interrupted = api.get(f"/experiments/{made}").json()
    assert interrupted["state"] == "interrupted"
    file = traces / api.get(f"/traces/{interrupted['trace']}").json()["entry"]["file"]
    assert len(read_trace(file).position) > 0
    assert api.get("/queue").json()["paused"]
    assert running.end("service") == 0


@pytest.mark.parametrize(("end", "code"), [("exit 4", 4), ("kill -KILL $$", 128 + signal.SIGKILL)])
def test_the_first_process_waits_for_what_the_program_has_left_and_has_its_exit_code(end: str, code: int) -> None:
    left = "(while kill -0 $$ 2>/dev/null; do :; done; echo left; read line <&3; echo $line) &"
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with subprocess.Popen([*FIRST, "sh", "-c", f"exec 3<&0; {left} {end}"], text=True, **pipes) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "left\n"
        assert process.poll() is None
        assert process.communicate("goes on\n", timeout=30)[0] == "goes on\n"
        assert process.returncode == code


def test_the_first_process_passes_signals_on() -> None:
    program = "trap 'echo asked; exit 5' TERM; echo ready; while :; do read line; done"
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with subprocess.Popen([*FIRST, "sh", "-c", program], text=True, **pipes) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        process.terminate()
        assert process.communicate(timeout=30)[0] == "asked\n"
        assert process.returncode == 5
