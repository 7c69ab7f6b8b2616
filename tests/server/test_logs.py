"""Standard error of a service that is no terminal: JSON alone, whoever writes there."""

import json
import logging
import subprocess
import sys
from typing import Any

from server.logs import PlainLines

PROGRAM = """
import logging, sys, threading, warnings
from server import logs
from server.jobs.service import worker_processes

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
