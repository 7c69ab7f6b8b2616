"""A process with limits, from its first order to its last."""

from __future__ import annotations

import os
import queue
import resource
import sys
import threading
import traceback
from contextlib import suppress
from pathlib import Path

from daq.contracts.errors import DaqError
from server.bounded.messages import ORDER, Answer, Limits, ReadUpload
from server.bounded.motion import preview_of
from server.bounded.upload import read_upload
from server.problems import NO_ROOM

NICENESS = 10
GROWN = 256 << 20
"""Bytes of resident memory at most, so far, beyond which a process is ended rather than kept."""
LONGEST_LINE = 300
OOM_SCORE = "800"
"""Of 1000: where the computer runs out of memory, this process goes and not the service."""


def main() -> int:
    """Reads the limits, then orders, and answers them, until the service closes its end."""
    os.nice(NICENESS)
    with suppress(OSError):
        Path("/proc/self/oom_score_adj").write_text(OOM_SCORE, "ascii")
    orders: queue.SimpleQueue[str] = queue.SimpleQueue()
    limits = Limits.model_validate_json(sys.stdin.readline())
    threading.Thread(target=_listen, args=(orders,), daemon=True).start()
    _limit(limits)
    while True:
        line = orders.get()
        _limit_time(limits.seconds)
        answer = answer_order(line, limits)
        sys.stdout.write(answer.model_dump_json() + "\n")
        sys.stdout.flush()
        if answer.spent:
            return 0


def answer_order(line: str, limits: Limits) -> Answer:
    """One order carried out. Whatever is wrong with what was sent is a line."""
    try:
        order = ORDER.validate_json(line)
        done = read_upload(order) if isinstance(order, ReadUpload) else preview_of(order)
        return Answer(data=done.model_dump(mode="json"), spent=_has_grown())
    except DaqError as error:
        return Answer(problem=_short(str(error)), no_room=_is_of_the_disk(error), spent=_has_grown())
    except MemoryError:
        line = f"needs more than the {limits.memory >> 20} MB of memory that there are for it"
        return Answer(problem=line, exhausted=True, spent=True)
    except RecursionError:
        return Answer(problem="is nested too deeply", spent=True)
    except Exception as error:  # noqa: BLE001 - whatever a file makes of its reader is what is wrong with the file
        line = f"cannot be read: {type(error).__name__}: {error}"
        return Answer(problem=_short(line), fault=traceback.format_exc()[-4000:], spent=True)


def _is_of_the_disk(error: BaseException | None) -> bool:
    """Whether nothing more can be written, at the end of what caused an error."""
    while error is not None:
        if isinstance(error, OSError) and error.errno in NO_ROOM:
            return True
        error = error.__cause__
    return False


def _listen(orders: queue.SimpleQueue[str]) -> None:
    """Ends this process with the service, in the middle of whatever it does."""
    for line in sys.stdin:
        orders.put(line)
    os._exit(0)


def _limit(limits: Limits) -> None:
    """Of what this process may have; what it had for itself when it began is not counted."""
    own = _virtual_data()
    resource.setrlimit(resource.RLIMIT_DATA, (own + limits.memory, own + limits.memory))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def _limit_time(seconds: float) -> None:
    """Where nobody is there any more to end it, the system does."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    _, hard = resource.getrlimit(resource.RLIMIT_CPU)
    resource.setrlimit(resource.RLIMIT_CPU, (int(used.ru_utime + used.ru_stime + seconds) + 2, hard))


def _virtual_data() -> int:
    """Bytes that RLIMIT_DATA counts."""
    return _memory("VmData")


def _has_grown() -> bool:
    """Not by `ru_maxrss`, which a process inherits from the one that starts it."""
    return _memory("VmHWM") > GROWN


def _memory(name: str) -> int:
    """Bytes of a kind of memory of this process, as the kernel counts it; 0 where it does not say."""
    with suppress(OSError, ValueError, IndexError):
        for line in Path("/proc/self/status").read_text("ascii").splitlines():
            if line.startswith(f"{name}:"):
                return int(line.split()[1]) << 10
    return 0


def _short(line: str) -> str:
    line = " ".join(line.split())
    return line if len(line) <= LONGEST_LINE else f"{line[:LONGEST_LINE]} …"
