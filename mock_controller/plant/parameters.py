"""The plant's constants, in SI units, read from a data file that states the source of each."""

from __future__ import annotations

import math
from dataclasses import dataclass
from importlib import resources

from mock_controller.quantities import DataFileError, Provenance, QuantityReader

JOINTS = 6


@dataclass(frozen=True)
class RigidBodyParameters:
    """The arm of chapter 7: a cylinder, two thin uniform rods and a load at the end of the last one.

    `gravity` is a vector (m/s²) in base axes; z is up. `load_offset` moves the load's centre (m) along the hand,
    `centre_shift_2` and `centre_shift_3` those of links 2 and 3 (m) along the link.
    """

    m1: float
    m2: float
    m3: float
    m_load: float
    r1: float
    a2: float
    a3: float
    b2: float
    b3: float
    gravity: tuple[float, float, float]
    wrist_inertia: float
    load_offset: float = 0.0
    centre_shift_2: float = 0.0
    centre_shift_3: float = 0.0


@dataclass(frozen=True)
class JointParameters:
    """Motor, gear, friction, end stops and start angle (rad) of one joint.

    `gear_ratio` is motor turns per joint turn; `viscous_friction` acts on the motor's speed (7.30); `constant_friction`
    (N·m, at the joint) is added to the load-dependent Coulomb friction.
    """

    resistance: float
    inductance: float
    torque_constant: float
    back_emf_constant: float
    rotor_inertia: float
    gear_ratio: float
    viscous_friction: float
    constant_friction: float
    lower_stop: float
    upper_stop: float
    start: float

    @property
    def reflected_inertia(self) -> float:
        """Rotor inertia felt at the joint (kg·m²): n² J."""
        return self.gear_ratio**2 * self.rotor_inertia


@dataclass(frozen=True)
class FrictionParameters:
    """Coulomb friction: effective arm μ̃ (m) of (7.32)–(7.34) and the displacement (rad) over which it builds up.

    `extra_arms` (m) are added to the common arm at joints 1 to 3, each at its own joint.
    """

    effective_arm: float
    presliding: float
    extra_arms: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class AmplifierParameters:
    """Power amplifier: gain and symmetric limit of its output (V)."""

    gain: float
    supply_limit: float


@dataclass(frozen=True)
class PlantParameters:
    """All constants of the plant. Element i of `joints` is joint i+1."""

    rigid_body: RigidBodyParameters
    amplifier: AmplifierParameters
    friction: FrictionParameters
    joints: tuple[JointParameters, ...]

    @property
    def start(self) -> tuple[float, ...]:
        """Angles (rad) at which the arm stands when it is switched on."""
        return tuple(joint.start for joint in self.joints)


def _joint(reader: QuantityReader, number: int) -> JointParameters:
    table = f"joint_{number}"
    lower = reader.take(table, "lower_stop", "deg", -360, 360)
    upper = reader.take(table, "upper_stop", "deg", -360, 360)
    if lower >= upper:
        raise DataFileError(f"{table}: lower_stop {lower} deg must be below upper_stop {upper} deg")
    return JointParameters(
        resistance=reader.take(table, "resistance", "ohm", 1e-3, 1e3),
        inductance=reader.take(table, "inductance", "H", 0, 1),
        torque_constant=reader.take(table, "torque_constant", "N*m/A", 0, 10),
        back_emf_constant=reader.take(table, "back_emf_constant", "V*s/rad", 0, 10),
        rotor_inertia=reader.take(table, "rotor_inertia", "kg*m^2", 0, 1),
        gear_ratio=reader.take(table, "gear_ratio", "1", 1, 1e5),
        viscous_friction=reader.take(table, "viscous_friction", "N*m*s/rad", 0, 1),
        constant_friction=reader.take(table, "constant_friction", "N*m", 0, 100),
        lower_stop=math.radians(lower),
        upper_stop=math.radians(upper),
        start=math.radians(reader.take(table, "start", "deg", lower, upper)),
    )


def parse_plant(text: str, origin: str = "plant file") -> tuple[PlantParameters, tuple[Provenance, ...]]:
    """Returns parameters and the source of each, from TOML text. Raises DataFileError with one clear line."""
    reader = QuantityReader(text, origin)

    def body(key: str, unit: str, low: float, high: float) -> float:
        return reader.take("rigid_body", key, unit, low, high)

    parameters = PlantParameters(
        rigid_body=RigidBodyParameters(
            m1=body("m1", "kg", 0, 100),
            m2=body("m2", "kg", 1e-3, 100),
            m3=body("m3", "kg", 1e-3, 100),
            m_load=body("m_load", "kg", 1e-3, 100),
            r1=body("r1", "m", 0, 1),
            a2=body("a2", "m", 1e-2, 5),
            a3=body("a3", "m", 1e-2, 5),
            b2=body("b2", "m", -1, 1),
            b3=body("b3", "m", -1, 1),
            gravity=(
                body("gravity_x", "m/s^2", -20, 20),
                body("gravity_y", "m/s^2", -20, 20),
                body("gravity_z", "m/s^2", -20, 20),
            ),
            wrist_inertia=body("wrist_inertia", "kg*m^2", 1e-7, 1),
        ),
        amplifier=AmplifierParameters(
            gain=reader.take("amplifier", "gain", "1", 0.1, 1e3),
            supply_limit=reader.take("amplifier", "supply_limit", "V", 0.1, 1e3),
        ),
        friction=FrictionParameters(
            effective_arm=reader.take("friction", "effective_arm", "m", 0, 1),
            presliding=reader.take("friction", "presliding", "rad", 1e-4, 1e-1),
        ),
        joints=tuple(_joint(reader, number) for number in range(1, JOINTS + 1)),
    )
    reader.finish()
    return parameters, tuple(reader.provenance)


def default_plant_text() -> str:
    """Returns the text of the shipped data file: the model with viscous and Coulomb friction, table 7.9."""
    return resources.files("mock_controller.plant").joinpath("ma2000_plant.toml").read_text("utf-8")


def default_plant() -> PlantParameters:
    """Returns parameters of the shipped data file."""
    return parse_plant(default_plant_text(), "ma2000_plant.toml")[0]
