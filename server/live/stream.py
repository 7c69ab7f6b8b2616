"""One WebSocket from its first message to its last."""

from __future__ import annotations

import asyncio
import logging
from contextlib import suppress

from fastapi import WebSocket, WebSocketDisconnect
from fastapi.concurrency import run_in_threadpool
from pydantic import ValidationError

from daq.contracts.errors import DaqError
from daq.contracts.service.live import JogCommand, LiveRequest, RefusedMessage, ThinnedMessage
from server.access.caller import Caller
from server.access.limits import Bucket
from server.live.hub import Client
from server.live.outbox import Outbox
from server.problems import ProblemError, field_of
from server.services import RobotServices

BASE_RATE = 50
WAITING_MESSAGES = 64
"""Messages of a client that may wait to be carried out: what holds a key sends ten a second (an assumption)."""
MESSAGES_A_SECOND, MESSAGES_AT_ONCE = 100.0, 500.0
"""Messages of a client in the long run, and in one go; one that sends more is sent away."""
NOT_ALLOWED = 1008
TOO_SLOW = 1013
"""Close code: try again later."""
GOING_AWAY = 1001
LOOK_EVERY = 1.0
"""s between two looks at whether a client that takes nothing is to be dropped."""
ADVICE = "docs/service.md tells what this socket takes"
log = logging.getLogger("server.live")
Heard = tuple[str | None, float]
"""A message's text, None where it is bytes, and when it arrived (s, monotonic)."""


async def stream(socket: WebSocket, one: RobotServices, who: Caller) -> None:
    """Serves one client until it goes, or is dropped."""
    await socket.accept()
    client = Client(Outbox(one.robot.clock.monotonic()), who.name)
    one.hub.join(client)
    heard: asyncio.Queue[Heard] = asyncio.Queue(WAITING_MESSAGES)
    dropping = asyncio.create_task(_drop_if_hopeless(one, client))
    tasks = [
        dropping,
        asyncio.create_task(_send(socket, one, client)),
        asyncio.create_task(_receive(socket, one, client, heard)),
        asyncio.create_task(_carry_out(one, client, who, heard)),
    ]
    try:
        done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        for task in done:
            error = task.exception()
            if error is not None and not isinstance(error, WebSocketDisconnect):
                raise error
    finally:
        one.hub.leave(client)
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
    if dropping in done:
        one.hub.dropped += 1
        log.warning("live client %s took nothing for too long and was dropped", client.name)
        # Whoever reads nothing would not take the close either: the server ends the connection when this returns.
        with suppress(TimeoutError, WebSocketDisconnect):
            async with asyncio.timeout(LOOK_EVERY):
                await socket.close(TOO_SLOW, "this client read too slowly")


async def _send(socket: WebSocket, one: RobotServices, client: Client) -> None:
    clock = one.robot.clock
    while True:
        await client.something.wait()
        client.something.clear()
        messages = client.outbox.take(clock.monotonic())
        if not messages:
            continue
        if client.outbox.left_out:
            messages.append(ThinnedMessage(left_out=client.outbox.left_out).model_dump_json())
            client.outbox.left_out = 0
        head = f'{{"now":{clock.monotonic():.4f},"utc":{clock.utc().timestamp():.4f},"messages":['
        await socket.send_text(head + ",".join(messages) + "]}")


async def _receive(socket: WebSocket, one: RobotServices, client: Client, heard: asyncio.Queue[Heard]) -> None:
    """Waits for nothing but the client: the moment of a message is that of its arrival, whatever the one before it
    waits for."""
    clock = one.robot.clock
    room = Bucket(MESSAGES_A_SECOND, MESSAGES_AT_ONCE, MESSAGES_AT_ONCE, clock.monotonic())
    while True:
        message = await socket.receive()
        if message["type"] == "websocket.disconnect":
            return
        if room.take(clock.monotonic()) > 0:
            log.warning("live client %s sends too many messages and was sent away", client.name)
            await socket.close(NOT_ALLOWED, f"more than {MESSAGES_A_SECOND:g} messages a second")
            return
        try:
            heard.put_nowait((message.get("text"), one.robot.clock.monotonic()))
        except asyncio.QueueFull:
            _refuse(one, client, f"{WAITING_MESSAGES} messages wait already: this one is left out", "send fewer")


async def _carry_out(one: RobotServices, client: Client, who: Caller, heard: asyncio.Queue[Heard]) -> None:
    while True:
        text, said = await heard.get()
        if text is None:
            _refuse(one, client, "a message is text, not bytes", ADVICE)
            continue
        try:
            await _take(LiveRequest.model_validate_json(text), one, client, who, said)
        except ValidationError as error:
            first = error.errors()[0]
            where = field_of(first["loc"]) if first["loc"] else "message"
            _refuse(one, client, f"{where}: {first['msg']}", ADVICE)
        except ProblemError as error:
            _refuse(one, client, error.detail, error.advice)
        except DaqError as error:
            _refuse(one, client, str(error), "")


async def _take(request: LiveRequest, one: RobotServices, client: Client, who: Caller, said: float) -> None:
    now = one.robot.clock.monotonic()
    if request.rate is not None:
        client.every = BASE_RATE // request.rate
    fresh = set(request.subscribe) - client.topics
    client.topics = (client.topics | set(request.subscribe)) - set(request.unsubscribe)
    for message in one.hub.shown(fresh & client.topics):
        client.outbox.put(message, now)
    if request.history is not None:
        async with one.hub.looking_back:
            past = await run_in_threadpool(_past, one, now - request.history, request.points)
        client.outbox.put(past, now)
    if client.outbox:
        client.something.set()
    if request.jog is not None:
        await run_in_threadpool(_jog, request.jog, one, who, said)


def _past(one: RobotServices, begin: float, points: int) -> str:
    return one.hub.history.since(begin, points).model_dump_json()


def _jog(command: JogCommand, one: RobotServices, who: Caller, said: float) -> None:
    if not who.may_operate:
        raise ProblemError(403, "operator-needed", f"{who.name} may look only", "ask for the role operator")
    one.require_motion(command.lease)
    one.teaching.jog(dict(command.velocities), said)


def _refuse(one: RobotServices, client: Client, detail: str, advice: str) -> None:
    message = RefusedMessage(detail=detail, advice=advice)
    client.outbox.put(message.model_dump_json(), one.robot.clock.monotonic())
    client.something.set()


async def _drop_if_hopeless(one: RobotServices, client: Client) -> None:
    """Returns when the client is to be dropped."""
    while not client.outbox.is_hopeless(one.robot.clock.monotonic()):
        await asyncio.sleep(LOOK_EVERY)
