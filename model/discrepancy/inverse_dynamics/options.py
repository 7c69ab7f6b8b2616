"""What a diagnosis in torque space may be told."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat

from model.discrepancy.options import DiagnosisOptions


class TorqueOptions(BaseModel):
    """How to diagnose from torques.

    cutoff: Hz of the low-pass; None: the highest at which noise of the acceleration stays small.
    effects: names to try; None: every effect of the library, and the user's own, that acts on recorded torque.
    joints: on these joints only; None for all that the model moves.
    most_steps: effects added at most, one after the other.
    least_evidence: what an effect must take off −2 log posterior, its own parameters and the places looked at paid for.
    echo: share of the evidence that steps on its joints have brought, which a further effect must bring besides: what
        is left where a law is not exactly the rig's is no effect of its own.
    least_margin: evidence by which it must lead over every other answer, to be named alone.
    least_share: share by which the torque left on held-out records (in mean square) must fall.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    cutoff: Annotated[FiniteFloat, Field(gt=0)] | None = None
    effects: tuple[str, ...] | None = None
    joints: tuple[int, ...] | None = None
    most_steps: Annotated[int, Field(ge=1, le=20)] = 8
    least_evidence: FiniteFloat = 30.0
    echo: Annotated[FiniteFloat, Field(ge=0, lt=1)] = 0.02
    least_margin: FiniteFloat = 12.0
    least_share: Annotated[FiniteFloat, Field(ge=0, lt=1)] = 0.01


def torque_options(options: DiagnosisOptions | TorqueOptions | None) -> TorqueOptions:
    """What a diagnosis in torque space makes of the options of any diagnosis."""
    if isinstance(options, DiagnosisOptions):
        return TorqueOptions(effects=options.effects, joints=options.joints, most_steps=options.most_steps)
    return options or TorqueOptions()
