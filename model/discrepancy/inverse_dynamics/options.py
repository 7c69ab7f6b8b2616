"""Options of a diagnosis by inverse dynamics."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, FiniteFloat

from daq.contracts.frozen import FrozenRecord
from model.discrepancy.options import DiagnosisOptions


class TorqueOptions(FrozenRecord):
    """How to diagnose from torques.

    cutoff: of the low-pass, Hz; None: the highest at which noise of the acceleration stays small.
    effects: names to try; None: every effect of the library, and the user's own, that acts on recorded torque.
    joints: joints to look on; None for all that the model moves.
    most_steps: most effects that are added, one after the other.
    least_evidence: least fall of −2 log posterior by an effect, after the cost of its parameters and of the places
        searched.
    echo: share of the evidence from earlier steps on the same joints, which a further effect must bring in addition:
        where the law of an effect is not exactly the rig's, what is left is no effect of its own.
    least_margin: least lead in evidence over every other answer, for an effect to be named alone.
    least_share: least share by which the mean square of the torque on held-out records must fall.
    """

    cutoff: Annotated[FiniteFloat, Field(gt=0)] | None = None
    effects: tuple[str, ...] | None = None
    joints: tuple[int, ...] | None = None
    most_steps: Annotated[int, Field(ge=1, le=20)] = 8
    least_evidence: FiniteFloat = 30.0
    echo: Annotated[FiniteFloat, Field(ge=0, lt=1)] = 0.02
    least_margin: FiniteFloat = 12.0
    least_share: Annotated[FiniteFloat, Field(ge=0, lt=1)] = 0.01


def torque_options(options: DiagnosisOptions | TorqueOptions | None) -> TorqueOptions:
    """Returns the options of any diagnosis as options of this one, whose own number of steps holds where none is given:
    an arm of six joints has friction on each of them."""
    if isinstance(options, DiagnosisOptions):
        given = {"most_steps": options.most_steps} if "most_steps" in options.model_fields_set else {}
        return TorqueOptions(effects=options.effects, joints=options.joints, **given)
    return options or TorqueOptions()
