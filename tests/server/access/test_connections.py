"""Connections that ask for nothing, and what they may take from whoever asks."""

import asyncio
import socket

import httpx
import pytest
import uvicorn
from starlette.types import Receive, Scope, Send
from uvicorn.server import ServerState

from server.access.connections import MOST_HEADERS, Connection


async def _answer(scope: Scope, receive: Receive, send: Send) -> None:
    await send({"type": "http.response.start", "status": 200, "headers": [(b"content-length", b"0")]})
    await send({"type": "http.response.body", "body": b""})


class OneOfFew(Connection):
    """A connection of which there may be only four."""

    most = 4


def test_a_crowd_that_asks_for_nothing_keeps_nobody_out_and_does_not_grow() -> None:
    async def asked(listener: socket.socket) -> tuple[int, int]:
        config, state = uvicorn.Config(_answer, lifespan="off", log_config=None), ServerState()
        loop, address = asyncio.get_running_loop(), listener.getsockname()
        server = await loop.create_server(lambda: OneOfFew(config, state, {}), sock=listener)
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


def _head(headers: int = 0, *, address: int = 1, value: int = 1, end: bytes = b"\r\n") -> bytes:
    lines = b"".join(b"x-%d: %s\r\n" % (number, b"v" * value) for number in range(headers))
    return b"GET /%s HTTP/1.1\r\nhost: 127.0.0.1\r\n%s%s" % (b"a" * address, lines, end)


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
        (b"POST / HTTP/1.1\r\nhost: a\r\ntransfer-encoding: chunked\r\n\r\n0\r\n" + b"x: y\r\n" * 1000, 431),
        (_head() + _head(101), 431),
    ],
)
def test_a_head_too_large_is_refused_before_anything_is_made_of_it(sent: bytes, status: int) -> None:
    """The client reads its answer also where it has not been able to send all."""

    async def answered(listener: socket.socket) -> bytes:
        config, state = uvicorn.Config(_answer, lifespan="off", log_config=None), ServerState()
        loop, address = asyncio.get_running_loop(), listener.getsockname()
        server = await loop.create_server(lambda: Connection(config, state, {}), sock=listener)
        reader, writer = await asyncio.open_connection(*address)
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


@pytest.mark.parametrize("trailer", [b"x", b"x: a"], ids=["name", "value"])
def test_a_trailer_that_never_ends_is_refused_before_it_fills_the_memory(trailer: bytes) -> None:
    """Also after the answer: the parser keeps what follows the body, whether anybody reads that or not."""
    head = b"POST / HTTP/1.1\r\nhost: a\r\ntransfer-encoding: chunked\r\n\r\n0\r\n"

    async def asked() -> bytes:
        config, state = uvicorn.Config(_answer, lifespan="off", log_config=None), ServerState()
        transport, connection = _Transport(), Connection(config, state, {})
        connection.connection_made(transport)
        connection.data_received(head + trailer)
        for _ in range(100):
            connection.data_received(b"a" * 1000)
        connection.connection_lost(None)
        return transport.written

    assert b" 431 " in asyncio.run(asked())


def test_a_body_of_any_length_is_none_of_the_head() -> None:
    async def asked() -> bytes:
        config, state = uvicorn.Config(_answer, lifespan="off", log_config=None), ServerState()
        transport, connection = _Transport(), Connection(config, state, {})
        connection.connection_made(transport)
        connection.data_received(b"POST / HTTP/1.1\r\nhost: a\r\ntransfer-encoding: chunked\r\n\r\n")
        for _ in range(100):
            connection.data_received(b"3e8\r\n" + b"a" * 500)
            connection.data_received(b"a" * 500 + b"\r\n")
        connection.connection_lost(None)
        return transport.written

    assert b" 431 " not in asyncio.run(asked())
