"""Serves one WebSocket."""

from __future__ import annotations

import asyncio
import logging
from contextlib import suppress

from fastapi import WebSocket, WebSocketDisconnect
from fastapi.concurrency import run_in_threadpool
from pydantic import ValidationError

from daq.contracts.errors import DaqError
from daq.contracts.service.audit import AuditNote, Outcome
from daq.contracts.service.live import JogCommand, LiveRequest, RefusedMessage, ThinnedMessage
from firmware_protocol.invalid import first_invalid
from server.access.caller import Caller
from server.access.limits import Bucket
from server.live.hub import Client
from server.live.outbox import Outbox
from server.problems import ProblemError, field_of
from server.robot_services import RobotServices

BASE_RATE = 50
WAITING_MESSAGES = 64
"""Most waiting messages of a client: while a key is held, a client sends ten per second (an assumption)."""
MESSAGES_A_SECOND, MESSAGES_AT_ONCE = 100.0, 500.0
"""Limits of a client's messages: sustained rate (1/s), and messages at once. A client above them is disconnected."""
NOT_ALLOWED = 1008
TOO_SLOW = 1013
"""Close code: try again later."""
LOOK_EVERY = 1.0
"""Time (s) between two checks whether a client that does not read must be dropped."""
ADVICE = "docs/service.md describes the messages of this socket"
log = logging.getLogger("server.live")
Heard = tuple[str | None, float]
"""A message's text (None if it is bytes), and its arrival time (s, monotonic)."""


async def stream(socket: WebSocket, rig: RobotServices, caller: Caller, look_every: float = LOOK_EVERY) -> None:
    """Serves one client until it leaves, or is dropped."""
    await socket.accept()
    client = Client(Outbox(rig.robot.clock.monotonic()), caller.name)
    rig.hub.join(client)
    address = getattr(socket, "client", None)
    origin = "unknown" if address is None else str(address.host)
    heard: asyncio.Queue[Heard] = asyncio.Queue(WAITING_MESSAGES)
    dropping = asyncio.create_task(_drop_if_hopeless(rig, client, look_every))
    tasks = [
        dropping,
        asyncio.create_task(_send(socket, rig, client)),
        asyncio.create_task(_receive(socket, rig, client, heard)),
        asyncio.create_task(_carry_out(rig, client, caller, origin, heard)),
    ]
    try:
        done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        for task in done:
            error = task.exception()
            if error is not None and not isinstance(error, WebSocketDisconnect):
                raise error
    finally:
        rig.hub.leave(client)
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
    if dropping in done:
        rig.hub.dropped += 1
        log.warning("live client %s took nothing for too long and was dropped", client.name)
        # A client that does not read does not read the close either; the server ends the connection when this returns.
        with suppress(TimeoutError, WebSocketDisconnect):
            async with asyncio.timeout(look_every):
                await socket.close(TOO_SLOW, "this client read too slowly")


async def _send(socket: WebSocket, rig: RobotServices, client: Client) -> None:
    clock = rig.robot.clock
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


async def _receive(socket: WebSocket, rig: RobotServices, client: Client, heard: asyncio.Queue[Heard]) -> None:
    """Receives messages and waits for nothing else, so that each gets its true arrival time even if the previous one
    waits."""
    clock = rig.robot.clock
    room = Bucket(MESSAGES_A_SECOND, MESSAGES_AT_ONCE, MESSAGES_AT_ONCE, clock.monotonic())
    while True:
        message = await socket.receive()
        if message["type"] == "websocket.disconnect":
            return
        if room.take(clock.monotonic()) > 0:
            log.warning("live client %s sends too many messages and was disconnected", client.name)
            await socket.close(NOT_ALLOWED, f"more than {MESSAGES_A_SECOND:g} messages a second")
            return
        try:
            heard.put_nowait((message.get("text"), rig.robot.clock.monotonic()))
        except asyncio.QueueFull:
            _refuse(rig, client, f"{WAITING_MESSAGES} messages wait already: this one is left out", "send fewer")


async def _carry_out(
    rig: RobotServices, client: Client, caller: Caller, origin: str, heard: asyncio.Queue[Heard]
) -> None:
    while True:
        text, said = await heard.get()
        if text is None:
            _refuse(rig, client, "a message is text, not bytes", ADVICE)
            continue
        try:
            await _take(LiveRequest.model_validate_json(text), rig, client, caller, origin, said)
        except ValidationError as error:
            first = first_invalid(error)
            where = field_of(first.place) if first.place else "message"
            _refuse(rig, client, f"{where}: {first.message}", ADVICE)
        except ProblemError as error:
            _refuse(rig, client, error.detail, error.advice)
        except DaqError as error:
            _refuse(rig, client, str(error), "")


async def _take(
    request: LiveRequest, rig: RobotServices, client: Client, caller: Caller, origin: str, said: float
) -> None:
    now = rig.robot.clock.monotonic()
    if request.rate is not None:
        client.every = BASE_RATE // request.rate
    fresh = set(request.subscribe) - client.topics
    client.topics = (client.topics | set(request.subscribe)) - set(request.unsubscribe)
    for message in rig.hub.shown(fresh & client.topics):
        client.outbox.put(message, now)
    if request.history is not None:
        async with rig.hub.looking_back:
            past = await run_in_threadpool(_past, rig, now - request.history, request.points)
        client.outbox.put(past, now)
    if client.outbox:
        client.something.set()
    if request.jog is not None:
        await run_in_threadpool(_noted_jog, request.jog, rig, caller, origin, said)


def _past(rig: RobotServices, begin: float, points: int) -> str:
    return rig.hub.history.since(begin, points).model_dump_json()


def _noted_jog(command: JogCommand, rig: RobotServices, caller: Caller, origin: str, said: float) -> None:
    """Jogs, and informs plug-ins who did."""
    outcome: Outcome = "done"
    detail = ""
    try:
        _jog(command, rig, caller, said)
    except (ProblemError, DaqError) as error:
        outcome, detail = "refused", str(error)
        raise
    finally:
        rig.jogged(
            AuditNote(
                at=rig.robot.clock.utc(),
                actor=caller.name,
                role=caller.role,
                origin=origin,
                action="jog_robot",
                request="a message of the live WebSocket",
                robot=rig.robot.name,
                outcome=outcome,
                detail=detail,
            )
        )


def _jog(command: JogCommand, rig: RobotServices, caller: Caller, said: float) -> None:
    if not caller.may_operate:
        raise ProblemError(403, "operator-needed", f"{caller.name} may look only", "ask for the role operator")
    rig.require_motion(command.lease)
    rig.teaching.jog(dict(command.velocities), said)


def _refuse(rig: RobotServices, client: Client, detail: str, advice: str) -> None:
    message = RefusedMessage(detail=detail, advice=advice)
    client.outbox.put(message.model_dump_json(), rig.robot.clock.monotonic())
    client.something.set()


async def _drop_if_hopeless(rig: RobotServices, client: Client, look_every: float) -> None:
    """Returns once the client must be dropped."""
    while not client.outbox.is_hopeless(rig.robot.clock.monotonic()):
        await asyncio.sleep(look_every)
