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
from server.api.experiments import submit_experiment
from server.api.parts import (
    Arrived,
    IdempotencyKey,
    Identity,
    LeaseHeader,
    Operator,
    RobotPart,
    ServicesPart,
    Turn,
    Viewer,
)
from server.problems import PROBLEMS

router = APIRouter(prefix="/robots/{robot}", tags=["teaching"], responses=PROBLEMS)


@router.get("/teaching")
def get_teaching(one: RobotPart, _: Viewer) -> TeachingStatus:
    """What is being taught now, and how the last one ended."""
    return one.teaching.status()


@router.post("/teaching/jog")
def jog_robot(
    request: JogRequest, one: RobotPart, _: Operator, arrived: Arrived, lease: LeaseHeader = None
) -> TeachingStatus:
    """Drives joints for 0.3 s at most: whoever holds the key repeats this, ten times a second or so."""
    one.require_motion(lease)
    one.teaching.jog(dict(request.velocities), arrived)
    return one.teaching.status()


@router.post("/teaching/step", status_code=202)
def step_robot(
    request: StepRequest, one: RobotPart, _: Operator, arrived: Arrived, lease: LeaseHeader = None
) -> TeachingStatus:
    """Begins one step, all joints arriving together. Checked before it moves; GET …/teaching tells its end."""
    one.require_motion(lease)
    if (request.to is None) == (request.by is None):
        raise SpecError("step: give either `to` or `by`")
    kind: type[Absolute | Relative] = Relative if request.to is None else Absolute
    angles = dict(request.to or request.by or {})
    if not angles:
        raise SpecError("step: names no joint")
    instruction: Instruction = kind(angles=angles, speed=request.speed)
    one.teaching.perform(
        one.word(lease, arrived),
        Program(name="step", machine=one.robot.machine.name, instructions=(instruction,)),
        "step",
    )
    return one.teaching.status()


@router.post("/teaching/program", status_code=202)
def run_program(
    request: Program, one: RobotPart, _: Operator, arrived: Arrived, lease: LeaseHeader = None
) -> TeachingStatus:
    """Begins a taught program: steps, paths, waits, process signals. Checked from end to end before it moves."""
    one.require_motion(lease)
    one.teaching.perform(one.word(lease, arrived), request)
    return one.teaching.status()


@router.post("/teaching/lead", status_code=202)
def lead_robot(
    request: LeadRequest, one: RobotPart, _: Operator, arrived: Arrived, lease: LeaseHeader = None
) -> TeachingStatus:
    """Begins to record a path while the arm is led by hand. HOLD THE ARM: the led joints have no drive and sink."""
    one.require_motion(lease)
    one.teaching.lead(one.word(lease, arrived), tuple(sorted(set(request.joints))))
    return one.teaching.status()


@router.post("/teaching/finish")
def finish_teaching(one: RobotPart, _: Operator, lease: LeaseHeader = None) -> TeachingStatus:
    """Ends jogging, or leading: its path is in the answer."""
    one.control.require(lease)
    one.teaching.finish()
    return one.teaching.status()


@router.post("/calibrations/gain", status_code=201, response_model=Experiment, responses={200: {"model": Experiment}})
def calibrate_gain(
    request: CalibrationRequest,
    one: RobotPart,
    found: ServicesPart,
    who: Operator,
    response: Response,
    _turn: Turn,
    idempotency_key: IdempotencyKey = None,
) -> Experiment:
    """Queues the experiment that shows the actual proportional gain; GET …/traces/{trace}/gain tells it afterwards.

    It is checked as any other, and the same Idempotency-Key gives the same experiment (200).
    """
    spec = gain_experiment(tuple(sorted(set(request.joints))))
    return submit_experiment(ExperimentRequest(spec=spec), one, found, who, response, None, idempotency_key)


@router.get("/traces/{trace}/gain")
def get_measured_gain(trace: Identity, one: RobotPart, _: Viewer, _turn: Turn) -> tuple[MeasuredGain, ...]:
    """The actual proportional gains that a trace shows."""
    read = read_trace(one.catalogue.path_of(trace), one.catalogue.limits)
    fields = MeasuredGain.model_fields
    return tuple(
        MeasuredGain.model_validate({name: value for name, value in found.as_data().items() if name in fields})
        for found in gains_from_trace(read, one.robot.machine)
    )
