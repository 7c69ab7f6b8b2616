"""Index of every parameter of a model in the flat vector that compiled code reads.

The vector is `SHARED` values of the whole machine, then `PER_JOINT` values per joint. Every effect of the library has
its place; an effect that a model lacks is at its null value there, where it does nothing.
"""

from __future__ import annotations

(
    LOAD,  # kg, a point at the end of the last modelled link
    PAYLOAD,  # kg in addition to the load in the machine file
    GRAVITY_X,  # m/s², base frame
    GRAVITY_Y,
    GRAVITY_Z,
    TILT_X,  # rad, the base turned about its x axis
    TILT_Y,
    PERIOD,  # s, control period
    DELAY,  # s from sampling to the change of the drive
    PUBLISHED_INERTIA,  # 1: link 3 and load as one rod (7.28); 0: exact
) = range(10)
SHARED = 10

(
    A,  # m, D-H
    ALPHA,  # rad
    D,  # m
    THETA,  # rad
    MASS,  # kg
    MASS_ADDED,  # kg
    RADIUS,  # m, of a cylinder about its joint
    CENTRE_X,  # m, of a general body, in the link's frame
    CENTRE_Y,
    CENTRE_Z,
    INERTIA_XX,  # kg·m², about that centre
    INERTIA_YY,
    INERTIA_ZZ,
    INERTIA_XY,
    INERTIA_XZ,
    INERTIA_YZ,
    SHIFT,  # m, centre of mass displaced along the link
    RESISTANCE,  # Ω
    INDUCTANCE,  # H
    TORQUE_CONSTANT,  # N·m/A
    BACK_EMF,  # V·s/rad
    FLUX_LOSS,  # share of the magnet's flux: of torque and back-EMF constant
    ROTOR_INERTIA,  # kg·m², motor side
    GEAR,  # motor turns per joint turn
    VOLTS_PER_COUNT,  # V at the motor for a DAC count
    SUPPLY,  # V
    DEAD_ZONE,  # V at the motor
    THRESHOLD,  # V commanded, above which the amplifier passes all
    HEATING,  # relative rise of resistance per A²·s
    COOLING_TIME,  # s
    TIMED_RISE,  # relative rise of resistance over time, its final value
    RISING_TIME,  # s
    VISCOUS,  # N·m·s/rad, motor side
    COULOMB,  # N·m at the joint
    COULOMB_ARM,  # m
    GRAVITY_SHARE,  # of the gravity torque
    PRESLIDING,  # rad
    PRESLIDING_SHAPE,  # 0 Prandtl, 1 Dahl
    STRIBECK,  # N·m
    STRIBECK_SPEED,  # rad/s
    BREAKAWAY,  # N·m above Coulomb friction
    DIRECTION,  # N·m, forward − backward
    VISCOUS_DIRECTION,  # N·m·s/rad, motor side, forward − backward
    DRAG,  # N·m·s²/rad²
    GEAR_LOSS,  # share of the motor's torque
    GEAR_LOSS_DIRECTION,  # share of the motor's torque, driving − driven
    COMPLIANCE,  # rad/(N·m)
    TRANSMISSION_DAMPING,  # N·m·s/rad
    GAP,  # rad, full backlash
    CONTACT_COMPLIANCE,  # rad/(N·m), always in series in a transmission with backlash or compliance
    RIPPLE_SINE,  # N·m
    RIPPLE_COSINE,
    RIPPLE_CYCLES,  # per joint turn
    SPRING,  # N·m/rad
    SPRING_REST,  # rad
    CABLE,  # N·m/rad, signed: the side on which it pulls
    CABLE_REST,  # rad
    CONSTANT_TORQUE,  # N·m
    DISTURBANCE_SINE,  # N·m
    DISTURBANCE_COSINE,
    DISTURBANCE_FREQUENCY,  # Hz
    AT_ZERO,  # rad at count 0
    RAD_PER_COUNT,  # signed; 0 without a sensor
    RANGE,  # rad from count 0 to the last one, signed as counting
    POTENTIOMETER_GAIN,  # relative, about the middle of the range
    POTENTIOMETER_OFFSET,  # rad
    BEND_1,  # rad, sine of half a wave over the range, and its harmonics
    BEND_2,
    BEND_3,
    BEND_4,
    BEND_5,
    BEND_6,
    BEND_7,
    BEND_8,
    GAIN_ERROR,  # relative, of the controller
    EXTRA_DELAY,  # s
    LOST,  # share of set points
    OUTPUT_LIMIT,  # largest output of a sampled controller, unit of the drive
    SHAPE,  # of the link: CYLINDER, ROD or BODY
    PRISMATIC,  # 1, or 0 for a revolute joint
    USER,  # the first of USER_COLUMNS for effects from users' files
) = range(81)
BENDS = range(BEND_1, BEND_8 + 1)
USER_COLUMNS = 8
PER_JOINT = USER + USER_COLUMNS

CYLINDER, ROD, BODY = 0, 1, 2

# Bits of the integer that states which state-changing effects a joint has.
HAS_INDUCTANCE, HAS_FLEXIBILITY, HAS_STICTION, HAS_EXTRA_TORQUE, HAS_USER_EFFECT = 1, 2, 4, 8, 16
"""HAS_USER_EFFECT: at least one user effect."""

# Settings of a run, in this order.
(CONTROLLER, QUANTISE, PUBLISHED_LOADS, DRIVE_RECORDED) = range(4)
SETTINGS = 4
# Values of the setting QUANTISE. DRIVE_ROUNDED: only the output of a sampled controller, not the reading.
NOTHING_ROUNDED, ALL_ROUNDED, DRIVE_ROUNDED = 0, 1, 2
NO_CONTROLLER, BOARD_PID, SAMPLED_PID, CASCADE = 0, 1, 2, 3


def size(joints: int) -> int:
    """Returns the length of the vector of a machine with `joints` modelled joints."""
    return SHARED + joints * PER_JOINT


def slot(joint: int, column: int) -> int:
    """Returns the index of a joint's (from 1) column in the vector."""
    return SHARED + (joint - 1) * PER_JOINT + column


def column(slot: int) -> int:
    """Returns the column of a joint at an index of the vector beyond `SHARED`."""
    return (slot - SHARED) % PER_JOINT
