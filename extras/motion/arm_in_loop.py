"""A model of the arm and its controller as a function of set points."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from daq.contracts.errors import SpecError
from daq.contracts.experiment import Gain
from daq.contracts.machine import NoController
from extras.motion.posture_units import Scale, scale_of
from extras.motion.response import REACH, Response, response_of
from model.arrays import Floats
from model.machine_model.model import Model
from model.simulation.batch import BatchRun
from model.simulation.inputs import RunInputs, gains_of
from model.simulation.period import OUT_READING
from model.simulation.prepared import LONGEST_STEP, Options, Prepared, prepare

LEAD_IN = 1.5
"""Time (s) for which the simulated arm first holds its initial posture, until gravity and drive balance."""
NOISE_SEED = 1
"""Seed of the sensor's noise."""
CHANGE = 1.0
"""Change of a set point, in posture units, for estimating its response: the smallest that the controller takes."""


@dataclass(frozen=True)
class ArmInLoop:
    """The simulated arm: maps set points (k, n) of the modelled joints to readings (k, n), both in posture units.

    `smooth` and `rounded` are the run without and with the board's rounding, `lead` periods longer than the motion.
    """

    model: Model
    scale: Scale
    smooth: Prepared
    rounded: Prepared
    lead: int

    def readings(self, candidates: Sequence[Floats]) -> Floats:
        """Returns readings (r, k, n) for r candidates of set points, nothing rounded. Raises SpecError for an unstable
        loop."""
        return self._run([self._loaded(self.smooth, one) for one in candidates])

    def rounded_readings(self, set_points: Floats, draws: int) -> Floats:
        """Returns readings (r, k, n) of the board, with rounded set points, readings and powers, and `draws` draws of
        the stated noise."""
        machine = self.model.machine
        sensors = [machine.joint(joint).sensor for joint in machine.modelled_joints]
        counts = np.array([s.noise.value if s is not None and s.noise is not None else 0.0 for s in sensors])
        own, rng = self._loaded(self.rounded, np.floor(set_points + 0.5)), np.random.default_rng(NOISE_SEED)
        noises = counts * rng.standard_normal((draws, *own.noise.shape))
        return self._run([replace(own, noise=noise) for noise in noises])

    def responses(self, set_points: Floats) -> tuple[Response, ...]:
        """Returns the response of each joint about these set points.

        One run changes every REACH-th set point of all joints, so that REACH runs give the whole band. The influence of
        one joint's set points on another is left out: it is small, and the next run includes it.
        """
        count, joints = set_points.shape
        reach = min(REACH, count)
        rows = np.arange(count)
        changed = [set_points + CHANGE * (rows % reach == comb)[:, None] for comb in range(reach)]
        runs = self.readings([set_points, *changed])
        differences = (runs[1:] - runs[0]) / CHANGE
        places = rows[:, None] + np.arange(reach)
        inside = np.minimum(places, count - 1)
        bands = (differences[(rows % reach)[:, None], inside, j] for j in range(joints))
        return tuple(response_of(band) for band in bands)

    def _loaded(self, run: Prepared, set_points: Floats) -> Prepared:
        whole = np.concatenate([np.repeat(set_points[:1], self.lead, axis=0), set_points])
        return replace(run, set_points=self._taken(whole, rounded=run is self.rounded))

    def _taken(self, postures: Floats, *, rounded: bool) -> Floats:
        """Returns set points in the controller's units: counts for the board's integer PID, angles for others."""
        machine = self.model.machine
        if machine.controller.kind != "board_pid":
            return np.ascontiguousarray(self.scale.angles(postures))
        per_count = np.array([machine.calibration(j).rad_per_count for j in machine.modelled_joints])
        counts = postures * (self.scale.unit / per_count)
        return np.ascontiguousarray(np.floor(counts + 0.5) if rounded else counts)

    def _run(self, runs: Sequence[Prepared]) -> Floats:
        count = len(runs)
        vectors = np.tile(self.model.vector, (count, 1))
        initials = np.tile(self.smooth.initial, (count, 1, 1))
        out = BatchRun(self.model, runs, np.arange(count), vectors, initials, LONGEST_STEP).run()
        readings = out[:, OUT_READING, self.lead :]
        if not np.isfinite(readings).all():
            raise SpecError("the simulated motion does not stay finite: the model's control loop is unstable")
        return self.scale.postures(readings)


def arm_in_loop(model: Model, begin: Floats, count: int, gains: Mapping[int, Gain] | None) -> ArmInLoop:
    """Returns the arm at rest at `begin` (n,) posture units of its modelled joints, for a motion of `count` periods.

    Args:
        gains: those of the experiment, by joint; the machine's where it has none.

    Raises SpecError for a machine without a controller, or a joint without a sensor.
    """
    machine = model.machine
    controller = machine.controller
    if isinstance(controller, NoController):
        raise SpecError(f"machine {machine.name} has no controller that takes set points")
    joints, period = machine.modelled_joints, controller.period.value
    scale = scale_of(machine, joints)
    lead = round(LEAD_IN / period)
    whole = lead + count
    angles = np.tile(scale.angles(begin), (whole, 1))
    inputs = RunInputs(
        joints=joints,
        period=period,
        time=period * np.arange(float(whole)),
        set_points=angles,
        drive=np.zeros_like(angles),
        readings=angles,
        initial=np.stack([angles[0], np.zeros(len(joints))], axis=1),
        first_drive=np.zeros(len(joints)),
        rows=np.arange(whole, dtype=np.float64),
        gains=gains_of(machine, gains),
        noise=np.zeros_like(angles),
        name="the motion",
    )
    smooth = prepare(model, inputs, Options(quantise=False))
    return ArmInLoop(model, scale, smooth, prepare(model, inputs, Options()), lead)
