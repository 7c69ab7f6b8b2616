"""When the hub hands messages to clients: at once to a few, with the next sample to many, and at an end."""

import asyncio

from daq.contracts.service.robot import RobotStatus
from server.live.history import History
from server.live.hub import Hub
from server.live.waiting import when_ended
from tests.server.clocks import HandClock


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
