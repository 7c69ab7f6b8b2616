"""A person's terminal with `daq` running in it."""

import os
import pty
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

DAQ = [sys.executable, "-c", "from daq_cli import main; main()"]
TAKE_THE_TERMINAL = """
import fcntl, os, sys, termios
fcntl.ioctl(0, termios.TIOCSCTTY, 0)
os.execv(sys.executable, [sys.executable, *sys.argv[2:]])
"""


class Person:
    """Types, and reads what has appeared."""

    def __init__(self, process: subprocess.Popen[bytes], master: int) -> None:
        self.process = process
        self._master = master
        self.seen = b""

    def type(self, keys: bytes) -> None:
        os.write(self._master, keys)

    def until(self, words: bytes) -> None:
        """Reads on until the words have appeared."""
        while words not in self.seen:
            self.seen += os.read(self._master, 4096)

    def end(self) -> int:
        """Reads to the end; the exit code."""
        try:
            while piece := os.read(self._master, 4096):
                self.seen += piece
        except OSError:  # the terminal's other side has been closed: that is how the end looks on Linux
            pass
        return self.process.wait(30)


@contextmanager
def at_a_terminal(words: list[str]) -> Iterator[Person]:
    """`daq` as the foreground of a terminal of its own."""
    master, slave = pty.openpty()
    process = subprocess.Popen(
        [sys.executable, "-c", TAKE_THE_TERMINAL, *DAQ, *words],
        stdin=slave,
        stdout=slave,
        stderr=slave,
        start_new_session=True,
    )
    os.close(slave)
    try:
        yield Person(process, master)
    finally:
        process.kill()
        process.wait()
        os.close(master)
