"""Carries out orders that move the arm, one at a time: an experiment, jogging, a taught program, hand guiding."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

from daq.contracts import exit_codes
from daq.contracts.errors import DaqError, SafetyError
from daq.contracts.frozen import like
from daq.contracts.joint_text import speed_unit
from daq.contracts.limp import limp_line
from daq.contracts.sample import SampleRow
from daq.driver import Controller
from daq.link import LinkError, LinkState
from daq.owner.guardian import EndCause
from daq.owner.messages import Answer, Finished, JogBegin, JogDrive, LeadBegin, QuickOrder, RunExperiment, RunProgram
from daq.owner.owned_robot import OwnedRobot
from daq.owner.quick_orders import carry_out
from daq.runner.arm_control import StoppedError, stop_line
from daq.runner.experiment import RunResult, RunSetup, StopRequests, run_experiment
from daq.runner.preparation import Consent, require_not_stopped
from daq.teaching.jog import JogCommand, jog, top_speed
from daq.teaching.lead import lead_by_nose
from daq.teaching.performer import FollowingPerformer
from daq.teaching.program import Program
from daq.teaching.program_plan import check_program, plan_program, run_program
from daq.teaching.recording import RecordedPath
from firmware_protocol.errors import ProtocolError


@dataclass(frozen=True)
class _UntilClosed:
    """Ends the attempts when the time window closes."""

    closes: float
    sleep: Callable[[float], None]

    def wait(self, timeout: float) -> bool:
        """Returns True once the window has closed."""
        remaining = self.closes - time.monotonic()
        if remaining <= 0:
            return True
        self.sleep(min(timeout, remaining))
        return False


def deliver_late_stop(controller: Controller, window: float, sleep: Callable[[float], None] = time.sleep) -> str:
    """Tries to reach the controller for `window` s, with doubling delays, and freezes the arm once it answers.

    Returns a line with the result. It sends only the stop, for which the controller needs no greeting.
    """
    begun = time.monotonic()
    try:
        controller.link.reconnect(_UntilClosed(begun + window, sleep))
    except LinkError as error:
        return f"the link did not come back within {window:g} s ({error}): the arm holds its last set point"
    return f"the link came back after {time.monotonic() - begun:.1f} s: {stop_line(controller.stop())}"


def run(robot: OwnedRobot, order: RunExperiment) -> Answer:
    """Runs an experiment as `daq run` does."""
    result = run_experiment(
        RunSetup(
            robot.controller,
            robot.control,
            order.spec,
            robot.machine,
            robot.limits,
            robot.opening.folder,
            robot.speaker,
            StopRequests(robot.end_cause, lambda: robot.guardian.cause is EndCause.ORPHANED),
            robot.opening.robot,
            order.trace_id,
        ),
        Consent(order.moves_real_arm),
    )
    if not robot.opening.watched:
        result = _with_late_stop(robot, result)
    finished = like(Finished, result)
    return Answer(number=order.number, finished=finished, exit_code=exit_codes.OF_OUTCOME[result.outcome])


def _with_late_stop(robot: OwnedRobot, result: RunResult) -> RunResult:
    """Delivers the stop that a lost link held back, and adds the outcome to the result. Between orders nobody restores
    the link of an arm that is not monitored."""
    link = robot.controller.link
    if link.state is not LinkState.LOST or link.control is not None:
        return result  # the link is alive, or the robot is our own mock, whose lost link cannot come back
    robot.speaker.progress(1.0, "the link is lost: trying to deliver the stop")
    line = deliver_late_stop(robot.controller, robot.opening.late_stop_window)
    return replace(result, reason=f"{result.reason}; {line}")


def jog_until_finished(robot: OwnedRobot, order: JogBegin) -> Answer:
    """Jogs: the newest command drives the arm, for at most 0.3 s."""
    _require_ready(robot)
    newest: JogCommand | None = None

    def commands(_row: SampleRow) -> JogCommand | None:
        nonlocal newest
        _between_samples(robot)
        said = robot.inbox.drive()
        if said is not None and not robot.guardian.is_older_than_stop(said.said) and _allowed(robot, said):
            on_its_way = time.monotonic() - said.said
            newest = JogCommand(said.velocities, robot.controller.clock.now() - on_its_way)
        return newest

    jog(robot.arm(), robot.machine, robot.limits, commands, robot.inbox.finish.is_set, robot.say)
    return Answer(number=order.number)


def perform(robot: OwnedRobot, order: RunProgram) -> Answer:
    """Runs a taught program after checking all of it."""
    _require_ready(robot)
    here = robot.arm().next_sample()
    planned = plan_program(Program.model_validate(order.program), robot.machine, here.set_point)
    against = check_program(planned, robot.machine, robot.limits)
    if against:
        raise SafetyError(f"program refused: {against[0]}; nothing moved")
    with robot.control.frozen_on_error():
        performer = FollowingPerformer(
            robot.controller, robot.control, robot.machine, robot.limits, robot.end_cause, robot.say
        )
        run_program(planned, robot.machine, performer, robot.say)
        performer.finish()
    return Answer(number=order.number, data={"text": f"done: {len(planned)} instructions"})


def lead(robot: OwnedRobot, order: LeadBegin) -> Answer:
    """Lets a person guide joints by hand until `Finish`. The answer contains the recorded path, even after a stop."""
    _require_ready(robot)
    kept: dict[str, object] = {}

    def keep(path: RecordedPath) -> None:
        kept["path"] = path.model_dump(mode="json")

    problem, exit_code = "", 0
    try:
        lead_by_nose(robot.arm(), robot.machine, robot.limits, order.joints, robot.inbox.finish.is_set, keep)
    except DaqError as error:
        problem, exit_code = str(error), error.exit_code
    return Answer(number=order.number, data=kept, problem=problem, exit_code=exit_code)


def answered_quickly(robot: OwnedRobot, order: QuickOrder) -> Answer:
    """Returns the answer to a quick order; for a refused order it contains the problem."""
    try:
        return Answer(number=order.number, data=carry_out(robot, order))
    except DaqError as error:
        return Answer(number=order.number, problem=str(error), exit_code=error.exit_code)
    except ProtocolError as error:
        return Answer(number=order.number, problem=str(error), exit_code=exit_codes.WRONG_INPUT)


def _require_ready(robot: OwnedRobot) -> None:
    """Raises SafetyError or StoppedError if keys and programs must not move the arm."""
    if (cause := robot.end_cause() or robot.control.halted) is not None:
        raise StoppedError(cause)
    if not robot.opening.watched:
        require_not_stopped(robot.controller)
    line = limp_line(robot.read_gains())
    if line:
        raise SafetyError(f"{line}; hold the arm, reset it here, then set their gains; nothing moved")


def _between_samples(robot: OwnedRobot) -> None:
    order = robot.inbox.take()
    if order is None:
        return
    if isinstance(order, QuickOrder):
        robot.speaker.ended(answered_quickly(robot, order))
    else:
        robot.inbox.done()
        line = f"the arm is busy ({robot.activity}): end that first"
        robot.speaker.ended(Answer(number=order.number, problem=line, exit_code=SafetyError.exit_code))


def _allowed(robot: OwnedRobot, said: JogDrive) -> bool:
    """Whether a jog command is allowed: every joint exists and the speeds are within the limits. If not, the arm
    holds."""
    for joint, velocity in said.velocities.items():
        if not 1 <= joint <= len(robot.machine.joints):
            robot.say(f"jog refused: joint {joint}")
            return False
        if not abs(velocity) <= top_speed(robot.machine, robot.limits, joint):
            robot.say(f"jog refused: joint {joint} at {velocity:g} {speed_unit(robot.machine, joint)}")
            return False
    return True
