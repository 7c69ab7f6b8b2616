"""What the gate lets through of a request before anybody has looked at it: how much of its body, and how often."""

import asyncio
from dataclasses import dataclass, field

import pytest
from starlette.exceptions import HTTPException
from starlette.types import Message, Receive, Scope, Send

from server.access.gate import Gate
from server.access.limits import LARGEST_BODY, Buckets
from server.access.tickets import Tickets
from server.access.tokens import KnownTokens, TokenStore
from server.store.engine import Store
from tests.server.clocks import HandClock

ROBOT = "/api/v1/robots/ma2000"
PIECE = 1 << 20
NO_UPLOADS = [
    ("POST", f"{ROBOT}/experiments"),
    ("PATCH", f"{ROBOT}/traces/traces"),
    ("PATCH", f"{ROBOT}/models/models"),
    ("PATCH", f"{ROBOT}/experiments/traces"),
    ("PUT", f"{ROBOT}/traces"),
    ("POST", f"{ROBOT}/teaching/models"),
    ("POST", "/api/v1/traces"),
]


@pytest.fixture
def tokens(store: Store) -> KnownTokens:
    """None that opens anything."""
    return KnownTokens(TokenStore(store), HandClock())


@dataclass
class Request:
    """One that sends `pieces` of 1 MB, does not say how many, and keeps what it is told."""

    method: str
    path: str
    pieces: int = 0
    length: int | None = None
    headers: dict[str, str] = field(default_factory=dict)
    taken: int = 0
    status: int = 0
    refused: HTTPException | None = None
    sent: list[Message] = field(default_factory=list)

    async def receive(self) -> Message:
        """The next piece."""
        self.taken += 1
        return {"type": "http.request", "body": b"x" * PIECE, "more_body": self.taken < self.pieces}

    async def send(self, message: Message) -> None:
        """The answer."""
        if message["type"] == "http.response.start":
            self.status = message["status"]

    def through(self, gate: Gate) -> "Request":
        try:
            asyncio.run(self.send_through(gate))
        except HTTPException as error:  # FastAPI's handler makes a problem of it
            self.refused = error
        return self

    async def send_through(self, gate: Gate) -> None:
        """Is answered, on a loop of the caller's."""
        told = {"host": "127.0.0.1:8300"} | self.headers
        headers = [(name.encode(), value.encode()) for name, value in told.items()]
        if self.length is not None:
            headers.append((b"content-length", str(self.length).encode()))
        scope: Scope = {"type": "http", "method": self.method, "path": self.path, "headers": headers}
        await gate.middleware(_reads_everything)(scope, self.receive, self.send)


async def _reads_everything(scope: Scope, receive: Receive, send: Send) -> None:
    while (await receive())["more_body"]:
        pass
    await send({"type": "http.response.start", "status": 200, "headers": []})


def _gate(
    tokens: KnownTokens, *, local: bool = True, names: tuple[str, ...] = (), buckets: Buckets | None = None
) -> Gate:
    return Gate(tokens, Tickets(HandClock()), open_on_loopback=local, names=names, buckets=buckets or Buckets())


@pytest.mark.parametrize(("method", "path"), NO_UPLOADS)
def test_only_an_upload_may_be_larger_than_the_largest_body(tokens: KnownTokens, method: str, path: str) -> None:
    most = LARGEST_BODY // PIECE
    assert Request(method, path, most).through(_gate(tokens)).status == 200
    endless = Request(method, path, 120).through(_gate(tokens))
    assert endless.refused is not None
    assert (endless.refused.status_code, endless.taken) == (413, most + 1)
    told = Request(method, path, 120, length=LARGEST_BODY + 1).through(_gate(tokens))
    assert (told.status, told.taken) == (413, 0)


@pytest.mark.parametrize("path", [f"{ROBOT}/traces", f"{ROBOT}/models"])
def test_an_upload_counts_its_own_bytes(tokens: KnownTokens, path: str) -> None:
    upload = Request("POST", path, 20, length=20 * PIECE).through(_gate(tokens))
    assert (upload.status, upload.taken) == (200, 20)


@pytest.mark.parametrize(("method", "path"), [*NO_UPLOADS, ("POST", f"{ROBOT}/traces"), ("DELETE", f"{ROBOT}/jobs/1")])
def test_nothing_is_read_of_whoever_has_no_token(tokens: KnownTokens, method: str, path: str) -> None:
    stranger = Request(method, path, 120).through(_gate(tokens, local=False))
    assert (stranger.status, stranger.taken) == (401, 0)


@pytest.mark.parametrize("headers", [{"host": "arm.lab"}, {"x-forwarded-for": "10.0.0.9"}, {"via": "1.1 proxy"}])
def test_whoever_comes_through_a_proxy_needs_a_token(tokens: KnownTokens, headers: dict[str, str]) -> None:
    gate = _gate(tokens, names=("arm.lab",))
    assert Request("POST", f"{ROBOT}/queue/resume", headers=headers).through(gate).status == 401
    assert Request("POST", f"{ROBOT}/stop", headers=headers).through(gate).status == 401
    assert Request("POST", f"{ROBOT}/queue/resume").through(gate).status == 200


def test_no_limit_holds_up_a_stop_and_nothing_else_is_one(tokens: KnownTokens) -> None:
    gate = _gate(tokens, buckets=Buckets(rate=1e-9, size=1.0))
    assert Request("GET", ROBOT).through(gate).status == 200
    others = [("GET", f"{ROBOT}/traces/stop"), ("GET", f"{ROBOT}/stop"), ("POST", "/stop"), ("PATCH", f"{ROBOT}/stop")]
    assert [Request(*other).through(gate).status for other in others] == [429] * 4
    assert Request("POST", f"{ROBOT}/stop").through(gate).status == 200
