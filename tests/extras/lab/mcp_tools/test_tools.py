"""The tools through the reference client of the protocol: what they give, and what hostile arguments get."""

import asyncio
import socket
import subprocess
from collections.abc import Awaitable, Callable
from types import SimpleNamespace
from typing import Any

import pytest
from mcp import Client, StdioServerParameters
from mcp_types import CallToolResult

from extras.lab.mcp_tools import tools
from tests.server.service import DAQ, Service

RAMP = {"trajectory": {"kind": "ramp", "amplitude": 0.1}, "joints": [1]}


def text_of(answer: CallToolResult) -> str:
    return "\n".join(part.text for part in answer.content if part.type == "text")


def asked(server: Any, use: Callable[[Client], Awaitable[Any]]) -> Any:
    async def ask() -> Any:
        async with Client(server) as client:
            return await use(client)

    return asyncio.run(ask())


def called(server: Any, name: str, **arguments: Any) -> CallToolResult:
    found: CallToolResult = asked(server, lambda client: client.call_tool(name, arguments))
    return found


def answer(server: Any, name: str, **arguments: Any) -> Any:
    found = called(server, name, **arguments)
    assert not found.is_error, text_of(found)
    content = found.structured_content
    assert content is not None
    return content.get("result", content)


def test_an_experiment_goes_from_preview_to_trace_and_a_job(service: Service) -> None:
    server = tools.tools_of(service.url, None)
    planned = answer(server, "preview", spec=RAMP)
    assert (planned["moving"], planned["violations"]) == ([1], [])
    assert "set_points" not in planned
    submitted = answer(server, "submit", spec=RAMP)
    ended = service.robot.get(f"/experiments/{submitted['id']}?wait=60").json()
    assert ended["state"] == "done"
    assert answer(server, "experiments", most=1)[0]["id"] == submitted["id"]
    assert answer(server, "trace", number=ended["trace"])["entry"]["id"] == ended["trace"]
    assert ended["trace"] in {one["id"] for one in answer(server, "traces")}
    begun = answer(server, "fit", request={"traces": [ended["trace"]], "parameters": ["load.mass"]})
    assert answer(server, "job", number=begun["id"])["request"]["kind"] == "fit"
    service.robot.post(f"/jobs/{begun['id']}/cancel")
    assert answer(server, "status")["queue"]["review"] is None


@pytest.mark.parametrize(
    ("name", "arguments", "said"),
    [
        ("trace", {"number": "../../queue"}, "number"),
        ("trace", {"number": "0" * 100_000}, "number"),
        ("trace", {"number": "none"}, "none"),
        ("job", {"number": "x/result?y"}, "number"),
        ("traces", {"most": 10**30}, "most"),
        ("traces", {"text": "x" * 201}, "text"),
        ("submit", {"spec": "ramp"}, "spec"),
        ("submit", {"spec": {"joints": [1e308]}}, "submit: spec.joints.1: "),
        ("submit", {"spec": {"trajectory": {"kind": "sine", "amplitude": 1e999}}}, "amplitude"),
        ("submit", {"spec": {"folder": "/tmp"}}, "folder"),
        ("fit", {"request": {"traces": ["a"], "name": "<script>"}}, "name"),
        ("diagnose", {"request": {"traces": ["a"], "effects": ["__import__('os')"]}}, "request.effects.1"),
        ("fit", {"request": {"traces": ["a"], "holdout": []}}, "request.holdout: there is no such field here"),
        ("trace", {}, "trace: number: is missing"),
        ("approve", {"number": "1"}, "approve"),
    ],
)
def test_hostile_arguments_get_one_clear_answer_and_change_nothing(
    service: Service, name: str, arguments: dict[str, Any], said: str
) -> None:
    before = service.robot.get("/experiments").json()["items"]
    server = tools.tools_of(service.url, None)
    try:
        found = called(server, name, **arguments)
        assert found.is_error
        words = text_of(found)
    except Exception as error:  # noqa: BLE001 - the client raises what the protocol itself refuses
        words = str(error)
    assert said in words
    assert len(words) < 1000
    assert "Traceback" not in words
    assert "pydantic" not in words
    assert "_told" not in words
    assert service.robot.get("/experiments").json()["items"] == before


def test_no_tool_approves_consents_or_moves_by_hand(service: Service) -> None:
    listed = asked(tools.tools_of(service.url, None), lambda client: client.list_tools())
    fields = {tool.name: tool.input_schema.get("$defs", {}) for tool in listed.tools}
    assert "held_out" in fields["diagnose"]["DiagnoseRequest"]["properties"]
    assert "trajectory" in fields["submit"]["ExperimentSpec"]["properties"]
    names = {tool.name for tool in listed.tools}
    assert names == {
        *("status", "traces", "trace", "preview", "experiments", "job"),
        *("submit", "fit", "diagnose", "stop"),
    }


@pytest.mark.parametrize(("review", "goes"), [(None, False), ("operator", True)])
def test_a_real_arm_is_asked_for_only_where_somebody_reviews(
    monkeypatch: pytest.MonkeyPatch, review: str | None, goes: bool
) -> None:
    submitted: list[object] = []

    def submit(spec: object) -> object:
        submitted.append(spec)
        return SimpleNamespace(model_dump=lambda **_: {"id": "1"})

    status = SimpleNamespace(robot="bench", port="serial:///dev/ttyUSB0", queue=SimpleNamespace(review=review))
    arm = SimpleNamespace(status=lambda: status, experiments=SimpleNamespace(submit=submit))

    class Stub:
        def __init__(self, *_: object) -> None: ...
        def __enter__(self) -> Any:
            return SimpleNamespace(robot=lambda _name: arm)

        def __exit__(self, *_: object) -> None: ...
        def close(self) -> None: ...

    monkeypatch.setattr(tools, "Client", Stub)
    found = called(tools.tools_of("http://127.0.0.1:1", None), "submit", spec=RAMP)
    assert bool(submitted) is goes is not found.is_error
    assert goes or "nobody reviews its experiments" in text_of(found)


def test_standard_input_and_output_serve_one_who_starts_it(service: Service) -> None:
    started = StdioServerParameters(command=DAQ[0], args=[*DAQ[1:], "--server", service.url, "mcp"])
    assert answer(started, "status")["robot"] == "ma2000"


def test_over_http_nobody_asks_without_a_token(service: Service) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
    command = [*DAQ, "--server", service.url, "mcp", "--http", str(port)]
    with subprocess.Popen(command, stderr=subprocess.PIPE) as process:
        try:
            assert process.stderr is not None
            while b"running on" not in process.stderr.readline():
                assert process.poll() is None
            found = called(f"http://127.0.0.1:{port}/mcp", "status")
            assert found.is_error
            assert "no token: send" in text_of(found)
        finally:
            process.terminate()
