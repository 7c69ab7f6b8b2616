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
from typing import Any

from pydantic import ValidationError

from daq.child import last_words
from daq.contracts.errors import DaqError
from firmware_protocol.invalid import first_invalid
from model.discrepancy.diagnosis import Diagnosis
from model.machine_model.model import Model
from model.machine_model.model_file import save_model

MODEL, ANSWER, HELD_OUT = "model.json", "answer.json", "held-out.mcap"
TIME_LIMIT = 1800.0
"""Time limit of a diagnosis in s: generous, because the computer may be busy."""
_KEPT_VARIABLES = ("PATH", "HOME", "LANG", "LC_ALL", "PYTHONPATH", "PYTHONDONTWRITEBYTECODE", "VIRTUAL_ENV")
_KEPT_BEGINNINGS = ("NUMBA_", "OMP_", "OPENBLAS_", "MKL_")
DIAGNOSER = (sys.executable, "-m", "trials.blind.diagnoser")


# --- The mock's side of a trial, in separate processes: how detectable an arm's effects are, and what they are


class TrialStageError(DaqError):
    """A stage of a trial has failed; the text is one line."""


def detect(seed: int, set_points: Path, cache: Path) -> dict[str, Any]:
    """Returns detectability d′ of the arm's effects, one by one and together. Raises TrialStageError."""
    return _line("mock_controller.detectability", str(seed), "--experiment", str(set_points), "--cache", str(cache))


def reveal(seed: int) -> dict[str, Any]:
    """Returns the effects that the arm hides. Raises TrialStageError."""
    return _line("mock_controller.reveal", str(seed))


def _line(module: str, *arguments: str) -> dict[str, Any]:
    done = subprocess.run(
        [sys.executable, "-m", module, *arguments],
        env={"OPENBLAS_NUM_THREADS": "1"}
        | os.environ,  # threads would wait for each other in products of thin matrices
        capture_output=True,
        text=True,
        check=False,
        start_new_session=True,
    )
    try:
        line: dict[str, Any] = json.loads(done.stdout)
    except json.JSONDecodeError:
        told = f"{module} ended with code {done.returncode}: {last_words(done.stderr)}"
        raise TrialStageError(told) from None
    return line


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
) -> SealedAnswer:
    """Runs `diagnoser` in a new folder with copies of the traces and the model, and returns its answer.

    It gets no other arguments; the environment is what any program needs to run. Raises
    DiagnosisFailedError.
    """
    with tempfile.TemporaryDirectory(prefix="diagnosis-") as name:
        place = Path(name)
        for number, trace in enumerate(traces, start=1):
            shutil.copyfile(trace, place / f"trace-{number}.mcap")
        if holdout is not None:
            shutil.copyfile(holdout, place / HELD_OUT)
        save_model(model, place / MODEL)
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
