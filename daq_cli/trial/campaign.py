"""The trial, case by case: detectability, recording, diagnosis, scoring. Each stage is carried out once, and its
result kept."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path
from threading import Lock
from typing import Any

from daq.contracts.machine import Machine
from daq.traces.reader import read_trace
from daq_cli.models.stopping_rule import as_run, next_to_run, time_left
from daq_cli.trial.experiments import machine_with_load, trial_experiment, write_set_points
from daq_cli.trial.folder import STAGES, Stage, TrialFolder
from daq_cli.trial.mock_side import TrialStageError, detect, reveal
from daq_cli.trial.recording import Recorded, record
from daq_cli.trial.sealed import DIAGNOSER, DiagnosisFailedError, SealedAnswer, diagnose_sealed
from model.discrepancy.diagnosis import Acquired, NextExperiment
from model.machine_model.model import base_model
from model.trial.score import Score, score, score_of_failure
from model.trial.table import TrialTable, trial_table
from model.trial.truth import Detectability, parse_truth

ROBOT_TIME = 60.0
"""Robot time in s that a trial may spend on further experiments."""
Progress = Callable[[int, str], None]


@dataclass
class Campaign:
    """One trial. `machine` describes the arm from which every diagnosis begins, before a load is announced."""

    folder: TrialFolder
    machine: Machine
    diagnoser: Sequence[str] = DIAGNOSER
    until: Stage = "score"
    _tangents: dict[int, Lock] = field(default_factory=dict)
    _counting: Lock = field(default_factory=Lock)
    _failed: int = 0

    def run(self, seeds: Sequence[int], processes: int, progress: Progress) -> int:
        """Carries out the stages that are left of all cases, several at once; `progress` is called after every case.

        Returns how many are not done, because a process of theirs failed; they are tried again next time.
        """
        self._tangents = {seed % 10: Lock() for seed in seeds}
        seen_by = "diagnostic" if self.folder.asked.acquire else self.folder.asked.experiment
        set_points = self.folder.path / f"{seen_by}{self.folder.shard}.csv"
        write_set_points(trial_experiment(seen_by), self.machine, set_points)
        with ThreadPoolExecutor(processes) as pool:
            try:
                for number, said in enumerate(
                    pool.map(lambda seed: self._case(seed, set_points), self.folder.in_order(seeds)), start=1
                ):
                    progress(number, said)
            except BaseException:
                pool.shutdown(cancel_futures=True)
                raise
        return self._failed

    def scores(self) -> list[Score]:
        """The scores of all cases in the folder, those of other shards included."""
        self.folder.reload()
        return [Score.model_validate(row) for row in self.folder.rows("score")]

    def table(self) -> TrialTable:
        """The table of all scores."""
        scores = self.scores()
        return trial_table(scores, sum(row["outcome"] != "complete" for row in self.folder.rows("record")))

    def _case(self, seed: int, set_points: Path) -> str:
        """Carries out the stages of one case that are left; returns one line about it."""
        try:
            for stage in STAGES[: STAGES.index(self.until) + 1]:
                if self.folder.row(stage, seed) is None and not self._stage(stage, seed, set_points):
                    break
        except TrialStageError as error:
            with self._counting:
                self._failed += 1
            return f"{self.folder.name_of(seed)}: {error}"
        return f"{self.folder.name_of(seed)}: done"

    def _stage(self, stage: Stage, seed: int, set_points: Path) -> bool:
        """Carries out one stage; False where the case ends there."""
        if stage == "detect":
            # The first of a load works out its tangents, which takes a minute; the others read them.
            with self._tangents[seed % 10]:
                self.folder.add(stage, detect(seed, set_points, self.folder.path / "tangents"))
            return True
        if stage == "record":
            row = self._record(seed)
        elif stage == "diagnose":
            if self._row("record", seed)["outcome"] != "complete":
                return False
            row = self._diagnose(seed)
        else:
            row = self._score(seed)
        self.folder.add(stage, row)
        return True

    def _row(self, stage: Stage, seed: int) -> dict[str, Any]:
        row = self.folder.row(stage, seed)
        assert row is not None
        return row

    def _machine(self, seed: int) -> Machine:
        """The machine with the load that this arm is announced to carry."""
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
        return record(seed, name, trial_experiment(name), self._machine(seed), self.folder.path / "traces")

    def _diagnose(self, seed: int) -> dict[str, Any]:
        """The sealed answer, the last one where further experiments were run. Its file and hash are written before
        the truth is revealed."""
        recorded, case = self._row("record", seed), self.folder.name_of(seed)
        traces = [self.folder.path / "traces" / recorded["trace"]]
        row: dict[str, Any] = {"seed": seed, "case": case}
        budget, runs, answers = ROBOT_TIME if self.folder.asked.acquire else 0.0, list[Acquired](), list[SealedAnswer]()
        try:
            answers.append(self._answer(seed, traces, recorded["held_out"], runs))
            while (asked := next_to_run(answers[-1].read(), runs, budget)) is not None:
                runs.append(self._further(seed, asked, len(runs) + 1))
                if runs[-1].outcome == "complete":
                    traces.append(Path(runs[-1].file))
                    answers.append(self._answer(seed, traces, recorded["held_out"], runs))
        except DiagnosisFailedError as error:
            return {**row, "failure": str(error), "seconds": sum(given.seconds for given in answers)}
        file = self.folder.path / "answers" / f"{case}.json"
        file.write_bytes(answers[-1].text)
        return {
            **row,
            "answer": file.name,
            "sha256": answers[-1].digest,
            "seconds": sum(given.seconds for given in answers),
            "robot_seconds": recorded["robot_seconds"] + budget - time_left(runs, budget),
            "traces": [trace.name for trace in traces],
            "further": [
                {"experiment": r.experiment, "trace": Path(r.file).name, "outcome": r.outcome, "duration": r.duration}
                for r in runs
            ],
        }

    def _answer(self, seed: int, traces: list[Path], held_out: str, runs: Sequence[Acquired]) -> SealedAnswer:
        left = time_left(runs, ROBOT_TIME) if self.folder.asked.acquire else None
        model = base_model(self._machine(seed))
        return diagnose_sealed(traces, self.folder.path / "traces" / held_out, model, self.diagnoser, left)

    def _further(self, seed: int, asked: NextExperiment, number: int) -> Acquired:
        """Runs the experiment that an answer asks for on the same arm."""
        made = record(seed, f"further {number}", asked.spec, self._machine(seed), self.folder.path / "traces")
        return as_run(asked, read_trace(made.file), made.file, made.outcome)

    def _score(self, seed: int) -> dict[str, Any]:
        """Reveals the truth and scores the answer, which must be the one that was sealed."""
        sealed = self._row("diagnose", seed)
        seen = Detectability.model_validate(self._row("detect", seed))
        if "failure" in sealed:
            found = score_of_failure(parse_truth(reveal(seed)), seen, sealed["seconds"])
        else:
            text = (self.folder.path / "answers" / sealed["answer"]).read_bytes()
            if sha256(text).hexdigest() != sealed["sha256"]:
                raise TrialStageError(f"answer {sealed['answer']}: is not the one that was sealed")
            answer = SealedAnswer(text, sealed["seconds"]).read()
            found = score(parse_truth(reveal(seed)), seen, answer, self._machine(seed))
        return found.model_dump(mode="json")
