"""Moving the arm by hand through the service: only with the control, and never past a stop."""

import json
import socket
from typing import Any

import httpx

from tests.server.polling import reset, until
from tests.server.service import Service


def _lease(service: Service) -> dict[str, str]:
    answer = service.robot.post("/control", json={})
    assert answer.status_code == 201, answer.text
    return {"Control-Lease": answer.json()["lease"]}


def _until_taught(service: Service) -> dict[str, object]:
    while True:
        found: dict[str, object] = service.robot.get("/teaching").json()
        if found["activity"] == "none":
            return found


def test_motion_needs_the_control(service: Service) -> None:
    for path, body in (
        ("/teaching/jog", {"velocities": {"1": 0.1}}),
        ("/teaching/step", {"by": {"1": 0.1}}),
        ("/teaching/lead", {}),
    ):
        answer = service.robot.post(path, json=body)
        assert (answer.status_code, answer.json()["type"]) == (409, "/api/v1/problems#control-needed"), answer.text
    assert service.robot.put("/gripper", json={"closed": True}).status_code == 409


def test_one_client_has_the_control_at_a_time_and_gives_it_back(service: Service) -> None:
    mine = _lease(service)
    other = service.robot.post("/control", json={})
    assert (other.status_code, other.json()["type"]) == (409, "/api/v1/problems#control-held")
    assert service.robot.get("/control").json()["holder"] == "client"
    assert service.robot.put("/control", headers=mine).status_code == 200
    assert service.robot.delete("/control", headers=mine).status_code == 204
    assert service.robot.get("/control").json()["holder"] == "nobody"
    assert service.robot.put("/control", headers=mine).json()["type"] == "/api/v1/problems#control-lost"


def test_a_jog_ends_when_the_control_is_given_back(service: Service) -> None:
    mine = _lease(service)
    answer = service.robot.post("/teaching/jog", json={"velocities": {"2": -0.1}}, headers=mine)
    assert answer.json()["activity"] == "jog", answer.text
    service.robot.delete("/control", headers=mine)
    assert service.robot.get("/teaching").json()["result"] == "jog: done"


def test_a_stop_ends_a_jog_and_no_other_begins_before_a_reset(service: Service) -> None:
    mine = _lease(service)
    service.robot.post("/teaching/jog", json={"velocities": {"2": 0.1}}, headers=mine)
    stopped = service.robot.post("/stop").json()
    assert stopped["confirmed"], stopped
    ended = _until_taught(service)
    assert "the arm has been stopped" in str(ended["problem"])
    again = service.robot.post("/teaching/jog", json={"velocities": {"2": 0.1}}, headers=mine)
    assert again.status_code == 409
    assert service.status()["arm"] == "stopped"
    service.robot.delete("/control", headers=mine)


def test_jogging_too_fast_or_a_joint_or_an_output_that_is_not_there_is_refused(service: Service) -> None:
    mine = _lease(service)
    for velocities in ({"1": 2.0}, {"9": 0.1}, {"1": 1e9}):
        answer = service.robot.post("/teaching/jog", json={"velocities": velocities}, headers=mine)
        assert answer.status_code == 422, answer.text
    assert service.robot.put("/process/outputs/8", json={"on": True}, headers=mine).status_code == 422
    service.robot.delete("/control", headers=mine)


# ---- an order counts from its first byte


AT_ONCE = 40
"""Number of resets that wait at the same time: as many as the service has threads."""


class HalfSent:
    """A request without its last byte, which `end` sends."""

    def __init__(self, service: Service, method: str, path: str, body: dict[str, Any], lease: str = "") -> None:
        address, content = httpx.URL(service.url), json.dumps(body).encode()
        self._last = content[-1:]
        self._socket = socket.create_connection((address.host, address.port or 0), timeout=60)
        head = (
            f"{method} /api/v1/robots/ma2000{path} HTTP/1.1\r\nHost: {address.host}:{address.port}\r\n"
            f"Content-Type: application/json\r\nContent-Length: {len(content)}\r\nConnection: close\r\n"
        )
        self._socket.sendall(f"{head}Control-Lease: {lease}\r\n\r\n".encode() + content[:-1])

    def end(self) -> tuple[int, dict[str, Any]]:
        """Status and content of the answer."""
        with self._socket as connection:
            connection.sendall(self._last)
            answer = b"".join(iter(lambda: connection.recv(65536), b""))
        head, _, content = answer.partition(b"\r\n\r\n")
        return int(head.split()[1]), json.loads(content)


def test_what_was_begun_before_a_stop_changes_nothing_after_it(service: Service) -> None:
    before = service.robot.get("/process").json()
    lease = service.robot.post("/control", json={}).json()["lease"]
    assert service.robot.post("/stop").json()["confirmed"]
    address = str(service.robot.base_url).rstrip("/")
    seen = until(service.client, address, lambda found: found["stop"] is not None)["stop"]
    orders: list[tuple[str, str, dict[str, Any]]] = [
        *[("POST", "/reset", {"stop": seen, "here": bool(n % 2)}) for n in range(AT_ONCE)],
        ("PUT", "/gripper", {"closed": True, "while_stopped": True}),
        ("PUT", "/process/outputs/3", {"on": True, "while_stopped": True}),
        ("PUT", "/gains", {"gains": {"1": [2, 0, 0]}}),
        ("POST", "/teaching/jog", {"velocities": {"1": 0.1}}),
        ("POST", "/teaching/step", {"by": {"1": 0.1}}),
    ]
    begun = [HalfSent(service, *order, lease) for order in orders]
    resume = HalfSent(service, "POST", "/queue/resume", {})
    assert httpx.get(f"{service.url}/healthz", timeout=60).status_code == 200  # the service has read them all
    beside = service.client.get("/system").json()["stop_port"]
    stopped = httpx.post(f"http://127.0.0.1:{beside}/api/v1/robots/ma2000/stop", timeout=60).json()
    assert stopped["confirmed"], stopped
    for order, one in zip(orders, begun, strict=True):
        status, answer = one.end()
        assert status in (409, 503), (order, answer)  # 503: on a busy computer its time was over
    assert service.robot.get("/process").json() == before
    assert service.until_arm("stopped")["arm"] == "stopped"
    headers = {"Control-Lease": service.robot.post("/control", json={}).json().get("lease", lease)}
    assert reset(service.robot, headers=headers).status_code == 200
    assert resume.end()[0] == 200
    assert "stop" in service.until_paused()["reason"]
    service.robot.delete("/control", headers=headers)
