"""Connections that ask for nothing, and what they may take from whoever asks."""

from __future__ import annotations

import asyncio
import socket

import httpx
import pytest
import uvicorn
from starlette.types import Receive, Scope, Send
from uvicorn.server import ServerState

from server.connections import Connection

MOST = 4


async def _answer(scope: Scope, receive: Receive, send: Send) -> None:
    await send({"type": "http.response.start", "status": 200, "headers": [(b"content-length", b"0")]})
    await send({"type": "http.response.body", "body": b""})


def test_a_crowd_that_asks_for_nothing_keeps_nobody_out_and_does_not_grow(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("server.connections.MOST_CONNECTIONS", MOST)

    async def asked(listener: socket.socket) -> tuple[int, int]:
        config, state = uvicorn.Config(_answer, lifespan="off", log_config=None), ServerState()
        loop, address = asyncio.get_running_loop(), listener.getsockname()
        server = await loop.create_server(lambda: Connection(config, state, {}), sock=listener)
        crowd = [await asyncio.open_connection(*address) for _ in range(3 * MOST)]
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
    assert held <= MOST
