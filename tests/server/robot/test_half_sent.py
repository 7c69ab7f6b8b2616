"""An order counts from its first byte: what was begun before a stop and ends after it changes nothing."""

import json
import socket
from typing import Any

import httpx

from tests.server.polling import reset, until
from tests.server.service import Service

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
