"""The bridge in C before the mock's board, as a process with a port."""

import json
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from daq.transport.mock_process import MockProcess
from tests.firmware.compiled import made, need, need_simavr


@contextmanager
def served(bridge: str, *options: str) -> Iterator[MockProcess]:
    """`tests.firmware.serve` with a bridge and options of the mock, on a pseudo-terminal."""
    need("gcc", "make")
    if bridge == "mega2560":
        need("avr-gcc")
        need_simavr()
        made("mega2560.elf")
        made("libmega2560.so")
    else:
        made("libbridge-32.so")
    command = [sys.executable, "-m", "tests.firmware.serve", bridge, "--pty", "--owned", *options]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    assert process.stdout is not None
    line = b""
    while not line.startswith(b"{"):  # simavr says first what it loads
        line = process.stdout.readline()
        assert line, "the bridge did not start"
    ready = json.loads(line)
    running = MockProcess(ready["url"], ready["control"], process)
    try:
        yield running
    finally:
        running.close()
