"""Jogging, steps, programs, leading by hand, and calibration. All of it needs the control of the robot."""

from __future__ import annotations

from fastapi import APIRouter, Response

from daq.calibration import gain_experiment, gains_from_trace
from daq.contracts.errors import SpecError
from daq.contracts.service.experiments import Experiment, ExperimentRequest
from daq.contracts.service.teaching import (
    CalibrationRequest,
    JogRequest,
    LeadRequest,
    MeasuredGain,
    StepRequest,
    TeachingStatus,
)
from daq.teaching import Program
from daq.teaching.program import Absolute, Instruction, Relative
from daq.traces.reader import read_trace
from server.api.dependencies import (
    Arrived,
    IdempotencyKey,
    Identity,
    LeaseHeader,
    Operator,
    RobotDep,
    ServicesDep,
    Turn,
    Viewer,
)
from server.api.experiments import submit_experiment
from server.problems import PROBLEMS

router = APIRouter(prefix="/robots/{robot}", tags=["teaching"], responses=PROBLEMS)


@router.get("/teaching")
def get_teaching(rig: RobotDep, _: Viewer) -> TeachingStatus:
    """What is being taught now, and how the last one ended."""
    return rig.teaching.status()


@router.post("/teaching/jog")
def jog_robot(
    request: JogRequest, rig: RobotDep, _: Operator, arrived: Arrived, lease: LeaseHeader = None
) -> TeachingStatus:
    """Drives joints for 0.3 s at most: whoever holds the key repeats this, ten times a second or so."""
    rig.require_motion(lease)
    rig.teaching.jog(dict(request.velocities), arrived)
    return rig.teaching.status()


@router.post("/teaching/step", status_code=202)
def step_robot(
    request: StepRequest, rig: RobotDep, _: Operator, arrived: Arrived, lease: LeaseHeader = None
) -> TeachingStatus:
    """Begins one step, all joints arriving together. Checked before it moves; GET …/teaching tells its end."""
    rig.require_motion(lease)
    if (request.to is None) == (request.by is None):
        raise SpecError("step: give either `to` or `by`")
    kind: type[Absolute | Relative] = Relative if request.to is None else Absolute
    angles = dict(request.to or request.by or {})
    if not angles:
        raise SpecError("step: names no joint")
    instruction: Instruction = kind(angles=angles, speed=request.speed)
    rig.teaching.perform(
        rig.word(lease, arrived),
        Program(name="step", machine=rig.robot.machine.name, instructions=(instruction,)),
        "step",
    )
    return rig.teaching.status()


@router.post("/teaching/program", status_code=202)
def run_program(
    request: Program, rig: RobotDep, _: Operator, arrived: Arrived, lease: LeaseHeader = None
) -> TeachingStatus:
    """Begins a taught program: steps, paths, waits, process signals. Checked from end to end before it moves."""
    rig.require_motion(lease)
    rig.teaching.perform(rig.word(lease, arrived), request)
    return rig.teaching.status()


@router.post("/teaching/lead", status_code=202)
def lead_robot(
    request: LeadRequest, rig: RobotDep, _: Operator, arrived: Arrived, lease: LeaseHeader = None
) -> TeachingStatus:
    """Begins to record a path while the arm is led by hand. HOLD THE ARM: the led joints have no drive and sink."""
    rig.require_motion(lease)
    rig.teaching.lead(rig.word(lease, arrived), tuple(sorted(set(request.joints))))
    return rig.teaching.status()


@router.post("/teaching/finish")
def finish_teaching(rig: RobotDep, _: Operator, lease: LeaseHeader = None) -> TeachingStatus:
    """Ends jogging, or leading: its path is in the answer."""
    rig.control.require(lease)
    rig.teaching.finish()
    return rig.teaching.status()


@router.post("/calibrations/gain", status_code=201, response_model=Experiment, responses={200: {"model": Experiment}})
def calibrate_gain(
    request: CalibrationRequest,
    rig: RobotDep,
    services: ServicesDep,
    caller: Operator,
    response: Response,
    _turn: Turn,
    idempotency_key: IdempotencyKey = None,
) -> Experiment:
    """Queues the experiment that shows the actual proportional gain; GET …/traces/{trace}/gain tells it afterwards.

    It is checked as any other, and the same Idempotency-Key gives the same experiment (200).
    """
    spec = gain_experiment(tuple(sorted(set(request.joints))))
    return submit_experiment(ExperimentRequest(spec=spec), rig, services, caller, response, None, idempotency_key)


@router.get("/traces/{trace}/gain")
def get_measured_gain(trace: Identity, rig: RobotDep, _: Viewer, _turn: Turn) -> tuple[MeasuredGain, ...]:
    """The actual proportional gains that a trace shows."""
    read = read_trace(rig.catalogue.path_of(trace), rig.catalogue.limits)
    fields = MeasuredGain.model_fields
    return tuple(
        MeasuredGain.model_validate({name: value for name, value in gain.as_data().items() if name in fields})
        for gain in gains_from_trace(read, rig.robot.machine)
    )
