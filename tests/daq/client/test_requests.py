"""What the client sends twice and what never, what it makes of refusals, and how it reads lists and files."""

import json
from pathlib import Path

import httpx
import pytest

from daq.client import ServiceError, ServiceNotReachedError
from daq.client.connection import ANSWER_WITHIN, PAUSES, Request, parse_url
from daq.client.experiments import Experiments, Queue
from daq.client.live import proxy_to
from daq.client.traces import Traces
from daq.contracts.errors import SpecError, TraceError
from daq.contracts.experiment import ExperimentSpec
from daq.contracts.service.events import ServiceEvent
from daq.contracts.service.robot import Done
from daq.contracts.service.system import Me
from tests.daq.client.service_stand_in import StandIn, problem

ME = {"name": "anna", "role": "viewer"}
BROKEN = httpx.ConnectError("connection refused")
EXPERIMENT = {
    "id": "0123456789ab",
    "robot": "ma2000",
    "spec": ExperimentSpec().model_dump(mode="json"),
    "state": "queued",
    "priority": 0,
    "submitted": "2026-01-01T00:00:00Z",
    "submitted_by": "anna",
}


def queue_status(**changes: object) -> dict[str, object]:
    """As the service says it of its queue."""
    return {"paused": False, "reason": "", "since": "2026-01-01T00:00:00Z", "queued": 1} | changes


def test_what_changes_nothing_is_asked_again_a_few_times_after_growing_pauses() -> None:
    network = StandIn([BROKEN, httpx.ReadTimeout("slow"), httpx.Response(200, json=ME)])
    assert network.connection().get(Me, "me").name == "anna"
    assert network.pauses == list(PAUSES[:2])
    network = StandIn([BROKEN] * 10)
    with pytest.raises(ServiceNotReachedError, match=r"http://127.0.0.1:8300: not reached: connection refused"):
        network.connection().get(Me, "me")
    assert len(network.asked) == 1 + len(PAUSES)
    busy = problem(429, "too-many", Retry_After="2")
    network = StandIn([busy, problem(429, "too-many", Retry_After="3600"), httpx.Response(200, json=ME)])
    network.connection().get(Me, "me")
    assert network.pauses == [2.0, 5.0]


@pytest.mark.parametrize("method", ["POST", "PUT", "PATCH", "DELETE"])
def test_what_changes_something_is_sent_once(method: str) -> None:
    for answer in (BROKEN, problem(429, "too-many"), problem(503, "database")):
        network = StandIn([answer])
        with pytest.raises((ServiceError, ServiceNotReachedError)):
            network.connection().ask(Done, Request(method, "robots/ma2000/reset"))
        assert len(network.asked) == 1


def test_an_experiment_is_submitted_again_under_its_key_and_a_refusal_is_not_asked_again() -> None:
    network = StandIn([httpx.ReadTimeout("lost answer"), httpx.Response(200, json=EXPERIMENT)])
    made = Experiments(network.connection(), "robots/ma2000").submit(ExperimentSpec())
    assert made.id == EXPERIMENT["id"]
    keys = {request.headers["Idempotency-Key"] for request in network.asked}
    assert len(network.asked) == 2
    assert len(keys) == 1
    assert len({request.content for request in network.asked}) == 1
    network = StandIn([problem(409, "control-held", "bert has the control", "wait until it is given back")])
    with pytest.raises(ServiceError) as refused:
        network.connection().get(Me, "me")
    assert str(refused.value) == "bert has the control; wait until it is given back"
    assert (refused.value.kind, refused.value.status, refused.value.exit_code) == ("control-held", 409, 4)


@pytest.mark.parametrize(
    ("status", "kind", "exit_code"),
    [
        (422, "not-valid", 2),
        (422, "beyond-limits", 4),
        (404, "not-found", 2),
        (401, "token-needed", 2),
        (409, "port-in-use", 3),
        (409, "stopped", 6),
        (503, "not-reached", 3),
        (500, "fault", 1),
    ],
)
def test_a_refusal_ends_a_command_as_the_local_one_would(status: int, kind: str, exit_code: int) -> None:
    network = StandIn([problem(status, kind)])
    with pytest.raises(ServiceError) as refused:
        network.connection().ask(Me, Request("GET", "me"))
    assert refused.value.exit_code == exit_code


def test_what_else_answers_is_told_and_what_a_newer_service_adds_is_borne() -> None:
    with pytest.raises(ServiceError, match="502 Bad Gateway"):
        StandIn([httpx.Response(502, text="<html>")]).connection().get(Me, "me")
    with pytest.raises(ServiceNotReachedError, match="not as this version's service: name"):
        StandIn([httpx.Response(200, json={"role": "viewer"})]).connection().get(Me, "me")
    with pytest.raises(ServiceNotReachedError, match="not as this version's service"):
        StandIn([httpx.Response(200, text="<html>")]).connection().get(Me, "me")
    assert StandIn([httpx.Response(200, json=ME | {"shoe": 44})]).connection().get(Me, "me").name == "anna"


def test_the_token_goes_with_every_request_and_a_list_comes_part_by_part() -> None:
    network = StandIn([httpx.Response(200, json=ME)])
    network.connection(token="daq_x").get(Me, "me")
    assert network.asked[0].headers["Authorization"] == "Bearer daq_x"
    assert network.asked[0].url.path == "/api/v1/me"

    def part(number: int, following: str | None) -> httpx.Response:
        event = {"number": number, "at": "2026-01-01T00:00:00Z", "kind": "stop", "text": "x"}
        return httpx.Response(200, json={"items": [event], "next": following})

    network = StandIn([part(2, "abc"), part(1, None)])
    found = list(network.connection().every(ServiceEvent, "robots/ma2000/events", experiment=None))
    assert [event.number for event in found] == [2, 1]
    assert [dict(request.url.params) for request in network.asked] == [{}, {"cursor": "abc"}]


def test_a_wait_ends_with_the_experiment_or_with_its_time() -> None:
    done = EXPERIMENT | {"state": "done"}
    answers = [EXPERIMENT, queue_status(), done]
    network = StandIn([httpx.Response(200, json=answer) for answer in answers])
    assert Experiments(network.connection(), "robots/ma2000").wait("0123456789ab").state == "done"
    now = iter([0.0, 1.0, 100.0])
    network = StandIn([httpx.Response(200, json=EXPERIMENT)])
    with pytest.raises(TimeoutError, match="is queued after 10 s"):
        Experiments(network.connection(), "robots/ma2000").wait("0123456789ab", 10, lambda: next(now))
    assert network.asked[0].url.params["wait"] == "2.0"
    for ask in (
        lambda connection: Experiments(connection, "robots/ma2000").cancel("0123456789ab", within=1.0),
        lambda connection: Queue(connection, "robots/ma2000").attend(within=1.0),
    ):
        network = StandIn([httpx.ReadTimeout("slow")])
        with pytest.raises(ServiceNotReachedError):
            ask(network.connection())
        assert set(network.asked[0].extensions["timeout"].values()) == {1.0}
    network = StandIn([httpx.Response(200, json=ME)])
    network.connection().get(Me, "me", patience=5.0)
    assert network.asked[0].extensions["timeout"]["read"] == ANSWER_WITHIN + 5.0


def test_who_waits_in_a_queue_that_a_person_must_resume_hears_it_soon_and_once() -> None:
    paused = queue_status(paused=True, reason="the robot was connected while 1 experiment waited: look at the arm")
    away = queue_status(waiting_for="nobody has confirmed presence")
    answers = [
        EXPERIMENT,
        paused,
        EXPERIMENT,
        paused,
        EXPERIMENT,
        away,
        EXPERIMENT,
        away,
        EXPERIMENT | {"state": "done"},
    ]
    network = StandIn([httpx.Response(200, json=answer) for answer in answers])
    with pytest.warns(UserWarning, match="waits") as told:
        Experiments(network.connection(), "robots/ma2000").wait("0123456789ab")
    assert [str(one.message) for one in told] == [
        f"experiment 0123456789ab waits: the queue is paused: {paused['reason']}",
        "experiment 0123456789ab waits: nobody has confirmed presence",
    ]
    assert [request.url.params.get("wait") for request in network.asked[::2]] == ["2.0", *["30.0"] * 4]


def test_a_file_is_whole_or_not_there_and_never_written_over_another(tmp_path: Path) -> None:
    # A file that breaks off leaves nothing
    def broken(_: httpx.Request) -> httpx.Response:
        def pieces() -> object:
            yield b"half"
            raise httpx.ReadError("cable")

        return httpx.Response(200, content=pieces())  # type: ignore[arg-type]

    with pytest.raises(ServiceNotReachedError, match="cable"):
        StandIn([broken]).connection().download("robots/ma2000/traces/a/data.mcap", tmp_path / "a.mcap")
    assert list(tmp_path.iterdir()) == []
    # A trace is never written over another
    target = tmp_path / "a.mcap"
    target.write_bytes(b"one")
    traces = Traces(StandIn([httpx.Response(200, content=b"one")]).connection(), "robots/ma2000")
    assert traces.download("a", target) == target
    traces = Traces(StandIn([httpx.Response(200, content=b"another")]).connection(), "robots/ma2000")
    with pytest.raises(TraceError, match="exists and is not trace a"):
        traces.download("a", target)
    assert target.read_bytes() == b"one"
    assert list(tmp_path.iterdir()) == [target]
    network = StandIn([httpx.Response(302, text="<html>log in", headers={"Location": "http://proxy.lab"})])
    with pytest.raises(ServiceError, match="302 Found"):
        network.connection().download("robots/ma2000/traces/a/data.mcap", tmp_path / "b.mcap")
    assert list(tmp_path.iterdir()) == [target]


def _entries(*names: tuple[str, str]) -> httpx.Response:
    items = [
        {
            "id": number,
            "robot": "ma2000",
            "file": file,
            "created": "2026-01-01T00:00:00Z",
            "source": "mock",
            "kind": None,
            "name": None,
            "joints": [1],
            "outcome": None,
            "samples": 1,
            "duration": 0,
            "size": 1,
            "operator": None,
            "experiment": None,
        }
        for number, file in names
    ]
    return httpx.Response(200, content=json.dumps({"items": items, "next": None}))


def test_a_trace_is_found_by_the_beginning_of_its_number_or_name() -> None:
    two = (("ab12", "2026_ramp_ab12.mcap"), ("ab34", "2026_step_ab34.mcap"))
    for wanted, found in (("ab1", "ab12"), ("2026_step", "ab34"), ("last", "ab12")):
        traces = Traces(StandIn([_entries(*two)]).connection(), "robots/ma2000")
        assert traces.find(wanted).id == found
    with pytest.raises(TraceError, match="2 of the service match"):
        Traces(StandIn([_entries(*two)]).connection(), "robots/ma2000").find("ab")
    with pytest.raises(TraceError, match="no trace of the service has"):
        Traces(StandIn([_entries(*two)]).connection(), "robots/ma2000").find("ramp")
    with pytest.raises(TraceError, match="no trace yet"):
        Traces(StandIn([_entries()]).connection(), "robots/ma2000").find("last")


@pytest.mark.parametrize("text", ["", "arm.lab:8300", "ftp://arm.lab", "http://", "http://a:b@arm.lab", "http://x?y=1"])
def test_an_address_that_can_be_no_services_is_refused(text: str) -> None:
    with pytest.raises(SpecError, match="server"):
        parse_url(text)


def test_an_address_takes_a_path_and_no_syntax_from_a_name() -> None:
    network = StandIn([httpx.Response(200, json=ME)])
    network.connection("https://lab.example/arm/").get(Me, "me")
    assert str(network.asked[0].url) == "https://lab.example/arm/api/v1/me"
    network = StandIn([httpx.Response(200, json=ME)])
    network.connection().get(Me, "robots/ma2000/traces/why?wait=9#50%")
    assert network.asked[0].url.raw_path == b"/api/v1/robots/ma2000/traces/why%3Fwait%3D9%2350%25"


@pytest.mark.parametrize("token", ["", "schlüssel", "daq_x\n", "daq x"])
def test_a_token_that_no_header_can_carry_is_refused_and_not_shown(token: str) -> None:
    with pytest.raises(SpecError) as wrong:
        StandIn([]).connection(token=token)
    assert str(wrong.value).startswith("token: only ASCII characters without spaces are allowed")


def test_the_stream_takes_the_proxy_that_requests_take(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("http_proxy", "https_proxy", "all_proxy", "no_proxy"):
        monkeypatch.delenv(name, raising=False)
        monkeypatch.delenv(name.upper(), raising=False)
    assert proxy_to("http://arm.lab:8300") is None
    monkeypatch.setenv("http_proxy", "proxy.lab:3128")
    monkeypatch.setenv("no_proxy", "near.lab")
    assert proxy_to("http://arm.lab:8300") == "http://proxy.lab:3128"
    assert proxy_to("https://arm.lab") is None
    assert proxy_to("http://near.lab:8300") is None
    assert proxy_to("http://127.0.0.1:8300") is None
