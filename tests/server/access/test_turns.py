"""Many questions at once are worked out a few at a time, and hold up no stop."""

import asyncio
from typing import Any

import pytest
from starlette.types import Message

from server.access.gate import AT_ONCE, Turn, Turns

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
    "scope",
    [
        {"method": "POST", "path": "/api/v1/robots/ma2000/stop"},
        {"method": "PUT", "path": "/api/v1/robots/ma2000/control"},
        {"path": f"{LIST}/a", "query": b"wait=30"},
        {"path": "/api/v1/robots/ma2000/jobs/a", "query": b"x=y&w%61it=0.5"},
        {"path": "/readyz"},  # anybody asks it, and it waits for the database
        {"path": "/api/v1/robots/ma2000/gains"},
    ],
)
def test_what_is_no_plain_question_waits_for_none(scope: dict[str, Any]) -> None:
    async def ask() -> None:
        turns = Turns()
        for _ in range(AT_ONCE):
            await _takes(turns)
        for _ in range(2 * AT_ONCE):
            assert (await _takes(turns, **scope)).done()

    asyncio.run(ask())


@pytest.mark.parametrize(
    "scope",
    [
        {"query": b"wait=30"},
        {"query": b"x=wait=30"},
        {"path": f"{LIST}/a", "query": b"wait=0"},
        {"path": f"{LIST}/a", "query": b"x=wait=30"},
        {"path": f"{LIST}/a", "query": b"wait=long"},
        {"path": "/api/v1/robots/ma2000/traces/a", "query": b"wait=30"},
    ],
)
def test_what_only_looks_as_if_it_waits_takes_a_turn(scope: dict[str, Any]) -> None:
    async def ask() -> None:
        turns = Turns()
        for _ in range(AT_ONCE):
            assert (await _takes(turns, **scope)).done()
        assert not (await _takes(turns, **scope)).done()

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
