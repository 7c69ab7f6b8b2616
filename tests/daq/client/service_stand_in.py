"""A network that answers from a list, and a pause that nobody waits for."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import httpx

from daq.client.connection import Connection

Answer = httpx.Response | Exception | Callable[[httpx.Request], httpx.Response]


@dataclass
class StandIn:
    """Gives `answers` one after the other, and keeps what it was asked."""

    answers: list[Answer]
    asked: list[httpx.Request] = field(default_factory=list)
    pauses: list[float] = field(default_factory=list)

    def connection(self, url: str = "http://127.0.0.1:8300", token: str | None = None) -> Connection:
        """To this network."""
        return Connection(url, token, transport=httpx.MockTransport(self._answer), pause=self.pauses.append)

    def _answer(self, request: httpx.Request) -> httpx.Response:
        request.read()
        self.asked.append(request)
        answer = self.answers.pop(0)
        if isinstance(answer, Exception):
            raise answer
        return answer if isinstance(answer, httpx.Response) else answer(request)


def problem(status: int, kind: str, detail: str = "no", advice: str = "", **headers: str) -> httpx.Response:
    """As the service makes it."""
    data: dict[str, Any] = {
        "type": f"/api/v1/problems#{kind}",
        "title": "No",
        "status": status,
        "detail": detail,
        "advice": advice,
    }
    return httpx.Response(status, json=data, headers={name.replace("_", "-"): value for name, value in headers.items()})
