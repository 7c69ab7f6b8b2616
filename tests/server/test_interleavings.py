"""No order of what people, queue, owner and board do moves the arm after a confirmed stop that nobody has released."""

import threading
from collections.abc import Callable
from contextlib import suppress
from types import SimpleNamespace
from typing import cast

import greenlet
import pytest

from daq.contracts.errors import DaqError
from daq.contracts.service.queue import ControlRequest, QueueResume
from daq.contracts.service.robot import GripperRequest, ResetRequest
from daq.contracts.service.teaching import JogRequest, StepRequest
from daq.owner import guardian, long_orders, loop, owned_robot, quick_orders
from daq.owner.messages import Reset
from daq.owner.quick_orders import carry_out
from server.access.caller import LOCAL
from server.api import controller, robots, teaching
from server.api import queue as queue_routes
from server.problems import ProblemError
from server.queue.service import Review
from server.robot import control
from tests.server.interleaved import RULE, Actor, Scene, World, moved

SOON, ALL = 300, 2500
"""Seeds of each scene: in every run of the tests, and in the slow one."""


@pytest.fixture(autouse=True)
def virtual(monkeypatch: pytest.MonkeyPatch) -> None:
    """Time passes by the world's clock, and no thread is made."""
    for module in (guardian, long_orders, owned_robot, loop, quick_orders):
        monkeypatch.setattr(module, "time", SimpleNamespace(monotonic=lambda: World.present.now))
    no_thread = SimpleNamespace(start=lambda: None)
    monkeypatch.setattr(
        control, "threading", SimpleNamespace(Condition=threading.Condition, Thread=lambda **_: no_thread)
    )
    monkeypatch.setattr(loop, "_moved", moved)
    monkeypatch.setattr(Review, "of", lambda *_: RULE)


class People:
    """What people do in a scene, each at a door of their own."""

    def __init__(self, scene: Scene) -> None:
        self.scene, self.rig = scene, scene.rig
        self.lease: str | None = None

    def does(self, name: str, *steps: Callable[[], object]) -> None:
        """A person does one thing after another; what is refused is refused."""

        def run() -> None:
            for step in steps:
                with suppress(ProblemError, DaqError):
                    step()

        self.scene.world.spawn(name, run)

    def ask(self, carried_out: Callable[[float], object]) -> None:
        """A request: its first byte, its last one, its turn among the threads."""
        arrived = cast(Actor, greenlet.getcurrent()).sent = self.scene.world.clock.now
        self.scene.world.step()
        self.scene.world.step()
        carried_out(arrived)

    # ---- stops

    def stop_by_service(self) -> None:
        self.rig.queue.stop_asked("anna")
        self.scene.world.step()
        self.rig.stop.stop_now()

    def stop_by_listener(self) -> None:
        self.scene.stop_here()
        self.scene.world.step()
        self.rig.queue.stop_asked("anna")  # the service is told later

    # ---- releases

    def seen(self) -> int:
        """The stop that the page shows, as soon as it shows one."""
        self.scene.world.until(lambda: self.rig.robot.arm.stop is not None)
        return int(self.rig.robot.arm.stop)

    def reset(self, *, here: bool = False, stop: int | None = None) -> None:
        request = ResetRequest(stop=self.seen() if stop is None else stop, here=here)
        self.ask(lambda arrived: robots.reset_robot(request, self.rig, LOCAL, arrived, self.lease))

    # ---- what moves

    def take_control(self) -> None:
        self.lease = queue_routes.take_control(ControlRequest(), self.rig, LOCAL).lease

    def give_back(self) -> None:
        lease, self.lease = self.lease, None
        queue_routes.give_control_back(self.rig, LOCAL, lease)

    def jog(self) -> None:
        request = JogRequest(velocities={1: 0.1})
        self.ask(lambda arrived: teaching.jog_robot(request, self.rig, LOCAL, arrived, self.lease))

    def step(self) -> None:
        request = StepRequest(by={1: 0.1})
        self.ask(lambda arrived: teaching.step_robot(request, self.rig, LOCAL, arrived, self.lease))

    def grip(self, *, while_stopped: bool = False) -> None:
        request = GripperRequest(closed=True, while_stopped=while_stopped)
        self.ask(lambda arrived: controller.set_gripper(request, self.rig, LOCAL, arrived, self.lease))

    def resume(self) -> None:
        self.ask(lambda arrived: queue_routes.resume_queue(QueueResume(), self.rig, arrived, LOCAL))


def _stale_reset(seed: int) -> Scene:
    """A reset of the stop before, at whose every byte another stop may come, and one of whatever stop is shown; a
    client that jogs, and one that drives."""
    scene = Scene(seed, stopped=True)
    people = People(scene)
    people.take_control()
    people.does("reset", lambda: people.reset(stop=scene.before), people.reset)
    people.does("stop", people.stop_by_listener)
    people.does("jog", *[people.jog] * 4)
    people.does("step", *[people.step] * 4)
    return scene


def _queue(seed: int) -> Scene:
    """Experiments wait; one person resets and resumes, one resumes late, two stop, one pauses."""
    scene = Scene(seed, stopped=True, waiting=2)
    people = People(scene)
    people.does("anna", people.reset, people.resume)
    people.does("bert", people.resume, people.reset, people.resume)
    people.does("stop", people.stop_by_service)
    people.does("stop at the listener", people.stop_by_listener)
    people.does("pause", lambda: scene.rig.queue.pause("by carl", "carl"), people.resume)
    return scene


def _here(seed: int) -> Scene:
    """Resets that adopt the posture, stops of this and of another computer, a hand that switches."""
    scene = Scene(seed, stopped=True)
    people = People(scene)
    people.take_control()
    people.does("anna", lambda: people.reset(here=True), people.step, lambda: people.reset(here=True), people.step)
    people.does("stop", people.stop_by_service)
    people.does("another computer", scene.stop_elsewhere)
    people.does("grip", lambda: people.grip(while_stopped=True), people.grip, people.grip)
    return scene


def _moving(seed: int) -> Scene:
    """An arm that moves under a lease that is given back, while the queue waits for it; two stops, two resets."""
    scene = Scene(seed, stopped=False, waiting=1)
    scene.rig.queue.pause("by anna", "anna")
    people = People(scene)
    people.does("jog", people.take_control, people.jog, people.step, people.give_back, people.resume)
    people.does("stop", people.stop_by_listener, people.reset, people.resume)
    people.does("stop too", people.stop_by_service, people.reset)
    return scene


def command_line(seed: int) -> Scene:
    """Commands at the port, one after the other, which others stop meanwhile: both resets, a run."""
    scene = Scene(seed, stopped=True)
    scene.inbox.closing.set()  # no service owns this port
    people = People(scene)

    def reset(*, here: bool) -> None:
        cast(Actor, greenlet.getcurrent()).named = None  # it acts on the stop that it sees
        carry_out(scene.owned_on_demand(), Reset(number=0, asked=scene.world.clock.now, stop=None, here=here))

    people.does("reset", *[lambda: reset(here=False), lambda: reset(here=True)] * 2)
    people.does("another computer", scene.stop_elsewhere, scene.stop_elsewhere)
    people.does("run", lambda: scene.controller.set_points({1: 1}), lambda: scene.controller.set_points({1: 2}))
    return scene


SCENES = [_stale_reset, _queue, _here, _moving, command_line]


def checked(begin: Callable[[int], Scene], seeds: int) -> tuple[int, int]:
    """How many different interleavings there were, and how many set points in them. No fault in any."""
    found, motions = set(), 0
    for seed in range(seeds):
        scene = begin(seed)
        scene.play()
        assert scene.wire.faults == [], (seed, scene.wire.faults, scene.world.order)
        found.add(tuple(scene.world.order))
        motions += scene.wire.motions
    return len(found), motions


@pytest.mark.parametrize("begin", SCENES)
@pytest.mark.parametrize("seeds", [SOON, pytest.param(ALL, marks=pytest.mark.slow)])
def test_nothing_moves_after_a_confirmed_stop_unless_an_order_of_after_it_names_it(
    begin: Callable[[int], Scene], seeds: int
) -> None:
    interleavings, motions = checked(begin, seeds)
    assert interleavings > 0.9 * seeds  # the scene has many of them
    assert motions > 0  # and in some the arm moves
