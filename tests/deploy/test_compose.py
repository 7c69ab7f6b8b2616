"""The files of deploy/: container, first process, board and alerts fit the service, and others' tools accept them."""

import json
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
from grafana_foundation_sdk.cog.encoder import JSONEncoder
from grafana_foundation_sdk.cog.plugins import register_default_plugins
from grafana_foundation_sdk.models.dashboard import Dashboard

from daq.config.settings import Settings
from daq.traces.reader import read_trace
from tests.deploy.expressions import OF_PROMETHEUS, Scraped, wrong
from tests.repository.tracked import ROOT
from tests.server.polling import reset
from tests.server.service import DAQ, Service, running_service

DEPLOY = ROOT / "deploy"
CONTAINERFILE = (DEPLOY / "Containerfile").read_text("utf-8")
SERVICE: dict[str, Any] = yaml.safe_load((DEPLOY / "compose.yaml").read_text("utf-8"))["services"]["service"]
FIRST = [sys.executable, str(DEPLOY / "first_process.py")]
"""What the image starts its command with."""
RAMP = {"trajectory": {"kind": "ramp", "amplitude": 0.05, "duration": 0.4}, "joints": [2], "settle": 0.2, "hold": 0.2}
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


# ---- Board and alert rules name what a running service has, and Prometheus, promtool and Grafana's types accept them.

RULES = DEPLOY / "prometheus-rules.yaml"
BOARD: dict[str, Any] = json.loads((DEPLOY / "grafana-board.json").read_text("utf-8"))
ALERTS: list[dict[str, Any]] = yaml.safe_load(RULES.read_text("utf-8"))["groups"][0]["rules"]
PANELS = [(panel["title"], target) for panel in BOARD["panels"] for target in panel["targets"]]


@pytest.fixture(scope="module")
def scraped(running: Service) -> Scraped:
    """What the service says at /metrics once something of each kind has happened."""
    made = running.end_of(running.robot.post("/experiments", json={"spec": RAMP}).json()["id"])
    assert made["state"] == "done", made
    job = running.robot.post("/jobs", json={"kind": "compare", "traces": [made["trace"]], "models": ["machine"]})
    assert running.end_of(job.json()["id"], "jobs")["state"] == "done"
    assert running.robot.post("/stop").is_success
    unknown = {"Authorization": "Bearer nobody-knows-this"}
    assert httpx.get(f"{running.url}/api/v1/me", headers=unknown).status_code == 401
    while not (found := Scraped.of(_metrics(running))).labels.get("daq_stops_total"):
        assert running.process.poll() is None  # a stop is counted once it has been answered
    return found


def _metrics(running: Service) -> str:
    answer = httpx.get(f"{running.url}/metrics")
    assert answer.status_code == 200, answer.text
    return answer.text


def test_rules_and_board_name_only_what_a_running_service_has(scraped: Scraped) -> None:
    expressions = {
        **{f"alert {alert['alert']}": alert["expr"] for alert in ALERTS},
        **{f"panel {title}: {target['refId']}": target["expr"] for title, target in PANELS},
    }
    found = {name: lines for name, text in expressions.items() if (lines := wrong(text, scraped))}
    assert found == {}
    assert len(expressions) >= 40


def test_texts_name_only_labels_that_a_running_service_has(scraped: Scraped) -> None:
    known = OF_PROMETHEUS.union(*(set(labels) for labels in scraped.labels.values()))
    told = [re.findall(r"\$labels\.(\w+)", text) for alert in ALERTS for text in alert["annotations"].values()]
    told += [re.findall(r"\{\{(\w+)\}\}", target["legendFormat"]) for _, target in PANELS]
    assert {label for labels in told for label in labels} - known == set()
    variables = [re.fullmatch(r"label_values\((\w+)(?:\{.*\})?, (\w+)\)", one["query"]) for one in _variables()]
    for asked in variables:
        assert asked is not None
        assert asked[1] in scraped.labels
        assert asked[2] in {*scraped.labels[asked[1]], *OF_PROMETHEUS}


def _variables() -> Iterator[dict[str, Any]]:
    return (one for one in BOARD["templating"]["list"] if one["type"] == "query")


@pytest.mark.parametrize(
    ("expression", "line"),
    [
        ("daq_conected == 0", "no metric daq_conected"),
        ('daq_connected{robt="a"}', "daq_connected has no label robt"),
        ('rate(daq_jobs_total{state="ended"}[1h])', "daq_jobs_total: state is never ended"),
        ('daq_jobs_total{state=~"failed|ended"}', "daq_jobs_total: state is never failed|ended"),
        ("sum by (rig) (daq_connected)", "no label rig"),
        ("daq_connected > ignoring (rig) daq_connected", "no label rig"),
        ("rate(daq_job_seconds[5m])", "no metric daq_job_seconds"),
    ],
)
def test_a_wrong_name_is_found(expression: str, line: str) -> None:
    said = 'daq_connected{robot="a"} 1\n# TYPE daq_jobs_total counter\ndaq_jobs_total{state="done"} 1\n'
    said += '# TYPE daq_job_seconds histogram\ndaq_job_seconds_bucket{le="+Inf"} 1\ndaq_job_seconds_count 1\n'
    assert wrong(expression, Scraped.of(said)) == [line]


def test_grafana_knows_every_field_of_the_board() -> None:
    register_default_plugins()
    again = json.loads(JSONEncoder().encode(Dashboard.from_json(BOARD)))
    assert list(_lost(BOARD, again, "")) == []
    identities = [panel["id"] for panel in BOARD["panels"]]
    assert len(set(identities)) == len(identities)


def _lost(given: Any, again: Any, path: str) -> Iterator[str]:
    """The places of what Grafana's own types do not keep."""
    if isinstance(given, dict):
        for key, value in given.items():
            if key in again:
                yield from _lost(value, again[key], f"{path}/{key}")
            else:
                yield f"{path}/{key}"
    elif isinstance(given, list):
        for number, (one, other) in enumerate(zip(given, again, strict=True)):
            yield from _lost(one, other, f"{path}/{number}")
    elif given != again:
        yield path


def promtool(*words: object) -> subprocess.CompletedProcess[str]:
    program = shutil.which("promtool")
    if program is None:
        pytest.skip("needs promtool: apt install prometheus")
    return subprocess.run([program, *map(str, words)], capture_output=True, text=True, check=False)


def test_promtool_finds_nothing(tmp_path: Path) -> None:
    for kind, file in (("rules", RULES), ("config", _configuration(tmp_path, "127.0.0.1:1", "t"))):
        done = promtool("check", kind, file)
        assert done.returncode == 0, done.stdout + done.stderr


def test_each_alert_comes_when_it_should_and_not_before(tmp_path: Path) -> None:
    rules = yaml.safe_load(RULES.read_text("utf-8"))
    for alert in rules["groups"][0]["rules"]:
        del alert["annotations"]  # promtool would want their texts repeated in each case
    (tmp_path / RULES.name).write_text(yaml.safe_dump(rules), "utf-8")
    cases = Path(__file__).with_name("rules_test.yaml").read_text("utf-8")
    (tmp_path / "cases.yaml").write_text(cases, "utf-8")
    done = promtool("test", "rules", tmp_path / "cases.yaml")
    assert done.returncode == 0, done.stdout + done.stderr
    tried = {case["alertname"] for test in yaml.safe_load(cases)["tests"] for case in test["alert_rule_test"]}
    assert tried == {alert["alert"] for alert in ALERTS}


def _configuration(folder: Path, target: str, token: str) -> Path:
    """deploy/prometheus.yaml in a folder of its own, for a service at `target`."""
    text = (DEPLOY / "prometheus.yaml").read_text("utf-8")
    text = text.replace("127.0.0.1:8300", target).replace("_interval: 15s", "_interval: 1s")
    (folder / "prometheus.yaml").write_text(text, "utf-8")
    (folder / "ma2000-daq.token").write_text(token, "utf-8")
    shutil.copy(RULES, folder)
    return folder / "prometheus.yaml"


def test_a_real_prometheus_reads_the_service_and_evaluates_everything(
    running: Service, scraped: Scraped, tmp_path: Path
) -> None:
    program = shutil.which("prometheus")
    if program is None:
        pytest.skip("needs Prometheus: apt install prometheus")
    with socket.create_server(("127.0.0.1", 0)) as free:
        address = f"127.0.0.1:{free.getsockname()[1]}"
    command = [*DAQ, "token", "add", tmp_path.name]
    made = subprocess.run(command, cwd=running.folder, check=True, capture_output=True)
    file = _configuration(tmp_path, urlsplit(running.url).netloc, made.stdout.decode().split()[-1])
    words = [f"--config.file={file}", f"--storage.tsdb.path={tmp_path / 'data'}", f"--web.listen-address={address}"]
    with subprocess.Popen([program, *words], stderr=subprocess.DEVNULL) as process:
        try:
            with httpx.Client(base_url=f"http://{address}/api/v1", transport=httpx.HTTPTransport(retries=20)) as client:
                while not _answer(client, 'up{job="ma2000-daq"} == 1'):
                    assert process.poll() is None
                    assert not _answer(client, "count_over_time(up[1m]) > 20"), client.get("/targets").text
                for _, target in PANELS:
                    _answer(client, re.sub(r"\$(service|robot)", ".*", target["expr"]))
                assert _answer(client, 'daq_connected{robot="ma2000"}')
                while not all(one["evaluationTime"] > 0 for one in _rules(client)):
                    assert process.poll() is None
                assert {one["name"]: one.get("lastError") for one in _rules(client)} == dict.fromkeys(
                    (alert["alert"] for alert in ALERTS), None
                )
        finally:
            process.terminate()


def _answer(client: httpx.Client, expression: str) -> list[Any]:
    answer = client.get("/query", params={"query": expression}).json()
    assert answer["status"] == "success", answer
    found: list[Any] = answer["data"]["result"]
    return found


def _rules(client: httpx.Client) -> list[dict[str, Any]]:
    return [rule for group in client.get("/rules").json()["data"]["groups"] for rule in group["rules"]]


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
