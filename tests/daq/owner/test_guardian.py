"""Each request to end or to stop is heard, freezes before anything else, and is answered in time."""

from __future__ import annotations

import os
import shutil
import signal
import socket
import threading
import time
from collections.abc import Iterator
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast

import pytest

from daq.driver import StopConfirmation
from daq.owner import freezer as module
from daq.owner import guardian, stop_socket
from daq.owner.freezer import Freezer
from daq.owner.guardian import CANCEL, EndCause, Guardian
from daq.owner.stop_socket import StopAnswer, StopSocket, request_stop, stop_listener
from daq.runner.arm_control import ArmControl

CONFIRMED = StopAnswer(robot="arm", delivered=True, confirmed=True, tick=7)


@pytest.fixture(autouse=True)
def own_runtime_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path / "run"
    monkeypatch.setenv(stop_socket.FOLDER_VARIABLE, str(folder))
    return folder


@dataclass
class Freezes:
    """Stands for the freezer: remembers why it was asked, and in which state the guardian was then."""

    causes: list[str] = field(default_factory=list)
    asked: threading.Semaphore = field(default_factory=lambda: threading.Semaphore(0))

    def __call__(self, cause: str) -> StopAnswer:
        self.causes.append(cause)
        self.asked.release()
        return CONFIRMED

    def wait(self) -> None:
        assert self.asked.acquire(timeout=10)


@dataclass
class Scene:
    guardian: Guardian
    freezes: Freezes
    listener: StopSocket
    parent: int


@contextmanager
def guarded() -> Iterator[Scene]:
    reader, writer = os.pipe()
    freezes = Freezes()
    try:
        with stop_listener("arm") as listener, Guardian(listener, reader, freezes) as guardian:
            yield Scene(guardian, freezes, listener, writer)
    finally:
        os.close(reader)
        with suppress(OSError):  # the test may have closed it
            os.close(writer)


def test_no_cause_until_somebody_wants_the_end_and_the_loss_of_the_parent_is_told_once() -> None:
    with guarded() as scene:
        assert scene.guardian.cause is None
    assert scene.freezes.causes == []
    with guarded() as scene:
        os.close(scene.parent)
        scene.freezes.wait()
        request_stop()
        scene.freezes.wait()
    assert scene.freezes.causes == [EndCause.ORPHANED.value, EndCause.STOP.value]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_is_a_stop_and_the_handlers_are_put_back(number: int) -> None:
    before = signal.getsignal(number)
    with guarded() as scene:
        os.kill(os.getpid(), number)
        scene.freezes.wait()
        assert scene.guardian.cause is EndCause.SIGNAL
    assert signal.getsignal(number) is before


def test_a_client_is_answered_with_what_became_of_the_stop_also_at_the_end() -> None:
    with guarded() as scene:
        (attempt,) = request_stop()
        assert scene.guardian.cause is EndCause.STOP
    assert attempt.answer == CONFIRMED
    assert attempt.robot == "arm"
    client = socket.socket(socket.AF_UNIX)
    client.settimeout(10)
    with guarded() as scene:
        scene.guardian._closing = True  # it looks at its socket no more
        client.connect(str(scene.listener.path))
    with client:
        assert StopAnswer.from_json(client.recv(4096)) == CONFIRMED


def test_a_word_of_the_parent_is_a_stop_and_a_reset_forgets_only_what_came_before() -> None:
    # A word of the parent is a stop and its end the loss of it
    with guarded() as scene:
        os.write(scene.parent, b"stop\n")
        scene.freezes.wait()
        assert scene.guardian.cause is EndCause.PARENT
        os.close(scene.parent)
        scene.freezes.wait()
        assert scene.freezes.causes[-1] == EndCause.ORPHANED.value
        assert scene.guardian.cause is EndCause.PARENT, "the first cause is kept"
    with guarded() as scene:
        before = time.monotonic()
        request_stop()
        assert not scene.guardian.clear_cause(before)
        assert scene.guardian.cause is EndCause.STOP
        assert scene.guardian.clear_cause(time.monotonic())
        assert scene.guardian.cause is None
    # A cancel of the service is called one however often it is said
    with guarded() as scene:
        os.write(scene.parent, 2 * CANCEL)
        scene.freezes.wait()
        assert scene.guardian.cause is EndCause.CANCELLED


def test_a_client_that_reads_nothing_or_goes_has_asked_and_holds_up_nobody() -> None:
    with guarded() as scene:
        hanging = [socket.socket(socket.AF_UNIX) for _ in range(3)]
        for client in hanging:
            client.connect(str(scene.listener.path))
        (attempt,) = request_stop()
        for client in hanging:
            client.close()
    assert attempt.answer == CONFIRMED
    with guarded() as scene:
        client = socket.socket(socket.AF_UNIX)
        client.connect(str(scene.listener.path))
        client.close()
        scene.freezes.wait()


def test_a_socket_without_its_folder_is_made_again_for_all_that_found_it(own_runtime_folder: Path) -> None:
    with guarded() as scene, socket.socket(socket.AF_UNIX) as early:
        early.settimeout(10)
        with scene.guardian._lock:  # so that the early client waits until the folder is gone
            early.connect(str(scene.listener.path))
            shutil.rmtree(own_runtime_folder)
        assert StopAnswer.from_json(early.recv(4096)) == CONFIRMED
        until = time.monotonic() + 10
        while not (found := request_stop()) and time.monotonic() < until:
            time.sleep(guardian.LOOK_EVERY / 10)
        assert [attempt.answer for attempt in found] == [CONFIRMED]
        assert scene.guardian.socket_problem == ""


def test_stops_of_two_threads_at_once_are_both_answered_and_a_reset_between_them_forgets_nothing() -> None:
    begun, go_on = threading.Semaphore(0), threading.Semaphore(0)

    def slow(_cause: str) -> StopAnswer:
        begun.release()
        assert go_on.acquire(timeout=10)
        return CONFIRMED

    with stop_listener("arm") as listener, Guardian(listener, None, slow) as watched:
        with ThreadPoolExecutor(2) as pool:
            first, second = pool.submit(watched.stop), pool.submit(watched.stop)
            assert begun.acquire(timeout=10)
            assert begun.acquire(timeout=10)
            go_on.release()
            done, (left,) = wait([first, second], timeout=10, return_when=FIRST_COMPLETED)
            assert [one.result() for one in done] == [CONFIRMED]
            assert not watched.clear_cause(time.monotonic()), "the other one is still under way"
            go_on.release()
            assert left.result(10) == CONFIRMED
        assert watched.clear_cause(time.monotonic())


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_a_guardian_that_fails_freezes_the_arm_and_ends_the_run() -> None:
    freezes = Freezes()
    reader, writer = os.pipe()
    with stop_listener("arm") as listener, Guardian(listener, reader, freezes) as guardian:
        os.close(reader)  # under its hands: reading it fails
        os.write(guardian._wake_write, b"\0")
        freezes.wait()
        assert guardian.cause is EndCause.LISTENER_FAILED
    os.close(writer)
    assert freezes.causes == [EndCause.LISTENER_FAILED.value]


# ---- Whoever asks for a stop is answered in time, with what is known by then


class SlowControl:
    """An arm whose board confirms when the test says so."""

    def __init__(self) -> None:
        self.confirm = threading.Event()
        self.stops = 0
        self.answer = StopConfirmation(sent=True, acknowledged=True, tick=9, frozen={1: 500})

    def stop(self, _cause: str) -> StopConfirmation:
        self.stops += 1
        assert self.confirm.wait(10)
        return self.answer


def controlled(freezer: Freezer) -> SlowControl:
    control = SlowControl()
    freezer.control = cast(ArmControl, cast(Any, control))
    return control


def test_what_is_known_of_a_stop_is_answered() -> None:
    with Freezer("arm", "serial:///dev/x") as freezer:
        answer = freezer.freeze("now")
    assert (answer.robot, answer.port, answer.delivered) == ("arm", "serial:///dev/x", False)
    assert "ends before anything moves" in answer.text
    with Freezer("arm", "") as freezer:
        controlled(freezer).confirm.set()
        answer = freezer.freeze("now")
    assert (answer.delivered, answer.confirmed, answer.tick, answer.postures) == (True, True, 9, (500,))
    with Freezer("arm", "") as freezer:
        control = controlled(freezer)
        control.answer = StopConfirmation(sent=False, acknowledged=False, problem="no line")
        control.confirm.set()
        answer = freezer.freeze("now")
    assert (answer.delivered, answer.confirmed, answer.text) == (False, False, "no line")


def test_a_board_that_does_not_confirm_keeps_only_the_stop_waiting(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "ANSWER_WITHIN", 0.01)
    with Freezer("arm", "") as freezer:
        control = controlled(freezer)
        first, second = freezer.freeze("now"), freezer.freeze("again")
        assert control.stops == 1, "the second request waits for the stop that is under way"
        control.confirm.set()
    assert (first.delivered, first.confirmed) == (second.delivered, second.confirmed) == (True, False)
    assert "no confirmation within" in first.text
