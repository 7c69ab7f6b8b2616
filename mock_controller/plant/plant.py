"""The arm with its drives: volts at the amplifiers' inputs in, joint angles out.

MuJoCo moves the rigid bodies; motors, gears, friction and amplifiers are the mock's own. The two meet once a step.
Angles and rates are staggered as in the leapfrog scheme: `qvel` belongs to the step's time t and `qpos` to t + h/2,
which makes the engine's semi-implicit Euler step second order in h. The motors' linear damping is taken at
mid-step: half of it by the engine's implicit damping, half as a force.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import mujoco
import numpy as np

from mock_controller.modification import Modification, Restartable, of_kind
from mock_controller.plant.drive_train import CoulombLevel, DriveTrain, FreeRotor, deflect
from mock_controller.plant.extension_points import (
    AddsJointTorque,
    AddsTorque,
    ChangesDriveVoltage,
    ChangesFriction,
    ChangesMotorTorque,
    ChangesMotorVolts,
    ChangesPlant,
    ChangesTransmission,
    CouplesDrives,
    KnowsPlant,
    RubsUnderGravity,
)
from mock_controller.plant.parameters import JOINTS, PlantParameters
from mock_controller.plant.rigid_body import RigidSteps, build_model

STEP_US = 1000
"""Integration step (µs); halving it changes the default ramp by less than a hundredth of an ADC count."""

_PARTS_OF_A_STEP = 4
"""Substeps of a step with an elastic gear or backlash: the light waist of an upright arm oscillates in its teeth."""
_STALL_INERTIA = 1e9
"""Inertia (kg·m²) of a stalled joint, large enough to hold it still against any torque of the arm."""


class PlantError(ValueError):
    """An invalid state of the plant or request to it."""


class Plant:
    """Six joints from a set of parameters and modifications, at rest at `angles` (rad; by default the file's start).

    Raises PlantError for a modification that the step length cannot follow.
    """

    def __init__(
        self,
        parameters: PlantParameters,
        modifications: Iterable[Modification] = (),
        angles: Sequence[float] | None = None,
        step_us: int = STEP_US,
    ) -> None:
        self._modifications = tuple(modifications)
        for change in of_kind(self._modifications, ChangesPlant):
            parameters = change.change_plant(parameters)
        self.parameters = parameters
        self.step_us = step_us
        self._inner_us = step_us
        if of_kind(self._modifications, ChangesTransmission):
            self._inner_us = max(step_us // _PARTS_OF_A_STEP, 1)
        self._step_s = self._inner_us * 1e-6
        self._drives = [DriveTrain(joint, self._step_s) for joint in parameters.joints]
        self._rotors = self._free_rotors()
        self._model = build_model(parameters, self._step_s, {index + 1 for index in self._rotors})
        self._data = mujoco.MjData(self._model)
        self._q = self._data.qpos
        self._v = self._data.qvel
        self._applied = self._data.qfrc_applied
        self._coulomb = CoulombLevel(parameters)
        self._presliding_rate = parameters.friction.presliding / self._step_s
        """Joint rate (rad/s) at which one step covers the presliding displacement."""
        self._with_current = [i for i, joint in enumerate(parameters.joints) if joint.inductance > 0.0]
        self._half_damping = [0.0 if i in self._rotors else 0.5 * drive.damping for i, drive in enumerate(self._drives)]
        for curious in of_kind(self._modifications, KnowsPlant):
            curious.know_plant(parameters, self._step_s)
        self._coupling_effects: list[CouplesDrives] = of_kind(self._modifications, CouplesDrives)
        self._supply_effects: list[ChangesMotorVolts] = of_kind(self._modifications, ChangesMotorVolts)
        self._voltage_effects: list[ChangesDriveVoltage] = of_kind(self._modifications, ChangesDriveVoltage)
        self._torque_effects: list[ChangesMotorTorque] = of_kind(self._modifications, ChangesMotorTorque)
        self._friction_effects: list[ChangesFriction] = of_kind(self._modifications, ChangesFriction)
        self._gravity_effects: list[RubsUnderGravity] = of_kind(self._modifications, RubsUnderGravity)
        self._still = mujoco.MjData(self._model)
        """The arm at rest, for computing gravity's torques."""
        self._joint_effects: list[AddsJointTorque] = of_kind(self._modifications, AddsJointTorque)
        self._outside_effects: list[AddsTorque] = of_kind(self._modifications, AddsTorque)
        self._is_modified = any(
            (
                self._with_current,
                self._rotors,
                self._supply_effects,
                self._torque_effects,
                self._friction_effects,
                self._gravity_effects,
                self._joint_effects,
                self._outside_effects,
            )
        )
        self._model.dof_damping[:] = self._half_damping
        self._rigid = RigidSteps(self._model, self._data, self._half_damping, self._coulomb, self._presliding_rate)
        self._stalled: set[int] = set()
        self.reset(parameters.start if angles is None else angles)
        self._check_stiffness()

    def reset(self, angles: Sequence[float]) -> None:
        """Puts the arm at rest at six joint angles (rad) at time zero, motors without current, nothing stalled.

        Raises PlantError outside the end stops.
        """
        for number, (angle, joint) in enumerate(zip(angles, self.parameters.joints, strict=True), start=1):
            if not joint.lower_stop <= angle <= joint.upper_stop:
                low, high = math.degrees(joint.lower_stop), math.degrees(joint.upper_stop)
                raise PlantError(
                    f"joint {number}: start at {math.degrees(angle):.2f}°: allowed are {low:.2f}° to {high:.2f}°"
                )
        for number in tuple(self._stalled):
            self.release(number)
        mujoco.mj_resetData(self._model, self._data)
        self._q[:] = angles
        mujoco.mj_forward(self._model, self._data)
        self._bristle = [0.0] * JOINTS
        self._current = [0.0] * JOINTS
        self._motor_volts = [0.0] * JOINTS
        self._steps = 0
        for index, rotor in self._rotors.items():
            rotor.angle, rotor.rate = float(angles[index]), 0.0
        for modification in of_kind(self._modifications, Restartable):
            modification.restart()

    @property
    def time_us(self) -> int:
        """Simulated time since the reset (µs)."""
        return self._steps * self._inner_us

    @property
    def joint_angles(self) -> list[float]:
        """True angles of the six joints (rad)."""
        half = 0.5 * self._step_s
        return [q - half * v for q, v in zip(self._q.tolist(), self._v.tolist(), strict=True)]

    @property
    def joint_rates(self) -> list[float]:
        """True rates of the six joints (rad/s)."""
        rates: list[float] = self._v.tolist()
        return rates

    @property
    def motor_volts(self) -> tuple[float, ...]:
        """Volts at the six motors, after amplifier and supply limit."""
        return tuple(self._motor_volts)

    @property
    def stalled_joints(self) -> frozenset[int]:
        """Joints (from 1) that are jammed."""
        return frozenset(self._stalled)

    def stall(self, joint: int) -> None:
        """Jams a joint (from 1) at once, at its present angle."""
        index = _index(joint)
        self._q[index] -= 0.5 * self._step_s * self._v[index]
        self._v[index] = 0.0
        self._model.dof_armature[index] = _STALL_INERTIA
        self._stalled.add(joint)

    def release(self, joint: int) -> None:
        """Frees a jammed joint (from 1); a free one stays free."""
        index = _index(joint)
        rigid = index not in self._rotors
        self._model.dof_armature[index] = self.parameters.joints[index].reflected_inertia if rigid else 0.0
        self._v[index] = 0.0
        self._stalled.discard(joint)

    def advance(self, volts_in: Sequence[float], duration_us: int) -> None:
        """Moves the arm for `duration_us` under six constant voltages (V) at the amplifiers' inputs.

        Raises PlantError for a duration that is no whole number of steps, or volts that are not six finite numbers.
        """
        steps, rest = divmod(duration_us, self.step_us)
        if rest or steps < 0:
            raise PlantError(f"duration of {duration_us} µs: must be a whole number of {self.step_us} µs steps")
        if len(volts_in) != JOINTS or not all(map(math.isfinite, volts_in)):
            raise PlantError(f"voltages {list(volts_in)}: must be {JOINTS} finite numbers")
        volts = self._motor_volts = self._amplify(volts_in)
        if self._is_modified:
            for _ in range(steps * (self.step_us // self._inner_us)):
                self._step_modified(volts)
            return
        self._bristle = self._rigid.run(self._pushed_by(volts), self._bristle, steps)
        self._steps += steps

    def place(self, angles: Sequence[float], duration_us: int) -> None:
        """Puts the arm at rest at six angles (rad) after `duration_us`, during which something else held and moved
        it."""
        self._q[:] = angles
        self._v[:] = 0.0
        self._bristle = [0.0] * JOINTS
        self._current = [0.0] * JOINTS
        self._motor_volts = [0.0] * JOINTS
        for index, rotor in self._rotors.items():
            rotor.angle, rotor.rate = float(angles[index]), 0.0
        self._steps += duration_us // self._inner_us

    def _pushed_by(self, volts: list[float]) -> list[float]:
        """Returns the joint torques (N·m) of the motors' volts within a step, before any damping."""
        return [drive.torque_per_volt * value for drive, value in zip(self._drives, volts, strict=True)]

    def _amplify(self, volts_in: Sequence[float]) -> list[float]:
        amplifier = self.parameters.amplifier
        volts = [amplifier.gain * value for value in volts_in]
        for coupling in self._coupling_effects:
            volts = coupling.coupled_volts(volts)
        for effect in self._voltage_effects:
            index = effect.joint - 1
            volts[index] = effect.drive_voltage(volts[index], self.time_us * 1e-6)
        limit = amplifier.supply_limit
        return [min(max(value, -limit), limit) for value in volts]

    def _step_modified(self, asked: list[float]) -> None:
        """Does one step with everything that a modification or an inductance may add; `asked` are the amplifiers'
        volts."""
        v: list[float] = self._v.tolist()
        q: list[float] = self._q.tolist()
        time_s = self.time_us * 1e-6
        bristle = self._deflect(v)
        if self._supply_effects:
            volts = list(asked)
            for supply in self._supply_effects:
                volts[supply.joint - 1] = supply.motor_volts(volts[supply.joint - 1])
            self._motor_volts = volts
        # The motor's torque without the damping that depends on the motor's own speed.
        motor = self._pushed_by(self._motor_volts)
        for i in self._with_current:
            motor[i] += self._drives[i].torque_per_held_ampere * self._current[i]
        for effect in self._torque_effects:
            i = effect.joint - 1
            damping = self._drives[i].damping * (self._rotors[i].rate if i in self._rotors else v[i])
            motor[i] += effect.torque_change(motor[i] - damping, time_s, q[i], v[i])
        level = self._coulomb.at(q)
        if self._gravity_effects:
            weights = self._weights(q)
            for rubbing in self._gravity_effects:
                i = rubbing.joint - 1
                level[i] = rubbing.friction_under_gravity(level[i], weights[i])
        for friction in self._friction_effects:
            i = friction.joint - 1
            level[i] = friction.friction_level(level[i], q[i], v[i])
        speed_before = [self._rotors[i].rate if i in self._rotors else v[i] for i in self._with_current]
        torque = [
            self._rotors[i].advance(motor[i], q[i], v[i], self._step_s)
            if i in self._rotors
            else motor[i] - self._half_damping[i] * v[i]
            for i in range(JOINTS)
        ]
        for own in self._joint_effects:
            torque[own.joint - 1] += own.joint_torque(time_s, q[own.joint - 1], v[own.joint - 1])
        for outside in self._outside_effects:
            added = outside.external_torque(time_s, q, v)
            torque = [inside + extra for inside, extra in zip(torque, added, strict=True)]
        self._applied[:] = [torque[i] - level[i] * bristle[i] for i in range(JOINTS)]
        mujoco.mj_step(self._model, self._data)
        self._advance_currents(speed_before)
        self._steps += 1

    def _weights(self, q: list[float]) -> list[float]:
        """Returns the torques (N·m) with which gravity loads the joints at six angles (rad)."""
        self._still.qpos[:] = q
        mujoco.mj_kinematics(self._model, self._still)
        mujoco.mj_comPos(self._model, self._still)
        found = np.zeros(JOINTS)
        mujoco.mj_rne(self._model, self._still, 0, found)
        weights: list[float] = found.tolist()
        return weights

    def _deflect(self, v: list[float]) -> list[float]:
        """Updates the bristles after the displacement h·v that brought each joint to its present angle."""
        self._bristle = deflect(self._bristle, v, self._presliding_rate)
        return self._bristle

    def _advance_currents(self, speed_before: list[float]) -> None:
        for i, before in zip(self._with_current, speed_before, strict=True):
            after = self._rotors[i].rate if i in self._rotors else float(self._v[i])
            mid = 0.5 * (before + after)
            self._current[i] = self._drives[i].next_current(self._current[i], self._motor_volts[i], mid)

    def _free_rotors(self) -> dict[int, FreeRotor]:
        """Returns rotors that a modification has separated from their links, by index; their inertia leaves the rigid
        body."""
        rotors: dict[int, FreeRotor] = {}
        for change in of_kind(self._modifications, ChangesTransmission):
            index = _index(change.joint)
            if index in rotors:
                raise PlantError(f"joint {change.joint}: two modifications change its transmission")
            inertia = self.parameters.joints[index].reflected_inertia
            rotors[index] = FreeRotor(change.transmission(), inertia, self._drives[index].damping)
        return rotors

    def _check_stiffness(self) -> None:
        """Rejects a coupling whose natural frequency an explicit step cannot follow."""
        inertias = np.zeros((JOINTS, JOINTS))
        mujoco.mj_fullM(self._model, self._data, inertias)
        for index, rotor in self._rotors.items():
            # Computed with every other joint free, where the link's inertia is smallest.
            link = 1.0 / float(np.linalg.inv(inertias)[index, index])
            own = self.parameters.joints[index].reflected_inertia
            effective = link * own / (link + own) if own > 0.0 else 0.0
            allowed = effective / self._step_s**2
            damping_allowed = effective / self._step_s
            coupling = rotor.transmission
            if coupling.stiffness > allowed or coupling.damping > damping_allowed:
                raise PlantError(
                    f"joint {index + 1}: coupling of {coupling.stiffness:g} N·m/rad and {coupling.damping:g} N·m·s/rad "
                    f"is too stiff for {self._inner_us} µs steps: allowed are {allowed:.3g} and {damping_allowed:.3g}"
                )


def _index(joint: int) -> int:
    if not 1 <= joint <= JOINTS:
        raise PlantError(f"joint {joint}: allowed are 1 to {JOINTS}")
    return joint - 1
