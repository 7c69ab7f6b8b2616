"""A step that the recorded controller's own numbers prove."""

from __future__ import annotations

import numpy as np

from model.discrepancy.diagnosis import UNWRITTEN, Candidate, FoundValue, Step, Where
from model.discrepancy.grounds import ControllerProof
from model.discrepancy.output_error.controller_evidence import ControllerFinding
from model.discrepancy.output_error.holdout import errors
from model.discrepancy.output_error.observation import Observation, Signals
from model.machine_model.model import Model


def proved_step(model: Model, observation: Observation, finding: ControllerFinding) -> Step:
    """Nothing was fitted for it: its evidence is the number of samples that prove it, and its errors are zero."""
    part = "relative" if finding.effect == "wrong_gain" else "share"
    name = f"joint{finding.joint}.{finding.effect}.{part}"
    value = FoundValue(value=finding.value, low=finding.low, high=finding.high, unit="1")
    evidence = float(finding.samples)
    proof = Candidate(
        effect=finding.effect, joints=(finding.joint,), evidence=evidence, parameters={name: value}, refitted=False
    )
    quiet: Signals = tuple(np.zeros_like(r.measured) for r in observation.records)
    where = Where(joint=finding.joint, phase=None, summary=UNWRITTEN, cells=(), dependences=())
    return Step(
        effect=finding.effect, joints=(finding.joint,), parameters={name: value}, evidence=evidence, margin=evidence,
        candidates=(proof,), rmse_fit=errors(observation, model, quiet, quiet, observation.deviations), where=where,
        reason=UNWRITTEN, proof=ControllerProof(samples=finding.samples, of=finding.of), adopted=True,
    )  # fmt: skip
