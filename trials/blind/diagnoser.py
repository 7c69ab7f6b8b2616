"""`python -m trials.blind.diagnoser`: diagnoses the traces of its working folder.

It reads trace-1.mcap, trace-2.mcap, …, held-out.mcap if present, and model.json, and writes answer.json. With
asking.json, it may request an experiment that takes no longer than the budget there, s.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from daq.contracts.errors import DaqError
from trials.blind.sealed import ANSWER, ASKING, HELD_OUT, MODEL

if TYPE_CHECKING:
    from daq.contracts.machine import Machine
    from model.discrepancy.experiment_design.next_experiment import ExperimentChooser


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
        answer = diagnose(model, traces, held_out, chooser=_chooser(here / ASKING, model.machine))
    except DaqError as error:
        print(error, file=sys.stderr)
        return error.exit_code
    (here / ANSWER).write_text(answer.model_dump_json(indent=1) + "\n", "utf-8")
    return 0


def _chooser(file: Path, machine: Machine) -> ExperimentChooser | None:
    """Returns the experiments that may be requested; None if none may."""
    from server.jobs.next_experiment import experiment_chooser

    return experiment_chooser(machine, float(json.loads(file.read_text("utf-8"))["budget"])) if file.exists() else None


if __name__ == "__main__":
    raise SystemExit(main())
