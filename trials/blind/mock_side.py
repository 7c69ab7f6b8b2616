"""The mock's side of a trial, in separate processes: how detectable an arm's effects are, and what they are."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

from daq.child import last_words
from daq.contracts.errors import DaqError


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
