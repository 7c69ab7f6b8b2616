"""Whoever asks for much, or for nothing, waits for themselves alone, and holds up no stop."""

import asyncio
import resource
import socket
from contextlib import closing
from typing import Any

import httpx
import pytest
import uvicorn
from starlette.types import Message, Receive, Scope, Send
from uvicorn.server import ServerState

from daq.contracts.experiment import ExperimentSpec, Sine
from daq.contracts.machine import load_machine
from daq.contracts.service.experiments import MotionPreview
from daq.safety.preview import preview_of
from server.access import lanes as of_lanes
from server.access.connections import MOST_HEADERS, Connection
from server.access.gate import AT_ONCE, Turn, Turns
from server.access.lanes import MOST_WAITING, Lanes
from server.bounded.messages import Limits, WorkOutMotion
from server.bounded.workers import Workers
from server.problems import ProblemError
from server.steady import RESERVED, most_connections


async def _answer(scope: Scope, receive: Receive, send: Send) -> None:
    await send({"type": "http.response.start", "status": 200, "headers": [(b"content-length", b"0")]})
    await send({"type": "http.response.body", "body": b""})


async def _listening(listener: socket.socket, kind: type[Connection]) -> tuple[asyncio.Server, ServerState]:
    """A server of such connections, and what it knows of them."""
    config, state = uvicorn.Config(_answer, lifespan="off", log_config=None), ServerState()
    loop = asyncio.get_running_loop()
    return await loop.create_server(lambda: kind(config, state, {}), sock=listener), state


class OneOfFew(Connection):
    """A connection of which there may be only four."""

    most = 4


def test_a_crowd_that_asks_for_nothing_keeps_nobody_out_and_does_not_grow() -> None:
    async def asked(listener: socket.socket) -> tuple[int, int]:
        server, state = await _listening(listener, OneOfFew)
        address = listener.getsockname()
        crowd = [await asyncio.open_connection(*address) for _ in range(3 * OneOfFew.most)]
        async with httpx.AsyncClient() as client:
            status = (await client.get(f"http://127.0.0.1:{address[1]}", timeout=60)).status_code
        held = len(state.connections)
        server.close()
        for connection in state.connections:
            connection.shutdown()
        await asyncio.gather(*(reader.read() for reader, _ in crowd), return_exceptions=True)
        for _, writer in crowd:
            writer.close()
        return status, held

    with socket.create_server(("127.0.0.1", 0)) as listener:
        status, held = asyncio.run(asked(listener))
    assert status == 200
    assert held <= OneOfFew.most


def _head(headers: int = 0, *, address: int = 1, value: int = 1, end: bytes = b"\r\n") -> bytes:
    lines = b"".join(b"x-%d: %s\r\n" % (number, b"v" * value) for number in range(headers))
    return b"GET /%s HTTP/1.1\r\nhost: 127.0.0.1\r\n%s%s" % (b"a" * address, lines, end)


CHUNKED = b"POST / HTTP/1.1\r\nhost: a\r\ntransfer-encoding: chunked\r\n\r\n"


@pytest.mark.parametrize(
    ("sent", "status"),
    [
        (_head(50, value=100), 200),
        (_head(300_000), 431),
        (_head(40, value=1000), 431),
        (_head(1, value=10 << 20, end=b""), 431),  # a header that never ends is told of by no parser
        (_head(address=10_000), 414),
        (_head(address=5 << 20), 414),
        (b"GET /" + b"a" * (5 << 20), 414),
        (CHUNKED + b"0\r\n" + b"x: y\r\n" * 1000, 431),
        (_head() + _head(101), 431),
    ],
)
def test_a_head_too_large_is_refused_before_anything_is_made_of_it(sent: bytes, status: int) -> None:
    """The client reads its answer also where it has not been able to send all."""

    async def answered(listener: socket.socket) -> bytes:
        server, state = await _listening(listener, Connection)
        reader, writer = await asyncio.open_connection(*listener.getsockname())
        writer.write(sent)
        answer = await asyncio.wait_for(reader.readline(), 60)
        assert all(len(one.headers) <= MOST_HEADERS + 1 for one in state.connections if isinstance(one, Connection))
        writer.transport.abort()
        server.close()
        while state.connections or state.tasks:
            await asyncio.sleep(0)
        return answer

    with socket.create_server(("127.0.0.1", 0)) as listener:
        assert int(asyncio.run(answered(listener)).split()[1]) == status


class _Transport(asyncio.Transport):
    """Keeps what is written to it."""

    def __init__(self) -> None:
        super().__init__({"peername": ("127.0.0.1", 1), "sockname": ("127.0.0.1", 2)})
        self.written = b""

    def write(self, data: bytes | bytearray | memoryview) -> None:
        self.written += bytes(data)

    def is_closing(self) -> bool:
        return False

    def close(self) -> None:
        pass

    def pause_reading(self) -> None:
        pass

    def resume_reading(self) -> None:
        pass


@pytest.mark.parametrize(
    ("begin", "pieces", "refused"),
    [
        (b"0\r\nx", [b"a" * 1000], True),
        (b"0\r\nx: a", [b"a" * 1000], True),
        (b"", [b"3e8\r\n" + b"a" * 500, b"a" * 500 + b"\r\n"], False),
    ],
    ids=["a trailer's name", "a trailer's value", "a body"],
)
def test_a_trailer_that_never_ends_is_refused_before_it_fills_the_memory_and_a_long_body_is_not(
    begin: bytes, pieces: list[bytes], refused: bool
) -> None:
    """Also after the answer: the parser keeps what follows the body, whether anybody reads that or not."""

    async def asked() -> bytes:
        config, state = uvicorn.Config(_answer, lifespan="off", log_config=None), ServerState()
        transport, connection = _Transport(), Connection(config, state, {})
        connection.connection_made(transport)
        connection.data_received(CHUNKED + begin)
        for piece in pieces * 100:
            connection.data_received(piece)
        connection.connection_lost(None)
        return transport.written

    assert (b" 431 " in asyncio.run(asked())) is refused


# ---- long computations, a few at a time for each caller


def test_a_caller_has_a_few_turns_and_another_one_as_many() -> None:
    async def turns() -> None:
        lanes, over, begun = Lanes(), asyncio.Event(), []

        async def ask(caller: str) -> None:
            async with lanes.turn(caller):
                begun.append(caller)
                await over.wait()

        greedy = [asyncio.create_task(ask("greedy")) for _ in range(of_lanes.AT_ONCE + MOST_WAITING)]
        await asyncio.sleep(0)
        with pytest.raises(ProblemError, match=f"{MOST_WAITING} requests of greedy wait") as refused:
            await ask("greedy")
        assert (refused.value.status, "Retry-After" in refused.value.headers) == (429, True)
        modest = asyncio.create_task(ask("modest"))
        await asyncio.sleep(0)
        assert begun == ["greedy"] * of_lanes.AT_ONCE + ["modest"]
        greedy[-1].cancel()  # a client that goes away keeps no place
        over.set()
        await asyncio.gather(*greedy[:-1], modest)
        assert begun.count("greedy") == of_lanes.AT_ONCE + MOST_WAITING - 1

    asyncio.run(turns())


def test_nobody_waits_for_ever() -> None:
    async def turns() -> None:
        lanes = Lanes(wait_at_most=0.001)
        async with lanes.turn("anna"), lanes.turn("anna"):
            with pytest.raises(ProblemError, match="have waited for their turn"):
                async with lanes.turn("anna"):
                    raise AssertionError("there is no turn left")
        async with lanes.turn("anna"):
            pass

    asyncio.run(turns())


def test_a_long_motion_is_the_same_wherever_it_is_worked_out() -> None:
    spec = ExperimentSpec(trajectory=Sine(amplitude=0.1, period=2.0, cycles=40), joints=(1, 2), repeats=2)
    order = WorkOutMotion(spec=spec, machine=load_machine("ma2000"), most_shown=500)
    with closing(Workers(Limits(memory=1 << 30, seconds=60.0), 1)) as workers:
        answer = workers.ask(order)
        wrong = workers.ask(order.model_copy(update={"spec": spec.model_copy(update={"repeats": 1000})}))
    assert MotionPreview.model_validate(answer.data) == preview_of(order.spec, order.machine, order.most_shown)
    assert "longer than" in wrong.problem or "allowed" in wrong.problem


# ---- many questions at once, which hold up no stop


LIST = "/api/v1/robots/ma2000/experiments"


def _scope(method: str = "GET", path: str = LIST, query: bytes = b"") -> dict[str, Any]:
    return {"method": method, "path": path, "query_string": query}


async def _sent(_message: Message) -> None:
    pass


async def _takes(turns: Turns, **scope: Any) -> asyncio.Task[Turn]:
    """A request that has gone as far as it can."""
    task = asyncio.create_task(turns.taken(_scope(**scope), _sent))
    await asyncio.sleep(0)
    return task


def test_a_question_waits_while_others_are_worked_out_and_no_longer_than_their_answers_begin() -> None:
    async def ask() -> None:
        turns = Turns()
        first = [(await _takes(turns)).result() for _ in range(AT_ONCE)]
        waiting = await _takes(turns)
        assert not waiting.done()
        await first[0].send({"type": "http.response.start", "status": 200})
        await first[0].send({"type": "http.response.body", "body": b""})
        (await waiting).end()
        first[1].end()
        first[1].end()  # of one that fails after it has begun to answer
        for _ in range(2):
            assert (await _takes(turns)).done()
        assert not (await _takes(turns)).done()

    asyncio.run(ask())


@pytest.mark.parametrize(
    ("scope", "takes_a_turn"),
    [
        ({"method": "POST", "path": "/api/v1/robots/ma2000/stop"}, False),
        ({"method": "PUT", "path": "/api/v1/robots/ma2000/control"}, False),
        ({"path": f"{LIST}/a", "query": b"wait=30"}, False),
        ({"path": "/api/v1/robots/ma2000/jobs/a", "query": b"x=y&w%61it=0.5"}, False),
        ({"path": "/readyz"}, False),  # anybody asks it, and it waits for the database
        ({"path": "/api/v1/robots/ma2000/gains"}, False),
        ({"query": b"wait=30"}, True),  # these only look as if they waited
        ({"query": b"x=wait=30"}, True),
        ({"path": f"{LIST}/a", "query": b"wait=0"}, True),
        ({"path": f"{LIST}/a", "query": b"x=wait=30"}, True),
        ({"path": f"{LIST}/a", "query": b"wait=long"}, True),
        ({"path": "/api/v1/robots/ma2000/traces/a", "query": b"wait=30"}, True),
    ],
)
def test_what_is_no_plain_question_waits_for_none(scope: dict[str, Any], takes_a_turn: bool) -> None:
    async def ask() -> None:
        turns = Turns()
        for _ in range(AT_ONCE):
            assert (await _takes(turns, **scope if takes_a_turn else {})).done()
        for _ in range(2 * AT_ONCE):
            assert (await _takes(turns, **scope)).done() is not takes_a_turn

    asyncio.run(ask())


def test_a_question_that_is_given_up_takes_no_turn() -> None:
    async def ask() -> None:
        turns = Turns()
        first = [(await _takes(turns)).result() for _ in range(AT_ONCE)]
        (await _takes(turns)).cancel()
        waiting = await _takes(turns)
        first[0].end()
        assert await waiting

    asyncio.run(ask())


# ---- files that connections leave for stops


@pytest.mark.parametrize(
    ("limit", "most"), [(64, 16), (1024, 496), (4096, 500), (20, 4), (resource.RLIM_INFINITY, 500)]
)
def test_connections_leave_files_for_stops(monkeypatch: pytest.MonkeyPatch, limit: int, most: int) -> None:
    set_to: list[tuple[int, int]] = []
    monkeypatch.setattr(resource, "getrlimit", lambda _: (16, limit))
    monkeypatch.setattr(resource, "setrlimit", lambda _, both: set_to.append(both))
    assert most_connections(500) == most
    assert set_to == [(limit, limit)]
    assert limit in (20, resource.RLIM_INFINITY) or limit - most >= RESERVED
