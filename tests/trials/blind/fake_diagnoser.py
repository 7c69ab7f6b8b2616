"""Stands for the diagnosis where a test is about what surrounds it: answers what its folder holds.

The answer names what the process was given: files, arguments, environment, load.
"""

import json
import os
import sys
from pathlib import Path

from daq.traces.reader import read_trace
from model.discrepancy.diagnosis import Diagnosis
from model.machine_model.model_file import load_model

model = load_model(Path("model.json"))
traces = sorted(Path().glob("trace-*.mcap"))
given = {
    "files": sorted(file.name for file in Path().iterdir()),
    "arguments": sys.argv[1:],
    "environment": dict(os.environ),
    "load": None if model.machine.load is None else model.machine.load.value,
}
answer = Diagnosis(
    verdict="nothing-significant",
    summary="",
    steps=(),
    model_before=model,
    model_after=model,
    traces=tuple(read_trace(file).record.trace_id for file in traces),
    seconds=0.1,
    robot_seconds=1.0,
    notes=(json.dumps(given),),
)
Path("answer.json").write_text(answer.model_dump_json(), "utf-8")
