"""The bridge in C before the mock's board, as a process with a port."""

import json
from collections.abc import Iterator
from contextlib import contextmanager

from daq.child import Child
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
    process = Child("tests.firmware.serve", bridge, "--pty", "--owned", *options)
    ready = json.loads(
        next(line for line in process.lines() if line.startswith(b"{"))
    )  # simavr says first what it loads
    running = MockProcess(ready["url"], ready["control"], process)
    try:
        yield running
    finally:
        running.close()
