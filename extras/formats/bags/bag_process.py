"""Imports a bag in a separate process with limited memory, because rosbags uncompresses whatever a bag contains."""

from __future__ import annotations

import io
import json
import os
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from daq.contracts.errors import DaqError, TraceError
from daq.contracts.extras import require_extra
from daq.contracts.import_choice import Choice
from daq.contracts.trace import Trace, TraceRecord
from daq.contracts.trace_limits import DEFAULT_TRACE_LIMITS, TraceLimits
from extras.formats.bags.ros_bag import NO_MEMORY, import_bag

SPARE = 64 << 20
"""Memory (bytes) in addition to that for files and messages: rosbags needs it for its type definitions."""
REFUSED = 2
"""Exit code of a process that returns an error instead of a trace."""
_SIGNALS = ("time", "position", "velocity", "drive", "set_point")
_UNLIMITED = 1 << 62


def import_bag_apart(path: Path, limits: TraceLimits = DEFAULT_TRACE_LIMITS, choice: Choice | None = None) -> Trace:
    """Returns the result of `import_bag`, computed in another process with the memory of `memory_of`.

    Each file that it writes is limited too, and is in a folder that is always removed. Raises TraceError, also if the
    memory does not suffice, and MissingExtraError.
    """
    require_extra("ros", f"{path}: reading a bag", "rosbags")
    order = {"path": str(path), "limits": limits.model_dump(), "choice": vars(choice or Choice())}
    with TemporaryDirectory() as folder:
        done = subprocess.run(
            [sys.executable, "-P", "-m", "extras.formats.bags.bag_process"],
            input=json.dumps(order).encode(),
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env=os.environ | {"TMPDIR": folder},
            check=False,
        )
    if done.returncode == REFUSED:
        raise TraceError(done.stdout.decode("utf-8", "surrogateescape"))
    if done.returncode:
        raise TraceError(f"{path}: cannot be read as a bag (its process ended with code {done.returncode})")
    return _unpacked(done.stdout)


def memory_of(limits: TraceLimits) -> int:
    """Returns the memory (bytes) for a bag: one whole file, and as much for its content as all chunks of a file may
    have."""
    return SPARE + limits.file_bytes + limits.total_bytes


def main() -> int:
    """Reads one order, and writes the trace or one line of error."""
    order = json.loads(sys.stdin.buffer.read())
    limits = TraceLimits(**order["limits"])
    from rosbags import rosbag1  # noqa: F401 - what loading takes is not the bag's memory

    _confine(limits)
    given: dict[str, Any] = {
        name: tuple(value) if isinstance(value, list) else value for name, value in order["choice"].items()
    }
    code = REFUSED
    try:
        trace = import_bag(Path(order["path"]), limits, Choice(**given))
        answer, code = _packed(trace), 0
    except DaqError as error:
        answer = str(error).encode("utf-8", "surrogateescape")
    except MemoryError:
        answer = f"{order['path']}: {NO_MEMORY}".encode("utf-8", "surrogateescape")
    sys.stdout.buffer.write(answer)
    return code


def _confine(limits: TraceLimits) -> None:
    """Limits the memory and the files of this process. Windows has no such limits."""
    if sys.platform != "win32":
        import resource

        own = 0  # bytes of this process that RLIMIT_DATA counts, if the system reports them
        with suppress(OSError, ValueError, IndexError):
            own = int(Path("/proc/self/statm").read_text("ascii").split()[5]) * resource.getpagesize()
        for kind, wanted in (
            (resource.RLIMIT_DATA, own + memory_of(limits)),
            (resource.RLIMIT_FSIZE, limits.file_bytes),
            (resource.RLIMIT_CORE, 0),
        ):
            _, hard = resource.getrlimit(kind)
            most = min(wanted, _UNLIMITED if hard == resource.RLIM_INFINITY else hard)
            with suppress(*((ValueError, OSError) if sys.platform == "darwin" else ())):  # macOS refuses some
                resource.setrlimit(kind, (most, most))


def _packed(trace: Trace) -> bytes:
    signals = {name: getattr(trace, name) for name in _SIGNALS if getattr(trace, name) is not None}
    record = np.frombuffer(trace.record.model_dump_json().encode(), np.uint8)
    file = io.BytesIO()
    np.savez(file, record=record, joints=np.array(trace.joints), **signals)
    return file.getvalue()


def _unpacked(data: bytes) -> Trace:
    with np.load(io.BytesIO(data), allow_pickle=False) as found:
        record = TraceRecord.model_validate_json(found["record"].tobytes())
        signals = {name: found[name] for name in _SIGNALS if name in found}
        return Trace(record, tuple(found["joints"].tolist()), **signals)


if __name__ == "__main__":
    sys.exit(main())
