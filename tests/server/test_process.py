"""The process of the service: what it loads, what it writes to standard error, and that it ends in time."""

import contextlib
import json
import logging
import signal
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import httpx
import pytest
from websockets.sync.client import connect

from benchmarks.service_process import child
from server.logs import PlainLines
from server.serve import FORCED
from tests.daq.traces.test_hostile_files import bomb_of_chunks
from tests.server.service import running_service


def test_the_web_server_and_the_owner_of_the_port_load_no_compiler_no_physics_engine_and_no_http_client() -> None:
    heavy = ("numba", "scipy", "mujoco", "matplotlib", "httpx")
    for module in ("server.serve", "server.owner"):
        line = f"import sys, {module}; print(*[name for name in {heavy} if name in sys.modules])"
        told = subprocess.run([sys.executable, "-c", line], capture_output=True, text=True, check=True)
        assert told.stdout.split() == [], module


# ---- standard error, where it is no terminal: JSON alone, whoever writes there


PROGRAM = """
import logging, sys, threading, warnings
from server import logs
from server.jobs.shared_workers import worker_processes

if __name__ == "__main__":
    logs.begin()
    logs.begin()  # again: nothing is told twice
    warnings.warn("a warning", stacklevel=1)
    print("two", "lines\\nof a library", file=sys.stderr)
    thread = threading.Thread(target=lambda: 1 / 0, name="worker-of-a-test")
    thread.start()
    thread.join()
    with worker_processes(1) as workers:
        workers.submit(exec, "import sys; print('Compiling the simulation', file=sys.stderr)").result()
        workers.submit(exec, "import warnings; warnings.warn('a warning of a worker')").result()
    logging.getLogger("uvicorn.error").error("as uvicorn says it")
    {}["what ends the process"]
"""


def _told(program: str) -> list[dict[str, Any]]:
    ended = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert ended.stdout == ""
    return [json.loads(line) for line in ended.stderr.splitlines()]


def test_every_line_is_json_whoever_writes_it() -> None:
    told = _told(PROGRAM)
    texts = [line["text"] for line in told]
    expected = (
        "a warning",
        "two lines",
        "of a library",
        "thread worker-of-a-test ended: division by zero",
        "Compiling the simulation",
        "a warning of a worker",
        "as uvicorn says it",
        "what ends the process",
    )
    for text in expected:
        assert sum(text in one for one in texts) >= 1, (text, texts)
    assert texts.count("two lines") == 1
    assert {line["logger"] for line in told} == {"py.warnings", "stderr", "uvicorn.error"}
    (ending,) = [line for line in told if line["level"] == "critical"]
    assert "KeyError" in ending["traceback"]


def test_what_is_wrong_with_the_configuration_is_a_line_of_json() -> None:
    daq = "import sys; sys.argv = ['daq', '--config', 'nothing.toml', 'serve']; from daq_cli import main; main()"
    (line,) = _told(daq)
    assert line["text"].startswith("daq: ")
    assert "nothing.toml" in line["text"]


def test_a_log_that_cannot_be_written_does_not_end_the_program() -> None:
    program = """
from server import logs
import os, sys
logs.begin()
os.close(2)
print("lost", file=sys.stderr)
print("still here")
"""
    ended = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert (ended.returncode, ended.stdout) == (0, "still here\n")


def test_what_is_logged_gives_a_terminal_no_orders_and_forges_no_line() -> None:
    path = "/a\x1b[2J\x1b]0;title\x07\n12:00:00 info    all is well\r\u202e\x9b1m é"
    trace = (ValueError, ValueError("first\x1b[2J\nsecond"), None)
    record = logging.LogRecord("server", logging.INFO, __file__, 1, "%s %s", ("GET", path), None)
    failed = logging.LogRecord("server", logging.INFO, __file__, 1, "%s", (path,), trace)
    (line,) = PlainLines().format(record).split("\n")
    assert line.isprintable()
    assert line.endswith(r"/a\x1b[2J\x1b]0;title\x07\n12:00:00 info    all is well\r\u202e\x9b1m é")
    for told in PlainLines().format(failed).split("\n"):
        assert told.isprintable()


# ---- it ends within 5 s of SIGTERM, whatever it is doing for whomever


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
        content = bomb_of_chunks(16)

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
