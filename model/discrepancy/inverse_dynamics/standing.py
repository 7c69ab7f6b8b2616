"""Where a diagnosis by inverse dynamics stands: what its next step is judged against, and what its answer tells of."""

from __future__ import annotations

from dataclasses import dataclass

from model.discrepancy.diagnosis import Step
from model.discrepancy.inverse_dynamics.case import TorqueCase
from model.discrepancy.inverse_dynamics.fitting import BalanceFit
from model.machine_model.model import Model


@dataclass(frozen=True)
class Standing:
    """The records of a diagnosis and what it has made of them so far.

    given: the model as the user gave it. model: the one with the effects found so far. now: the fit of that. steps:
    those that were tried so far, adopted or not.
    """

    case: TorqueCase
    given: Model
    model: Model
    now: BalanceFit
    steps: tuple[Step, ...]
