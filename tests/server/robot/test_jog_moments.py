"""When a jog command was said: the moment at which it arrived, whatever it had to wait for in the service."""

import asyncio
import threading
import time
from types import SimpleNamespace
from typing import Any, cast

import anyio.to_thread
import httpx

from daq.contracts.service.teaching import TeachingStatus
from server.access.caller import LOCAL
from server.access.gate import Gate
from server.api.stream import WAITING_MESSAGES, _carry_out, _receive
from server.app import bare_app
from server.live.hub import Client
from server.live.outbox import Outbox
from tests.server.clocks import HandClock

JOG = '{"jog": {"lease": "mine", "velocities": {"1": 0.1}}}'
WITHIN = 60.0
"""s after which a test has failed."""


class Teaching:
    """Keeps when commands were said; the first of them is carried out only when it is let go."""

    def __init__(self) -> None:
        self.said: list[float] = []
        self.begun, self.let_go, self.second = threading.Event(), threading.Event(), threading.Event()

    def jog(self, _velocities: dict[int, float], said: float) -> None:
        self.said.append(said)
        if self.begun.is_set():
            self.second.set()
            return
        self.begun.set()
        self.let_go.wait(WITHIN)

    def status(self) -> TeachingStatus:
        return TeachingStatus(activity="jog")


class Socket:
    """A client that says what it is to say, then goes."""

    def __init__(self, *says: Any) -> None:
        self.says = iter(says)

    async def receive(self) -> dict[str, str]:
        for say in self.says:
            text = await say()
            return {"type": "websocket.receive", "text": text}
        return {"type": "websocket.disconnect"}


def test_over_the_socket_it_is_not_that_at_which_the_command_before_it_was_done() -> None:
    clock, teaching = HandClock(), Teaching()
    one = cast(
        Any,
        SimpleNamespace(
            robot=SimpleNamespace(clock=clock, name="ma2000"),
            teaching=teaching,
            require_motion=lambda _lease: None,
            hub=SimpleNamespace(shown=lambda _topics: []),
            jogged=lambda _note: None,
        ),
    )

    async def first() -> str:
        return JOG

    async def second() -> str:
        await asyncio.to_thread(teaching.begun.wait, WITHIN)
        clock.turn(0.1)
        return JOG

    async def let_go_of_the_key_long_ago() -> str:
        clock.turn(5.0)
        teaching.let_go.set()
        await asyncio.to_thread(teaching.second.wait, WITHIN)
        return "{}"

    async def served() -> None:
        client, heard = Client(Outbox(clock.monotonic()), "anna"), asyncio.Queue[Any](WAITING_MESSAGES)
        carrying_out = asyncio.create_task(_carry_out(one, client, LOCAL, "127.0.0.1", heard))
        await _receive(cast(Any, Socket(first, second, let_go_of_the_key_long_ago)), one, client, heard)
        carrying_out.cancel()

    begun = clock.monotonic()
    asyncio.run(served())
    assert teaching.said == [begun, begun + 0.1]


def test_messages_beyond_those_that_may_wait_are_refused_and_not_kept_from_the_clock() -> None:
    clock = HandClock()
    one = cast(Any, SimpleNamespace(robot=SimpleNamespace(clock=clock)))

    async def anything() -> str:
        return "{}"

    async def served() -> Client:
        client, heard = Client(Outbox(clock.monotonic()), "anna"), asyncio.Queue[Any](1)
        await _receive(cast(Any, Socket(anything, anything)), one, client, heard)
        assert heard.qsize() == 1
        return client

    (refused,) = asyncio.run(served()).outbox.take(clock.monotonic())
    assert "left out" in refused


def test_over_rest_it_is_not_that_at_which_a_thread_was_free() -> None:
    teaching = Teaching()
    teaching.let_go.set()
    one = SimpleNamespace(teaching=teaching, require_motion=lambda _lease: None)
    app = bare_app(None)
    app.state.services = SimpleNamespace(robot=lambda _name: one)
    gate = Gate(cast(Any, None), cast(Any, None), open_on_loopback=True)
    transport = httpx.ASGITransport(gate.middleware(app))

    async def asked() -> float:
        threads = anyio.to_thread.current_default_thread_limiter()
        threads.total_tokens = 1
        await threads.acquire()
        async with httpx.AsyncClient(transport=transport, base_url="http://127.0.0.1:8300") as client:
            path = "/api/v1/robots/ma2000/teaching/jog"
            answer = asyncio.create_task(client.post(path, json={"velocities": {"1": 0.1}}))
            while not threads.statistics().tasks_waiting:
                assert not answer.done(), answer.result().text
                await asyncio.sleep(0)
            freed = time.monotonic()
            threads.release()
            assert (await answer).status_code == 200
        return freed

    freed = asyncio.run(asked())
    assert len(teaching.said) == 1
    assert teaching.said[0] <= freed
