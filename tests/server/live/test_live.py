"""The live stream: through a real WebSocket, and its rules for slow clients without one."""

import asyncio
import json
from contextlib import ExitStack
from types import SimpleNamespace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect
from websockets.typing import Origin

from daq.owner.messages import LiveSample
from server.access.caller import LOCAL
from server.access.gate import MOST_SOCKETS
from server.api.stream import stream
from server.live.history import History
from server.live.hub import Hub
from server.live.outbox import DROP_AFTER, THIN_AFTER, THIN_BEYOND, Outbox
from tests.server.clocks import HandClock
from tests.server.live.watching import frames, messages, watching
from tests.server.polling import reset
from tests.server.service import Service


def test_samples_come_one_a_period_and_say_how_old_they_are(service: Service) -> None:
    with watching(service, subscribe=["samples"]) as socket:
        ticks = []
        for frame in frames(socket):
            for message in frame.messages:
                assert message.topic == "sample"
                assert 0 <= frame.now - message.host_time < 60
                assert len(message.position) == len(message.joints) == 6
                ticks.append(message.tick)
            if len(ticks) > 20:
                break
    assert ticks == list(range(ticks[0], ticks[0] + len(ticks)))


def test_a_client_that_joins_finds_history_status_and_queue(service: Service) -> None:
    with watching(service, subscribe=["robot", "queue", "link"], history=60, points=50) as socket:
        found: dict[str, Any] = {}
        for frame in frames(socket):
            found |= {message.topic: message for message in frame.messages}
            if {"robot", "queue", "link", "history"} <= set(found):
                break
    assert found["robot"].arm == "idle"
    assert found["queue"].status.paused is False
    assert len(found["history"].tick) == len(found["history"].position[0]) <= 50


def test_an_experiment_is_told_from_the_queue_to_its_end(service: Service) -> None:
    spec = {
        "trajectory": {"kind": "ramp", "amplitude": 0.05, "duration": 0.2},
        "joints": [1],
        "settle": 0.1,
        "hold": 0.1,
    }
    with watching(service, subscribe=["events", "queue", "robot"]) as socket:
        made = service.robot.post("/experiments", json={"spec": spec}).json()
        told, marks, activities, fractions = [], [], set(), []
        for frame in frames(socket):
            for message in frame.messages:
                if message.topic == "event" and message.event.experiment == made["id"]:
                    told.append(message.event.text)
                elif message.topic == "record_event":
                    marks.append(message.kind)
                elif message.topic == "robot":
                    activities.add(message.activity)
                elif message.topic == "progress":
                    assert message.experiment == made["id"]
                    fractions.append(message.fraction)
            if len(told) == 3:
                break
    assert told == ["queued", "started", "completed"]
    assert {"start", "ramp_start", "ramp_end", "end"} <= set(marks)
    assert fractions == sorted(fractions)


def test_what_is_not_understood_is_refused_in_one_line_and_the_stream_goes_on(service: Service) -> None:
    with watching(service, subscribe=["robot"]) as socket:
        for text in ("{", "[]", b"{}", b"\xff", '{"subscribe":["everything"]}', '{"rate":7}', '{"shell":"ls"}'):
            socket.send(text)
            refused = next(messages(socket, "refused"))
            assert refused.detail
        socket.send('{"jog": {"lease": "no lease", "velocities": {"9": 0.1}}}')
        assert next(messages(socket, "refused")).detail.startswith("jog.velocities.9: ")
        socket.send('{"history":1}')
        assert next(messages(socket, "history"))


def test_a_flood_of_messages_ends_its_own_stream_alone(service: Service) -> None:
    with watching(service, subscribe=["robot"]) as other, watching(service, subscribe=["robot"]) as socket:
        with pytest.raises(ConnectionClosed) as ended:  # noqa: PT012 - whichever of them meets the end
            for _ in range(20_000):
                socket.send("{}")
            while True:
                socket.recv(60)
        assert ended.value.rcvd is not None
        assert (ended.value.rcvd.code, "messages a second" in ended.value.rcvd.reason) == (1008, True)
        other.send('{"history":1}')
        assert next(messages(other, "history"))


def test_a_crowd_of_sockets_leaves_room_for_everybody_else(service: Service) -> None:
    url = f"{service.url.replace('http', 'ws', 1)}/api/v1/robots/ma2000/live"
    with ExitStack() as opened:
        for _ in range(MOST_SOCKETS):
            opened.enter_context(connect(url, open_timeout=60, close_timeout=10))
        with pytest.raises(InvalidStatus) as refused:
            connect(url, open_timeout=60)
        assert refused.value.response.status_code == 403
        assert service.robot.post("/stop").json()["confirmed"]
    reset(service.robot)


@pytest.mark.parametrize("origin", ["http://attacker.example", "null", "http://127.0.0.1:1", "https://127.0.0.1"])
def test_a_page_of_another_origin_watches_nothing(service: Service, origin: str) -> None:
    url = f"{service.url.replace('http', 'ws', 1)}/api/v1/robots/ma2000/live"
    with pytest.raises(InvalidStatus) as refused:
        connect(url, origin=Origin(origin), open_timeout=60)
    assert refused.value.response.status_code == 403


def test_jogging_through_the_stream_needs_the_control(service: Service) -> None:
    with watching(service, subscribe=["robot"]) as socket:
        socket.send(json.dumps({"jog": {"lease": "no lease", "velocities": {"1": 0.1}}}))
        assert "no longer have control" in next(messages(socket, "refused")).detail
        lease = service.robot.post("/control", json={}).json()["lease"]
        try:
            socket.send(json.dumps({"jog": {"lease": lease, "velocities": {"1": 0.1}}}))
            assert any(message.activity == "jog" for message in messages(socket, "robot"))
        finally:
            service.robot.delete("/control", headers={"Control-Lease": lease})


# ---- slow clients, without a server


@given(st.lists(st.booleans(), max_size=600))
def test_only_samples_are_left_out_and_order_is_kept(kinds: list[bool]) -> None:
    outbox = Outbox(0.0)
    outbox.put("", 0.0)
    kinds.insert(0, False)
    for number, is_sample in enumerate(kinds[1:], 1):
        outbox.put(str(number), THIN_AFTER, sample=is_sample)
    taken = [int(message or 0) for message in outbox.take(THIN_AFTER)]
    assert taken == sorted(taken)
    assert {number for number, is_sample in enumerate(kinds) if not is_sample} <= set(taken)
    assert sum(kinds[number] for number in taken) <= THIN_BEYOND
    assert len(taken) + outbox.left_out == len(kinds)


def test_a_hiccup_of_the_service_leaves_nothing_out() -> None:
    outbox = Outbox(0.0)
    for number in range(3 * THIN_BEYOND):
        outbox.put(str(number), 5.0, sample=True)
    assert (len(outbox.take(5.0)), outbox.left_out) == (3 * THIN_BEYOND, 0)


def test_a_client_that_takes_nothing_is_hopeless_and_one_that_waits_for_news_is_not() -> None:
    outbox = Outbox(0.0)
    assert not outbox.is_hopeless(1000.0)
    outbox.put("something", 1000.0)
    assert not outbox.is_hopeless(1000.0 + DROP_AFTER)
    assert outbox.is_hopeless(1000.1 + DROP_AFTER)
    outbox.take(1000.2 + DROP_AFTER)
    assert not outbox.is_hopeless(2000.0)


def test_a_client_that_does_not_take_its_dismissal_either_is_dropped_without_a_fault() -> None:
    clock = HandClock()

    async def never(*_: object) -> None:
        await asyncio.Event().wait()

    async def dropped() -> tuple[int, int]:
        hub = Hub(clock, History(6, 0.02, 1.0), lambda: pytest.fail("nobody asks for it"))
        socket = SimpleNamespace(accept=lambda: asyncio.sleep(0), receive=never, send_text=never, close=never)
        one = SimpleNamespace(robot=SimpleNamespace(clock=clock), hub=hub)
        serving = asyncio.create_task(stream(socket, one, LOCAL, look_every=0.001))  # type: ignore[arg-type]
        while hub.clients == 0:
            await asyncio.sleep(0)
        (client,) = hub._clients
        client.outbox.put("news", clock.monotonic())
        clock.turn(DROP_AFTER + 1)
        await serving
        return hub.dropped, hub.clients

    assert asyncio.run(dropped()) == (1, 0)


def _sample(tick: int, value: float) -> LiveSample:
    six = (value,) * 6
    return LiveSample(
        tick=tick,
        host_time=tick * 0.02,
        joints=(1, 2, 3, 4, 5, 6),
        set_point=six,
        position=six,
        error=six,
        drive=six,
        status=0,
        lateness=0.0,
    )


@given(st.integers(1, 150), st.integers(10, 40))
def test_history_keeps_the_newest_and_every_extreme(count: int, points: int) -> None:
    history = History(joints=6, period=0.02, seconds=1.5)
    for tick in range(count):
        history.add(_sample(tick, 1.0 if tick == count - 2 else 0.0))
    found = history.since(0.0, points)
    assert len(found.tick) <= max(points, 2)
    assert found.tick[-1] == count - 1
    assert list(found.tick) == sorted(found.tick)
    if count >= 2:
        assert max(value for value in found.position[0] if value is not None) == 1.0


def test_joints_that_were_not_sampled_have_no_value_in_history() -> None:
    history = History(joints=6, period=0.02, seconds=4.0)
    signals = dict.fromkeys(("set_point", "position", "error", "drive"), (0.5,))
    history.add(_sample(1, 0.5).model_copy(update={"joints": (2,), **signals}))
    found = history.since(0.0, 100)
    assert found.position[0] == (None,)
    assert found.position[1] == (0.5,)
