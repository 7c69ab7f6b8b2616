"""The service ends within 5 s of SIGTERM, whatever it is doing for whomever."""

import contextlib
import signal
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path
from urllib.parse import urlsplit

import httpx
import pytest
from websockets.sync.client import connect

from benchmarks.service_process import child
from server.serve import FORCED
from tests.server.hostile_files import bomb, sound_trace
from tests.server.service import running_service

WITHIN = 5.0
HOURS = {"trajectory": {"kind": "sine", "amplitude": 0.1, "period": 1.0, "cycles": 1000}, "joints": [1], "repeats": 10}
BEGIN = """import re, threading, server.serve as e
e.END_WITHIN, e.LAST_RESORT = {}, {}
end = e.EndInTime(lambda: None, lambda: {}, lambda: print("the stop door is closed"))
end.arm()
{}"""
WAIT, HOLD = "threading.Event().wait()", "re.match('(a+)+$', 'a' * 60 + 'b')"
"""The second is a search that holds the interpreter, and lets no other thread run."""


@pytest.mark.parametrize(
    ("limits", "in_order", "work", "code"),
    [
        ((0.1, 60.0), False, WAIT, FORCED),
        ((0.1, 0.5), False, HOLD, -signal.SIGALRM),
        ((0.1, 60.0), True, WAIT, 0),
        # a thread that computes on, for which Python waits
        ((50.0, 60.0), True, f"threading.Thread(target=lambda: {WAIT}).start(); end.finish()", 0),
    ],
)
def test_what_nobody_can_interrupt_is_ended_and_is_no_fault_if_all_else_was_in_order(
    limits: tuple[float, float], in_order: bool, work: str, code: int
) -> None:
    command = [sys.executable, "-c", BEGIN.format(*limits, in_order, work)]
    ended = subprocess.run(command, check=False, capture_output=True, timeout=60)
    assert (ended.returncode, ended.stdout) == (code, b"the stop door is closed\n" * in_order)


def test_the_service_ends_in_time_whatever_it_does(tmp_path: Path) -> None:
    with running_service(tmp_path) as service:
        service.until_connected()
        where, over = urlsplit(service.url), threading.Event()
        content = bomb(sound_trace(), 1 << 30)

        def ask(method: str, path: str, **body: object) -> None:
            with contextlib.suppress(httpx.HTTPError), httpx.Client(timeout=60) as client:
                while not over.is_set():
                    client.request(method, f"{service.url}/api/v1/robots/ma2000{path}", **body)  # type: ignore[arg-type]

        kind = {"Content-Type": "application/octet-stream"}
        threads = [threading.Thread(target=ask, args=("POST", "/traces"), kwargs={"content": content, "headers": kind})]
        threads += [
            threading.Thread(target=ask, args=("POST", "/experiments/preview"), kwargs={"json": {"spec": HOURS}})
            for _ in range(4)
        ]
        threads += [threading.Thread(target=ask, args=("GET", path)) for path in ("", "/queue?wait=30")]
        for thread in threads:
            thread.start()
        slow = socket.create_connection((where.hostname, where.port))
        slow.sendall(b"POST /api/v1/robots/ma2000/traces HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 999\r\n\r\n")
        with slow, connect(f"ws://{where.netloc}/api/v1/robots/ma2000/live") as watcher:
            watcher.send('{"subscribe": ["samples", "robot"]}')
            watcher.recv()
            while not _begun(service.process.pid):
                assert service.process.poll() is None
            begun = time.monotonic()
            code = service.end()
            took = time.monotonic() - begun
        over.set()
        for thread in threads:
            thread.join()
    assert took < WITHIN
    assert code == 0


def _begun(service: int) -> bool:
    """Whether a process reads for somebody."""
    with contextlib.suppress(RuntimeError, OSError):
        return child(service, b"server.bounded") > 0
    return False
