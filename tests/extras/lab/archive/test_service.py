"""The archive as clients meet it: over REST, from Python, by commands."""

import logging
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest

from daq.client import Client
from daq.contracts.service.archive import Transfer
from tests.daq_cli.invoke import CommandLine
from tests.extras.lab.archive.store import ACCESS, SECRET, FaultyStore, ObjectStore, settings_of
from tests.server.inside import WrongClock, service_inside
from tests.server.polling import until

TABLE = "time,position_1\n" + "\n".join(f"{0.02 * n:.2f},{0.001 * n}" for n in range(50))


@pytest.fixture
def api(
    tmp_path: Path, store: ObjectStore, proxy: FaultyStore, monkeypatch: pytest.MonkeyPatch
) -> Iterator[httpx.Client]:
    """Of a service with an archive."""
    key = tmp_path / "key.toml"
    key.write_text(f'access_key = "{ACCESS}"\nsecret_key = "{SECRET}"\n', "utf-8")
    settings = settings_of(store.bucket(), proxy.url, credentials=key)
    with service_inside(tmp_path, WrongClock(), monkeypatch, sections={"archive": settings}) as client:
        yield client


def _archived(api: httpx.Client) -> str:
    """A new trace that the archive has. Its number."""
    made = api.post("traces", content=TABLE, headers={"Content-Type": "text/csv"})
    assert made.status_code == 201, made.text
    trace: str = made.json()["id"]
    until(api, f"traces/{trace}/archive", lambda kept: kept["archived"] is not None)
    return trace


def _dropped(api: httpx.Client) -> str:
    """A new trace that only the archive has."""
    trace = _archived(api)
    assert api.post(f"traces/{trace}/archive", json={"drop": True}).status_code == 202
    until(api, f"traces/{trace}/archive", lambda kept: not kept["local"])
    return trace


def test_a_trace_of_the_archive_is_listed_opened_and_downloaded_as_every_other(
    api: httpx.Client, proxy: FaultyStore, tmp_path: Path
) -> None:
    trace = _dropped(api)
    (entry,) = api.get("traces").json()["items"]
    assert (entry["archived"], entry["local"], entry["missing"]) == (True, False, False)
    proxy.fail("503")
    for path in ("", "/data.mcap", "/data.csv", "/data.json", "/gain"):
        answer = api.get(f"traces/{trace}{path}")
        assert (answer.status_code, answer.headers["Retry-After"]) == (503, "2"), path
        assert answer.json()["type"].endswith("#trace-in-archive")
    proxy.fail("")
    seen: list[Transfer] = []
    with Client(str(api.base_url).partition("/api")[0]) as client:
        file = client.robot().traces.download(trace, tmp_path / "copy.mcap", seen.append)
    assert file.read_bytes() == (tmp_path / "traces" / entry["file"]).read_bytes()
    assert api.get(f"traces/{trace}").status_code == 200


def test_its_state_is_in_answers_metrics_events_and_warnings(
    api: httpx.Client, proxy: FaultyStore, caplog: pytest.LogCaptureFixture
) -> None:
    root = str(api.base_url).partition("/api")[0]
    _archived(api)
    proxy.fail("503")
    with caplog.at_level(logging.INFO):
        second = api.post("traces", content=TABLE.replace("0.049", "0.05"), headers={"Content-Type": "text/csv"})
        assert second.status_code == 201, second.text
        status = until(api, "archive", lambda archive: archive["state"] != "ok")
    assert (status["state"], status["archived"], status["waiting"]) == ("away", 1, 1)
    assert status["next_try"] >= 0
    system = httpx.get(f"{root}/api/v1/system").json()
    ready = httpx.get(f"{root}/readyz")
    metrics = httpx.get(f"{root}/metrics").text
    assert any("the store answers 503; 1 traces wait" in line for line in system["warnings"])
    assert ready.status_code == 200
    assert "503" in ready.json()["checks"]["archive of ma2000"]
    assert 'daq_archive_reached{robot="ma2000"} 0.0' in metrics
    assert 'daq_archive_traces{robot="ma2000"} 1.0' in metrics
    assert 'daq_archive_waiting{direction="send",robot="ma2000"} 1.0' in metrics
    assert 'daq_archive_transfers_total{direction="send",result="done",robot="ma2000"} 1.0' in metrics
    events = api.get("events").json()["items"]
    assert any(one["kind"] == "archive" and "answers 503" in one["text"] for one in events)
    everything = "\n".join([str(status), str(system), ready.text, metrics, str(events), caplog.text])
    assert ACCESS not in everything
    assert SECRET not in everything
    proxy.fail("")
    until(api, "archive", lambda archive: archive["archived"] == 2)


def test_the_commands_show_send_and_fetch(
    api: httpx.Client, capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    root, daq = str(api.base_url).partition("/api")[0], CommandLine(capsys)
    trace = _archived(api)
    said = daq("--server", root, "traces", "archive")
    assert said.code == 0
    assert "state:    ok, 1 traces; 0 wait to be sent, 0 fetched" in said.out
    assert "SHA-256" in daq("--server", root, "traces", "archive", trace, "--drop").out
    until(api, f"traces/{trace}/archive", lambda kept: not kept["local"])
    said = daq("--server", root, "traces", "fetch", trace[:6])
    assert said.code == 0
    assert said.out.startswith(f"{trace}: here and in the archive since ")
    daq("--server", root, "traces", "archive", "--drop").complains(2, "--drop: name a trace")
    daq("--server", root, "traces", "fetch", "nothing").complains(2, "no trace of the service has")


def test_a_service_without_an_archive_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    with service_inside(tmp_path, WrongClock(), monkeypatch) as api:
        answer = api.get("archive")
        assert (answer.status_code, answer.json()["type"].partition("#")[2]) == (409, "no-archive")
        daq = CommandLine(capsys)
        root = str(api.base_url).partition("/api")[0]
        daq("--server", root, "traces", "archive").complains(4, "this service has no archive; set [archive]")
    daq("traces", "archive").complains(2, "only a service has this")


def test_config_show_hides_passwords(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("AWS_SECRET_ACCESS_KEY", SECRET)
    file = tmp_path / "daq.toml"
    lines = ("[server]", f'database = "postgresql+psycopg://daq:{SECRET}@db.lab/arm?sslpassword={SECRET}"')
    file.write_text("\n".join((*lines, "[archive]", 'bucket = "traces"', "")), "utf-8")
    daq = CommandLine(capsys)
    for options in ((), ("--json",)):
        said = daq("--config", file, "config", "show", *options)
        assert said.code == 0
        assert "db.lab/arm" in said.out
        assert SECRET not in said.out + said.err
