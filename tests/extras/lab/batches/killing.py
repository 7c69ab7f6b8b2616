"""A batch in which a process is killed with -9 after the fifth trace: python -m … URL FOLDER OUT [PROCESS].

Without PROCESS it is the worker that computed that trace.
"""

import faulthandler
import json
import os
import signal
import sys
from pathlib import Path

from daq.contracts.errors import DaqError
from daq.executors.workers import ending
from daq.traces.catalogue import list_traces
from daq.traces.query import TraceQuery
from extras.lab.batches.executors import open_workers
from extras.lab.batches.folder import Row, asked_of, opened
from extras.lab.batches.run import Standing, chosen_traces, run_batch
from extras.lab.batches.study import Common, SimulateStudy
from tests.extras.lab.batches.traces import MACHINE

AFTER = 5


def main(url: str, traces: str, out: str, process: str = "") -> None:
    """Prints which process was killed after how many traces, and how the batch ended."""
    killed: list[int] = []

    def tell(standing: Standing, row: Row | None) -> None:
        if row is not None and standing.done == AFTER:
            killed.append(int(process or row.worker.rpartition(":")[2]))
            os.kill(killed[0], signal.SIGKILL)

    common = Common(study=SimulateStudy(), model=None, machine=MACHINE)
    chosen, _ = chosen_traces(list_traces(Path(traces)), TraceQuery())
    try:
        with opened(Path(out), asked_of(common)) as folder, ending(open_workers(url)) as workers:
            ended = run_batch(folder, common, chosen, workers, tell)
    except DaqError as error:
        print(json.dumps({"killed": killed[0], "error": str(error), "code": error.exit_code}))
    else:
        print(json.dumps({"killed": killed[0], "done": ended.done, "failed": ended.failed}))


if __name__ == "__main__":
    faulthandler.dump_traceback_later(100, exit=True)  # a batch that hangs shows where
    main(*sys.argv[1:])
