"""`python -m trials.blind.diagnoser`: diagnoses the traces of its working folder.

It reads trace-1.mcap, trace-2.mcap, …, held-out.mcap if present, and model.json, and writes answer.json.
"""

from __future__ import annotations

import sys
from pathlib import Path

from daq.contracts.errors import DaqError
from trials.blind.sealed import ANSWER, HELD_OUT, MODEL


def main() -> int:
    """Writes the answer, and returns the exit code."""
    from daq.traces.reader import read_trace
    from model.discrepancy.workflow import diagnose
    from model.machine_model.model_file import load_model

    here = Path()
    try:
        traces = [read_trace(file) for file in sorted(here.glob("trace-*.mcap"))]
        held_out = [read_trace(file) for file in sorted(here.glob(HELD_OUT))]
        model = load_model(here / MODEL)
        answer = diagnose(model, traces, held_out)
    except DaqError as error:
        print(error, file=sys.stderr)
        return error.exit_code
    (here / ANSWER).write_text(answer.model_dump_json(indent=1) + "\n", "utf-8")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
