"""Steps by command: stop, period, gains, first ramps, and what the model says of them."""

from __future__ import annotations

import math
import time
from pathlib import Path
from typing import Any

import numpy as np

from daq.contracts.errors import SpecError
from daq_cli.commands.commission.bench import Bench, NotCommissionedError, connected

PERIODS = 150
"""Number of control periods over which the period is measured."""
TO_GAIN = (1, 2, 3)


def stop(bench: Bench) -> dict[str, Any]:
    """The program's stop, from the request to the board's confirmation."""
    with connected(bench) as controller:
        bench.consent.require(bench.call.port, controller.identity)
        begun = time.perf_counter()
        confirmation = controller.stop()
        taken = 1e3 * (time.perf_counter() - begun)
        if not confirmation.acknowledged:
            raise NotCommissionedError(f"the stop was not confirmed: {confirmation.problem}. Use the emergency stop")
        controller.release()
    return {
        "confirmed_ms": round(taken, 2),
        "frozen": [confirmation.frozen[joint] for joint in sorted(confirmation.frozen)],
    }


def period(bench: Bench) -> dict[str, Any]:
    """The control period by the host's clock."""
    with connected(bench) as controller:
        ticks, times, after = [], [], None
        for _ in range(PERIODS):
            snapshot = controller.next_snapshot(after, (1,))
            after = snapshot.tick
            ticks.append(snapshot.tick)
            times.append(snapshot.host_time)
        missed = controller.status().missed
    slope = float(np.polyfit(ticks, times, 1)[0]) if ticks[-1] > ticks[0] else math.nan
    left = np.asarray(times) - np.polyval(np.polyfit(ticks, times, 1), ticks)
    return {
        "period_ms": round(1e3 * slope, 4),
        "jitter_ms": round(1e3 * float(np.std(left)), 3),
        "missed_set_points": missed,
        "computing_delay": "not measured: the machine file's assumption stands",
    }


def gain(bench: Bench) -> dict[str, Any]:
    """Volts per radian of each joint, by `daq calibrate gain`."""
    from daq.calibration import gain_experiment, gains_from_trace
    from daq.traces.reader import read_trace
    from daq_cli.robot.access import robot_access
    from daq_cli.robot.experiment import acquire_complete

    robot = robot_access(bench.configured)
    joints = tuple(joint for joint in bench.joints if joint in TO_GAIN)
    done = acquire_complete(robot, gain_experiment(joints), robot.machine, robot.call.trace_folder, bench.consent)
    found = gains_from_trace(read_trace(done.trace), robot.machine)
    for one in found:
        bench.operator.show(str(one))
    return {"trace": str(done.trace), "gains": {f"joint_{one.joint}": str(one) for one in found if one.joint in joints}}


def first_ramp(bench: Bench) -> dict[str, Any]:
    """A ramp of joint 1."""
    return _ramp(bench, (1,))


def ramp(bench: Bench) -> dict[str, Any]:
    """The ramp step of the source, on joints 1 to 3."""
    return _ramp(bench, (1, 2, 3))


def _ramp(bench: Bench, joints: tuple[int, ...]) -> dict[str, Any]:
    from daq.contracts.experiment import ExperimentSpec
    from daq_cli.robot.access import robot_access
    from daq_cli.robot.experiment import acquire_complete

    robot = robot_access(bench.configured)
    spec = ExperimentSpec(name="commission-ramp", joints=joints)
    done = acquire_complete(robot, spec, robot.machine, robot.call.trace_folder, bench.consent)
    return {"trace": str(done.trace), "samples": done.samples, "missing": done.missing, "outcome": done.outcome}


def model(bench: Bench) -> dict[str, Any]:
    """Whether the arm behaves as its machine file says."""
    from daq.traces.reader import read_trace
    from model.comparison.compare import compare
    from model.machine_model.model import base_model

    if "trace" not in bench.record.steps.get("ramp", {}):
        raise SpecError("the step ramp has left no trace: do it first (--only ramp)")
    trace = read_trace(Path(bench.record.steps["ramp"]["trace"]))
    machine = bench.configured.settings.machine()
    compared = compare([("machine file", base_model(machine))], [trace])
    joints = compared.models[0].in_sample or ()
    left = {f"joint_{one.joint}_counts": round(one.counts, 2) for one in joints if one.counts is not None}
    above = [one.joint for one in joints if one.rmse > 2 * one.floor]
    return {
        **left,
        "above_the_noise_floor": above,
        "next": f"daq diagnose {bench.record.steps['ramp']['trace']}"
        if above
        else "nothing: the model explains the ramp",
    }
