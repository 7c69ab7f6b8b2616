"""The last stage of a trial: what the records of an arm can distinguish, computed once its answer is sealed and
scored.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from hashlib import sha256
from pathlib import Path
from typing import Any

from daq.contracts.errors import DaqError
from daq.contracts.experiment import ExperimentSpec
from daq.contracts.machine import Machine
from daq.traces.reader import read_trace
from model.trial.score import Score
from model.trial.sharpness import Sharpness, asks_for_rivals, named_rivals
from trials.blind.experiments import write_experiment
from trials.blind.folder import TrialFolder
from trials.blind.mock_side import TrialStageError, tell_apart
from trials.blind.sealed import SealedAnswer


def sealed_answer(folder: TrialFolder, seed: int) -> SealedAnswer:
    """Returns the sealed answer of a case. Raises TrialStageError if it is missing, or changed."""
    sealed = folder.row("diagnose", seed)
    if sealed is None or "answer" not in sealed:
        raise TrialStageError("no answer has been sealed")
    text = (folder.path / "answers" / sealed["answer"]).read_bytes()
    if sha256(text).hexdigest() != sealed["sha256"]:
        raise TrialStageError(f"answer {sealed['answer']}: differs from the one that was sealed")
    return SealedAnswer(text, sealed["seconds"])


def work_out_sharpness(
    folder: TrialFolder, seed: int, machine: Machine, experiment: Callable[[str], ExperimentSpec]
) -> dict[str, Any]:
    """Computes d′ of the rivals that a scored answer names, in all of its experiments together.

    `machine`: with the announced load. `experiment`: returns the experiment of a name. Raises TrialStageError.
    """
    answer, scored = sealed_answer(folder, seed), folder.row("score", seed)
    if scored is None:
        raise TrialStageError("its answer has not been scored")
    rivals = named_rivals(Score.model_validate(scored), answer.read())
    with tempfile.TemporaryDirectory(prefix="sharpness-") as place:
        specs = [experiment(folder.asked.experiment), *_further(folder, seed)]
        files = [write_experiment(spec, machine, Path(place) / f"{k}.json") for k, spec in enumerate(specs)]
        return tell_apart(seed, files, rivals, folder.path / "tangents")


def rivals_wanted(folder: TrialFolder) -> list[int]:
    """Returns the cases whose answers need d′ of rivals."""
    scores = (Score.model_validate(row) for row in folder.rows("score"))
    return [score.seed for score in scores if asks_for_rivals(score)]


def with_rivals(score: Score, row: dict[str, Any] | None) -> Score:
    """Returns the score with d′ of the rivals, if they have been computed."""
    if row is None:
        return score
    found = Sharpness.model_validate(row)
    return score.model_copy(update={"rivals": {rival.effect: rival.d_prime for rival in found.rivals}})


def _further(folder: TrialFolder, seed: int) -> list[ExperimentSpec]:
    """Returns the experiments that were requested and used, from their traces."""
    sealed = folder.row("diagnose", seed) or {}
    specs = []
    for name in sealed.get("traces", [])[1:]:
        try:
            spec = read_trace(folder.path / "traces" / name).record.spec
        except DaqError as error:
            raise TrialStageError(f"a requested experiment is not known: {error}") from error
        if spec is None:
            raise TrialStageError(f"trace {name}: does not state its experiment")
        specs.append(spec)
    return specs
