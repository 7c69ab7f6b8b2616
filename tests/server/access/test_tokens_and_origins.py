"""Who gets in, and what browsers may not do behind a person's back."""

import asyncio
from pathlib import Path

import httpx
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sqlalchemy import text
from sqlalchemy.event import listen
from sqlalchemy.exc import SQLAlchemyError
from starlette.types import Message, Receive, Scope, Send
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from server.access.caller import Caller
from server.access.gate import NOT_ALLOWED, TRY_LATER, Gate
from server.access.limits import Bucket, Buckets
from server.access.origin import is_from_elsewhere, is_known_name, is_loopback, is_this_computers_user
from server.access.tickets import GOOD_FOR, MOST, Tickets
from server.access.tokens import REMEMBERED_FOR, UNKNOWN_FOR, KnownTokens, TokenStore, digest_of
from server.database_errors import DamagedError
from server.store.engine import Store
from server.store.tables import TokenRow
from tests.daq_cli.invoke import CommandLine
from tests.server.access.people import kind_of
from tests.server.clocks import HandClock
from tests.server.service import Service, running_service


@pytest.fixture
def clock() -> HandClock:
    return HandClock()


@pytest.fixture
def tokens(store: Store) -> TokenStore:
    return TokenStore(store)


@pytest.mark.parametrize(
    ("host", "here"),
    [(host, True) for host in ("127.0.0.1", "127.8.8.8", "::1", "[::1]", "localhost")]
    + [(host, False) for host in ("0.0.0.0", "::", "192.168.1.5", "example.org", "127.0.0.1.example.org", "")],
)
def test_which_addresses_are_this_computers_own(host: str, here: bool) -> None:
    assert is_loopback(host) is here


@pytest.mark.parametrize(
    ("host", "names", "loopback_only", "known"),
    [
        ("127.0.0.1:8300", (), True, True),
        ("localhost:8300", (), True, True),
        ("[::1]:8300", (), True, True),
        ("attacker.example:8300", (), True, False),
        ("", (), True, False),
        ("arm.lab:8300", ("arm.lab",), True, True),
        ("192.168.1.5", (), False, True),
        ("192.168.1.5", ("arm.lab",), False, True),
        ("attacker.example", ("arm.lab",), False, False),
        ("[", (), True, False),
    ],
)
def test_a_name_that_somebody_else_lets_point_here_is_not_known(
    host: str, names: tuple[str, ...], loopback_only: bool, known: bool
) -> None:
    assert is_known_name(host, names, loopback_only=loopback_only) is known


@pytest.mark.parametrize(
    ("headers", "elsewhere"),
    [
        ({"host": "127.0.0.1:8300"}, False),
        ({"host": "127.0.0.1:8300", "origin": "http://127.0.0.1:8300"}, False),
        ({"host": "127.0.0.1:8300", "origin": "http://127.0.0.1:9999"}, True),
        ({"host": "127.0.0.1:8300", "origin": "null"}, True),
        ({"host": "127.0.0.1:8300", "origin": "http://["}, True),
        ({"host": "127.0.0.1:8300", "sec-fetch-site": "cross-site"}, True),
        ({"host": "127.0.0.1:8300", "sec-fetch-site": "same-site"}, True),
        ({"host": "127.0.0.1:8300", "sec-fetch-site": "none"}, False),
        # An origin leaves out the usual port of its scheme, and a proxy may not.
        ({"host": "arm.lab:443", "origin": "https://arm.lab"}, False),
        ({"host": "ARM.lab", "origin": "https://arm.lab:443"}, False),
        ({"host": "arm.lab:443", "origin": "http://arm.lab"}, True),
        ({"host": "arm.lab:8443", "origin": "https://arm.lab"}, True),
        # A proxy has put its own name for the service into Host.
        ({"host": "127.0.0.1:8300", "origin": "https://arm.lab"}, False),
        ({"host": "127.0.0.1:8300", "origin": "https://arm.lab:9999"}, True),
        ({"host": "127.0.0.1:8300", "origin": "https://attacker.example"}, True),
        ({"host": "127.0.0.1:8300", "origin": "https://arm.lab", "sec-fetch-site": "cross-site"}, True),
        ({"host": "arm.lab:8300", "origin": "https://arm.lab"}, True),
        ({"host": "127.0.0.1:8300", "origin": "ftp://arm.lab:21"}, True),
    ],
)
def test_pages_of_another_origin_change_nothing(headers: dict[str, str], elsewhere: bool) -> None:
    assert is_from_elsewhere(headers, ("arm.lab",), changes_something=True) is elsewhere
    assert not is_from_elsewhere(headers, ("arm.lab",), changes_something=False)


@pytest.mark.parametrize(
    ("headers", "local"),
    [
        ({"host": "127.0.0.1:8300"}, True),
        ({"host": "localhost:8300", "accept": "*/*"}, True),
        ({"host": "[::1]:8300"}, True),
        ({"host": "arm.lab"}, False),
        ({"host": "192.168.1.5:8300"}, False),
        ({}, False),
        ({"host": "127.0.0.1:8300", "x-forwarded-for": "10.0.0.9"}, False),
        ({"host": "127.0.0.1:8300", "x-forwarded-proto": "https"}, False),
        ({"host": "localhost:8300", "forwarded": "for=10.0.0.9"}, False),
        ({"host": "localhost:8300", "via": "1.1 proxy"}, False),
        ({"host": "127.0.0.1:8300", "origin": "http://localhost:8300"}, True),
        ({"host": "127.0.0.1:8300", "origin": "https://arm.lab"}, False),
        ({"host": "127.0.0.1:8300", "origin": "null"}, False),
    ],
)
def test_what_a_proxy_hands_on_is_no_user_of_this_computer(headers: dict[str, str], local: bool) -> None:
    assert is_this_computers_user(headers) is local


@given(st.lists(st.floats(0, 10), min_size=1, max_size=200))
def test_a_bucket_gives_no_more_than_its_size_and_rate(pauses: list[float]) -> None:
    bucket, now, given_out = Bucket(rate=2.0, size=5.0, level=5.0, at=0.0), 0.0, 0
    for pause in pauses:
        now += pause
        wait = bucket.take(now)
        if wait == 0:
            given_out += 1
        else:
            assert 0 < wait <= 0.5
    assert given_out <= 5 + 2 * now + 1e-6


def test_one_callers_requests_are_not_counted_against_another() -> None:
    buckets = Buckets(rate=1.0, size=1.0)
    assert buckets.take("anna", "a", 0.0) == 0
    assert buckets.take("anna", "a", 0.0) > 0
    assert buckets.take("bert", "a", 0.0) == 0
    assert buckets.take("anna", "b", 0.0) == 0


def test_a_ticket_is_good_once_and_for_a_moment(clock: HandClock) -> None:
    tickets, anna = Tickets(clock), Caller("anna", "viewer")
    ticket = tickets.give(anna).ticket
    assert tickets.take(ticket) == anna
    assert tickets.take(ticket) is None
    late = tickets.give(anna).ticket
    clock.turn(GOOD_FOR)
    assert tickets.take(late) is None
    assert tickets.take("never given") is None
    kept = tickets.give(anna).ticket
    for _ in range(2 * MOST):
        tickets.give(Caller("greedy", "viewer"))
    assert tickets.take(kept) == anna


def test_a_token_is_kept_as_its_hash_and_a_revoked_one_opens_nothing(
    clock: HandClock, store: Store, tokens: TokenStore
) -> None:
    token = tokens.add("anna", "operator", clock.utc())
    with store.reading() as session:
        row = session.query(TokenRow).one()
        assert row.digest == digest_of(token)
        assert token not in (row.id, row.name, row.digest)
    known = KnownTokens(tokens, clock)
    assert known.remembered(token) == (False, None)
    assert known.look_up(token) == Caller("anna", "operator")
    assert known.remembered(token) == (True, Caller("anna", "operator"))
    tokens.revoke("anna", clock.utc())
    clock.turn(REMEMBERED_FOR)
    assert known.remembered(token) == (False, None)
    assert known.look_up(token) is None


def test_whoever_tries_tokens_has_the_database_asked_once(clock: HandClock, store: Store, tokens: TokenStore) -> None:
    known, asked = KnownTokens(tokens, clock), []
    listen(store.engine, "before_cursor_execute", lambda *told: asked.append(told[2]))
    for number in range(50):
        found, _ = known.remembered(f"daq_{number}")
        assert found or known.look_up(f"daq_{number}") is None
    assert sum("tokens" in statement for statement in asked) == 1
    token = tokens.add("anna", "operator", clock.utc())
    clock.turn(UNKNOWN_FOR)
    assert known.look_up(token) == Caller("anna", "operator")


def test_who_was_known_still_is_while_the_database_cannot_be_read(
    clock: HandClock, store: Store, tokens: TokenStore
) -> None:
    token = tokens.add("anna", "operator", clock.utc())
    known, late = KnownTokens(tokens, clock), KnownTokens(tokens, clock)
    assert known.look_up(token) == Caller("anna", "operator")
    with store.writing() as session:
        session.execute(text("DROP TABLE tokens"))
    clock.turn(REMEMBERED_FOR)
    assert known.look_up(token) == Caller("anna", "operator")
    with pytest.raises(SQLAlchemyError):
        late.look_up(token)


def test_a_moment_that_is_damaged_keeps_nobody_out(clock: HandClock, store: Store, tokens: TokenStore) -> None:
    token = tokens.add("anna", "operator", clock.utc())
    tokens.add("bert", "viewer", clock.utc())
    with store.writing() as session:
        session.execute(text("UPDATE tokens SET created = 'noon'"))
    assert KnownTokens(tokens, clock).look_up(token) == Caller("anna", "operator")


class _Damaged(TokenStore):
    """Its rows can be read once, or never."""

    damaged = True

    def callers(self) -> dict[str, Caller]:
        if self.damaged:
            raise DamagedError("table tokens: a row cannot be read")
        return super().callers()


def test_tokens_that_are_damaged_keep_out_nobody_who_was_known(clock: HandClock, store: Store) -> None:
    tokens = _Damaged(store)
    token = tokens.add("anna", "operator", clock.utc())
    known, sent = KnownTokens(tokens, clock), []
    gate = Gate(known, Tickets(clock), open_on_loopback=False)

    async def inside(scope: Scope, _receive: Receive, send: Send) -> None:
        if scope["type"] == "websocket":
            await send({"type": "websocket.accept"})
        else:
            await send({"type": "http.response.start", "status": 200, "headers": []})

    async def send(message: Message) -> None:
        sent.append(message.get("status") or message.get("code") or message["type"])

    async def receive() -> Message:
        raise AssertionError("nobody asks for it")

    async def asked(kind: str) -> object:
        sent.clear()
        headers = [(b"host", b"10.0.0.1"), (b"authorization", f"Bearer {token}".encode())]
        path = "/api/v1/robots/ma2000/stop"
        scope = {"type": kind, "method": "POST", "path": path, "query_string": b"", "headers": headers}
        await gate.middleware(inside)(scope, receive, send)
        return sent[0]

    assert asyncio.run(asked("http")) == 503
    assert asyncio.run(asked("websocket")) == TRY_LATER
    tokens.damaged = False
    assert asyncio.run(asked("http")) == 200
    tokens.damaged = True
    clock.turn(REMEMBERED_FOR)
    assert asyncio.run(asked("http")) == 200
    clock.turn(REMEMBERED_FOR)
    assert asyncio.run(asked("websocket")) == "websocket.accept"
    clock.turn(REMEMBERED_FOR)
    assert asyncio.run(known.still_let_in(Caller("anna", "operator", digest_of(token))))


def test_a_ticket_of_a_revoked_token_and_who_watches_with_one_are_sent_away(
    clock: HandClock, tokens: TokenStore
) -> None:
    tickets = Tickets(clock)
    token = tokens.add("anna", "operator", clock.utc())
    gate = Gate(KnownTokens(tokens, clock), tickets, open_on_loopback=False, look_every=0.001)
    sent, ended = [], []

    async def watches(_scope: Scope, _receive: Receive, send: Send) -> None:
        await send({"type": "websocket.accept"})
        caller = (await asyncio.to_thread(tokens.callers))[digest_of(token)]
        tickets.give(caller)
        await asyncio.to_thread(tokens.revoke, "anna", clock.utc())
        clock.turn(REMEMBERED_FOR)
        try:
            await asyncio.Event().wait()
        finally:
            ended.append("watching")

    async def send(message: Message) -> None:
        sent.append((message["type"], message.get("code")))
        if len(sent) == 2:
            await asyncio.Event().wait()  # a client that reads nothing

    async def receive() -> Message:
        raise AssertionError("nobody asks for it")

    def opened(headers: dict[str, str], query: str = "") -> None:
        pairs = [(name.encode(), value.encode()) for name, value in ({"host": "10.0.0.1"} | headers).items()]
        scope = {"type": "websocket", "path": "/live", "query_string": query.encode(), "headers": pairs}
        asyncio.run(gate.middleware(watches)(scope, receive, send))

    opened({"authorization": f"Bearer {token}"})
    assert sent == [("websocket.accept", None), ("websocket.close", NOT_ALLOWED)]
    assert ended == ["watching"]
    (ticket,) = tickets._given
    opened({}, f"ticket={ticket}")
    assert sent[2:] == [("websocket.close", NOT_ALLOWED)]


# ---- through a real service


def test_every_answer_tells_browsers_what_they_may_not_do(service: Service) -> None:
    for answer in (service.client.get("/robots"), service.client.get("/nothing")):
        assert answer.headers["Content-Security-Policy"].startswith("default-src 'none'; script-src 'self';")
        assert answer.headers["X-Content-Type-Options"] == "nosniff"
        assert answer.headers["Cache-Control"] == "no-store"
        assert len(answer.headers["X-Request-Id"]) == 16


def test_a_request_from_elsewhere_or_too_large_changes_nothing(service: Service) -> None:
    for path in ("/stop", "/experiments", "/queue/pause"):
        answer = service.robot.post(path, json={}, headers={"Origin": "http://attacker.example"})
        assert kind_of(answer) == (403, "other-origin")
    named = service.client.get("/robots", headers={"Host": "attacker.example"})
    assert kind_of(named) == (403, "unknown-name")
    large = service.robot.post("/experiments", content=b"x" * (17 << 20), headers={"Content-Type": "application/json"})
    assert kind_of(large) == (413, "too-large")
    assert service.robot.get("/queue").json()["queued"] == 0


@pytest.mark.parametrize(
    ("configured", "words", "said"),
    [
        ("", ("--host", "0.0.0.0"), "make one with `daq token add NAME --role operator`"),
        ('[server]\ntokens = "always"\n', (), 'server.tokens is "always", and there is no token'),
    ],
    ids=["at every address", "behind a proxy"],
)
def test_a_service_for_others_does_not_start_without_tokens(
    here: CommandLine,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    configured: str,
    words: tuple[str, ...],
    said: str,
) -> None:
    monkeypatch.setattr("server.logs.begin", lambda: None)  # the logs of this process are the tests' own
    (tmp_path / "daq.toml").write_text(configured)
    here("serve", *words, "--port", "0").complains(2, said)


def _token(here: CommandLine, name: str, role: str) -> str:
    made = here("token", "add", name, "--role", role)
    assert made.code == 0, made.err
    return made.out.strip()


def test_viewers_look_and_stop_operators_do_the_rest(tmp_path: Path, here: CommandLine) -> None:
    viewer, operator = _token(here, "anna", "viewer"), _token(here, "bert", "operator")
    with running_service(tmp_path, "mock://?pty=1&lock_step=1", "--host", "0.0.0.0") as service:
        base = f"{service.url.replace('0.0.0.0', '127.0.0.1')}/api/v1"
        with httpx.Client(base_url=base, timeout=60) as nobody:
            assert nobody.get("/robots").status_code == 401
            assert nobody.post("/robots/ma2000/stop").status_code == 401
            assert nobody.get("/robots", headers={"Authorization": "Bearer daq_wrong"}).status_code == 401
            anna = {"Authorization": f"Bearer {viewer}"}
            me = nobody.get("/me", headers=anna).json()
            assert (me["name"], me["role"], me["owner_of"]) == ("anna", "viewer", [])
            refused = nobody.post("/robots/ma2000/experiments", json={}, headers=anna)
            assert (refused.status_code, refused.json()["type"]) == (403, "/api/v1/problems#operator-needed")
            bert = {"Authorization": f"Bearer {operator}"}
            assert nobody.post("/robots/ma2000/connect", headers=bert).status_code == 200
            assert nobody.post("/robots/ma2000/stop", headers=anna).json()["confirmed"] is True
            ticket = nobody.post("/tickets", headers=anna).json()["ticket"]
            url = f"{base.replace('http', 'ws', 1)}/robots/ma2000/live?ticket={ticket}"
            with connect(url, open_timeout=60) as socket:
                socket.send('{"subscribe":["robot"]}')
                while '"arm":"stopped"' not in str(socket.recv(60)):
                    pass
            with pytest.raises((InvalidStatus, ConnectionClosed)), connect(url, open_timeout=60) as socket:
                socket.recv(60)
