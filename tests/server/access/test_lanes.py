"""Whoever asks for much waits for themselves, and for nobody else."""

import asyncio

import pytest

from daq.contracts.experiment import ExperimentSpec, Sine
from daq.contracts.machine import load_machine
from daq.contracts.service.experiments import MotionPreview
from server.access.lanes import AT_ONCE, MOST_WAITING, Lanes
from server.bounded.messages import Limits, WorkOutMotion
from server.bounded.motion import preview_of
from server.bounded.workers import Workers
from server.problems import ProblemError


def test_a_caller_has_a_few_turns_and_another_one_as_many() -> None:
    async def turns() -> None:
        lanes, over, begun = Lanes(), asyncio.Event(), []

        async def ask(caller: str) -> None:
            async with lanes.turn(caller):
                begun.append(caller)
                await over.wait()

        greedy = [asyncio.create_task(ask("greedy")) for _ in range(AT_ONCE + MOST_WAITING)]
        await asyncio.sleep(0)
        with pytest.raises(ProblemError, match=f"{MOST_WAITING} requests of greedy wait") as refused:
            await ask("greedy")
        assert (refused.value.status, "Retry-After" in refused.value.headers) == (429, True)
        modest = asyncio.create_task(ask("modest"))
        await asyncio.sleep(0)
        assert begun == ["greedy"] * AT_ONCE + ["modest"]
        greedy[-1].cancel()  # a client that goes away keeps no place
        over.set()
        await asyncio.gather(*greedy[:-1], modest)
        assert begun.count("greedy") == AT_ONCE + MOST_WAITING - 1

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
    workers = Workers(Limits(memory=1 << 30, seconds=60.0), 1)
    answer = workers.ask(order)
    wrong = workers.ask(order.model_copy(update={"spec": spec.model_copy(update={"repeats": 1000})}))
    workers.close()
    assert MotionPreview.model_validate(answer.data) == preview_of(order)
    assert "longer than" in wrong.problem or "allowed" in wrong.problem
