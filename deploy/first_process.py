"""The first process of a container: starts a program, and ends only after every process that the program has left.

When the first process of a container ends, the kernel kills all others in it. The process that owns a robot's port must
not end like that: when the service is killed, it freezes the arm and closes the trace, and then ends by itself. So this
process passes signals on to the program, and stays until the last process of the container has ended.
"""

from __future__ import annotations

import ctypes
import os
import signal
import sys

PR_SET_CHILD_SUBREAPER = 36
"""Option of prctl(2), from Linux's prctl.h: processes whose parent has ended become children of this one. Process 1 has
them without it; with it, this program can be tried outside a container."""
PASSED_ON = (signal.SIGTERM, signal.SIGINT, signal.SIGHUP, signal.SIGQUIT, signal.SIGUSR1, signal.SIGUSR2)


def run(command: list[str]) -> int:
    """Runs a command; returns its exit code, or 128 and the number of the signal that ended it, once nothing that it
    has started is left. Raises OSError if it cannot be started."""
    ctypes.CDLL(None).prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)
    # A signal that comes before the program is there waits until it is.
    signal.pthread_sigmask(signal.SIG_BLOCK, PASSED_ON)
    program = os.posix_spawnp(command[0], command, os.environ, setsigmask=())
    for number in PASSED_ON:
        signal.signal(number, lambda received, _frame: os.kill(program, received))
    signal.pthread_sigmask(signal.SIG_UNBLOCK, PASSED_ON)
    code = 0
    while True:
        try:
            ended, status = os.wait()
        except ChildProcessError:
            return code
        if ended == program:
            code = os.waitstatus_to_exitcode(status)
            code = code if code >= 0 else 128 - code
            for number in PASSED_ON:  # what is left ends by itself, and the program's number may become another's
                signal.signal(number, signal.SIG_IGN)


if __name__ == "__main__":
    sys.exit(run(sys.argv[1:]))
