"""The files of deploy/: container and first process fit the service, and others' tools accept them."""

import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import httpx
import pytest
import yaml

from daq.config.settings import Settings
from daq.traces.reader import read_trace
from tests.repository.tracked import ROOT
from tests.server.polling import reset
from tests.server.service import DAQ, Service, running_service

DEPLOY = ROOT / "deploy"
CONTAINERFILE = (DEPLOY / "Containerfile").read_text("utf-8")
SERVICE: dict[str, Any] = yaml.safe_load((DEPLOY / "compose.yaml").read_text("utf-8"))["services"]["service"]
FIRST = [sys.executable, str(DEPLOY / "first_process.py")]
"""What the image starts its command with."""
LONG = {"trajectory": {"kind": "ramp", "amplitude": 0.05, "duration": 60.0}, "joints": [2]}


@pytest.fixture(scope="module")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Service]:
    """The service as the image starts it, after its first process."""
    with running_service(tmp_path_factory.mktemp("deploy"), program=[*FIRST, *DAQ]) as service:
        service.until_connected()
        reset(service.robot).raise_for_status()
        yield service


def test_the_container_may_do_no_more_than_it_needs_and_is_reached_from_this_computer_alone() -> None:
    assert SERVICE["read_only"] is True
    assert SERVICE["cap_drop"] == ["ALL"]
    assert SERVICE["security_opt"] == ["no-new-privileges:true"]
    assert re.fullmatch(r"[1-9]\d*:[1-9]\d*", SERVICE["user"])
    assert "privileged" not in SERVICE
    assert all(port.startswith("127.0.0.1:") for port in SERVICE["ports"])


def test_the_environment_is_settings_and_what_is_written_lies_in_a_volume_or_in_memory(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    (words,) = re.findall(r"^ENV ((?:.*\\\n)*.*)$", CONTAINERFILE, re.MULTILINE)
    environment = dict(word.split("=", 1) for word in words.replace("\\\n", " ").split())
    for name, value in SERVICE["environment"].items():
        monkeypatch.setenv(name, value)
    settings = Settings()
    assert (settings.server.host, settings.server.tokens) == ("0.0.0.0", "always")
    paths = [settings.server.folder, settings.traces.folder]
    paths += [Path(value) for key, value in environment.items() if value.startswith("/") and key != "PATH"]
    writable = [one.partition(":")[2] for one in SERVICE["volumes"]]
    writable += [one.partition(":")[0] for one in SERVICE["tmpfs"]]
    assert [path for path in paths if not any(path.is_relative_to(one) for one in writable)] == []


def test_each_image_is_pinned_to_a_version() -> None:
    images = {*re.findall(r"^ARG BASE=(\S+)$", CONTAINERFILE, re.MULTILINE), SERVICE["image"]}
    pinned = re.compile(r"[a-z.]+/[a-z0-9/-]+:v?\d+\.\d+(\.\d+)?(-[a-z]+)?(@sha256:[0-9a-f]{64})?")
    assert [one for one in images if not pinned.fullmatch(one)] == []


def test_the_image_has_the_version_of_the_package() -> None:
    version = re.findall(r'^version = "(.*)"$', (ROOT / "pyproject.toml").read_text("utf-8"), re.MULTILINE)
    assert SERVICE["image"].endswith(f":{version[0]}")


def test_linters_of_others_find_nothing() -> None:
    hadolint = shutil.which("hadolint", path=Path(sys.executable).parent)
    schema = shutil.which("check-jsonschema", path=Path(sys.executable).parent)
    assert hadolint
    assert schema
    for command in (
        [hadolint, "--failure-threshold", "style", "deploy/Containerfile"],
        [schema, "--builtin-schema", "vendor.compose-spec", "deploy/compose.yaml"],
    ):
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout


def test_the_image_is_built_from_every_folder_of_the_wheel_and_from_no_more() -> None:
    wheel = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["hatch"]["build"]["targets"]["wheel"]
    copied = re.findall(r"^COPY (\w+) \1$", CONTAINERFILE, re.MULTILINE)
    let_in = re.findall(r"^!/(\w+)$", (ROOT / ".dockerignore").read_text("utf-8"), re.MULTILINE)
    assert {*wheel["packages"], *wheel["force-include"]} == set(copied) <= set(let_in)


# ---- A container that is killed or ended leaves whole traces.


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


def test_a_real_prometheus_reads_the_service(running: Service, tmp_path: Path) -> None:
    program = shutil.which("prometheus")
    if program is None:
        pytest.skip("needs Prometheus: apt install prometheus")
    with socket.create_server(("127.0.0.1", 0)) as free:
        address = f"127.0.0.1:{free.getsockname()[1]}"
    command = [*DAQ, "token", "add", tmp_path.name]
    made = subprocess.run(command, cwd=running.folder, check=True, capture_output=True)
    text = (DEPLOY / "prometheus.yaml").read_text("utf-8")
    text = text.replace("127.0.0.1:8300", urlsplit(running.url).netloc).replace("_interval: 15s", "_interval: 1s")
    (tmp_path / "prometheus.yaml").write_text(text, "utf-8")
    (tmp_path / "ma2000-daq.token").write_text(made.stdout.decode().split()[-1], "utf-8")
    words = [f"--config.file={tmp_path / 'prometheus.yaml'}", f"--storage.tsdb.path={tmp_path / 'data'}"]
    with subprocess.Popen([program, *words, f"--web.listen-address={address}"], stderr=subprocess.DEVNULL) as process:
        try:
            with httpx.Client(base_url=f"http://{address}/api/v1", transport=httpx.HTTPTransport(retries=20)) as client:
                while not _answer(client, 'daq_connected{robot="ma2000"}'):
                    assert process.poll() is None
                    assert not _answer(client, "count_over_time(up[1m]) > 20"), client.get("/targets").text
        finally:
            process.terminate()


def _answer(client: httpx.Client, expression: str) -> list[Any]:
    answer = client.get("/query", params={"query": expression}).json()
    assert answer["status"] == "success", answer
    found: list[Any] = answer["data"]["result"]
    return found


def test_a_killed_service_leaves_a_whole_trace_before_its_container_ends(tmp_path: Path) -> None:
    with running_service(tmp_path, program=[*FIRST, *DAQ]) as service:
        service.until_connected()
        service.robot.post("/queue/resume", json={}).raise_for_status()
        made = service.robot.post("/experiments", json={"spec": LONG}).json()["id"]
        service.until_recording(made)
        first = service.process.pid
        children = Path(f"/proc/{first}/task/{first}/children").read_text("utf-8").split()
        (serving,) = (int(child) for child in children if b"serve" in Path(f"/proc/{child}/cmdline").read_bytes())
        os.kill(serving, signal.SIGKILL)
        assert service.process.wait(30) == 128 + signal.SIGKILL
    traces = tmp_path / "traces"
    assert list(traces.rglob("*.part")) == []
    (file,) = traces.rglob("*.mcap")
    assert len(read_trace(file).position) > 0
