"""Clients of a service: WebSockets that watch, and plain GETs at a steady rate.

They run in two processes, so that the watchers' processing of samples does not count as the service's time to answer.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import multiprocessing
import os
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from multiprocessing.connection import Connection
from urllib.parse import urlsplit

import websockets

CONNECTIONS = 8
"""Connections kept open for the GETs; one that waits for an answer is not reused."""
SUBSCRIBED = ["samples", "robot", "queue", "jobs", "events"]


@dataclass
class Seen:
    """Observations of the clients. Times in s."""

    latencies: list[float] = field(default_factory=list)
    """Latency of every GET from the time when it was due, so that waiting for a free connection counts."""
    own_lateness: list[float] = field(default_factory=list)
    """Lateness of the clients' own timer, which shares the cores with the measured programs."""
    refused: int = 0
    watchers: int = 0
    """Number of watchers that have received their history."""
    joining: float = 0.0
    """Time (s) until all watchers, having joined at once, had it."""
    samples: int = 0
    samples_missed: int = 0
    ended_early: int = 0


@dataclass
class _HttpLine:
    """One connection that stays open: a minimal client, since it shares the cores with the service."""

    reader: asyncio.StreamReader
    writer: asyncio.StreamWriter

    async def get(self, host: str, path: str) -> int:
        """Returns the status of the answer, when all of it has come."""
        self.writer.write(f"GET {path} HTTP/1.1\r\nHost: {host}\r\n\r\n".encode())
        head = (await self.reader.readuntil(b"\r\n\r\n")).decode("latin-1").lower()
        length = head.partition("content-length:")[2].partition("\r\n")[0]
        if length.strip():
            await self.reader.readexactly(int(length))
        return int(head.split(" ", 2)[1])


async def _get_steadily(host: str, paths: Sequence[str], rate: float, seen: Seen, over: asyncio.Event) -> None:
    name, _, port = host.partition(":")
    free: asyncio.Queue[_HttpLine] = asyncio.Queue()
    for _ in range(CONNECTIONS):
        free.put_nowait(_HttpLine(*await asyncio.open_connection(name, int(port))))

    async def get(path: str, due: float) -> None:
        line = await free.get()
        status = await line.get(host, path)
        seen.latencies.append(time.monotonic() - due)
        seen.refused += status != 200
        free.put_nowait(line)

    begun, number = time.monotonic(), 0
    async with asyncio.TaskGroup() as under_way:
        while not over.is_set():
            due = begun + number / rate
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(max(0.0, due - time.monotonic())):
                    await over.wait()
            now = time.monotonic()
            seen.own_lateness.append(now - due)
            under_way.create_task(get(paths[number % len(paths)], now))
            number += 1
    while not free.empty():
        free.get_nowait().writer.close()


async def _watch(url: str, seen: Seen) -> None:
    last: int | None = None
    async with websockets.connect(url, compression=None, open_timeout=60) as socket:
        await socket.send(json.dumps({"subscribe": SUBSCRIBED, "history": 60}))
        async for frame in socket:
            for message in json.loads(frame)["messages"]:
                seen.watchers += message["topic"] == "history"
                if message["topic"] != "sample":
                    continue
                seen.samples += 1
                if last is not None:
                    seen.samples_missed += message["tick"] - last - 1
                last = message["tick"]
    seen.ended_early += 1


async def _all(url: str, live: str, watchers: int, paths: Sequence[str], rate: float, parent: Connection) -> Seen:
    seen, over = Seen(), asyncio.Event()
    loop = asyncio.get_running_loop()

    def told() -> None:
        try:
            word = parent.recv()
        except EOFError:  # the measuring process was killed
            word = "end"
        if word == "end":
            loop.remove_reader(parent.fileno())
            over.set()
        else:
            seen.latencies.clear()
            seen.own_lateness.clear()

    async with asyncio.TaskGroup() as clients:
        begun = time.monotonic()
        watching = [clients.create_task(_watch(live, seen)) for _ in range(watchers)]
        while seen.watchers < watchers:
            await asyncio.sleep(0.01)
        seen.joining = time.monotonic() - begun
        loop.add_reader(parent.fileno(), told)
        parent.send("ready")
        if paths:
            await _get_steadily(urlsplit(url).netloc, paths, rate, seen, over)
        await over.wait()
        for task in watching:
            task.cancel()
    return seen


def _run(url: str, live: str, watchers: int, paths: Sequence[str], rate: float, parent: Connection) -> None:
    os.setsid()  # the kernel shares the cores among sessions: clients are other users' programs, not the service's
    parent.send(asyncio.run(_all(url, live, watchers, paths, rate, parent)))


@dataclass
class _Part:
    """One of the processes."""

    pipe: Connection
    process: int
    seen: Seen = field(default_factory=Seen)


@contextlib.contextmanager
def _part(url: str, live: str, watchers: int, paths: Sequence[str], rate: float) -> Iterator[_Part]:
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    process = context.Process(
        target=_run, args=(url, url.replace("http", "ws", 1) + live, watchers, tuple(paths), rate, theirs)
    )
    process.start()
    theirs.close()
    made = _Part(ours, process.pid or 0)
    try:
        ours.recv()
        yield made
        ours.send("end")
        made.seen = ours.recv()
    finally:
        process.join(20)
        if process.is_alive():
            process.kill()
            process.join()
        ours.close()


@dataclass
class Clients:
    """Running clients."""

    _watching: _Part | None
    _asking: _Part
    seen: Seen = field(default_factory=Seen)
    """Complete when the block has ended."""

    @property
    def processes(self) -> dict[str, int]:
        """Returns processes by their task."""
        watching = {} if self._watching is None else {"watchers": self._watching.process}
        return watching | {"GETs": self._asking.process}

    def begin_anew(self) -> None:
        """Discards the GETs so far, which were made during the start."""
        self._asking.pipe.send("anew")


@contextlib.contextmanager
def clients(url: str, watchers: int, paths: Sequence[str], rate: float, live: str = "") -> Iterator[Clients]:
    """Runs `watchers` WebSockets at `live` (a path), and `rate` GETs per second of `paths` in turn, during the
    block.
    """
    with contextlib.ExitStack() as parts:
        watching = parts.enter_context(_part(url, live, watchers, (), 0.0)) if watchers else None
        asking = parts.enter_context(_part(url, live, 0, paths, rate))
        made = Clients(watching, asking)
        yield made
    asked = asking.seen
    made.seen = (
        asked
        if watching is None
        else replace(
            watching.seen,
            latencies=asked.latencies,
            own_lateness=asked.own_lateness,
            refused=asked.refused,
        )
    )
