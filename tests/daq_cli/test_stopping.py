"""Keys and `daq stop`, at a service or for several robots: sent in time, told, and never lost."""

import json
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx
import pytest

from daq.client import Client, ServiceError, ServiceNotReachedError
from daq.contracts.errors import SafetyError
from daq.contracts.experiment import ExperimentSpec
from daq.contracts.service.experiments import Experiment, ExperimentState
from daq.contracts.service.problems import ProblemDetails
from daq.contracts.service.queue import QueueStatus
from daq.contracts.service.robot import RobotIdentity, RobotStatus, RobotSummary, StopResult
from daq.contracts.service.teaching import TaughtPath, TeachingStatus
from daq.owner.stop_socket import StopAnswer
from daq.teaching.program import Program, Wait
from daq.teaching.recording import RecordedPath
from daq_cli.app.consent import ConsentPrompt
from daq_cli.robot.remote import run as companion
from daq_cli.robot.remote.run import Companion, acquire_remotely
from daq_cli.robot.remote.teach import RemoteTeaching, Stopped, StoppedAtServerError
from tests.daq.client.service_stand_in import problem
from tests.daq_cli.invoke import CommandLine

FROZEN = StopResult(delivered=True, confirmed=True, tick=7, seconds=0.1, text="stopped, confirmed by the board")
PROGRAM = Program(name="wait", instructions=(Wait(duration=1.0),))


def refused(status: int, kind: str = "no") -> ServiceError:
    return ServiceError(ProblemDetails(type=f"#{kind}", title="No", status=status, detail=kind))


class Experiments:
    """Those of a robot: a cancel does what a test says."""

    def __init__(self, does: Callable[[], object] | None, patience: list[float | None]) -> None:
        self._does = does
        self._patience = patience

    def cancel(self, _experiment: str, *, within: float | None = None) -> object:
        self._patience.append(within)
        assert self._does is not None
        return self._does()


class Queue:
    """That of a robot: what is asked of it is kept."""

    def __init__(self, patience: list[float | None]) -> None:
        self.attended = threading.Event()
        self.resumed: list[dict[str, bool]] = []
        self._patience = patience

    def attend(self, *, within: float | None = None) -> None:
        self._patience.append(within)
        self.attended.set()

    def resume(self, **word: bool) -> None:
        self.resumed.append(word)


class Robot:
    """Of a service. A cancel does what a test says; stops are counted; `states` are told one after the other."""

    def __init__(self, cancel: Callable[[], object] | None = None, states: Sequence[RobotStatus] = ()) -> None:
        self.name = "arm"
        self.stops = 0
        self.patience: list[float | None] = []
        self.states = list(states)
        self.status_of_teaching = TeachingStatus(activity="none", result="done: 1 instructions")
        self.experiments = Experiments(cancel, self.patience)
        self.queue = Queue(self.patience)

    def stop(self) -> StopResult:
        self.stops += 1
        return FROZEN

    def teaching(self) -> TeachingStatus:
        return self.status_of_teaching

    def status(self) -> RobotStatus:
        return self.states.pop(0)


def raising(error: Exception) -> Callable[[], object]:
    def fail() -> object:
        raise error

    return fail


def state(name: ExperimentState) -> Callable[[], object]:
    return lambda: Experiment.model_construct(state=name)


# ---- an experiment in the queue


def patient_companion(robot: Any, *, ends_within: float = 60.0) -> Companion:
    """Keys beside experiment 1234, with time enough however busy this computer is."""
    return Companion(robot, "1234", attends=False, ends_within=ends_within, leaves_within=60.0)


@pytest.mark.parametrize(
    "cancel",
    [raising(refused(status)) for status in (401, 429, 500, 503)] + [raising(ServiceNotReachedError("no answer"))],
    ids=["401", "429", "500", "503", "no answer"],
)
def test_a_cancel_that_fails_becomes_a_stop_that_is_reported(
    cancel: Callable[[], object], capsys: pytest.CaptureFixture[str]
) -> None:
    robot: Any = Robot(cancel)
    with patient_companion(robot) as keys:
        keys.press()
    assert robot.stops == 1
    assert robot.patience == [companion.ANSWER_WITHIN]
    assert companion.ANSWER_WITHIN <= 1.0
    assert "arm: stopped, confirmed by the board" in capsys.readouterr().err


@pytest.mark.parametrize("cancel", [state("running"), raising(refused(409, "experiment-state"))])
def test_an_experiment_that_still_runs_after_its_cancel_is_stopped(cancel: Callable[[], object]) -> None:
    stopped = threading.Event()
    robot: Any = Robot(cancel)
    robot.stop = lambda: stopped.set() or FROZEN
    with patient_companion(robot, ends_within=0.0) as keys:
        keys.press()
        assert stopped.wait(60)


@pytest.mark.parametrize("cancel", [state("cancelled"), raising(refused(404))], ids=["it waited", "it has ended"])
def test_what_a_key_cancels_before_it_runs_or_after_it_has_run_stops_no_other(cancel: Callable[[], object]) -> None:
    robot: Any = Robot(cancel)
    with patient_companion(robot) as keys:
        keys.press()
    assert (robot.stops, len(robot.patience)) == (0, 1)


def test_the_third_key_leaves_and_the_stop_is_sent_all_the_same() -> None:
    robot: Any = Robot(state("running"))

    def leave() -> None:
        with patient_companion(robot) as keys:
            for _ in range(3):
                keys.press()
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        leave()
    assert robot.stops >= 1


def test_confirming_that_an_operator_is_present_delays_no_stop() -> None:
    robot: Any = Robot()
    with Companion(robot, "1234", attends=True, attend_every=0.0):
        assert robot.queue.attended.wait(60)
    assert robot.patience[0] == companion.ANSWER_WITHIN


class Agreeing(ConsentPrompt):
    """An operator who agrees when asked."""

    def agreed(self, url: str) -> bool:
        return bool(url)


def test_a_queue_that_is_paused_while_the_operator_is_asked_stays_paused() -> None:
    identity = RobotIdentity(simulated=False, protocol=2, period=0.02, boots=1)

    def status(paused: bool) -> RobotStatus:
        queue = QueueStatus.model_construct(paused=paused, reason="by bert: a guest is at the arm")
        return RobotStatus.model_construct(robot="arm", port="serial:///dev/x", identity=identity, queue=queue)

    robot: Any = Robot(states=[status(False), status(True)])
    with pytest.raises(SafetyError, match="a guest is at the arm"):
        acquire_remotely(robot, "http://arm.lab:8300", ExperimentSpec(), Path("traces"), Agreeing(given=False))
    assert robot.queue.resumed == []


# ---- teaching


@pytest.mark.parametrize("error", [None, SafetyError("the program has ended"), refused(409, "stopped")])
def test_a_key_that_meets_the_end_of_the_work_counts_as_a_stop(error: Exception | None) -> None:
    robot: Any = Robot()

    def work() -> None:
        with Stopped(robot) as stopped:
            stopped.press()
            stopped.press()
            if error is not None:
                raise error

    with pytest.raises(StoppedAtServerError, match="confirmed by the board"):
        work()
    assert robot.stops == 1


def test_without_a_key_nothing_is_stopped() -> None:
    robot: Any = Robot()
    with Stopped(robot):
        pass
    assert robot.stops == 0


class Control:
    """The control of `robot`, for as long as the block lasts. What a test does not set does nothing."""

    def __init__(self) -> None:
        self.robot: Any = Robot()
        self.lease = None
        self.perform: Callable[[object], None] = lambda _: None
        self.lead: Callable[[object], None] = lambda _: None
        self.finish: Callable[[], object] = lambda: None

    @contextmanager
    def held(self) -> Iterator[tuple[Any, Any]]:
        yield self.robot, self


@pytest.fixture
def control() -> Control:
    return Control()


def test_a_program_that_ends_while_the_stop_is_in_flight(control: Control, capsys: pytest.CaptureFixture[str]) -> None:
    control.perform = lambda _: signal.raise_signal(signal.SIGINT)
    with pytest.raises(StoppedAtServerError):
        RemoteTeaching(control.held()).perform(PROGRAM)
    assert control.robot.stops == 1
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize("finish", [None, refused(503, "not-reached")])
def test_a_lead_that_is_stopped_keeps_its_path(control: Control, finish: ServiceError | None) -> None:
    """The path is there only when the lead has ended, which is after the answer to the stop."""
    path = TaughtPath(joints=(1,), times=(0.0, 0.1), positions=((0.0,), (0.1,)))
    ended = TeachingStatus(activity="none", problem="the arm has been stopped", path=path)
    kept: list[RecordedPath] = []

    def end() -> TeachingStatus:
        assert control.robot.stops == 1
        control.robot.status_of_teaching = ended
        if finish is not None:
            raise finish
        return ended

    control.robot.status_of_teaching = TeachingStatus(activity="lead")
    control.lead = lambda _: signal.raise_signal(signal.SIGINT)
    control.finish = end
    with pytest.raises(StoppedAtServerError):
        RemoteTeaching(control.held()).lead((1,), 60.0, kept.append)
    assert [one.joints for one in kept] == [(1,)]


# ---- daq stop


@pytest.fixture
def asked_for_names(monkeypatch: pytest.MonkeyPatch) -> list[float | None]:
    """How long was to be waited for the names of the service's robots, each time."""
    waited: list[float | None] = []

    def robots(_: Client, *, within: float | None = None) -> list[RobotSummary]:
        waited.append(within)
        return [RobotSummary(robot="other", machine="ma2000", connection="connected", arm="idle")]

    monkeypatch.setattr(Client, "robots", robots)
    return waited


def test_a_service_that_does_not_answer_a_stop_is_reported_at_once(
    daq: CommandLine, asked_for_names: list[float | None], monkeypatch: pytest.MonkeyPatch
) -> None:
    def silent(url: str, **_: object) -> httpx.Response:
        raise httpx.ReadTimeout("slow", request=httpx.Request("POST", url))

    monkeypatch.setattr("daq.client.stopping.httpx.post", silent)
    said = daq("--server", "http://arm.lab:8300", "stop")
    assert said.code == 3
    assert "ma2000: stop NOT DELIVERED" in said.out
    assert asked_for_names == []


def test_a_stop_with_an_unknown_name_says_so_and_stops_the_robots_of_the_service(
    daq: CommandLine, asked_for_names: list[float | None], monkeypatch: pytest.MonkeyPatch
) -> None:
    def post(url: str, **_: object) -> httpx.Response:
        if "/other/" in url:
            return httpx.Response(200, content=FROZEN.model_dump_json())
        return problem(404, "not-found", "there is no robot 'ma2000'")

    monkeypatch.setattr("daq.client.stopping.httpx.post", post)
    said = daq("--server", "http://arm.lab:8300", "stop")
    assert said.code == 0, said
    assert said.err.startswith("there is no robot 'ma2000': http://arm.lab:8300 is asked to stop")
    assert said.out.startswith("other: stopped, confirmed by the board")
    assert len(asked_for_names) == 1
    assert asked_for_names[0] is not None
    assert asked_for_names[0] <= 1.0


def test_a_token_that_is_not_ascii_is_refused_without_being_shown(
    daq: CommandLine, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("DAQ_TOKEN", "daq_schlüssel")
    stopped = daq("--server", "http://127.0.0.1:1", "stop")
    assert stopped.code == 3, stopped
    assert "stop NOT DELIVERED: token: only ASCII" in stopped.out
    told = daq("--server", "http://127.0.0.1:1", "status")
    told.complains(2, "token: only ASCII")
    assert "schl" not in stopped.out + stopped.err + told.err


# ---- several robots in daq.toml: all of them unless one is named, and all in doubt


TWO = "".join(f'[robots.{name}]\nport = "tcp://127.0.0.1:{port}"\n' for name, port in (("left", 1), ("right", 2)))


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, str]]:
    """The ports through which a stop was asked for; every one is confirmed."""
    Path("daq.toml").write_text(TWO)
    found: list[tuple[str, str]] = []

    def stop(robot: str, url: str) -> StopAnswer:
        found.append((robot, url))
        return StopAnswer(robot=robot, port=url, delivered=True, confirmed=True, tick=7)

    monkeypatch.setattr("daq.owner.port_stop.stop_at_port", stop)
    return found


LEFT, RIGHT = ("left", "tcp://127.0.0.1:1"), ("right", "tcp://127.0.0.1:2")


@pytest.mark.parametrize(
    ("words", "stopped"),
    [(["stop"], [LEFT, RIGHT]), (["stop", "--robot", "right"], [RIGHT]), (["--robot", "left", "stop"], [LEFT])],
)
def test_all_robots_are_stopped_unless_one_is_named(
    daq: CommandLine, asked: list[tuple[str, str]], words: Sequence[str], stopped: list[tuple[str, str]]
) -> None:
    said = daq(*words)
    assert said.code == 0, said
    assert sorted(asked) == stopped


def test_a_name_that_no_robot_has_stops_all_and_says_so(daq: CommandLine, asked: list[tuple[str, str]]) -> None:
    said = daq("stop", "--robot", "lfet", "--json")
    assert said.err == "no robot is called lfet: every robot is stopped\n"
    assert sorted(asked) == [LEFT, RIGHT]
    assert {one["robot"] for one in json.loads(said.out)} == {"left", "right"}


def test_other_commands_need_the_name_and_are_told_those_there_are(daq: CommandLine) -> None:
    Path("daq.toml").write_text(TWO)
    daq("status").complains(2, "say which one with --robot: left, right")
    daq("--robot", "middle", "status").complains(2, "robot 'middle': is not configured; there is left, right")
    daq("--robot", "left", "serve").complains(2, "`daq serve` is about all robots")
