"""When the hub hands messages to clients: at once to a few, with the next sample to many, and at an end."""

import asyncio
from collections.abc import Awaitable, Callable

import pytest

from daq.contracts.service.live import TeachingMessage, Topic
from daq.contracts.service.robot import RobotStatus
from daq.owner.messages import LiveSample
from server.live.history import History
from server.live.hub import MANY, Client, Hub
from server.live.outbox import Outbox
from server.live.waiting import when_ended
from tests.server.clocks import HandClock

TOPICS: set[Topic] = {"samples", "teaching"}
SAMPLE = LiveSample(
    tick=1,
    host_time=0.0,
    joints=(1,),
    set_point=(0.0,),
    position=(0.0,),
    error=(0.0,),
    drive=(0.0,),
    status=0,
    lateness=0.0,
)


def _with_hub(watchers: int, do: Callable[[Hub, list[Client], Client], Awaitable[None]]) -> None:
    """With a number of watchers, and a request that waits for news."""

    async def all_of_it() -> None:
        hub = Hub(HandClock(), History(1, 0.02, 1.0), lambda: pytest.fail("nobody asks for it"))
        hub.open(lambda: None)
        clients = [Client(Outbox(0.0), str(number), TOPICS) for number in range(watchers)]
        waiting = Client(Outbox(0.0), "waits", TOPICS, watches=False)
        for one in (*clients, waiting):
            hub.join(one)
        await do(hub, clients, waiting)
        await hub.close()

    asyncio.run(all_of_it())


async def _after(hub: Hub, *texts: str) -> None:
    """Publishes messages, and lets the loop put them into the outboxes."""
    for text in texts:
        hub.publish("teaching", TeachingMessage(text=text))
    for _ in range(3):
        await asyncio.sleep(0)


def test_few_watchers_get_every_message_at_once() -> None:
    async def watch(hub: Hub, clients: list[Client], waiting: Client) -> None:
        await _after(hub, "one")
        assert all(client.something.is_set() for client in (*clients, waiting))

    _with_hub(MANY - 1, watch)


def test_many_watchers_get_messages_together_with_the_next_sample() -> None:
    async def watch(hub: Hub, clients: list[Client], waiting: Client) -> None:
        await _after(hub, "one", "two")
        assert not any(client.something.is_set() for client in clients)
        assert waiting.something.is_set(), "it does not watch: it waits for an end"
        hub.on_report(SAMPLE)
        await _after(hub)
        assert all(client.something.is_set() for client in clients)
        assert [len(client.outbox.take(0.0)) for client in clients] == [3] * MANY

    _with_hub(MANY, watch)


def test_many_watchers_get_messages_in_time_without_a_sample() -> None:
    async def watch(hub: Hub, clients: list[Client], _waiting: Client) -> None:
        for _ in range(2):
            await _after(hub, "one", "two")
            await asyncio.gather(*(client.something.wait() for client in clients))
            for client in clients:
                assert len(client.outbox.take(0.0)) == 2
                client.something.clear()

    _with_hub(MANY, watch)


def _no_status() -> RobotStatus:
    raise AssertionError("nobody asks for it")


def test_whoever_waits_is_answered_when_the_service_ends() -> None:
    async def waited() -> list[str]:
        hub, looked = Hub(HandClock(), History(6, 0.02, 1.0), _no_status), asyncio.Event()
        loop = asyncio.get_running_loop()

        def look() -> str:
            loop.call_soon_threadsafe(looked.set)
            return "running"

        def is_done(state: str) -> bool:
            return state == "done"

        begun = asyncio.create_task(when_ended(hub, {"jobs"}, look, is_done, 3600.0))
        await looked.wait()
        assert hub.clients == 0  # nobody watches
        hub.end_waiting()
        return [await begun, await when_ended(hub, {"jobs"}, look, is_done, 3600.0)]

    assert asyncio.run(waited()) == ["running", "running"]
