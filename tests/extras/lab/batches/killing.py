"""A batch of four processes whose worker is killed with -9 after the fifth trace: python -m … FOLDER OUT."""

import faulthandler
import json
import os
import signal
import sys
from pathlib import Path

from daq.executors import LocalWorkers
from daq.executors.local import ending
from daq.traces.catalogue import list_traces
from daq.traces.query import TraceQuery
from extras.lab.batches.folder import Row, asked_of, opened
from extras.lab.batches.run import Standing, chosen_traces, run_batch
from extras.lab.batches.study import Common, SimulateStudy
from tests.extras.lab.batches.traces import MACHINE

AFTER = 5


def main(traces: str, out: str) -> None:
    """Prints which process was killed after how many traces, and how the batch ended."""
    killed: list[int] = []

    def tell(standing: Standing, row: Row | None) -> None:
        if row is not None and standing.done == AFTER:
            killed.append(int(row.worker.rpartition(":")[2]))
            os.kill(killed[0], signal.SIGKILL)

    common = Common(study=SimulateStudy(), model=None, machine=MACHINE)
    chosen, _ = chosen_traces(list_traces(Path(traces)), TraceQuery())
    with opened(Path(out), asked_of(common)) as folder, ending(LocalWorkers(4)) as workers:
        ended = run_batch(folder, common, chosen, workers, tell)
    print(json.dumps({"killed": killed[0], "done": ended.done, "failed": ended.failed}))


if __name__ == "__main__":
    faulthandler.dump_traceback_later(100, exit=True)  # a batch that hangs shows where
    main(*sys.argv[1:])
