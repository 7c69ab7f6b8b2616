"""Parameter deviations of the healthy arm that imitate a hidden effect exactly or nearly, if there are any.

`separation` uses them as a second start of its refit.
"""

from __future__ import annotations

from collections.abc import Iterable

from mock_controller.hidden.tolerances import tolerances
from mock_controller.modification import Modification
from mock_controller.modifications.friction import LoadDependentFriction, ViscousFriction
from mock_controller.modifications.load import LinkMass, Payload
from mock_controller.modifications.motor import WeakenedMagnet
from mock_controller.modifications.sensor import PotentiometerGain
from mock_controller.plant import PlantParameters


def imitation(parameters: PlantParameters, modifications: Iterable[Modification]) -> dict[str, float]:
    """Returns deviations (fractions) of the arm `parameters` that act like the modifications, or nearly, if any can."""
    found: dict[str, float] = {}
    for effect in modifications:
        for name, fraction in _of_one(parameters, effect).items():
            found[name] = found.get(name, 0.0) + fraction
    return found


def _of_one(  # noqa: PLR0911  (a table with one line per effect)
    parameters: PlantParameters, effect: Modification
) -> dict[str, float]:
    body = parameters.rigid_body
    match effect:
        case Payload():
            return {"m_load": effect.mass / body.m_load}
        case LinkMass():
            name = f"m{effect.joint}"
            return {name: effect.mass / float(getattr(body, name))}
        case LoadDependentFriction():
            return {f"coulomb_arm_{effect.joint}": effect.arm / parameters.friction.effective_arm}
        case ViscousFriction():
            return _damping(parameters, effect.joint, effect.coefficient)
        case WeakenedMagnet():
            return {f"{constant}_{effect.joint}": -effect.loss for constant in ("torque_constant", "back_emf_constant")}
        case PotentiometerGain():
            return _as_sensor_gain(parameters, effect.joint, 1.0 / (1.0 + effect.error) - 1.0)
        case _:
            return {}


def _dampings(parameters: PlantParameters, number: int) -> tuple[float, float]:
    """Returns the damping (N·m·s/rad) of a joint by its back-EMF and by its viscous friction."""
    joint = parameters.joints[number - 1]
    squared = joint.gear_ratio**2
    electrical = squared * joint.torque_constant * joint.back_emf_constant / joint.resistance
    return electrical, squared * joint.viscous_friction


def _as_sensor_gain(parameters: PlantParameters, number: int, excess: float) -> dict[str, float]:
    """Returns deviations that imitate a wrong sensor gain: the true speed is `excess` larger than the measured one, as
    a share.

    Damping and rotor inertia thus appear larger by that share.
    """
    damped = _damping(parameters, number, excess * sum(_dampings(parameters, number)))
    return {**damped, f"rotor_inertia_{number}": excess}


def _damping(parameters: PlantParameters, number: int, extra: float) -> dict[str, float]:
    """Returns deviations that add `extra` damping (N·m·s/rad), by back-EMF and viscous friction.

    It is divided so that the sum of squared deviations (in σ) is least.
    """
    stated = {tolerance.name: tolerance.stated for tolerance in tolerances()}
    names = (f"back_emf_constant_{number}", f"viscous_friction_{number}")
    present = _dampings(parameters, number)
    weights = [(stated[name] * damping) ** 2 for name, damping in zip(names, present, strict=True)]
    return {
        name: extra * weight / sum(weights) / damping
        for name, weight, damping in zip(names, weights, present, strict=True)
    }
