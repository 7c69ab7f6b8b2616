"""Makes a new machine file from available data: a URDF, names of servos, a record, or answers at the terminal."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from daq.contracts.drive_library import library_drives
from daq.contracts.errors import SpecError
from daq.contracts.machine import Joint, Machine, PlainGain, parse_machine
from daq.contracts.machine_units import GAIN
from daq.contracts.quantity import Quantity
from daq.contracts.written_numbers import is_number, read_number
from extras.formats.robot_files.machine_of_arm import JointParts
from model.arrays import Floats

if TYPE_CHECKING:
    from daq.contracts.trace import Trace

TOLD = "as told when the file was made"
GUESSED = {"mass": "0.2 kg ± 50 %, guess", "length": "100 mm ± 20 %, guess"}
ALIKE_IN_A_ROW = 5.0
"""Factor on the standard error of a gain, because errors of consecutive samples are correlated."""
MOST_ERROR = 0.3
"""Largest relative standard error of a gain that is used."""
LIKELY = 0.5
"""Least share of the variance of a joint's needed torque that its recorded drive must explain to estimate its gain."""


@dataclass(frozen=True)
class Described:
    """A short description of a joint.

    drive: a name of the library, a torque per unit of the recorded drive such as `0.5 N·m/A`, or empty: not known.
    mass: of its link. length: to the next joint's axis. axis: direction of that axis relative to this one's;
    None: not told, taken for parallel.
    """

    name: str
    drive: str = ""
    mass: str = GUESSED["mass"]
    length: str = GUESSED["length"]
    axis: Literal["parallel", "crossed"] | None = None


def text_of(
    name: str, joints: Sequence[Described], unit: str, gravity: tuple[float, float, float] | None = None
) -> str:
    """Returns the machine file of described joints, whose notes say which directions were assumed.

    unit: of the recorded drive. gravity: m/s², z along the first axis; None: not told. Raises SpecError.
    """
    notes = ["gravity acts along the first axis (--gravity 0,-9.81,0: across it)"] if gravity is None else []
    if any(joint.axis is None for joint in joints[:-1]):
        notes.append("axes are parallel (alpha = '90 deg' in a joint's geometry crosses the next one)")
    lines = [f'name = "{name}"', *([] if gravity is None else [f"gravity = {list(gravity)}"])]
    lines += [f'notes = "Assumed: {"; ".join(notes)}."'] if notes else []
    for joint in joints:
        lines += ["", "[[joints]]", f'name = "{joint.name}"']
        alpha = ', alpha = "90 deg"' if joint.axis == "crossed" else ""
        lines.append(f'geometry = {{ a = "{joint.length}"{alpha} }}')
        lines.append(f'link = {{ mass = "{joint.mass}" }}')
        if joint.drive in library_drives():
            lines.append(f'drive = "{joint.drive}"')
        else:
            gain = joint.drive or f"1 {_gain_unit(unit)} ± 50 %, assumed: nothing is known of it"
            lines.append(f'drive = {{ gain = "{gain}" }}')
            lines.append('friction = { viscous = "0 ± 0.1 N·m·s/rad, guess", coulomb = "0 ± 0.1 N·m, guess" }')
    text = "\n".join(lines) + "\n"
    parse_machine(text, name)
    return text


def check_drive(text: str, slides: bool = False) -> str:
    """Returns the typed text if it is a drive. Raises SpecError."""
    if text and text not in library_drives():
        if not is_number(text):
            from daq.contracts.drive_library import library_drive

            library_drive(text)
        _gain(text, slides)
    return text


def parts_of(drives: Mapping[str, str], slides: Mapping[str, bool]) -> dict[str, JointParts]:
    """Returns the parts of joints, by name, whose drives are described; see `Described`. Raises SpecError."""
    found = {}
    for name, drive in drives.items():
        if drive in library_drives():
            own = library_joint(drive)
            found[name] = JointParts(own.drive, own.friction, own.sensor)
        elif drive:
            found[name] = JointParts(_gain(drive, slides[name]))
    return found


def library_joint(name: str) -> Joint:
    """Returns a joint with a drive of the library. Raises SpecError."""
    return parse_machine(f'name = "one"\n[[joints]]\nname = "one"\nlink = {{ mass = 1 }}\ndrive = "{name}"\n').joint(1)


def _gain(text: str, slides: bool) -> PlainGain:
    try:
        gain = Quantity.model_validate(read_number(text, TOLD, GAIN.sliding if slides else GAIN.allowed))
    except ValueError as error:
        raise SpecError(f"drive: {error}") from error
    return PlainGain(kind="gain", gain=gain)


def _gain_unit(unit: str, slides: bool = False) -> str:
    force = "N" if slides else "N·m"
    return f"{force}/({unit})" if "·" in unit else f"{force}/{unit}"


def with_gains_of_record(machine: Machine, trace: Trace) -> Machine:
    """Returns the machine with unknown drive gains estimated from a record, by the torque that its motion needs.

    A joint whose gain cannot be estimated gets 1, with a wide deviation.
    """
    unit = trace.record.drive_unit or "V"
    unknown = [
        j
        for j in machine.modelled_joints
        if isinstance((drive := machine.joint(j).drive), PlainGain) and drive.gain.assumed
    ]
    if trace.drive is None or not unknown:
        return machine
    plain = _with_gains(machine, dict.fromkeys(unknown, (1.0, None)), unit)
    if unit in ("N·m", "N"):
        return plain
    return _with_gains(plain, {joint: shown for joint, shown in _shown_gains(plain, trace) if joint in unknown}, unit)


def _shown_gains(machine: Machine, trace: Trace) -> Iterator[tuple[int, tuple[float, float | None]]]:
    """Yields by joint the estimated torque per unit of drive, with friction fitted too, and the explained share of the
    variance."""
    from extras.formats.robot_files.uncertain_numbers import CUTOFF
    from model.inverse_dynamics.recorded_motion import recorded_motion
    from model.inverse_dynamics.torque_balance import TorqueBalance
    from model.machine_model.model import base_model

    motion = recorded_motion(trace, machine, CUTOFF)
    balance = TorqueBalance(base_model(machine), (motion,))
    driven = balance.supplied_by_drive()[0]
    needed = balance.residual({})[0] + driven
    signs = (motion.contact, motion.speed, np.ones_like(motion.speed))
    friction = [motion.compared(signal) for signal in signs]
    rotor = motion.compared(motion.acceleration)
    for k, joint in enumerate(machine.modelled_joints):
        others = [own[:, k] for own in friction]
        sides = needed[:, k], driven[:, k]
        yield joint, _ratio(*sides, [*others, rotor[:, k]]) or _ratio(*sides, others) or (1.0, None)


def _ratio(needed: Floats, driven: Floats, others: Sequence[Floats]) -> tuple[float, float] | None:
    """Returns the torque per unit of drive, with other contributions fitted, and the share of the torque that all
    explain.

    None if the record does not determine it.
    """
    columns = np.stack([driven, *others], axis=1)
    size = np.linalg.norm(columns, axis=0)
    if not size[0]:
        return None
    columns = columns[:, size > 0.0] / size[size > 0.0]
    found = np.linalg.lstsq(columns, needed, rcond=1e-9)[0]
    left, whole = needed - columns @ found, needed - needed.mean()
    explained = 1.0 - float(left @ left) / max(float(whole @ whole), 1e-300)
    spread = np.linalg.pinv(columns.T @ columns)[0, 0]
    error = ALIKE_IN_A_ROW * np.sqrt(float(left @ left) / len(left) * spread)
    if explained < LIKELY or error > MOST_ERROR * abs(found[0]):
        return None
    return float(found[0] / size[0]), explained


def _with_gains(machine: Machine, gains: Mapping[int, tuple[float, float | None]], unit: str) -> Machine:
    joints = list(machine.joints)
    for number, (value, likeness) in gains.items():
        joint = joints[number - 1]
        exact = unit in ("N·m", "N")
        word = "the recorded drive is the torque" if exact else "nothing is known of it"
        source = word if likeness is None else f"a record and the stated masses; it explains {likeness:.0%} of it"
        rounded = float(f"{value:.3g}")
        gain = Quantity(
            value=rounded,
            unit=_gain_unit(unit, joint.kind == "prismatic"),
            source=source,
            assumed=True,
            deviation=None if exact else float(f"{abs(rounded) * (0.5 if likeness is None else MOST_ERROR):.2g}"),
        )
        joints[number - 1] = joint.model_copy(update={"drive": PlainGain(kind="gain", gain=gain)})
    notes = [line for line in machine.notes.split("\n") if "the recorded drive is the torque" not in line]
    changed = {"joints": tuple(joints), "notes": "\n".join(notes)}
    return Machine.model_validate(machine.model_copy(update=changed).model_dump())
