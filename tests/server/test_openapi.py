"""The description of the API: complete, usable for generated clients, and true."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from server.app import bare_app
from tests.server.service import Service


@pytest.fixture(scope="module")
def described() -> dict[str, Any]:
    """The OpenAPI document."""
    return bare_app(None).openapi()


def _operations(described: dict[str, Any]) -> list[tuple[str, dict[str, Any]]]:
    return [
        (f"{method.upper()} {path}", operation)
        for path, methods in described["paths"].items()
        for method, operation in methods.items()
    ]


def test_operations_have_names_of_their_own_that_are_functions(described: dict[str, Any]) -> None:
    names = [operation["operationId"] for _, operation in _operations(described)]
    assert len(names) == len(set(names))
    assert all(name.isidentifier() and name.islower() for name in names)


def test_every_operation_says_what_it_does_and_what_it_answers(described: dict[str, Any]) -> None:
    for name, operation in _operations(described):
        assert operation.get("description"), name
        good = [answer for status, answer in operation["responses"].items() if status.startswith("2")]
        assert good, name
        if "204" not in operation["responses"]:
            assert any("content" in answer for answer in good), name


def test_everything_of_a_robot_names_it(described: dict[str, Any]) -> None:
    of_no_robot = {
        "/api/v1/robots",
        "/api/v1/tickets",
        "/api/v1/me",
        "/api/v1/system",
        "/healthz",
        "/readyz",
        "/metrics",
    }
    for path in described["paths"]:
        assert path in of_no_robot or path.startswith("/api/v1/robots/{robot}"), path


def test_the_types_of_the_live_stream_are_in_it(described: dict[str, Any]) -> None:
    assert {"LiveFrame", "SampleMessage", "RobotMessage", "QueueMessage", "JobMessage"} <= set(
        described["components"]["schemas"]
    )


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_no_request_that_fits_the_description_meets_a_fault_of_the_program(service: Service) -> None:
    schemathesis = Path(sys.executable).with_name("schemathesis")
    command = [
        str(schemathesis), "run", f"{service.url}/api/v1/openapi.json", "--phases", "fuzzing", "--max-examples", "6",
        "--checks", "not_a_server_error", "--request-timeout", "60", "--seed", "1",
        "--exclude-operation-id", "connect_robot", "--exclude-operation-id", "disconnect_robot",
        "--exclude-operation-id", "submit_job",
    ]  # fmt: skip
    ended = subprocess.run(command, cwd=service.folder, capture_output=True, text=True, timeout=280, check=False)
    assert ended.returncode == 0, ended.stdout[-4000:]
