"""deploy/compose.yaml is what the service needs: its commands run as processes, and an experiment goes all the way."""

import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import httpx
import psycopg
import pytest

from tests.deploy.composition import OWN_IMAGE, RAMP, SECRETS, Composition, composition, ended, image
from tests.repository.tracked import ROOT
from tests.server.polling import reset, until

SERVICES: dict[str, dict[str, Any]] = composition(SECRETS)["services"]


@pytest.mark.timeout(400)
def test_an_experiment_is_recorded_archived_and_fitted(running: Composition, api: httpx.Client) -> None:
    made = ended(api, f"/experiments/{api.post('/experiments', json={'spec': RAMP}).json()['id']}")
    assert made["state"] == "done", made
    until(api, f"/traces/{made['trace']}/archive", lambda kept: kept["archived"], process=running.processes["service"])
    bucket = running.services["service"]["environment"]["DAQ_ARCHIVE__BUCKET"]
    stored = running.stores["objects"].objects(bucket)
    file = running.folder / "data" / "traces" / api.get(f"/traces/{made['trace']}").json()["entry"]["file"]
    assert file.read_bytes() in stored.values()

    request = {"kind": "fit", "traces": [made["trace"]], "parameters": ["joint2.*viscous*"]}
    job = ended(api, f"/jobs/{api.post('/jobs', json=request).json()['id']}")
    assert job["state"] == "done", job

    with psycopg.connect(
        host=running.address("database"), dbname="ma2000", user="ma2000", password=SECRETS["DATABASE_PASSWORD"]
    ) as database:
        rows = database.execute("SELECT state FROM experiments WHERE id = %s", (made["id"],)).fetchall()
    assert rows == [("done",)]


def test_who_has_no_token_is_refused_and_the_stop_listener_answers(running: Composition, api: httpx.Client) -> None:
    host = running.address("service")
    assert httpx.get(f"http://{host}:8300/healthz").status_code == 200
    assert httpx.get(f"http://{host}:8300/api/v1/robots/ma2000").status_code == 401
    stop = f"http://{host}:8301/api/v1/robots/ma2000/stop"
    assert httpx.post(stop).status_code == 401
    assert httpx.post(stop, headers=api.headers).json()["confirmed"]
    # The listener answers before the service knows of its stop.
    until(api, str(api.base_url).rstrip("/"), lambda status: status["arm"] == "stopped")
    assert reset(api).is_success


@pytest.mark.parametrize("name", SERVICES)
def test_each_container_may_do_no_more_than_it_needs(name: str) -> None:
    service = SERVICES[name]
    assert service["read_only"] is True
    assert service["cap_drop"] == ["ALL"]
    assert service["security_opt"] == ["no-new-privileges:true"]
    assert re.fullmatch(r"[1-9]\d*:[1-9]\d*", service["user"])
    assert "healthcheck" in service or service["restart"] == "no"
    assert "privileged" not in service


def test_only_the_service_is_reached_from_outside_and_only_from_this_computer() -> None:
    assert {name for name, one in SERVICES.items() if "ports" in one} == {"service"}
    assert all(port.startswith("127.0.0.1:") for port in SERVICES["service"]["ports"])
    assert {name for name, one in SERVICES.items() if "outside" in one.get("networks", ())} == {"service"}
    assert composition(SECRETS)["networks"]["inside"]["internal"] is True


@pytest.mark.parametrize("name", [name for name, one in SERVICES.items() if one["image"] == OWN_IMAGE])
def test_what_is_written_lies_in_a_volume_or_in_memory(name: str) -> None:
    service = SERVICES[name]
    writable = [one.partition(":")[2] for one in service.get("volumes", ())]
    writable += [one.partition(":")[0] for one in service["tmpfs"]]
    told = {**image()["environment"], **service.get("environment", {})}
    paths = [value for key, value in told.items() if str(value).startswith("/") and key != "PATH"]
    words = [word for word in service.get("command", ()) if word.startswith("/")]
    if not any(one.startswith("data:") for one in service.get("volumes", ())):
        paths.remove(image()["environment"]["NUMBA_CACHE_DIR"])  # it computes nothing
    needed = {*paths, *words}
    assert [path for path in needed if not any(Path(path).is_relative_to(one) for one in writable)] == []


def test_each_image_is_pinned_to_a_version() -> None:
    base = re.findall(r"^ARG BASE=(\S+)$", (ROOT / "deploy" / "Containerfile").read_text("utf-8"), re.MULTILINE)
    images = {*base, *(one["image"] for one in SERVICES.values())}
    pinned = re.compile(r"[a-z.]+/[a-z0-9/-]+:v?\d+\.\d+(\.\d+)?(-[a-z]+)?(@sha256:[0-9a-f]{64})?")
    assert [one for one in images if not pinned.fullmatch(one)] == []


def test_the_image_has_the_version_of_the_package() -> None:
    version = re.findall(r'^version = "(.*)"$', (ROOT / "pyproject.toml").read_text("utf-8"), re.MULTILINE)
    assert OWN_IMAGE.endswith(f":{version[0]}")


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
    copied = re.findall(r"^COPY (\w+) \1$", (ROOT / "deploy" / "Containerfile").read_text("utf-8"), re.MULTILINE)
    let_in = re.findall(r"^!/(\w+)$", (ROOT / ".dockerignore").read_text("utf-8"), re.MULTILINE)
    assert {*wheel["packages"], *wheel["force-include"]} == set(copied) <= set(let_in)
