"""Routes for jogging, steps, programs and hand guiding, which need control of the robot; and for calibration."""

from __future__ import annotations

from fastapi import Response

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
from daq.teaching.jog import require_step_speed
from daq.teaching.program import Absolute, Instruction, Program, Relative
from server.api.dependencies import (
    Arrived,
    Experiments,
    IdempotencyKey,
    Identity,
    LeaseHeader,
    Motions,
    Operator,
    RobotDep,
    Turn,
    Viewer,
)
from server.api.experiments import submit_experiment
from server.problems import PROBLEMS
from server.routes import Router

router = Router(prefix="/robots/{robot}", tags=["teaching"], responses=PROBLEMS)


@router.get("/teaching")
def get_teaching(rig: RobotDep, _: Viewer) -> TeachingStatus:
    """Returns the current teaching activity, and how the last one ended."""
    return rig.teaching.status()


@router.post("/teaching/jog")
def jog_robot(
    request: JogRequest, rig: RobotDep, _: Operator, arrived: Arrived, lease: LeaseHeader = None
) -> TeachingStatus:
    """Drives joints for at most 0.3 s. While a key is held, the client repeats this about ten times per second."""
    rig.require_motion(lease)
    rig.teaching.jog(dict(request.velocities), arrived)
    return rig.teaching.status()


@router.post("/teaching/step", status_code=202)
def step_robot(
    request: StepRequest, rig: RobotDep, _: Operator, arrived: Arrived, lease: LeaseHeader = None
) -> TeachingStatus:
    """Starts one step, in which all joints arrive together. It is checked first; GET …/teaching reports its end."""
    rig.require_motion(lease)
    if (request.to is None) == (request.by is None):
        raise SpecError("step: give either `to` or `by`")
    kind: type[Absolute | Relative] = Relative if request.to is None else Absolute
    angles = dict(request.to or request.by or {})
    if not angles:
        raise SpecError("step: names no joint")
    require_step_speed(rig.robot.machine, angles, request.speed)
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
    """Starts a taught program of steps, paths, waits and process signals. All of it is checked before it moves."""
    rig.require_motion(lease)
    rig.teaching.perform(rig.word(lease, arrived), request)
    return rig.teaching.status()


@router.post("/teaching/lead", status_code=202)
def lead_robot(
    request: LeadRequest, rig: RobotDep, _: Operator, arrived: Arrived, lease: LeaseHeader = None
) -> TeachingStatus:
    """Starts recording a path while the arm is guided by hand. HOLD THE ARM: the guided joints have no drive and
    sink."""
    rig.require_motion(lease)
    rig.teaching.lead(rig.word(lease, arrived), tuple(sorted(set(request.joints))))
    return rig.teaching.status()


@router.post("/teaching/finish")
def finish_teaching(rig: RobotDep, _: Operator, lease: LeaseHeader = None) -> TeachingStatus:
    """Ends jogging or hand guiding; the answer contains the recorded path."""
    rig.control.require(lease)
    rig.teaching.finish()
    return rig.teaching.status()


@router.post("/calibrations/gain", status_code=201, response_model=Experiment, responses={200: {"model": Experiment}})
def calibrate_gain(
    request: CalibrationRequest,
    rig: RobotDep,
    experiments: Experiments,
    motions: Motions,
    caller: Operator,
    response: Response,
    _turn: Turn,
    idempotency_key: IdempotencyKey = None,
) -> Experiment:
    """Queues the experiment that measures the actual proportional gain. GET …/traces/{trace}/gain then returns it.

    It is checked like any experiment; the same Idempotency-Key returns the same experiment (200).
    """
    from daq.calibration import gain_experiment

    spec = gain_experiment(tuple(sorted(set(request.joints))))
    request_of = ExperimentRequest(spec=spec)
    return submit_experiment(request_of, rig, experiments, motions, caller, response, None, idempotency_key)


@router.get("/traces/{trace}/gain")
def get_measured_gain(trace: Identity, rig: RobotDep, _: Viewer, _turn: Turn) -> tuple[MeasuredGain, ...]:
    """Returns the actual proportional gains measured from a trace."""
    from daq.calibration import gains_from_trace
    from daq.traces.reader import read_trace

    read = read_trace(rig.catalogue.path_of(trace), rig.catalogue.limits)
    fields = MeasuredGain.model_fields
    return tuple(
        MeasuredGain.model_validate({name: value for name, value in gain.as_data().items() if name in fields})
        for gain in gains_from_trace(read, rig.robot.machine)
    )
