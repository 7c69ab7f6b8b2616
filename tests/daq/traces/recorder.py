"""A program that records without end and prints the tick of every row it has handed over: something to kill."""

import sys
from pathlib import Path

from daq.traces.writer import TraceWriter
from tests.daq.traces.samples import JOINTS, record, row


def main(path: Path, sync_interval: float) -> None:
    tick = 0
    with TraceWriter(path, record(), JOINTS, sync_interval=sync_interval, patience=10) as writer:
        print("ready", flush=True)
        for _ in sys.stdin:
            for tick in range(tick + 1, tick + 51):  # noqa: B020  # each line asks for the next fifty
                writer.sample(row(tick))
            print(writer.synced_samples, flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]), float(sys.argv[2]))
