"""A model checker for stops and releases, of the code of service, owner and command line itself.

Each client, the owner of the port and the queue are coroutines of one thread. They give way wherever something else may
come between in reality: before each request to the board and before its answer, between a request's first byte, its
last byte and its turn among the threads, and wherever they wait. A seed decides who goes on. Only what lies beneath is
made here: the wire with a board that stops and releases as PROTOCOL.md says (section 6), the clock, and the stores.
"""

import math
import queue
import threading
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from types import SimpleNamespace
from typing import Any, ClassVar, cast

import greenlet

from daq.contracts.experiment import ExperimentSpec
from daq.contracts.machine import load_machine
from daq.contracts.service.robot import RobotIdentity, StopResult
from daq.driver import Controller
from daq.driver.set_point_watch import SetPointWatch
from daq.link import LinkState, RequestRefusedError, StopCameFirstError
from daq.owner import long_orders
from daq.owner.freezer import Freezer
from daq.owner.guardian import EndCause, Guardian
from daq.owner.inbox import Inbox
from daq.owner.messages import Answer, ArmReport, Finished, Open, RunExperiment
from daq.owner.owned_robot import OwnedRobot
from daq.owner.speaker import Speaker
from daq.owner.watched_controller import WatchedController
from daq.runner.arm_control import ArmControl
from daq.runner.preparation import require_not_stopped
from daq.teaching.controller_arm import ControllerArm
from firmware_protocol import commands as c
from firmware_protocol.message import Request
from server.experiments.review import Review
from server.experiments.states import Waiting
from server.queue.context import QueueContext
from server.queue.service import QueueService
from server.robot.control import ControlService
from server.robot.robot import Robot, RobotPlace
from server.robot.stop import StopService
from server.robot.teaching import TeachingService
from server.robot_services import RobotServices
from tests.server.clocks import HandClock

MACHINE = load_machine("ma2000")
IDENTITY = RobotIdentity(simulated=True, protocol=2, period=0.02, boots=1)
RULE = Review("ma2000", "digest", None)
TICK = 0.001
"""Time (s) from one step of anybody to the next."""
NO_SCHEDULES = SimpleNamespace(due=lambda *_: (), leave_out_missed=lambda *_: (), void_outdated=lambda *_: ())
MOTIONS = 3
"""Set points of one order that moves the arm: enough to be cut short at any of them."""


class Actor(greenlet.greenlet):
    """Somebody who does one thing after another. sent: when the order that it carries out was sent; named: the stop
    that this order is to end"""

    waits: Callable[[], bool] | None = None
    sent: float = -math.inf
    named: int | None = None
    owner_s: bool = False
    """Whether it is the owner of the port, who knows of stops on this computer alone."""

    @property
    def may_go_on(self) -> bool:
        """Whether it has not ended, and does not wait in vain."""
        return not self.dead and (self.waits is None or self.waits())


@dataclass(frozen=True)
class Stopped:
    """A stop that was confirmed to whoever asked: its number, when the board took it, whether the owner heard it."""

    number: int
    at: float
    here: bool


class World:
    """The clock, and who goes on."""

    present: ClassVar[HandClock]
    """The clock of the world that was made last."""

    def __init__(self, seed: int) -> None:
        self.clock = World.present = HandClock()
        self.actors: dict[str, Actor] = {}
        self.order: list[str] = []
        """Who went on at each step."""
        self._random = Random(seed)
        self._hub = greenlet.getcurrent()

    def spawn(self, name: str, run: Callable[[], object]) -> Actor:
        """Somebody who begins as soon as the seed says so."""
        made = self.actors[name] = Actor(run, self._hub)
        return made

    def step(self) -> None:
        """Anybody else may come between here."""
        self._hub.switch()

    def until(self, so: Callable[[], bool]) -> None:
        """Waits for something that somebody else does."""
        me = cast(Actor, greenlet.getcurrent())
        while not so():
            me.waits = so
            self._hub.switch()

    def run(self) -> None:
        """Until nobody can go on."""
        while ready := [name for name, one in self.actors.items() if one.may_go_on]:
            name = self._random.choice(ready) if len(ready) > 1 else ready[0]
            self.order.append(name)
            self.clock.turn(TICK)
            actor = self.actors[name]
            actor.waits = None
            actor.switch()


class Wire:
    """The link to a board that stops and releases, and what the board has seen. It is `Link` to whoever uses it."""

    state, url, lock_step, complaint = LinkState.CONNECTED, "wire", False, ""
    counters, scale = SimpleNamespace(numbers=dict), SimpleNamespace(turn_bytes=None)

    def __init__(self, world: World) -> None:
        self.world = world
        self.number, self.frozen, self.released_by = 0, False, (0, -math.inf)
        """Number of the newest stop; whether it is in force; the newest release's order: the stop it names, when it was
        sent."""
        self.taken: dict[int, float] = {}
        """When the board took each stop."""
        self.confirmed: list[Stopped] = []
        self.faults: list[str] = []
        self.motions = self.stops = 0

    def request(self, request: Request, _kind: object, before_stop: int | None = None) -> Any:
        """One request and its reply, each of which takes time."""
        return self.exchange(request, before_stop=before_stop)[0]

    def exchange_timed(self, *requests: Request) -> tuple[tuple[Any, ...], tuple[float, ...]]:
        return self.exchange(*requests), (0.0,) * len(requests)

    def exchange(self, *requests: Request, before_stop: int | None = None) -> tuple[Any, ...]:
        """Requests that are written together reach the board together."""
        self.world.step()
        if before_stop is not None and before_stop != self.stops:
            raise StopCameFirstError
        self.stops += any(isinstance(request, c.Stop) for request in requests)
        replies = tuple(map(self._answer, requests))
        self.world.step()
        for request, reply in zip(requests, replies, strict=True):
            if isinstance(reply, c.Refusal):
                raise RequestRefusedError(type(request).__name__, reply)
        return replies

    def stop(self) -> Any:
        return self.request(c.Stop(), c.Stopped)

    def _answer(self, request: Request) -> Any:  # noqa: PLR0911 - one for each kind of request
        me = cast(Actor, greenlet.getcurrent())
        match request:
            case c.Stop():
                self.number, self.frozen = self.number + 1, True
                self.taken[self.number] = self.world.clock.now
                return c.Stopped(self.number, (0,) * 6)
            case c.Release():
                if request.stop != self.number:
                    return c.Refusal.OTHER_STOP
                self.frozen = False
                self.released_by = (self.number if me.named is None else me.named, me.sent)
                return c.Released()
            case c.WriteSetPoints():
                if self.frozen:
                    return c.Refusal.FROZEN
                self.motions += 1
                self._judge("motion", me, *self.released_by)
            case c.SetGripper():
                self._judge("gripper", me)
            case c.ReadStatus():
                if not me.owner_s and me.named is None:  # a command that sees the arm now acts on what it sees
                    me.sent, me.named = self.world.clock.now, self.number
                return c.Status(0, c.StatusFlag.FROZEN if self.frozen else 0, 1, 0, self.number)
            case c.ReadProcess():
                return c.Process(0, 0, 0)
        return None

    def _judge(self, what: str, by: Actor, named: float = math.inf, sent: float = math.inf) -> None:
        """Notes a fault where a confirmed stop is not ended by an order sent after it that names it, or where what is
        carried out was sent before a stop that its owner heard."""
        for stop in self.confirmed:
            if named < stop.number or sent <= stop.at:
                self.faults.append(f"{what} after stop {stop.number}: the order of before it names {named}")
            if by.owner_s and stop.here and by.sent <= stop.at:
                self.faults.append(f"{what} by an order of before stop {stop.number}")


class WiredController(WatchedController):
    """The driver at such a wire. Samples are not needed here, and what they carry is asked for."""

    def __init__(self, wire: Wire) -> None:
        self.link: Any = wire
        self.joints = (1, 2, 3, 4, 5, 6)
        self.memory_map = cast(Any, SimpleNamespace(has_gains=False, has_process=True))
        self.identity = cast(Any, SimpleNamespace(period_s=0.02, boots=1))
        self._watch = SetPointWatch()

    def set_points(self, postures: Any) -> Any:
        return self.link.request(c.WriteSetPoints(tuple(postures.items())), c.SetPointsTaken)

    def line_rate(self, *_: object, **__: object) -> Any:
        return SimpleNamespace(every=1)

    def next_snapshot(self, *_: object, **__: object) -> Any:
        """Flags and tick of one."""
        status = self.link.request(c.ReadStatus(), c.Status)
        return SimpleNamespace(tick=0, flags=c.StatusFlag(status.status), joints=())


class Told(Future[Answer]):
    """The answer to an order. Waiting for it lets others go on; the time-out is by the world's clock."""

    def __init__(self, world: World) -> None:
        super().__init__()
        self._world = world

    def result(self, timeout: float | None = None) -> Answer:
        until = math.inf if timeout is None else self._world.clock.now + timeout
        self._world.until(lambda: self.done() or self._world.clock.now >= until)
        if not self.done():
            raise TimeoutError
        return super().result()


class InboxHere(Inbox):
    """The owner's inbox without a pipe: the service puts orders into it itself."""

    def __init__(self, world: World, end: Callable[[], None]) -> None:
        self.closing, self.finish = threading.Event(), threading.Event()
        self._waiting = queue.Queue()
        self._lock = threading.Lock()
        self._drive, self._said, self._long = None, -math.inf, 0
        self._world, self._end = world, end
        self.idle: Callable[[], bool] = lambda: True
        self.sent: dict[int, float] = {}
        """When each order was sent in truth, whatever it says."""

    def take(self, patience: float = 0.0) -> Any:
        """Waits while there is nothing else to do, and notes whose order comes next."""
        del patience
        if (me := cast(Actor, greenlet.getcurrent())).owner_s and self.idle():
            self._world.until(lambda: not self._waiting.empty() or self.closing.is_set() or not self.idle())
        order = super().take()
        if order is not None:
            me.sent, me.named = self.sent[order.number], getattr(order, "stop", None)
        return order

    def _end_what_runs(self, said: bytes) -> None:
        del said
        if self._long:
            self._end()


class Turn:
    """A condition, or an event, of the world's one thread."""

    def __init__(self, world: World) -> None:
        self._world, self._set = world, False

    def __enter__(self) -> "Turn":
        return self

    def __exit__(self, *_: object) -> None:
        """Nothing was locked."""

    def wait_for(self, so: Callable[[], bool], _timeout: float) -> bool:
        self._world.until(so)
        return True

    def notify_all(self) -> None:
        """Whoever waits looks by itself."""

    def set(self) -> None:
        self._set = True

    def clear(self) -> None:
        self._set = False

    def wait(self, _timeout: float) -> None:
        """As an event's, without a time-out: nothing is due."""
        self._world.until(lambda: self._set)


@dataclass
class Stores:
    """Experiments that wait, and what the queue asks besides."""

    waiting: int = 0
    said: list[str] = field(default_factory=list)

    def due(self, *_: object, **__: object) -> list[Waiting]:
        return [Waiting(str(n), n, 0, None) for n in range(self.waiting)]

    def begin(self, _robot: str, identity: str, *_: object) -> Any:
        """One that waits no longer."""
        self.waiting -= 1
        return SimpleNamespace(id=identity, spec=ExperimentSpec())

    def count_waiting(self, *_: object) -> int:
        return self.waiting

    def trace_number(self, identity: str) -> str:
        return identity

    def __getattr__(self, _name: str) -> Callable[..., Any]:
        return lambda *_, **__: ()


class Scene:
    """One robot from the service to the wire. `stopped`: it begins stopped, and everybody knows of that."""

    def __init__(self, seed: int, *, stopped: bool, waiting: int = 0) -> None:
        self.world = World(seed)
        self.wire = Wire(self.world)
        self.controller = WiredController(self.wire)
        self._guardian_s_turn = False
        self._make_owner()
        self._make_service(Stores(waiting))
        self.world.spawn("owner", self._own).owner_s = True
        self.world.spawn("queue", self.rig.queue._work)
        if stopped:
            self.world.spawn("before", self.stop_here)
        self.world.run()
        self.before = self.wire.number
        self.wire.confirmed.clear()

    def play(self) -> None:
        """Lets everybody go on to their ends, in the seed's order."""
        self.world.run()
        self.inbox.closing.set()
        self.rig.queue.begin_no_more()
        self.world.run()
        assert all(one.dead for one in self.world.actors.values()), self.world.order

    # ---- stops

    def stop_here(self) -> bool:
        """By the owner's stop socket: `daq stop`, the listener, and the service. Whether it was confirmed."""
        return self._end(EndCause.STOP)

    def stop_elsewhere(self) -> None:
        """Another computer's, at the board."""
        self._note(self.wire.stop().tick, here=False)

    def _end(self, cause: EndCause) -> bool:
        self.world.until(lambda: not self._guardian_s_turn)  # it hears one after the other
        self._guardian_s_turn = True
        answer = self.guardian._end(cause)
        self._guardian_s_turn = False
        self.world.step()  # the answer is on its way
        if answer.confirmed:
            self._note(answer.tick or 0, here=True)
        return answer.confirmed

    def _note(self, number: int, *, here: bool) -> None:
        self.wire.confirmed.append(Stopped(number, self.wire.taken[number], here))

    # ---- what is made

    def owned_on_demand(self) -> OwnedRobot:
        """The robot of an owner that a command has started: it has heard of no stop yet."""
        opening = Open(url="wire", machine=MACHINE, limits=MACHINE.limits, folder=Path())
        control = ArmControl(self.controller)
        guardian = Guardian(cast(Any, SimpleNamespace(problem="")), None, lambda _cause: control.stop("a stop"))  # type: ignore[arg-type, return-value]
        guardian._thread = cast(Any, SimpleNamespace(is_alive=lambda: True))
        return OwnedRobot(opening, self.controller, control, guardian, self.inbox, cast(Any, None))

    def _make_owner(self) -> None:
        self.control = ArmControl(self.controller)
        freezer = Freezer("arm", "wire")
        freezer.control = self.control
        listener = cast(Any, SimpleNamespace(problem=""))
        self.guardian = Guardian(listener, None, lambda cause: freezer._stop(self.control, cause))
        self.guardian._thread = cast(Any, SimpleNamespace(is_alive=lambda: True))
        self.inbox = InboxHere(self.world, self._spawn_cancel)
        self.owned = OwnedRobot(
            Open(
                url="wire", machine=MACHINE, limits=MACHINE.limits, folder=Path(), robot="arm", watched=True, live=True
            ),
            self.controller,
            self.control,
            self.guardian,
            self.inbox,
            cast(Speaker, SimpleNamespace(say=self._hear, ended=self._answer)),
        )
        self.inbox.idle = lambda: self.owned.newest_stop is not None

    def _spawn_cancel(self) -> None:
        self.world.spawn(f"cancel {len(self.world.actors)}", lambda: self._end(EndCause.CANCELLED))

    def _own(self) -> None:
        from daq.owner.loop import serve

        serve(self.owned)

    def _make_service(self, stores: Stores) -> None:
        self.asked: dict[int, Told] = {}
        place = RobotPlace("arm", "mock://", MACHINE, Path())
        robot = Robot(place, self.world.clock)
        robot._owner = cast(Any, SimpleNamespace(ask=self._ask, send=self.inbox._put, pid=1))
        robot._identity = IDENTITY
        robot._on_report(ArmReport(arm="idle", cause="", activity="none", limp=(), link="connected", counters={}))
        control = ControlService(self.world.clock, lambda _: None)
        context = QueueContext(
            robot=robot,
            control=control,
            experiments=cast(Any, stores),
            schedules=cast(Any, NO_SCHEDULES),
            queues=cast(Any, SimpleNamespace(get=lambda _: None, set=lambda *_: None)),
            clock=self.world.clock,
            record_event=lambda *_, **__: None,
            add_trace=lambda _: None,
            add_unfinished_traces=lambda: None,
            unattended=True,
        )
        made = QueueService(context)
        made._changed = cast(Any, Turn(self.world))
        robot.listeners.append(made.on_report)
        teaching = TeachingService(robot, lambda _: None)
        teaching._changed = cast(Any, Turn(self.world))
        stop = object.__new__(StopService)
        stop._robot, stop._stop = robot, lambda _: self._stopped_here()
        self.rig = cast(Any, RobotServices)(
            robot=robot,
            keeper=None,
            stop=stop,
            control=control,
            queue=made,
            catalogue=None,
            teaching=teaching,
            hub=None,
            jobs=None,
            models=None,
            events=SimpleNamespace(record=lambda *_, **__: None),
            unattended=True,
            jogged=None,
        )

    def _stopped_here(self) -> StopResult:
        done = self.stop_here()
        return StopResult(delivered=True, confirmed=done, seconds=0.0, text="")

    def _ask(self, kind: Callable[..., Any], **fields: object) -> Told:
        number = len(self.asked) + 1
        me = cast(Actor, greenlet.getcurrent())
        self.inbox.sent[number] = self.world.clock.now if me.sent == -math.inf else me.sent
        self.asked[number] = answer = Told(self.world)
        self.inbox._put(kind(number=number, **fields))
        return answer

    def _answer(self, answer: Answer) -> None:
        self.world.step()
        self.asked[answer.number].set_result(answer)

    def _hear(self, report: Any) -> None:
        self.rig.robot._on_report(report)


def moved(robot: OwnedRobot, order: Any) -> Answer:
    """What an order that moves the arm does, from its checks to its last set point; its plan and trace are left out."""
    if isinstance(order, RunExperiment):
        require_not_stopped(cast(Controller, robot.controller))
    else:
        long_orders._require_ready(robot)
    arm = object.__new__(ControllerArm)
    arm._controller, arm._control, arm._ended = robot.controller, robot.control, robot.end_cause
    with arm.driven():
        for posture in range(MOTIONS):
            arm.set_points({1: posture})
            if not isinstance(order, RunExperiment):
                long_orders._between_samples(robot)
            if robot.inbox.finish.is_set():
                break
    finished = Finished(outcome="complete", trace="x", samples=1, missing=0, counters={}, reason="")
    return Answer(number=order.number, finished=finished if isinstance(order, RunExperiment) else None)
