"""Options of a diagnosis."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from pydantic import Field, FiniteFloat

from daq.contracts.errors import SpecError
from daq.contracts.frozen import FrozenRecord, UserRecord
from model.discrepancy.grounds import Method
from model.discrepancy.thresholds import THRESHOLDS, TORQUE_LEAD, UNSURE_NOISE
from model.effects.library import effect

if TYPE_CHECKING:
    from model.machine_model.model import Model


class DiagnosisOptions(UserRecord):
    """Options of a diagnosis; the defaults suit traces of a machine with a known controller.

    effects: candidates by name; None for the whole library and loaded effects of the user's own.
    joints: on these joints only; None for all that the model moves.
    most_steps: effects that may be added, one after another.
    method: how model and records are compared; None: as machine and traces allow (`workflow.choose_method`).
    despite_doubts: compute although a record is doubted; the verdict stays `check-the-record`.
    """

    effects: tuple[str, ...] | None = None
    joints: tuple[int, ...] | None = None
    most_steps: Annotated[int, Field(ge=1, le=10)] = 3
    method: Method | None = None
    despite_doubts: bool = False


def check_options(options: DiagnosisOptions | TorqueOptions, model: Model) -> None:
    """Raises SpecError for options that leave nothing to look for.

    That is a joint that the model does not move, an effect that is not in the library, or a user's own effect that acts
    on other joints.
    """
    moved = model.machine.modelled_joints
    for joint in options.joints or ():
        if joint not in moved:
            raise SpecError(f"joints to look on: {joint} is not modelled; allowed are {_listed(moved)}")
    if options.effects == ():
        raise SpecError("effects to try: none is named; leave them out for all")
    looked_on = options.joints or moved
    for name in options.effects or ():
        own = effect(name).joints
        if own and not set(own) & set(looked_on):
            raise SpecError(
                f"effect {name}: its file has it on joints {_listed(own)} alone, and it is looked for on joints "
                f"{_listed(looked_on)}"
            )


def _listed(joints: tuple[int, ...]) -> str:
    return ", ".join(map(str, joints))


class TorqueOptions(FrozenRecord):
    """How to diagnose from torques.

    cutoff: of the low-pass, Hz; None: the highest at which noise of the acceleration stays small.
    effects: names to try; None: every effect of the library, and the user's own, that acts on recorded torque.
    joints: joints to look on; None for all that the model moves.
    most_steps: most effects that are added, one after the other.
    least_evidence: least fall of −2 log posterior by an effect, after the cost of its parameters and of the places
        searched.
    least_margin: least lead in evidence over every other answer, for an effect to be named alone.
    least_share: least share by which the mean square of the torque on held-out records must fall.
    """

    cutoff: Annotated[FiniteFloat, Field(gt=0)] | None = None
    effects: tuple[str, ...] | None = None
    joints: tuple[int, ...] | None = None
    most_steps: Annotated[int, Field(ge=1, le=20)] = 8
    least_evidence: FiniteFloat = UNSURE_NOISE * THRESHOLDS.significant
    least_margin: FiniteFloat = TORQUE_LEAD
    least_share: Annotated[FiniteFloat, Field(ge=0, lt=1)] = 0.01


def torque_options(options: DiagnosisOptions | TorqueOptions | None) -> TorqueOptions:
    """Returns the options of any diagnosis as options of this one, whose own number of steps holds where none is given:
    an arm of six joints has friction on each of them."""
    if isinstance(options, DiagnosisOptions):
        given = {"most_steps": options.most_steps} if "most_steps" in options.model_fields_set else {}
        return TorqueOptions(effects=options.effects, joints=options.joints, **given)
    return options or TorqueOptions()


def reading_options(options: DiagnosisOptions) -> TorqueOptions:
    """The same for readings, whose noise is known: what it takes to name an effect there."""
    return TorqueOptions(
        effects=options.effects,
        joints=options.joints,
        most_steps=options.most_steps,
        least_evidence=THRESHOLDS.significant,
        least_margin=THRESHOLDS.margin,
    )
