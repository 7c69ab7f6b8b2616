"""Runs the trial, case by case: detectability, recording, diagnosis, scoring. Each stage runs once, and its result is
kept."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor
from contextlib import contextmanager
from dataclasses import dataclass, replace
from hashlib import sha256
from itertools import takewhile
from pathlib import Path
from typing import Any

from daq.contracts.experiment import ExperimentSpec
from daq.contracts.file_lock import take_lock
from daq.contracts.machine import Machine
from daq.executors import Workers, done_in_any_order
from daq.executors.local import growing
from model.machine_model.model import base_model
from model.trial.score import Score, score, score_of_failure
from model.trial.truth import Detectability, parse_truth
from trials.blind.folder import STAGES, Stage, TrialFolder
from trials.blind.recording import Recorded, machine_with_load, record, trial_experiment, write_set_points
from trials.blind.sealed import (
    DIAGNOSER,
    DiagnosisFailedError,
    SealedAnswer,
    TrialStageError,
    detect,
    diagnose_sealed,
    reveal,
)
from trials.blind.table import TrialTable, trial_table

Progress = Callable[[int, str], None]


def _sealed_answer(folder: TrialFolder, seed: int) -> SealedAnswer:
    """Returns the sealed answer of a case. Raises TrialStageError if it is missing, or changed."""
    sealed = folder.row("diagnose", seed)
    if sealed is None or "answer" not in sealed:
        raise TrialStageError("no answer has been sealed")
    text = (folder.path / "answers" / sealed["answer"]).read_bytes()
    if sha256(text).hexdigest() != sealed["sha256"]:
        raise TrialStageError(f"answer {sealed['answer']}: differs from the one that was sealed")
    return SealedAnswer(text, sealed["seconds"])


@contextmanager
def _alone(folder: Path, load: int) -> Iterator[None]:
    """Prevents other processes with this folder from working on the same load within the block."""
    folder.mkdir(exist_ok=True)
    with (folder / f".load-{load}").open("ab") as lock:
        take_lock(lock, waits=True)
        yield


@dataclass(frozen=True)
class CaseStage:
    """A stage of a case, for any process; `folder` has the results of the case's earlier stages."""

    stage: Stage
    seed: int
    folder: TrialFolder


@dataclass
class Campaign:
    """One trial. `machine` describes the initial model of every diagnosis, before a load is announced."""

    folder: TrialFolder
    machine: Machine
    diagnoser: Sequence[str] = DIAGNOSER
    until: Stage = "score"
    experiment: Callable[[str], ExperimentSpec] = trial_experiment
    """Returns the experiment of a name."""
    recorder: Callable[[int, str, ExperimentSpec, Machine, Path], Recorded] = record

    def run(self, seeds: Sequence[int], workers: Workers, progress: Progress, seconds: float | None = None) -> int:
        """Runs the remaining stages of all cases; calls `progress` after every case.

        Only this process writes the lines; the workers must see the folder. After `seconds` no further stage is begun.
        Returns how many cases are not done because one of their processes failed; they are tried again next time.
        """
        end = math.inf if seconds is None else time.monotonic() + seconds
        write_set_points(self.experiment(self.folder.asked.experiment), self.machine, self._set_points)
        ended, failed = 0, 0
        left = deque[CaseStage]()

        def go_on(seed: int, first: bool) -> None:
            nonlocal ended
            if (stage := self._next_stage(seed)) is not None:
                put = left.append if first else left.appendleft
                put(CaseStage(stage, seed, self.folder.of_case(seed)))
            else:
                ended += 1
                progress(ended, f"{self.folder.name_of(seed)}: done")

        for seed in self.folder.in_order(seeds):
            go_on(seed, first=True)
        anywhere = replace(self, folder=TrialFolder(self.folder.path, self.folder.asked))
        in_time = takewhile(lambda _: time.monotonic() < end, growing(left))
        for task, future in done_in_any_order(workers, anywhere._carry_out, in_time):
            try:
                self.folder.add(task.stage, future.result())
            except (TrialStageError, BrokenExecutor) as error:
                ended, failed = ended + 1, failed + 1
                progress(ended, f"{self.folder.name_of(task.seed)}: {error}")
            else:
                go_on(task.seed, first=False)
        return failed

    @property
    def _set_points(self) -> Path:
        """Returns the file of the set points for which effects must be detectable."""
        return self.folder.path / f"{self.folder.asked.experiment}.csv"

    def _next_stage(self, seed: int) -> Stage | None:
        """Returns the first remaining stage of a case; None without one, or if the case ended before it."""
        for stage in STAGES[: STAGES.index(self.until) + 1]:
            if self.folder.row(stage, seed) is None:
                recorded = self.folder.row("record", seed)
                return None if recorded is not None and recorded["outcome"] != "complete" else stage
        return None

    def _carry_out(self, task: CaseStage) -> dict[str, Any]:
        """Runs a stage in a worker, and returns its line."""
        return replace(self, folder=task.folder)._stage(task.stage, task.seed)

    def scores(self) -> list[Score]:
        """Returns the scores of all cases in the folder."""
        self.folder.reload()
        rows = self.folder.rows("score")
        return [Score.model_validate(row) for row in rows]

    def table(self) -> TrialTable:
        """Returns the table of all scores."""
        scores = self.scores()
        return trial_table(scores, sum(row["outcome"] != "complete" for row in self.folder.rows("record")))

    def _stage(self, stage: Stage, seed: int) -> dict[str, Any]:
        if stage == "detect":
            tangents = self.folder.path / "tangents"
            # The first case of a load computes its tangents, which takes a minute; the others read them.
            with _alone(tangents, seed % 10):
                return detect(seed, self._set_points, tangents)
        if stage == "record":
            return self._record(seed)
        return self._diagnose(seed) if stage == "diagnose" else self._score(seed)

    def _row(self, stage: Stage, seed: int) -> dict[str, Any]:
        row = self.folder.row(stage, seed)
        assert row is not None
        return row

    def _machine(self, seed: int) -> Machine:
        """Returns the machine with the load that this arm is announced to carry."""
        return machine_with_load(self.machine, self._row("detect", seed)["load_kg"])

    def _record(self, seed: int) -> dict[str, Any]:
        begun = time.monotonic()
        runs = [self._run(seed, name) for name in (self.folder.asked.experiment, "held-out")]
        failed = next((run for run in runs if run.outcome != "complete"), None)
        return {
            "seed": seed,
            "case": self.folder.name_of(seed),
            "outcome": "complete" if failed is None else failed.outcome,
            "reason": "" if failed is None else failed.reason,
            "trace": runs[0].file.name,
            "held_out": runs[1].file.name,
            "robot_seconds": runs[0].duration,
            "seconds": time.monotonic() - begun,
        }

    def _run(self, seed: int, name: str) -> Recorded:
        return self.recorder(seed, name, self.experiment(name), self._machine(seed), self.folder.path / "traces")

    def _diagnose(self, seed: int) -> dict[str, Any]:
        """Diagnoses a case; returns its answer, sealed: its file and hash are written before the truth is revealed."""
        recorded, case, traces = self._row("record", seed), self.folder.name_of(seed), self.folder.path / "traces"
        row: dict[str, Any] = {"seed": seed, "case": case}
        fitted, held_out, model = traces / recorded["trace"], traces / recorded["held_out"], self._machine(seed)
        try:
            answer = diagnose_sealed([fitted], held_out, base_model(model), self.diagnoser)
        except DiagnosisFailedError as error:
            return {**row, "failure": str(error), "seconds": 0.0}
        file = self.folder.path / "answers" / f"{case}.json"
        file.write_bytes(answer.text)
        return {**row, "answer": file.name, "sha256": answer.digest, "seconds": answer.seconds}

    def _score(self, seed: int) -> dict[str, Any]:
        """Reveals the truth and scores the answer, which must be the one that was sealed."""
        sealed = self._row("diagnose", seed)
        seen = Detectability.model_validate(self._row("detect", seed))
        if "failure" in sealed:
            found = score_of_failure(parse_truth(reveal(seed)), seen, sealed["seconds"])
        else:
            answer = _sealed_answer(self.folder, seed).read()
            found = score(parse_truth(reveal(seed)), seen, answer, self._machine(seed))
        return found.model_dump(mode="json")
