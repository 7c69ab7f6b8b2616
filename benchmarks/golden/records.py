"""Makes the records for the questions: written once by the mock in lock-step and by the rigs' scripts."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from benchmarks.golden.cases import EXAMPLES, RIGS, Arm, Rig

RAMP_STEP = {
    "trajectory": {
        "kind": "sequence",
        "segments": [
            {"move": {"kind": "ramp"}},
            {"move": {"kind": "pause", "duration": 3.0}},
            {"move": {"kind": "ramp", "amplitude": -0.3769911184307752}},
            {"move": {"kind": "pause", "duration": 3.2}},
        ],
    },
    "joints": [1, 2, 3],
    "hold": 0.02,
    "name": "ramp-step",
}
"""The source's ramp-step, there and back: 7.5 s."""
HELD_OUT = ("run", "sine", "--joints", "1-3", "--yes", "--json")
DAQ = (
    sys.executable,
    "-c",
    (
        "import tomllib, importlib, sys; "
        "module, name = tomllib.load(open('pyproject.toml', 'rb'))['project']['scripts']['daq'].split(':'); "
        "sys.argv[0] = 'daq'; getattr(importlib.import_module(module), name)()"
    ),
)
"""The command `daq` of the sources in this folder."""


def ask(words: Sequence[str]) -> str:
    """Returns the output of `daq words…`. Raises RuntimeError for exit codes other than 0, 3 or 5."""
    done = subprocess.run([*DAQ, *words], capture_output=True, text=True, check=False, cwd=EXAMPLES.parent)
    if done.returncode not in (0, 3, 5):
        raise RuntimeError(f"daq {' '.join(words)}: ended with {done.returncode}: {done.stderr.strip()[-400:]}")
    return done.stdout


def record_arm(place: Path, arm: Arm) -> None:
    """Records the trace that is fitted to and, for the short experiment, a held-out one."""
    folder = place / "traces" / arm.name
    if (folder / "done").exists():
        return
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    spec = folder / "ramp-step.json"
    spec.write_text(json.dumps(RAMP_STEP))
    fitted = ("run", "spec", str(spec)) if arm.experiment == "ramp-step" else ("run", arm.experiment)
    runs = {"fitted": (1, (*fitted, "--yes", "--json")), "held-out": (2, HELD_OUT)}
    for name, (noise, words) in runs.items():
        port = f"mock://?lock_step=1&seed={noise}&{arm.query}"
        answer = json.loads(ask(("--port", port, *words, "--folder", str(folder / "run"))))
        shutil.move(answer["trace"], folder / f"{name}.mcap")
    (folder / "done").touch()


def record_rig(place: Path, rig: Rig) -> None:
    """Writes the CSV files of the rig's script."""
    folder = place / "rigs" / rig.name
    if not (folder / rig.records[-1]).exists():
        command = [sys.executable, str(EXAMPLES / rig.script), str(folder), *rig.arguments]
        subprocess.run(command, check=True, capture_output=True)


def record_all_rigs(place: Path) -> None:
    """Writes all rigs' records."""
    for rig in RIGS:
        record_rig(place, rig)
