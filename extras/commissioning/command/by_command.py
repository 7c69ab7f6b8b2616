"""Commissioning steps by command: stop, period, gains, first ramps, and their comparison with the model."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from daq.contracts.errors import SpecError
from daq.contracts.trace import LATE_SET_POINTS, late_set_points_line
from extras.commissioning.command.arm import note_period
from extras.commissioning.command.bench import CONFIG, Bench, NotCommissionedError, connected
from extras.commissioning.command.periods import followed_periods
from extras.commissioning.memory.procedure import Task
from firmware_protocol.commands import StatusFlag

if TYPE_CHECKING:
    from daq.calibration.gain import GainEstimate
    from daq.contracts.experiment import ExperimentSpec
    from daq.contracts.trace import Trace
    from model.machine_model.model import Model

TO_GAIN = (1, 2, 3)
FLOORS = 2.0
"""Errors above this multiple of the noise floor are more than noise, and are diagnosed."""
DIAGNOSIS = "diagnosis.html"
NEXT = "next_experiment.json"
WITHIN_TOLERANCES = "yes, within its tolerances"
"""Text for an arm that differs from the file's values, but within the file's deviations."""


def end_freeze(bench: Bench) -> None:
    """Ends an active stop with the person's consent; nothing moves by that. Raises NotCommissionedError if it is to
    stay."""
    with connected(bench) as controller:
        status = controller.status()
        if StatusFlag.FROZEN not in status.flags:
            return
        if not bench.operator.begin(Task("end_freeze")):
            raise NotCommissionedError(
                "the bridge holds the set points, so nothing can move: "
                f"`daq --config {bench.folder / CONFIG} reset` ends that"
            )
        controller.release(status.stop)


def stop(bench: Bench) -> dict[str, Any]:
    """Tests the program's stop, from the request to the board's confirmation and the ID for its release."""
    with connected(bench) as controller:
        asked = replace(
            bench.consent, what="it will be stopped at its present posture, and released again", refused="it is stopped"
        )
        asked.require(bench.call.port, controller.identity)
        confirmation, number = controller.stop_numbered()
        if not confirmation.acknowledged:
            raise NotCommissionedError(f"the stop was not confirmed: {confirmation.problem}. Use the emergency stop")
        if number is None:
            raise NotCommissionedError("the arm had already been stopped: look at it; `daq reset` ends that stop")
        controller.release(number)
    return {
        "confirmed_ms": round(1e3 * (confirmation.seconds or 0.0), 2),
        "frozen": [confirmation.frozen[joint] for joint in sorted(confirmation.frozen)],
    }


def period(bench: Bench) -> dict[str, Any]:
    """Measures the control period by the host's clock."""
    with connected(bench) as controller:
        found = followed_periods(controller)
        missed = controller.status().missed
    if found.problem:
        raise NotCommissionedError(found.problem)
    note_period(bench, found.period_ms, found.error_ms)
    return {
        "period_ms": round(found.period_ms, 4),
        "jitter_ms": round(found.jitter_ms, 3),
        "missed_set_points": missed,
    }


def gain(bench: Bench) -> dict[str, Any]:
    """Measures volts per radian of each joint, by `daq calibrate gain`; writes the common part into the machine
    file."""
    from daq.calibration import gain_experiment, gains_from_trace
    from daq.calibration.gain import GainEstimate, common_gain
    from daq.contracts.quantity import Quantity
    from daq.traces.reader import read_trace
    from daq_cli.robot.access import robot_access
    from daq_cli.robot.experiment import acquire_complete
    from extras.commissioning.command.measured import with_controller

    robot = robot_access(bench.configured)
    joints = tuple(joint for joint in bench.joints if joint in TO_GAIN)
    done = acquire_complete(robot, gain_experiment(joints), robot.machine, robot.call.trace_folder, bench.consent)
    trace = read_trace(done.trace)
    estimates = [one for one in gains_from_trace(trace, robot.machine) if one.joint in joints]
    for one in estimates:
        bench.operator.show(str(one))
    result: dict[str, Any] = {"trace": str(done.trace)}
    for one in estimates:
        result[f"joint_{one.joint}"] = _gain_data(one) if isinstance(one, GainEstimate) else {"problem": str(one)}
    common = common_gain([one for one in estimates if isinstance(one, GainEstimate)])
    if common is None:
        return result | {"machine_file": "not changed: the joints have no common gain per unit of P"}
    source = f"measured at joints {', '.join(map(str, common.joints))} by errors and powers"
    gain = Quantity(value=common.value, unit="1", source=source, deviation=common.deviation)
    values: dict[str, Any] = {"dac_counts_per_adc_count": gain}
    if trace.record.gains is not None and len(trace.record.gains) == len(robot.machine.joints):
        values["gains"] = tuple(trace.record.gains[joint] for joint in sorted(trace.record.gains))
    bench.write_machine(with_controller(bench.machine(), values))
    return result | {
        "machine_file": f"{common.value:.4f} ± {common.deviation:.4f} DAC counts per ADC count and unit of P"
    }


def _gain_data(one: GainEstimate) -> dict[str, Any]:
    return {
        "volts_per_rad": round(one.volts_per_rad, 2),
        "standard_error": round(one.volts_per_rad_error, 2),
        "dac_counts_per_adc_count": round(one.gain, 5),
        "lowest": round(one.lowest, 5),
        "highest": round(one.highest, 5),
        "p": None if one.per_unit is None else round(one.gain / one.per_unit),
        "different_errors": one.errors,
    }


def first_ramp(bench: Bench) -> dict[str, Any]:
    """Runs a ramp of joint 1."""
    return _ramp(bench, (1,))


def ramp(bench: Bench) -> dict[str, Any]:
    """Runs the ramp step of the source, on joints 1 to 3."""
    return _ramp(bench, (1, 2, 3))


def _ramp(bench: Bench, joints: tuple[int, ...]) -> dict[str, Any]:
    from daq.contracts.experiment import ExperimentSpec
    from daq_cli.robot.access import robot_access
    from daq_cli.robot.experiment import acquire_complete

    robot = robot_access(bench.configured)
    spec = ExperimentSpec(name="commission-ramp", joints=joints)
    done = acquire_complete(robot, spec, robot.machine, robot.call.trace_folder, bench.consent)
    late = done.counters.get(LATE_SET_POINTS)
    if late:
        bench.operator.show(late_set_points_line(late))
    return {
        "trace": str(done.trace),
        "samples": done.samples,
        "missing": done.missing,
        "set_points_taken_late": "not known" if late is None else round(late),
        "outcome": done.outcome,
    }


def model(bench: Bench) -> dict[str, Any]:
    """Compares the arm with its machine file; if it differs, diagnoses the difference."""
    from daq.traces.reader import read_trace
    from model.comparison.compare import compare
    from model.machine_model.model import base_model

    if "trace" not in bench.record.steps.get("ramp", {}):
        raise SpecError("the step ramp has left no trace: do it first (--only ramp)")
    trace = read_trace(Path(bench.record.steps["ramp"]["trace"]))
    begin = base_model(bench.machine())
    compared = compare([("machine file", begin)], [trace])
    joints = compared.models[0].in_sample or ()
    above = [one.joint for one in joints if one.rmse > FLOORS * one.floor]
    result: dict[str, Any] = {
        "behaves_like_the_machine_file": not above,
        "joints_above_the_noise_floor": above,
        **{
            f"joint_{one.joint}": {
                "error_counts": round(one.counts, 2),
                "error_in_floors": round(one.rmse / one.floor, 1),
            }
            for one in joints
            if one.counts is not None
        },
    }
    if not above:
        return result
    try:
        return result | _diagnosed(bench, begin, trace)
    except SpecError as error:  # the comparison is valid without it
        bench.operator.show(f"no diagnosis: {error}")
        return result | {"verdict": "no diagnosis", "diagnosis": str(error)}


def _diagnosed(bench: Bench, begin: Model, trace: Trace) -> dict[str, Any]:
    """Returns the diagnosis of the ramp, and its report."""
    from daq.contracts.machine import SampledPid
    from daq_cli.app.progress import shown_progress
    from model.discrepancy.explanation.answer_words import headline
    from model.discrepancy.options import DiagnosisOptions
    from model.discrepancy.workflow import diagnose
    from model.reports.diagnosis_data import told
    from model.reports.page import saved_report, write_page
    from server.jobs.next_experiment import experiment_chooser

    bench.operator.show(
        "The ramp differs from the machine file by more than noise. A diagnosis follows; it only computes."
    )
    simulated = isinstance(begin.machine.controller, SampledPid)  # torques, the default, propose no experiment
    options = DiagnosisOptions(method="output-error" if simulated else None)
    with shown_progress("diagnosing") as progress:
        found = diagnose(begin, [trace], (), options, progress, chooser=experiment_chooser(begin.machine))
    write_page(saved_report(told(found, begin, [trace]), {}), bench.folder / DIAGNOSIS)
    said = headline(found)
    bench.operator.show(said)
    asked = found.next_experiment
    sound = found.verdict == "nothing-significant" and not found.examined_nothing
    behaves = {"behaves_like_the_machine_file": WITHIN_TOLERANCES} if sound else {}
    return {
        **behaves,
        "verdict": found.verdict.replace("-", " "),
        "diagnosis": said,
        "report": DIAGNOSIS,
        "to_be_run_next": "nothing" if asked is None else _as_command(bench, asked.spec),
    }


def _as_command(bench: Bench, spec: ExperimentSpec) -> str:
    """Writes an experiment beside the results; returns the command that runs it."""
    from daq_cli.app.output_file import replacing

    path = bench.folder / NEXT
    with replacing(path) as part:
        part.write_text(spec.model_dump_json(indent=1) + "\n", "utf-8")
    return f"daq --config {bench.folder / CONFIG} run spec {path}"
