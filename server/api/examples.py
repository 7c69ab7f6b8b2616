"""One example of every request and response body, for the OpenAPI description. Each is an instance of its model, so
that an example cannot contradict its schema."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from functools import cache
from typing import Any

from pydantic import BaseModel

from daq.contracts.experiment import ExperimentSpec, Ramp
from daq.contracts.figures import JointFigureSet
from daq.contracts.machine import load_machine
from daq.contracts.service.archive import ArchiveOrder, ArchiveStatus, TraceArchive, Transfer
from daq.contracts.service.audit import AuditEntry
from daq.contracts.service.events import ServiceEvent
from daq.contracts.service.experiments import (
    Approval,
    ApprovalRequest,
    Experiment,
    ExperimentChange,
    ExperimentPreset,
    ExperimentRequest,
    MotionMark,
    MotionPreview,
    Schedule,
    ScheduleChange,
    ScheduleRequest,
)
from daq.contracts.service.fleet import (
    ArmComparison,
    ArmFit,
    FittedNumber,
    FleetComparison,
    FleetExperimentRequest,
    FleetExperiments,
    FleetRobot,
    FleetStatus,
    JointResidual,
    NumberChange,
)
from daq.contracts.service.jobs import (
    CompareRequest,
    DiagnoseRequest,
    EffectChoice,
    EffectInModel,
    FitRequest,
    Job,
    KnownEffect,
    ModelChange,
    ModelDetails,
    ModelEntry,
    ModelLineage,
    ModelParameter,
    ParameterWords,
    ValidateRequest,
)
from daq.contracts.service.live import LiveFrame, RobotMessage, SampleMessage, Ticket
from daq.contracts.service.notifications import DestinationStatus, NotificationStatus
from daq.contracts.service.queue import Control, ControlLease, ControlRequest, QueueResume, QueueStatus
from daq.contracts.service.robot import (
    Done,
    GripperRequest,
    JointGains,
    LinkStatus,
    OutputRequest,
    ProcessState,
    ResetRequest,
    RobotIdentity,
    RobotStatus,
    RobotSummary,
    Sample,
    StopResult,
)
from daq.contracts.service.system import Health, LoginWays, Me, OpenIdWay, SignedOut, StorageStatus, SystemStatus
from daq.contracts.service.teaching import (
    CalibrationRequest,
    JogRequest,
    LeadRequest,
    MeasuredGain,
    ProgramEntry,
    StepRequest,
    TeachingStatus,
)
from daq.contracts.service.traces import CatalogueEntry, TraceChange, TraceDetails, TraceSignals
from daq.contracts.trace import TraceEvent, TraceRecord
from daq.teaching import Program
from daq.teaching.program import Absolute, Gripper, Wait
from model.comparison.agreement import JointAgreement, ModelAgreement, TraceAgreement
from model.comparison.difference import ParameterDifference
from model.machine_model.model import base_model
from server.jobs.results import ComparisonData, ComparisonJobResult, Overlay
from server.stopping.arm import together
from server.store.programs import StoredProgram

NOON = datetime(2026, 3, 2, 12, 0, tzinfo=UTC)
ROBOT, TRACE, EXPERIMENT, JOB, MODEL = "ma2000", "3fa1c5d20b77", "c40d1a2b93ee", "77be01d3aa42", "9d2f4b6c8e10"
SPEC = ExperimentSpec(trajectory=Ramp(amplitude=0.377, duration=0.65), joints=(1, 2, 3), name="morning-ramp")
PICK = Program(name="pick", instructions=(Absolute(angles={1: 3.14, 2: 1.4}), Gripper(closed=True), Wait(duration=1)))
PROGRAM = ProgramEntry(name="pick", robot=ROBOT, revision=3, instructions=3, changed=NOON, changed_by="anna")
CONTENT = "5f3c9a1be4d277885f3c9a1be4d277885f3c9a1be4d277885f3c9a1be4d27788"
COULOMB = ParameterWords(joint=2, group="joint 2", short="Coulomb friction torque", label="J2 Coulomb friction torque")
COULOMB_NOW = {"name": "joint2.coulomb_friction.torque", "unit": "N·m"}
QUEUE = QueueStatus(paused=False, reason="resumed by anna", since=NOON, queued=2, running=EXPERIMENT)
NOBODY = Control(holder="nobody")
IDENTITY = RobotIdentity(simulated=False, protocol=2, period=0.02, boots=3)


def _experiments() -> list[BaseModel]:
    request = ExperimentRequest(spec=SPEC, at=NOON, priority=10)
    experiment = Experiment(
        id=EXPERIMENT,
        robot=ROBOT,
        spec=SPEC,
        state="running",
        priority=10,
        at=NOON,
        submitted=NOON,
        submitted_by="anna",
        owner="anna",
        approval=Approval(by="bert", at=NOON, as_owner=False),
        started=NOON,
        progress=0.4,
        progress_text="120 of 300 samples",
        trace=TRACE,
    )
    return [
        request,
        FleetExperimentRequest(request=request, robots=(ROBOT,)),
        FleetExperiments(experiments=(experiment,)),
        ExperimentChange(priority=5),
        ApprovalRequest(content=CONTENT),
        experiment,
        ExperimentPreset(name="ramp", description="the ramp of the 1991 thesis", spec=SPEC),
        ScheduleRequest(spec=SPEC, cron="0 2 * * *", zone="Europe/London", count=30),
        ScheduleChange(active=False),
        Schedule(
            id="51c0ffee0a1b",
            robot=ROBOT,
            spec=SPEC,
            every=86400,
            starts=NOON,
            count=30,
            priority=0,
            active=True,
            submitted_runs=3,
            next=NOON + timedelta(days=3),
            created=NOON,
            created_by="anna",
            content=CONTENT,
            approval=Approval(by="bert", at=NOON, as_owner=False),
        ),
        MotionPreview(
            time=(0.0, 0.02, 0.04),
            set_points=((3.14, 1.57, 1.57), (3.14, 1.58, 1.57), (3.14, 1.59, 1.57)),
            moving=(2,),
            duration=0.04,
            violations=(),
            marks=(MotionMark(time=0.02, kind="ramp_start", message="ramp starts"),),
        ),
        QUEUE,
        QueueResume(moves_real_arm=True),
        NOBODY,
        ControlRequest(moves_real_arm=True),
        ControlLease(lease="hJ4l0q", expires=NOON, remaining=10.0, heartbeat_every=3.0),
    ]


def _robot() -> list[BaseModel]:
    angles = (3.14, 1.57, 1.57)
    sample = Sample(
        tick=90210,
        host_time=512.34,
        utc=NOON.timestamp(),
        age=0.011,
        joints=(1, 2, 3),
        set_point=angles,
        position=(3.13, 1.57, 1.57),
        error=(0.01, 0.0, 0.0),
        drive=(0.4, 0.0, 0.0),
        frozen=False,
    )
    message = SampleMessage(
        tick=90210,
        host_time=512.34,
        joints=(1, 2, 3),
        set_point=angles,
        position=(3.13, 1.57, 1.57),
        error=(0.01, 0.0, 0.0),
        drive=(0.4, 0.0, 0.0),
        frozen=False,
        lateness=0.0007,
    )
    robot = RobotMessage(
        connection="connected",
        connection_problem="",
        identity=IDENTITY,
        arm="idle",
        cause="",
        stop=65538,
        activity="none",
        experiment=None,
        limp=(),
        control=NOBODY,
    )
    stopped = StopResult(
        delivered=True,
        confirmed=True,
        tick=90211,
        seconds=0.014,
        detail="set points frozen at tick 90211.",
        text="stopped, confirmed by the board: set points frozen at tick 90211.",
    )
    return [
        RobotSummary(robot=ROBOT, machine="ma2000", connection="connected", arm="idle"),
        RobotStatus(
            robot=ROBOT,
            machine="ma2000",
            port="serial:///dev/ttyUSB0?baud=115200",
            connection="connected",
            identity=IDENTITY,
            arm="idle",
            activity="none",
            sample=sample,
            link=LinkStatus(state="connected", counters={"retries": 0.0}, age=0.3),
            control=NOBODY,
            queue=QUEUE,
            utc=NOON,
        ),
        stopped,
        together({ROBOT: stopped}),
        FleetStatus(
            utc=NOON,
            robots=(
                FleetRobot(
                    robot=ROBOT,
                    machine="ma2000",
                    simulated=True,
                    connection="connected",
                    arm="idle",
                    activity="none",
                    sample_age=0.011,
                    unattended=False,
                    control=NOBODY,
                    queue=QUEUE,
                ),
            ),
        ),
        FleetComparison(
            experiments=("morning-ramp",),
            experiment="morning-ramp",
            days=30,
            robots=(
                ArmComparison(
                    robot=ROBOT,
                    fits=(
                        ArmFit(
                            job="0f1e2d3c4b5a",
                            at=NOON,
                            traces=(TRACE,),
                            converged=True,
                            whitened_mean_square=1.1,
                            residuals=(JointResidual(joint=2, unit="rad", after=0.0021, floor=0.0019),),
                            numbers=(FittedNumber(**COULOMB_NOW, value=0.21, deviation=0.01, low=0.19, high=0.23),),
                        ),
                    ),
                    reference="a5b4c3d2e1f0",
                    changes=(
                        NumberChange(
                            **COULOMB_NOW,
                            before=0.15,
                            after=0.21,
                            difference=0.06,
                            low=0.032,
                            high=0.088,
                            changed=True,
                        ),
                    ),
                ),
            ),
            words={COULOMB_NOW["name"]: COULOMB},
        ),
        ResetRequest(stop=65538, here=False),
        Done(text="released: the arm holds its posture and takes set points again"),
        JointGains(gains={1: (2, 0, 0), 2: (2, 0, 0)}),
        OutputRequest(on=True),
        GripperRequest(closed=True),
        ProcessState(inputs=(False,) * 8, outputs=(True, *(False,) * 7), gripper="closed"),
        ServiceEvent(number=17, at=NOON, kind="queue", text="resumed", actor="anna"),
        AuditEntry(
            number=18,
            at=NOON,
            actor="anna",
            role="operator",
            origin="192.168.1.20",
            action="resume_queue",
            request="POST /api/v1/robots/ma2000/queue/resume",
            robot="ma2000",
            outcome="done",
            status=200,
            content='{"moves_real_arm":true}',
            request_id="0f3c9a1be4d27788",
            previous="5d" * 32,
            digest="7a" * 32,
        ),
        NotificationStatus(
            destinations=(
                DestinationStatus(
                    name="lab",
                    channel="webhook",
                    host="hooks.example",
                    about=("fault", "attention"),
                    waiting=1,
                    sent=12,
                    failed=2,
                    given_up=0,
                    last_sent=NOON,
                    problem="hooks.example: answered 503",
                    next_attempt=NOON + timedelta(minutes=5),
                ),
            )
        ),
        LiveFrame(now=512.35, utc=NOON.timestamp(), messages=(message, robot)),
        Ticket(ticket="q8d1mV", seconds=30.0),
        load_machine("ma2000"),
    ]


def _teaching() -> list[BaseModel]:
    return [
        JogRequest(velocities={2: 0.1}),
        StepRequest(by={2: -0.09}, speed=0.2),
        LeadRequest(joints=(1, 2, 3)),
        PICK,
        TeachingStatus(activity="none", result="done: 3 instructions"),
        PROGRAM,
        StoredProgram(entry=PROGRAM, program=PICK),
        CalibrationRequest(joints=(1, 2)),
        MeasuredGain(joint=1, gain=2.04, standard_error=0.01, lowest=2.0, highest=2.1, volts_per_rad=42.0, reason=""),
    ]


def _traces() -> list[BaseModel]:
    entry = CatalogueEntry(
        id=TRACE,
        robot=ROBOT,
        file=f"2026-03-02T12-00-00Z_ramp_{TRACE[:6]}.mcap",
        created=NOON,
        source="real",
        kind="ramp",
        name="morning-ramp",
        joints=(1, 2, 3),
        outcome="complete",
        samples=158,
        duration=3.14,
        size=81234,
        operator="anna",
        experiment=EXPERIMENT,
        tags=("wear",),
        notes="after the belts were tightened",
    )
    figures = JointFigureSet(
        joint=1,
        unit="°",
        moved=True,
        start=180.0,
        end=201.6,
        overshoot=1.9,
        rise_time=0.42,
        largest_error=5.4,
        final_error=0.1,
        largest_drive=9.8,
    )
    event = TraceEvent(time=0.5, kind="ramp_start", message="ramp starts", tick=25)
    record = TraceRecord(
        trace_id=TRACE, created=NOON, software="ma2000-daq 0.1.0", source="real", spec=SPEC, outcome="complete"
    )
    return [
        entry,
        TraceChange(tags=("wear", "after service"), notes="belts tightened"),
        TraceDetails(entry=entry, record=record, figures=(figures,), events=(event,), missing_samples=0),
        TraceSignals(
            id=TRACE,
            joints=(1,),
            samples=158,
            time=(0.0, 0.02),
            position=((3.14, 3.15),),
            set_point=((3.14, 3.16),),
            error=((0.0, 0.01),),
            drive=((0.0, 0.4),),
            drive_unit="V",
            events=(event,),
        ),
    ]


def _models() -> list[BaseModel]:
    entry = ModelEntry(
        id=MODEL,
        robot=ROBOT,
        name="with friction",
        created=NOON,
        created_by="anna",
        parent=None,
        job=JOB,
        traces=(TRACE,),
    )
    parameter = ModelParameter(
        name="joint2.coulomb_friction.torque",
        words=COULOMB,
        unit="N·m",
        value=0.41,
        low=0.0,
        high=5.0,
        deviation=0.2,
    )
    fit = FitRequest(
        traces=(TRACE,), effects=(EffectChoice(name="coulomb_friction", joints=(2, 3)),), name="with friction"
    )
    job = Job(
        id=JOB,
        robot=ROBOT,
        request=fit,
        state="running",
        submitted=NOON,
        submitted_by="anna",
        started=NOON,
        progress=0.35,
        progress_text="12 evaluations",
    )
    used = EffectInModel(name="coulomb_friction", joints=(2, 3), called="Coulomb friction, joints 2+3")
    effect = KnownEffect(
        name="coulomb_friction",
        called="Coulomb friction",
        family="friction",
        title="Coulomb friction",
        physics="τ = τ_c sign(q̇)",
        joints=(),
        whole_machine=False,
    )
    return [
        fit,
        ValidateRequest(traces=(TRACE,), model=MODEL),
        CompareRequest(traces=(TRACE,), models=("machine", MODEL)),
        DiagnoseRequest(traces=(TRACE,), model=MODEL, joints=(2,)),
        job,
        effect,
        entry,
        parameter,
        ModelDetails(entry=entry, effects=(used,), parameters=(parameter,), ancestors=()),
        ModelChange(name="with friction - checked"),
        ModelLineage(machine="0a1b2c3d4e5f", models=(entry,), jobs=(job,)),
        _comparison(),
    ]


def _comparison() -> ComparisonJobResult:
    joint = JointAgreement(joint=1, unit="rad", rmse=0.004, largest=0.011, floor=0.001, count=0.0046, share=0.028)
    agreement = ModelAgreement(
        label=f"with friction ({MODEL})",
        model=MODEL,
        effects=("coulomb_friction",),
        traces=(TraceAgreement(trace=TRACE, held_out=None, samples=158, joints=(joint,)),),
        in_sample=(joint,),
        held_out=None,
    )
    overlay = Overlay(
        trace=TRACE,
        held_out=None,
        joints=(1,),
        units=("rad",),
        samples=158,
        time=(0.0, 0.02),
        measured=((3.14, 3.15),),
        set_point=None,
        simulated=(((3.14, 3.151),),),
        residual=(((0.0, -0.001),),),
    )
    name = "joint2.coulomb_friction.torque"
    difference = ParameterDifference(name=name, unit="N·m", values=(None, 0.41), deviations=None)
    words = {name: COULOMB}
    data = ComparisonData(models=(agreement,), signals=(overlay,), differences=(difference,), words=words)
    return ComparisonJobResult(id=JOB, data=data)


def _archive() -> list[BaseModel]:
    on_its_way = Transfer(direction="fetch", state="moving", done=400_000, total=900_000)
    digest = "9f86d081884c7d659a2feaa0c55ad015a3bf4f1b2b0b822cd15d6c15b0f00a08"
    return [
        ArchiveOrder(drop=True),
        on_its_way,
        TraceArchive(
            id=TRACE, local=False, archived=NOON, checked=NOON, size=900_000, sha256=digest, transfer=on_its_way
        ),
        ArchiveStatus(
            place="ma2000 at https://s3.lab",
            state="away",
            problem="archive ma2000 at https://s3.lab: keeping a trace: cannot be reached",
            since=NOON,
            next_try=8.0,
            archived=398,
            waiting=14,
            fetching=1,
            local_bytes=84_000_000_000,
            local_limit=100_000_000_000,
        ),
    ]


def _system() -> list[BaseModel]:
    storage = StorageStatus(
        traces_folder="/var/lib/ma2000-daq/traces",
        traces_free=50_000_000_000,
        traces_reserve=20_000_000,
        traces_size=500_000_000_000,
        traces=412,
        database="sqlite",
        database_size=1_200_000,
    )
    return [
        Health(status="ok", version="0.1.0", checks={"database": "", "traces": "", f"robot {ROBOT}": ""}),
        Me(name="anna", role="owner", owner_of=(ROBOT,), session_until=NOON),
        LoginWays(openid=OpenIdWay(label="the laboratory's accounts", start="/api/v1/login/start")),
        SignedOut(provider="https://accounts.example/end_session"),
        SystemStatus(
            version="0.1.0",
            uptime=86400.0,
            storage=storage,
            warnings=("the disk of the traces is 90% full: 50000 MB are free; no experiment is taken below 20 MB",),
            live_clients=3,
            live_dropped=0,
            jobs_at_once=1,
            short_jobs_at_once=1,
            unattended=False,
            stop_port=8301,
        ),
    ]


@cache
def examples() -> dict[str, Any]:
    """The examples as plain data, by the name of their schema."""
    every = [*_experiments(), *_robot(), *_teaching(), *_traces(), *_models(), *_archive(), *_system()]
    return {type(one).__name__: one.model_dump(mode="json") for one in every}


@cache
def untyped() -> dict[str, Any]:
    """Examples of operations whose bodies have no named schema, by operation id."""
    model = base_model(load_machine("ma2000")).model_dump(mode="json")
    return {
        "get_spec_schema": {"title": "ExperimentSpec", "type": "object", "properties": {}},
        "upload_model": model,
        "download_model": model,
    }
