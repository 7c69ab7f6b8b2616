"""Stands for the diagnosis where a test is about what surrounds it: answers what its folder holds.

The answer names what the process was given (files, arguments, environment, the budget). Where it may ask, it asks
for one more experiment while it has only one trace, of an arm that carries much.
"""

import json
import os
import sys
from pathlib import Path

from daq.contracts.experiment import ExperimentSpec, Pause
from daq.traces.reader import read_trace
from model.discrepancy.diagnosis import Diagnosis, NextExperiment
from model.machine_model.model_file import load_model

model = load_model(Path("model.json"))
traces = sorted(Path().glob("trace-*.mcap"))
asking = Path("asking.json")
budget = json.loads(asking.read_text("utf-8"))["budget"] if asking.exists() else None
given = {
    "files": sorted(file.name for file in Path().iterdir()),
    "arguments": sys.argv[1:],
    "environment": dict(os.environ),
    "budget": budget,
    "load": None if model.machine.load is None else model.machine.load.value,
}
asked = None
if budget is not None and len(traces) == 1 and model.machine.load is not None and model.machine.load.value > 1.5:
    asked = NextExperiment(
        name="a pause",
        spec=ExperimentSpec(trajectory=Pause(duration=0.4), joints=(1, 2, 3), settle=0, hold=0.1),
        duration=0.5,
        separates=("backlash", "input_delay"),
        predicted_separation=5.0,
        reason="",
    )
answer = Diagnosis(
    verdict="unknown-effect" if asked else "nothing-significant",
    summary="",
    steps=(),
    next_experiment=asked,
    model_before=model,
    model_after=model,
    traces=tuple(read_trace(file).record.trace_id for file in traces),
    seconds=0.1,
    robot_seconds=1.0,
    notes=(json.dumps(given),),
)
Path("answer.json").write_text(answer.model_dump_json(), "utf-8")
