"""Hostile requests against a service, while its arm is stopped again and again beside them.

    python -m benchmarks service_attack

One service on the loopback, on a mock in lock-step. Several clients send it files that are bombs or lies, heads that
are too large, bodies nested beyond measure, unknown tokens, foreign origins, half requests, floods of WebSockets and
motions of hours, in an order that a seed decides. Meanwhile another client, a process of its own, stops the arm through
both doors, and measures until the answer has come. At the end SIGTERM is sent while uploads are still being read.
"""

from __future__ import annotations

import argparse
import contextlib
import http.client
import json
import socket
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from urllib.parse import urlsplit

from benchmarks.damaged_traces import AT_RANDOM
from benchmarks.figures import Figure, at_most, quantile, show
from benchmarks.hostile_files import DEEP, bomb, hostile_tables, hostile_traces, sound_trace
from benchmarks.service_process import ROBOT, RunningService, started_service
from benchmarks.stopper import Stopped, stopping
from daq.contracts.service.system import stop_port_after

PORT = "mock://?pty=1&lock_step=1&seed=3"
API = f"/api/v1/robots/{ROBOT}"
CONFIGURATION = "[server]\nupload_memory = 512\nupload_time = 20\n"
JSON, MCAP, CSV = "application/json", "application/octet-stream", "text/csv"
ATTACKER = "http://attacker.example"
CLIENTS = 4
ANSWER_WITHIN = 90.0
STOP_TARGET_MS = 1000.0
END_TARGET_S = 5.0
GROWTH_TARGET_MB = 64.0
HOURS = {"trajectory": {"kind": "sine", "amplitude": 0.1, "period": 1.0, "cycles": 1000}, "joints": [1, 2, 3]}


@dataclass
class Attack:
    """One hostile request. `expected`: statuses that are answers to it; None where the connection may just end."""

    name: str
    method: str
    path: str
    body: bytes = b""
    headers: dict[str, str] = field(default_factory=dict)
    expected: tuple[int, ...] = (422,)
    raw: bytes | None = None
    """Sent as it stands, where it is no request."""


@dataclass
class Seen:
    """The answers. `unexpected`: which, and how often."""

    requests: int = 0
    statuses: Counter[int] = field(default_factory=Counter)
    unexpected: Counter[str] = field(default_factory=Counter)


def attacks(random: Random, count: int) -> list[Attack]:
    """So many attacks, of every kind, in an order that the seed determines."""
    sound = sound_trace()
    files = [_upload(name, content, MCAP) for name, content in hostile_traces(sound).items()]
    files += [_upload(name, content, CSV) for name, content in hostile_tables().items()]
    files.append(_upload("a bomb of 2 GB", bomb(sound, 2 << 30), MCAP))
    fixed = [*files, *_bodies(), *_heads(), *_strangers()]
    made = list(fixed)
    while len(made) < count:
        kind = random.randrange(3)
        if kind == 0:
            damage = random.choice(list(AT_RANDOM.values()))
            made.append(_upload("a damaged trace", damage(random, sound), MCAP, (201, 409, 413, 422)))
        else:
            made.append(random.choice(fixed[len(files) :] if kind == 1 else files[:-1]))
    random.shuffle(made)
    return made


def _upload(name: str, content: bytes, kind: str, expected: tuple[int, ...] = (413, 422)) -> Attack:
    return Attack(name, "POST", f"{API}/traces", content, {"Content-Type": kind}, expected)


def _json(name: str, path: str, body: bytes | object, *expected: int, method: str = "POST") -> Attack:
    content = body if isinstance(body, bytes) else json.dumps(body).encode()
    return Attack(name, method, f"{API}{path}", content, {"Content-Type": JSON}, expected or (400, 422))


def _bodies() -> list[Attack]:
    nested = b"[" * DEEP
    return [
        _json("a body nested deeply", "/experiments", nested),
        _json("objects nested deeply", "/experiments/preview", b'{"spec":' * DEEP),
        _json("a model nested deeply", "/models?name=x", nested),
        _json("a number of 10⁵ digits", "/experiments", b'{"priority": ' + b"9" * 100_000 + b"}"),
        _json("consent that is 1", "/queue/resume", {"moves_real_arm": 1}),
        _json("consent that is 0", "/control", {"moves_real_arm": 0}),
        _json("a motion of hours", "/experiments/preview", {"spec": HOURS | {"repeats": 10}}, 200, 422, 429),
        _json("a motion of years", "/experiments/preview", {"spec": HOURS | {"repeats": 10_000}}),
        _json("a body of 17 MB", "/experiments", b" " * (17 << 20), 413),
        _json("a fit of nothing", "/jobs", {"kind": "fit", "traces": ["x" * 64] * 200}, 404, 422),
        _json("a search for everything", "/traces?q=" + "%25" * 33, b"", 200, 429, method="GET"),
    ]


def _heads() -> list[Attack]:
    many = "".join(f"X-{number}: y\r\n" for number in range(30_000)).encode()
    start = f"GET {API} HTTP/1.1\r\nHost: 127.0.0.1\r\n".encode()
    return [
        Attack("30 000 headers", "GET", API, expected=(431,), raw=start + many + b"\r\n"),
        Attack("a header of 5 MB", "GET", API, expected=(431,), raw=start + b"X: " + b"y" * (5 << 20) + b"\r\n\r\n"),
        Attack("an address of 1 MB", "GET", "/" + "a" * (1 << 20), expected=(414,)),
        Attack("a head without an end", "GET", API, expected=(0, 431), raw=start + b"X: " + b"y" * 20_000),
        Attack("no HTTP", "GET", API, expected=(400,), raw=bytes(range(256)) * 100),
        Attack("trailers", "POST", API, expected=(405, 431), raw=_chunked(b"X: y\r\n" * 1000)),
        Attack("a chunk of 2⁶⁴ bytes", "POST", API, expected=(400, 405), raw=_chunked(b"", b"ffffffffffffffff\r\n")),
        Attack("two lengths", "POST", API, expected=(400,), raw=_two_lengths()),
    ]


def _chunked(trailers: bytes, chunk: bytes = b"0\r\n") -> bytes:
    head = f"POST {API} HTTP/1.1\r\nHost: 127.0.0.1\r\nTransfer-Encoding: chunked\r\n\r\n"
    return head.encode() + chunk + trailers + b"\r\n"


def _two_lengths() -> bytes:
    head = f"POST {API} HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 1\r\nTransfer-Encoding: chunked\r\n\r\n"
    return head.encode() + b"0\r\n\r\n"


def _strangers() -> list[Attack]:
    socket_head = {
        "Connection": "Upgrade",
        "Upgrade": "websocket",
        "Sec-WebSocket-Version": "13",
        "Sec-WebSocket-Key": "AAAAAAAAAAAAAAAAAAAAAA==",
    }
    return [
        Attack("an unknown token", "GET", API, headers={"Authorization": "Bearer daq_nobody"}, expected=(401, 429)),
        Attack("a long token", "GET", API, headers={"Authorization": "Bearer " + "x" * 10_000}, expected=(401, 429)),
        Attack("a foreign origin", "POST", f"{API}/reset", headers={"Origin": ATTACKER}, expected=(403,)),
        Attack("a foreign name", "GET", API, headers={"Host": "attacker.example"}, expected=(403,)),
        Attack("a proxy's stranger", "POST", f"{API}/reset", headers={"X-Forwarded-For": "10.0.0.9"}, expected=(401,)),
        Attack(
            "a socket of a foreign page",
            "GET",
            f"{API}/live",
            headers=socket_head | {"Origin": ATTACKER},
            expected=(403,),
        ),
        Attack("a socket that says nothing", "GET", f"{API}/live", headers=socket_head, expected=(101,)),
        Attack("a path that climbs", "GET", f"{API}/traces/..%2f..%2fetc%2fpasswd/data.mcap", expected=(404,)),
        Attack("a method that is none", "BREW", API, expected=(400, 405)),
    ]


def send(url: str, attack: Attack, seen: Seen, lock: threading.Lock) -> None:
    """One request, and what became of it."""
    where = urlsplit(url)
    try:
        status = _raw(where.hostname or "", where.port or 0, attack.raw) if attack.raw else _asked(where.netloc, attack)
    except (OSError, http.client.HTTPException) as error:
        status, what = 0, f"{attack.name}: {type(error).__name__}"
    else:
        what = f"{attack.name}: {status}"
    with lock:
        seen.requests += 1
        seen.statuses[status] += 1
        if status not in attack.expected:
            seen.unexpected[what] += 1


def _asked(place: str, attack: Attack) -> int:
    line = http.client.HTTPConnection(place, timeout=ANSWER_WITHIN)
    try:
        with contextlib.suppress(BrokenPipeError, ConnectionResetError):  # refused before all was sent: it has answered
            line.request(attack.method, attack.path, attack.body or None, attack.headers)
        answer = line.getresponse()
        if answer.status != http.client.SWITCHING_PROTOCOLS:
            answer.read()
        return answer.status
    finally:
        line.close()


def _raw(host: str, port: int, sent: bytes) -> int:
    with socket.create_connection((host, port), timeout=5.0) as line:
        with contextlib.suppress(BrokenPipeError, ConnectionResetError):
            line.sendall(sent)
        try:
            first = line.recv(64)
        except (TimeoutError, ConnectionResetError):
            return 0
        return int(first.split()[1]) if first.startswith(b"HTTP/1.1 ") else 0


def memory(process: int) -> float:
    """Resident memory of a process (MB)."""
    fields = Path(f"/proc/{process}/statm").read_text("ascii").split()
    return int(fields[1]) * 4096 / 1e6


@dataclass
class Measured:
    """What a campaign gave. Memory in MB, times in s."""

    seen: Seen
    stopped: dict[str, Stopped]
    before: float
    peak: float
    after: float
    wall: float
    end: float = 0.0
    code: int | None = None


def campaign(service: RunningService, random: Random, count: int) -> Measured:
    """All attacks by a few clients, and the stops beside them."""
    service.ask("POST", "/connect")
    warm = {"Content-Type": MCAP}
    service.robot.post("/traces", content=sound_trace(number=1), headers=warm)
    before = peak = memory(service.process.pid)
    seen, lock, left = Seen(), threading.Lock(), iter(attacks(random, count))

    def attack() -> None:
        while (following := _next(left, lock)) is not None:
            send(service.url, following, seen, lock)

    begun = time.monotonic()
    where = urlsplit(service.url)
    doors = {"service": where.port or 0, "stop listener": stop_port_after(where.port or 0)}
    with stopping(where.hostname or "", doors, f"{API}/stop") as stops:
        threads = [threading.Thread(target=attack) for _ in range(CLIENTS)]
        for thread in threads:
            thread.start()
        while any(thread.is_alive() for thread in threads):
            peak = max(peak, memory(service.process.pid))
            time.sleep(0.05)
        wall = time.monotonic() - begun
    return Measured(seen, stops.found, before, peak, memory(service.process.pid), wall)


def _next(left: Iterator[Attack], lock: threading.Lock) -> Attack | None:
    with lock:
        return next(left, None)


def end(service: RunningService, found: Measured) -> None:
    """SIGTERM while a bomb is read, motions are worked out, sockets are open and requests keep coming."""
    going_on = threading.Event()
    lock, seen, sound = threading.Lock(), Seen(), sound_trace()
    explosive = _upload("a bomb", bomb(sound, 2 << 30), MCAP)
    motion = _json("a motion", "/experiments/preview", {"spec": HOURS | {"repeats": 10}}, 200)
    plain = Attack("a question", "GET", API, expected=(200,))

    def keep_asking(attack: Attack) -> Callable[[], None]:
        def ask() -> None:
            while not going_on.wait(0.01):
                send(service.url, attack, seen, lock)

        return ask

    threads = [threading.Thread(target=keep_asking(one), daemon=True) for one in (explosive, motion, motion, plain)]
    for thread in threads:
        thread.start()
    time.sleep(1.0)
    at = time.monotonic()
    service.process.terminate()
    found.code = service.process.wait(60)
    found.end = time.monotonic() - at
    going_on.set()
    for thread in threads:
        thread.join(ANSWER_WITHIN)


def figures_of(found: Measured) -> list[Figure]:
    """The table."""
    seen = found.seen
    faults = seen.unexpected
    statuses = ", ".join(f"{status or 'closed'} {count}" for status, count in sorted(seen.statuses.items()))
    rows = [
        Figure("hostile requests", f"{seen.requests}", beside=f"{found.wall:.0f} s, {CLIENTS} clients: {statuses}"),
        Figure(
            "answers of 5xx",
            f"{sum(n for s, n in seen.statuses.items() if s >= 500)}",
            "0",
            not any(status >= 500 for status in seen.statuses),
        ),
        Figure(
            "unexpected answers",
            f"{sum(faults.values())}",
            "0",
            not faults,
            "; ".join(f"{what} × {count}" for what, count in list(faults.items())[:8]),
        ),
        at_most(
            "memory of the service, growth",
            found.after - found.before,
            GROWTH_TARGET_MB,
            "MB",
            f"before {found.before:.0f}, peak {found.peak:.0f}, after {found.after:.0f} MB",
        ),
    ]
    for door, stopped in found.stopped.items():
        ms = [1e3 * one for one in stopped.seconds]
        spread = f"p50 {quantile(ms, 0.5):.0f}, max {max(ms):.0f} ms; {len(ms)} stops, {stopped.failed} without answer"
        rows.append(at_most(f"stop through the {door}, p99", quantile(ms, 0.99), STOP_TARGET_MS, "ms", spread))
        rows.append(
            Figure(f"stop through the {door}: not confirmed", f"{stopped.unconfirmed}", "0", stopped.unconfirmed == 0)
        )
    rows.append(at_most("from SIGTERM to the end", found.end, END_TARGET_S, "s", f"exit code {found.code}"))
    return rows


def main() -> int:
    """The exit code: 1 when a target was missed."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks service_attack", description=__doc__)
    parser.add_argument("--requests", type=int, default=600)
    parser.add_argument("--seed", type=int, default=1991)
    parser.add_argument("--quick", action="store_true", help="100 requests")
    given = parser.parse_args()
    count = 100 if given.quick else min(given.requests, 10_000)
    with tempfile.TemporaryDirectory() as name:
        Path(name, "daq.toml").write_text(CONFIGURATION, "utf-8")
        with started_service(Path(name), PORT) as service:
            found = campaign(service, Random(given.seed), count)
            end(service, found)
    return show("Hostile requests, and stops beside them", "python -m benchmarks service_attack", figures_of(found))


if __name__ == "__main__":
    sys.exit(main())
