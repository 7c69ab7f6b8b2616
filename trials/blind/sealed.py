"""A diagnosis in a process that is given trace files, a model, the robot time it may ask for, and nothing else."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

from pydantic import ValidationError

from daq.child import last_words
from firmware_protocol.invalid import first_invalid
from model.discrepancy.diagnosis import Diagnosis
from model.machine_model.model import Model
from model.machine_model.model_file import save_model
from trials.blind.mock_side import TrialStageError

MODEL, ANSWER, HELD_OUT = "model.json", "answer.json", "held-out.mcap"
ASKING = "asking.json"
"""File that is there where experiments may be asked for: `budget` is the robot time in s that is left for them."""
TIME_LIMIT = 1800.0
"""Time limit of a diagnosis in s: generous, because the computer may be busy with others."""
_KEPT_VARIABLES = ("PATH", "HOME", "LANG", "LC_ALL", "PYTHONPATH", "PYTHONDONTWRITEBYTECODE", "VIRTUAL_ENV")
_KEPT_BEGINNINGS = ("NUMBA_", "OMP_", "OPENBLAS_", "MKL_")
DIAGNOSER = (sys.executable, "-m", "trials.blind.diagnoser")


class DiagnosisFailedError(TrialStageError):
    """A diagnosis that gave no answer, which is a wrong one."""


@dataclass(frozen=True)
class SealedAnswer:
    """An answer as bytes, with their SHA-256, and the time that the process took in s."""

    text: bytes
    seconds: float

    @property
    def digest(self) -> str:
        """SHA-256 of the answer as it was given."""
        return sha256(self.text).hexdigest()

    def read(self) -> Diagnosis:
        """The answer, parsed. Raises DiagnosisFailedError when it is not valid."""
        try:
            return Diagnosis.model_validate_json(self.text)
        except ValidationError as error:
            first = first_invalid(error)
            line = f"what the diagnosis gave is no answer: {first.where()}: {first.message}"
            raise DiagnosisFailedError(line) from error


def diagnose_sealed(
    traces: Sequence[Path],
    holdout: Path | None,
    model: Model,
    diagnoser: Sequence[str] = DIAGNOSER,
    budget: float | None = None,
) -> SealedAnswer:
    """Runs `diagnoser` in a new folder with copies of the traces and the model, and returns its answer.

    Arguments are those of `diagnoser` alone; the environment is what any program needs to run. `budget`: s of robot
    time for what it may ask for; None: it may not ask. Raises DiagnosisFailedError.
    """
    with tempfile.TemporaryDirectory(prefix="diagnosis-") as name:
        place = Path(name)
        for number, trace in enumerate(traces, start=1):
            shutil.copyfile(trace, place / f"trace-{number}.mcap")
        if holdout is not None:
            shutil.copyfile(holdout, place / HELD_OUT)
        save_model(model, place / MODEL)
        if budget is not None:
            (place / ASKING).write_text(json.dumps({"budget": budget}) + "\n", "utf-8")
        begun = time.monotonic()
        try:
            done = subprocess.run(
                diagnoser,
                cwd=place,
                env=_environment(),
                stdin=subprocess.DEVNULL,
                capture_output=True,
                text=True,
                check=False,
                timeout=TIME_LIMIT,
                start_new_session=True,
            )
        except subprocess.TimeoutExpired:
            raise DiagnosisFailedError(f"no answer within {TIME_LIMIT:g} s") from None
        seconds = time.monotonic() - begun
        answer = place / ANSWER
        if done.returncode or not answer.exists():
            line = f"the diagnosis ended with code {done.returncode}: {last_words(done.stderr)}"
            raise DiagnosisFailedError(line)
        return SealedAnswer(answer.read_bytes(), seconds)


def _environment() -> dict[str, str]:
    kept = {
        key: value for key, value in os.environ.items() if key in _KEPT_VARIABLES or key.startswith(_KEPT_BEGINNINGS)
    }
    return {"OPENBLAS_NUM_THREADS": "1"} | kept  # as `daq` does: threads of thin products wait for each other
