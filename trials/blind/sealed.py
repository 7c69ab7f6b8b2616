"""A diagnosis in a process that gets only trace files, a model, and the robot time that it may request."""

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
"""File that exists if experiments may be requested: `budget` is the remaining robot time for them in s."""
TIME_LIMIT = 1800.0
"""Time limit of a diagnosis in s: generous, because the computer may be busy."""
_KEPT_VARIABLES = ("PATH", "HOME", "LANG", "LC_ALL", "PYTHONPATH", "PYTHONDONTWRITEBYTECODE", "VIRTUAL_ENV")
_KEPT_BEGINNINGS = ("NUMBA_", "OMP_", "OPENBLAS_", "MKL_")
DIAGNOSER = (sys.executable, "-m", "trials.blind.diagnoser")


class DiagnosisFailedError(TrialStageError):
    """A diagnosis without an answer, which counts as wrong."""


@dataclass(frozen=True)
class SealedAnswer:
    """An answer as bytes, with their SHA-256, and the time in s that the process took."""

    text: bytes
    seconds: float

    @property
    def digest(self) -> str:
        """SHA-256 of the original answer."""
        return sha256(self.text).hexdigest()

    def read(self) -> Diagnosis:
        """Returns the parsed answer. Raises DiagnosisFailedError if it is not valid."""
        try:
            return Diagnosis.model_validate_json(self.text)
        except ValidationError as error:
            first = first_invalid(error)
            line = f"the output of the diagnosis is not an answer: {first.where()}: {first.message}"
            raise DiagnosisFailedError(line) from error


def diagnose_sealed(
    traces: Sequence[Path],
    holdout: Path | None,
    model: Model,
    diagnoser: Sequence[str] = DIAGNOSER,
    budget: float | None = None,
) -> SealedAnswer:
    """Runs `diagnoser` in a new folder with copies of the traces and the model, and returns its answer.

    It gets no other arguments; the environment is what any program needs to run. `budget`: robot time in s for its
    requests; None: it may request nothing. Raises DiagnosisFailedError.
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
    return {
        "OPENBLAS_NUM_THREADS": "1"
    } | kept  # as `daq` does: threads would wait for each other in products of thin matrices
