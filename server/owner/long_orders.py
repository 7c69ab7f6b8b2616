"""Orders that move the arm: an experiment, jogging, a taught program, leading by hand. One at a time."""

from __future__ import annotations

import time

from daq.acquisition.guardian import EndCause
from daq.acquisition.messages import Finished
from daq.contracts import exit_codes
from daq.contracts.errors import DaqError, ReachError, SafetyError
from daq.contracts.limp import limp_line
from daq.contracts.sample import SampleRow
from daq.runner import Arrangement, Consent, Outside, StoppedError, run_experiment
from daq.teaching import JogCommand, RecordedPath, check_program, jog, lead_by_nose, plan_program, run_program
from daq.teaching.jog import top_speed
from daq.teaching.performer import FollowingPerformer
from firmware_protocol.errors import ProtocolError
from server.owner.desk import Desk
from server.owner.messages import (
    BEGINS_WITHIN,
    Answer,
    JogBegin,
    JogDrive,
    LeadBegin,
    Long,
    Quick,
    RunExperiment,
    RunProgram,
)
from server.owner.quick_orders import carry_out


def require_in_time(order: Long) -> None:
    """Raises ReachError for an order that comes so late that an arm which begins now would surprise."""
    waited = time.monotonic() - order.asked
    if waited > BEGINS_WITHIN:
        line = f"the robot's process came to it after {waited:.1f} s, {BEGINS_WITHIN:g} s are allowed"
        raise ReachError(f"{order.activity}: {line}; nothing moved")


def run(desk: Desk, order: RunExperiment) -> Answer:
    """An experiment, as `daq run` does it."""
    result = run_experiment(
        Arrangement(
            desk.controller,
            desk.control,
            order.spec,
            desk.machine,
            desk.limits,
            desk.folder,
            desk.speaker,
            Outside(desk.ended, lambda: desk.guardian.cause is EndCause.ORPHANED),
            desk.robot,
            order.trace_id,
        ),
        Consent(order.moves_real_arm),
    )
    finished = Finished(
        outcome=result.outcome,
        trace=result.trace,
        samples=result.samples,
        missing=result.missing,
        counters=result.counters,
        reason=result.reason,
    )
    return Answer(number=order.number, finished=finished, exit_code=exit_codes.OF_OUTCOME[result.outcome])


def jog_until_finished(desk: Desk, order: JogBegin) -> Answer:
    """Jogging: the newest command drives the arm, for 0.3 s at most."""
    _require_ready(desk)
    newest: JogCommand | None = None

    def commands(_row: SampleRow) -> JogCommand | None:
        nonlocal newest
        _between_samples(desk)
        said = desk.inbox.drive()
        if said is not None and _allowed(desk, said):
            on_its_way = time.monotonic() - said.said
            newest = JogCommand(said.velocities, desk.controller.clock.now() - on_its_way)
        return newest

    jog(desk.arm(), desk.machine, desk.limits, commands, desk.inbox.finish.is_set, desk.say)
    return Answer(number=order.number)


def perform(desk: Desk, order: RunProgram) -> Answer:
    """A taught program, checked from end to end before its first motion."""
    _require_ready(desk)
    here = desk.arm().next_sample()
    planned = plan_program(order.program, desk.machine, here.set_point)
    against = check_program(planned, desk.machine, desk.limits)
    if against:
        raise SafetyError(f"program refused: {against[0]}; nothing moved")
    with desk.control.frozen_on_error():
        performer = FollowingPerformer(desk.controller, desk.control, desk.machine, desk.limits, desk.ended, desk.say)
        run_program(planned, desk.machine, performer, desk.say)
        performer.finish()
    return Answer(number=order.number, data={"text": f"done: {len(planned)} instructions"})


def lead(desk: Desk, order: LeadBegin) -> Answer:
    """Joints led by hand until finished; the recorded path comes back, also of one that was stopped."""
    _require_ready(desk)
    kept: dict[str, object] = {}

    def keep(path: RecordedPath) -> None:
        kept["path"] = path.model_dump(mode="json")

    problem, exit_code = "", 0
    try:
        lead_by_nose(desk.arm(), desk.machine, desk.limits, order.joints, desk.inbox.finish.is_set, keep)
    except DaqError as error:
        problem, exit_code = str(error), error.exit_code
    return Answer(number=order.number, data=kept, problem=problem, exit_code=exit_code)


def answered_quickly(desk: Desk, order: Quick) -> Answer:
    """A quick order's answer; its refusal is an answer too."""
    try:
        return Answer(number=order.number, data=carry_out(desk, order))
    except DaqError as error:
        return Answer(number=order.number, problem=str(error), exit_code=error.exit_code)
    except ProtocolError as error:
        return Answer(number=order.number, problem=str(error), exit_code=exit_codes.WRONG_INPUT)


def _require_ready(desk: Desk) -> None:
    """Raises SafetyError or StoppedError when neither keys nor programs may move the arm."""
    if (cause := desk.ended() or desk.control.halted) is not None:
        raise StoppedError(f"the arm has been stopped: {cause}")
    line = limp_line(desk.read_gains())
    if line:
        raise SafetyError(f"{line}; hold the arm, reset it here, then set their gains; nothing moved")


def _between_samples(desk: Desk) -> None:
    order = desk.inbox.take()
    if order is None:
        return
    if isinstance(order, Quick):
        desk.speaker.ended(answered_quickly(desk, order))
    else:
        desk.inbox.done()
        line = f"the arm is busy ({desk.activity}): end that first"
        desk.speaker.ended(Answer(number=order.number, problem=line, exit_code=SafetyError.exit_code))


def _allowed(desk: Desk, said: JogDrive) -> bool:
    """One that drives a joint that is not there, or too fast, is refused; the arm holds."""
    for joint, velocity in said.velocities.items():
        if not 1 <= joint <= len(desk.machine.joints) or not abs(velocity) <= top_speed(desk.limits, joint):
            desk.say(f"jog refused: joint {joint} at {velocity:g} rad/s")
            return False
    return True
