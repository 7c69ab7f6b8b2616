"""Main program of a process with limited memory and time."""

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
from daq.contracts.service.experiments import MotionPreview
from daq.safety.preview import preview_of
from model.machine_model.model_file import ModelFile, foreign_model
from server.bounded.messages import ORDER, Answer, Limits, Order, ReadModel, ReadUpload, UploadedTrace
from server.bounded.upload import read_upload
from server.problems import NO_ROOM
from server.steady import weigh_session

NICENESS, SESSION_NICENESS = 10, 5
"""Nice values of the process, and of its session: a client waits for the answer, but the service has priority."""
GROWN = 256 << 20
"""Peak resident memory (bytes) above which a process ends after its answer."""
LONGEST_LINE = 300
OOM_SCORE = "800"
"""Out of 1000: if the computer runs out of memory, the kernel ends this process before the service."""


def main() -> int:
    """Reads the limits, then carries out orders until the service closes its end."""
    os.nice(NICENESS)
    weigh_session(SESSION_NICENESS)
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
    """Carries out one order. Any error in the input becomes one line of the answer."""
    try:
        done = _carry_out(ORDER.validate_json(line))
        return Answer(data=done.model_dump(mode="json"), spent=_has_grown())
    except DaqError as error:
        return Answer(problem=_short(str(error)), no_room=_is_of_the_disk(error), spent=_has_grown())
    except MemoryError:
        line = f"needs more than the {limits.memory >> 20} MB of memory that it may use"
        return Answer(problem=line, exhausted=True, spent=True)
    except RecursionError:
        return Answer(problem="is nested too deeply", spent=True)
    except Exception as error:  # noqa: BLE001  # whatever error the reader raises, the file is the cause
        line = f"cannot be read: {type(error).__name__}: {error}"
        return Answer(problem=_short(line), fault=traceback.format_exc()[-4000:], spent=True)


def _carry_out(order: Order) -> UploadedTrace | ModelFile | MotionPreview:
    match order:
        case ReadUpload():
            return read_upload(order)
        case ReadModel():
            return foreign_model(order.path, "upload")
        case _:
            return preview_of(order.spec, order.machine, order.most_shown)


def _is_of_the_disk(error: BaseException | None) -> bool:
    """Whether an error, or one of its causes, means that the disk is full."""
    while error is not None:
        if isinstance(error, OSError) and error.errno in NO_ROOM:
            return True
        error = error.__cause__
    return False


def _listen(orders: queue.SimpleQueue[str]) -> None:
    """Passes on the orders, and ends this process at once when the service ends, whatever it is doing."""
    for line in sys.stdin:
        orders.put(line)
    os._exit(0)


def _limit(limits: Limits) -> None:
    """Limits the memory of this process, in addition to its use at the start, and disables core dumps."""
    own = _virtual_data()
    resource.setrlimit(resource.RLIMIT_DATA, (own + limits.memory, own + limits.memory))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def _limit_time(seconds: float) -> None:
    """Limits the processor time of an order, so that the system ends this process even if the service cannot."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    _, hard = resource.getrlimit(resource.RLIMIT_CPU)
    resource.setrlimit(resource.RLIMIT_CPU, (int(used.ru_utime + used.ru_stime + seconds) + 2, hard))


def _virtual_data() -> int:
    """Returns the number of bytes that RLIMIT_DATA counts."""
    return _memory("VmData")


def _has_grown() -> bool:
    """Whether the peak memory exceeds GROWN. `ru_maxrss` is unsuitable: a process inherits it from its parent."""
    return _memory("VmHWM") > GROWN


def _memory(name: str) -> int:
    """Returns one kind of memory of this process (bytes), as counted by the kernel; 0 if unknown."""
    with suppress(OSError, ValueError, IndexError):
        for line in Path("/proc/self/status").read_text("ascii").splitlines():
            if line.startswith(f"{name}:"):
                return int(line.split()[1]) << 10
    return 0


def _short(line: str) -> str:
    line = " ".join(line.split())
    return line if len(line) <= LONGEST_LINE else f"{line[:LONGEST_LINE]} …"
