"""The stop while the service cannot answer: its event loop blocked, or its whole process hanging."""

from __future__ import annotations

import os
import signal
import socket
import struct
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, contextmanager, suppress
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from urllib.parse import urlsplit

import httpx
import pytest
from sqlalchemy import text

from daq.client import Client
from daq.config.service import ServiceSettings
from daq.contracts.errors import ReachError
from daq.contracts.service.robot import StopResult
from daq.owner.stop_socket import FOLDER_VARIABLE
from server.access.caller import LOCAL, Caller
from server.access.digest import digest_of
from server.access.origin import beside
from server.access.stop_gate import StopGate, TokensCannotBeReadError
from server.access.tokens import KnownTokens, TokenStore
from server.problems import ProblemError
from server.serve import listening
from server.stopping.door import StopDoor
from server.stopping.listener import OnStop, Stop, StopListener
from server.stopping.messages import Begin
from server.stopping.tokens import UNKNOWN_FOR, StopTokens, reader_of
from server.store.engine import Store
from tests.daq_cli.invoke import CommandLine
from tests.server.clocks import HandClock
from tests.server.migrated import migrated_store
from tests.server.other_user import other_users_command_line
from tests.server.polling import reset
from tests.server.service import Service, running_service

LONG = {"trajectory": {"kind": "ramp", "amplitude": 0.1, "duration": 0.5}, "joints": [1, 2], "hold": 600}
BLOCKING = """
import pathlib, time
import server.serve
make_app = server.serve.make_app

def with_a_fault(services, gate):
    app = make_app(services, gate)

    @app.get("/block")
    async def block() -> None:
        pathlib.Path("blocked").touch()
        while not pathlib.Path("unblock").exists():
            time.sleep(0.01)

    return app

server.serve.make_app = with_a_fault
from daq_cli import main
main()
"""
"""`daq` with a coroutine in its service that does not give the event loop back."""


@pytest.fixture
def daq(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Iterator[CommandLine]:
    """The command of the user whose service it is, who finds the stop sockets of its processes."""
    with other_users_command_line(tmp_path, capsys, monkeypatch) as daq:
        yield daq


def _running(service: Service) -> str:
    service.until_connected()
    experiment: str = service.robot.post("/experiments", json={"spec": LONG}).json()["id"]
    service.until_recording(experiment)
    return experiment


@contextmanager
def _blocked(service: Service) -> Iterator[None]:
    """The service's event loop stands still within."""
    stuck = threading.Thread(target=httpx.get, args=(f"{service.url}/block",), kwargs={"timeout": 60})
    stuck.start()
    try:
        while not (service.folder / "blocked").exists():
            assert service.process.poll() is None
        with pytest.raises(httpx.ReadTimeout):
            httpx.get(f"{service.url}/healthz", timeout=0.5)
        yield
    finally:
        (service.folder / "unblock").touch()
        stuck.join()


def test_a_stop_reaches_the_arm_while_the_event_loop_is_blocked_and_while_the_whole_service_hangs(
    tmp_path: Path, daq: CommandLine
) -> None:
    with running_service(tmp_path, program=[sys.executable, "-c", BLOCKING]) as service:
        experiment = _running(service)
        with _blocked(service), Client(service.url) as client:
            _every_other_door_is_open(service, client, daq)
        ended = service.end_of(experiment)
        assert (ended["state"], ended["outcome"]) == ("cancelled", "stopped")
        texts = [event["text"] for event in service.robot.get("/events").json()["items"] if event["kind"] == "stop"]
        assert any("confirmed by the board" in text for text in texts)
        service.until_arm("stopped")
        answer = reset(service.robot)
        assert answer.status_code == 200, answer.text
        assert service.robot.post("/queue/resume", json={}).status_code == 200
        experiment = _running(service)
        _stopped_while_the_service_hangs(service, daq)
        assert service.end_of(experiment)["state"] == "cancelled"
        events = service.robot.get("/events").json()["items"]
        assert events[0]["at"] >= events[1]["at"]
        assert any(event["kind"] == "stop" and event["actor"] == "local" for event in events)


def test_a_stop_with_a_token_reaches_the_arm_while_the_whole_service_hangs(tmp_path: Path, daq: CommandLine) -> None:
    (tmp_path / "daq.toml").write_text('[server]\ntokens = "always"\n')
    made = daq("token", "add", "anna", "--role", "operator")
    assert made.code == 0, made.err
    token = {"Authorization": f"Bearer {made.out.strip()}"}
    with running_service(tmp_path, headers=token) as service:
        service.until_connected()
        stop = f"{_beside(service)}/stop"
        service.process.send_signal(signal.SIGSTOP)
        try:
            assert httpx.post(stop, timeout=30).status_code == 401
            assert httpx.post(stop, headers={"Authorization": "Bearer daq_wrong"}, timeout=30).status_code == 401
            assert httpx.post(stop, headers=token, timeout=30).json()["confirmed"] is True
        finally:
            service.process.send_signal(signal.SIGCONT)
        service.until_arm("stopped")


def _every_other_door_is_open(service: Service, client: Client, daq: CommandLine) -> None:
    stopped = client.robot("ma2000").stop()
    assert stopped.confirmed, stopped
    for words in (["stop"], ["--server", service.url, "stop"]):
        said = daq(*words)
        assert said.code == 0, (words, said)
        assert said.out.startswith("ma2000: stopped, confirmed by the board"), said


def _stopped_while_the_service_hangs(service: Service, daq: CommandLine) -> None:
    """The listener and the owner of the port are processes of their own."""
    beside = _beside(service)
    service.process.send_signal(signal.SIGSTOP)
    try:
        stopped = httpx.post(f"{beside}/stop", timeout=30).json()
        said = daq("stop")
        with Client(service.url) as client:
            again = client.robot("ma2000").stop()
    finally:
        service.process.send_signal(signal.SIGCONT)
    assert stopped["confirmed"], stopped
    assert said.code == 0, said
    assert said.out.startswith("ma2000: stopped, confirmed by the board")
    assert again.confirmed, again


# ---- who may


def _beside(service: Service) -> str:
    found: int = service.client.get("/system").json()["stop_port"]
    return f"http://127.0.0.1:{found}/api/v1/robots/ma2000"


@contextmanager
def listener_of(folder: Path, stops: dict[str, Stop], told: OnStop) -> Iterator[Any]:
    """A listener without a service, of robots that are stopped so. Its address."""
    with (
        closing(Store(folder / "service.sqlite")) as store,
        socket.create_server(("127.0.0.1", 0)) as door,
        closing(StopListener(door, StopGate(KnownTokens(TokenStore(store), HandClock()), True, (), 8300), stops, told)),
    ):
        yield door.getsockname()


def test_the_listener_stops_and_does_nothing_else(service: Service) -> None:
    base = _beside(service)
    answer = httpx.post(f"{base}/stop", timeout=30)
    assert answer.json()["confirmed"] is True
    service.until_arm("stopped")
    for method, path, status in (
        ("GET", "/stop", 405),
        ("PUT", "/stop", 405),
        ("POST", "/reset", 404),
        ("POST", "/../../../../etc/passwd", 404),
    ):
        answer = httpx.request(method, f"{base}{path}", timeout=30)
        assert answer.status_code == status, (method, path)
        assert answer.headers["Content-Type"] == "application/problem+json"
    answer = httpx.post(f"{base.replace('ma2000', 'other')}/stop", timeout=30)
    assert (answer.status_code, answer.json()["type"]) == (404, "/api/v1/problems#not-found")


def test_a_stop_that_is_not_delivered_holds_the_queue_at_either_door(tmp_path: Path) -> None:
    with running_service(tmp_path) as service:
        service.until_connected()
        assert service.robot.post("/disconnect").status_code == 200
        for stop in (f"{service.robot.base_url}stop", f"{_beside(service)}/stop"):
            service.until_paused()  # first, because the connection has ended
            assert service.robot.post("/queue/resume", json={}).json()["paused"] is False
            assert httpx.post(stop, timeout=30).json()["delivered"] is False
            assert service.until_paused()["reason"].startswith("somebody at the service's computer asked for a stop")


@pytest.mark.parametrize(
    ("head", "status"), [(b"x: y\r\n" * 300_000, 431), (b"x: " + b"y" * 5_000_000, 431), (b"x: y\r\n" * 20, 404)]
)
def test_a_head_too_large_is_refused_at_once(service: Service, head: bytes, status: int) -> None:
    where = urlsplit(_beside(service))
    with socket.create_connection((where.hostname, where.port), timeout=60) as line:
        with suppress(ConnectionError):  # it has answered, and takes no more
            line.sendall(b"POST /nothing HTTP/1.1\r\nHost: 127.0.0.1\r\n" + head + b"\r\n\r\n")
        answer = b""
        with suppress(ConnectionError):
            answer = line.recv(100)
    assert not answer or int(answer.split()[1]) == status
    assert httpx.post(f"{_beside(service)}/stop", timeout=60).json()["confirmed"]


def test_the_services_own_page_may_ask_the_listener_and_no_other_page(service: Service) -> None:
    base = _beside(service)
    policy = service.client.get("/robots").headers["Content-Security-Policy"]
    assert f"connect-src 'self' {base.partition('/api')[0]};" in policy
    own = {"Origin": service.url, "Sec-Fetch-Site": "same-site"}
    answer = httpx.post(f"{base}/stop", headers=own, timeout=30)
    assert answer.json()["confirmed"] is True
    assert answer.headers["Access-Control-Allow-Origin"] == service.url
    asked = httpx.request("OPTIONS", f"{base}/stop", headers=own, timeout=30)
    assert asked.headers["Access-Control-Allow-Headers"] == "authorization"
    for headers in ({"Origin": "http://attacker.example"}, {"Sec-Fetch-Site": "cross-site"}, {"Origin": "null"}):
        answer = httpx.post(f"{base}/stop", headers=headers, timeout=30)
        assert (answer.status_code, answer.json()["type"]) == (403, "/api/v1/problems#other-origin")
        assert "Access-Control-Allow-Origin" not in answer.headers
    named = httpx.post(f"{base}/stop", headers={"Host": "attacker.example"}, timeout=30)
    assert (named.status_code, named.json()["type"]) == (403, "/api/v1/problems#unknown-name")


def test_a_silent_client_or_a_crowd_of_them_keeps_nobody_from_stopping(service: Service) -> None:
    port = service.client.get("/system").json()["stop_port"]
    with ExitStack() as crowd, Client(service.url) as client:
        for _ in range(40):
            crowd.enter_context(socket.create_connection(("127.0.0.1", port)))
        assert client.robot("ma2000").stop().confirmed


def test_whoever_does_not_ask_in_time_keeps_no_place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    clock = HandClock()

    def later_at_every_look() -> float:
        clock.turn(600.0)
        return clock.monotonic()

    monkeypatch.setattr("server.stopping.listener.READ_WITHIN", 1000.0)
    monkeypatch.setattr("server.stopping.listener.time", SimpleNamespace(monotonic=later_at_every_look))
    with listener_of(tmp_path, {}, lambda *_: None) as address, socket.create_connection(address, timeout=60) as slow:
        slow.sendall(b"POST ")
        while slow.recv(4096):  # what it has sent is no request
            pass


def test_viewers_may_stop_and_strangers_may_not(store: Store) -> None:
    clock, tokens = HandClock(), TokenStore(store)
    token = tokens.add("anna", "viewer", clock.utc())
    gate = StopGate(KnownTokens(tokens, clock), False, (), 8300)
    assert gate.admit({"host": "10.0.0.1:8301", "authorization": f"Bearer {token}"}) == Caller("anna", "viewer")
    for headers in ({}, {"authorization": "Bearer daq_wrong"}, {"authorization": "Basic eDp5"}):
        with pytest.raises(ProblemError) as refused:
            gate.admit({"host": "10.0.0.1:8301"} | headers)
        assert refused.value.status == 401
    gate = StopGate(KnownTokens(tokens, clock), True, ("arm.lab",), 8300)
    assert gate.admit({"host": "localhost:8301"}) == LOCAL
    for proxied in ({"host": "arm.lab"}, {"host": "localhost:8301", "x-forwarded-for": "10.0.0.9"}):
        with pytest.raises(ProblemError) as refused:
            gate.admit(proxied)
        assert refused.value.status == 401


@pytest.mark.parametrize(
    ("host", "origin"),
    [
        ("127.0.0.1:8300", "http://127.0.0.1:8301"),
        ("[::1]:8300", "http://[::1]:8301"),
        ("Arm.Lab", "http://arm.lab:8301"),
        ("x; script-src *", None),
        ("", None),
    ],
)
def test_what_a_page_may_connect_to_is_a_name_and_a_port(host: str, origin: str | None) -> None:
    assert beside(host, 8301) == origin


def test_tokens_are_read_while_a_writer_holds_the_database_and_count_on_when_it_is_gone(tmp_path: Path) -> None:
    clock, file = HandClock(), tmp_path / "service.sqlite"
    with closing(migrated_store(file)) as store:
        tokens = TokenStore(store)
        anna, bert = tokens.add("anna", "viewer", clock.utc()), tokens.add("bert", "operator", clock.utc())
        found = StopTokens(reader_of(file), clock=clock.monotonic)
        with store.writing() as writing:  # as a service that was put aside in the middle of it
            writing.execute(text("UPDATE tokens SET role = 'operator'"))
            assert found.look_up(anna) == Caller("anna", "viewer")
        found.look_up("daq_wrong")
        assert found.remembered("daq_wrong") == (True, None)
        clock.turn(UNKNOWN_FOR)
        assert found.remembered("daq_wrong") == (False, None)
        found.look_up("daq_wrong")
        assert found.remembered(bert) == (True, Caller("bert", "operator"))
        tokens.revoke("bert", clock.utc())
        clock.turn(UNKNOWN_FOR)
        found.look_up("daq_wrong")  # as the thread does by itself every READ_AGAIN_AFTER s
        assert found.look_up(bert) is None
    file.unlink()
    clock.turn(UNKNOWN_FOR)
    found.look_up("daq_wrong")
    assert found.look_up(anna) == Caller("anna", "operator")
    found.close()
    with closing(StopTokens(reader_of(file))) as never, pytest.raises(TokensCannotBeReadError):
        never.look_up(anna)


def test_no_stop_with_a_known_token_waits_for_a_database_that_does_not_answer() -> None:
    asked, answered, clock = threading.Event(), threading.Event(), HandClock()

    def hangs() -> dict[str, Caller]:
        asked.set()
        answered.wait()
        return {}

    anna = Caller("anna", "viewer", digest_of("daq_anna"))
    with closing(StopTokens(hangs, {digest_of("daq_anna"): anna}, clock.monotonic)) as found:
        assert asked.wait(60)
        clock.turn(3600)
        assert found.remembered("daq_anna") == (True, anna)
        assert found.look_up("daq_wrong") is None  # after a moment, from what is known
        never = StopTokens(hangs, clock=clock.monotonic)
        with pytest.raises(TokensCannotBeReadError, match="not answered"):
            never.look_up("daq_anna")
        never.update({digest_of("daq_anna"): anna})
        assert never.look_up("daq_anna") == anna
        answered.set()
    never.close()


@contextmanager
def _door(
    folder: Path, monkeypatch: pytest.MonkeyPatch, *times: float
) -> Iterator[tuple[StopDoor, Callable[..., httpx.Response]]]:
    """A listener in a process of its own, and what asks it for a stop, with a token or without."""
    monkeypatch.setenv(FOLDER_VARIABLE, str(folder / "run"))
    begin = Begin(
        descriptor=-1,
        service_port=8300,
        open_on_loopback=True,
        names=(),
        urls={"ma2000": "mock://"},
        database=folder / "none.sqlite",
    )
    with socket.create_server(("127.0.0.1", 0)) as listener, closing(StopDoor(listener, begin, *times)) as door:
        address = f"http://127.0.0.1:{listener.getsockname()[1]}/api/v1/robots/ma2000/stop"

        def stop(token: str | None = None) -> httpx.Response:
            headers = {"Authorization": f"Bearer {token}"} if token else {}
            return httpx.post(address, headers=headers, timeout=60)

        yield door, stop


def test_a_listener_that_is_killed_is_started_again_and_whoever_asks_meanwhile_waits(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with _door(tmp_path, monkeypatch) as (door, stop):
        assert "no robot is connected" in stop().json()["text"]
        os.kill(door.pid, signal.SIGKILL)
        unread = stop("daq_x")
        assert (unread.status_code, unread.json()["type"]) == (503, "/api/v1/problems#database")
        door.set_tokens({digest_of("daq_x"): Caller("anna", "viewer", digest_of("daq_x"))})
        os.kill(door.pid, signal.SIGKILL)
        assert "no robot is connected" in stop("daq_x").json()["text"]
        assert stop("daq_y").status_code == 401
        last = door.pid
    with pytest.raises(ProcessLookupError):
        os.kill(last, 0)


def test_a_listener_that_cannot_be_started_again_at_once_is_started_later(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    refused, popen = [1, 2], subprocess.Popen

    def seldom(*words: Any, **options: Any) -> Any:
        if refused:
            refused.pop()
            raise BlockingIOError(11, "Resource temporarily unavailable")
        return popen(*words, **options)

    with _door(tmp_path, monkeypatch, 0.01) as (door, stop):
        door.wait_ready()
        monkeypatch.setattr("daq.child.subprocess.Popen", seldom)
        os.kill(door.pid, signal.SIGKILL)
        assert "no robot is connected" in stop().json()["text"]
        assert refused == []


def test_a_stop_is_told_though_whoever_asked_has_gone(tmp_path: Path) -> None:
    heard, gone = threading.Event(), threading.Event()

    def stop() -> StopResult:
        assert gone.wait(60)
        return StopResult(delivered=True, confirmed=True, tick=1, seconds=0.0, note="", text="x" * 5_000_000)

    with listener_of(tmp_path, {"ma2000": stop}, lambda *_: heard.set()) as address:
        with socket.create_connection(address) as line:
            line.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            line.sendall(b"POST /api/v1/robots/ma2000/stop HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
        gone.set()
        assert heard.wait(60)


def test_the_listener_is_at_the_port_after_the_services_unless_it_is_set() -> None:
    for settings, follows in ((ServiceSettings(port=0), True), (ServiceSettings(port=0, stop_port=0), False)):
        with listening(settings) as (own, stop):
            assert (stop.getsockname()[1] == own.getsockname()[1] + 1) is follows


def test_a_service_whose_stop_cannot_be_listened_for_does_not_start() -> None:
    with listening(ServiceSettings(port=0)) as (_, taken):
        taken.listen()
        port = taken.getsockname()[1]
        line = f"server.host 127.0.0.1, server.stop_port {port}: cannot be listened at: .*port after --port"
        with pytest.raises(ReachError, match=line), listening(ServiceSettings(port=0, stop_port=port)):
            pass
