"""A scheduler of Dask and its workers, as processes of this computer, for tests."""

import os
import re
import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field


@dataclass
class Cluster:
    """The address of a scheduler, and the processes of the scheduler and of its workers."""

    address: str
    scheduler: subprocess.Popen[str]
    workers: list[subprocess.Popen[str]] = field(default_factory=list)

    @property
    def url(self) -> str:
        return self.address.replace("tcp://", "dask://")


def _started(words: list[str], until: str, environment: Mapping[str, str]) -> tuple[subprocess.Popen[str], str]:
    """A process that has said a line, and what matched in it."""
    command = [sys.executable, "-m", *words]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env={**os.environ, **environment})
    assert process.stderr is not None
    said = []
    for line in process.stderr:
        said.append(line)
        if found := re.search(until, line):
            return process, found[1]
    raise RuntimeError("".join(said))


def _end(process: subprocess.Popen[str]) -> None:
    process.kill()
    process.wait()
    if process.stderr is not None:
        process.stderr.close()


@contextmanager
def cluster(workers: int, environment: Mapping[str, str] | None = None) -> Iterator[Cluster]:
    """A scheduler with registered workers of one thread each; `environment` is the workers' own."""
    with ExitStack() as ended:
        words = ["distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard"]
        process, address = _started(words, r"Scheduler at:\s+(tcp://\S+)", {})
        ended.callback(_end, process)
        made = Cluster(address, process)
        for _ in range(workers):
            words = ["distributed.cli.dask_worker", address, "--nthreads", "1", "--no-nanny", "--no-dashboard"]
            worker, _said = _started(words, r"Registered to:\s+(\S+)", environment or {})
            ended.callback(_end, worker)
            made.workers.append(worker)
        yield made
