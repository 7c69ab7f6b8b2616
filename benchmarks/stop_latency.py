"""From the wish to stop to the frozen set points, and to the first control period that uses them.

    python -m benchmarks stop_latency

A host process samples three joints of a mock at 115200 baud through a pseudo-terminal, sends set points in every
period, and listens on the socket of `daq stop`, all with the code of a real run. Stops come at random moments:
from another thread of the host; from another process through that socket, as `daq stop` does once Python has started;
and by the command itself, counted from its start, in a folder and an environment of its own, since it would freeze a
configured robot, too. First on a clean line, then with one frame in a hundred damaged or lost, both ways. The moments
are the mock's own record: board time, and the reading of the system's monotonic clock
(which all processes share) at its zero.
"""

from __future__ import annotations

import argparse
import contextlib
import multiprocessing
import os
import random
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from benchmarks.figures import Figure, at_most, none, quantile, show
from benchmarks.mock_process import MockControl, environment_of
from daq.driver import Controller
from daq.link import RequestRefusedError
from daq.owner.guardian import Guardian
from daq.owner.stop_socket import FOLDER_VARIABLE, StopAnswer, request_stop, stop_listener

URL = "mock://?pty=1&baud=115200"
FAULTS = "&fault=flip:rate=0.005&fault=drop:rate=0.005"
JOINTS = (1, 2, 3)
FROZEN_TARGET_MS = 20.0
USED_TARGET_MS = 45.0
ROBOT = "benchmark"
PERIOD_S = 0.02
LONGEST_WAIT_S = 5.0
START_TARGET_MS = 60.0
"""What the start of Python may add: 80 ms until frozen."""
WITH_START = "by `daq stop`, the start of Python included"


@dataclass
class Stops:
    """Latencies (ms) of repeated stops of one kind."""

    frozen: list[float] = field(default_factory=list)
    used: list[float] = field(default_factory=list)
    unconfirmed: int = 0


def _sample_until_stopped(controller: Controller) -> None:
    """Samples and sends set points, as a run does, until the board refuses them."""
    snapshot = controller.next_snapshot(joints=JOINTS)
    here = snapshot.set_points
    sway = 0
    with contextlib.suppress(RequestRefusedError):
        while True:
            sway = (sway + 1) % 8
            wanted = {joint: posture + sway // 4 for joint, posture in here.items()}
            snapshot = controller.next_snapshot(snapshot.tick, JOINTS, wanted)


def _host(url: str, parent: Connection) -> None:
    """Runs the host process. On "run", it runs until it is stopped; on a number, it stops itself after so many s."""
    with Controller.connect(url) as controller, stop_listener(ROBOT) as listener:

        def freeze(_cause: str) -> StopAnswer:
            confirmation = controller.stop()
            return StopAnswer(robot=ROBOT, delivered=confirmation.sent, confirmed=confirmation.acknowledged)

        with Guardian(listener, None, freeze):
            parent.send(controller.link.control)
            while (told := parent.recv()) != "end":
                controller.release(controller.status().stop)
                asked: list[tuple[float, bool]] = []
                stopper = threading.Thread(target=_stop_later, args=(controller, told, asked))
                if told != "run":
                    stopper.start()
                parent.send("running")
                _sample_until_stopped(controller)
                if told != "run":
                    stopper.join()
                parent.send(asked)
            parent.send(controller.counters.retries)


def _stop_later(controller: Controller, after_s: float, asked: list[tuple[float, bool]]) -> None:
    time.sleep(after_s)
    at = time.monotonic()
    asked.append((at, controller.stop().acknowledged))


def _by_thread(host: Connection, after_s: float, _folder: Path) -> tuple[float, bool]:
    host.send(after_s)
    host.recv()
    ((at, confirmed),) = host.recv()
    return at, confirmed


def _by_socket(host: Connection, after_s: float, _folder: Path) -> tuple[float, bool]:
    host.send("run")
    host.recv()
    time.sleep(after_s)
    at = time.monotonic()
    attempts = request_stop(ROBOT)
    host.recv()
    return at, len(attempts) == 1 and attempts[0].answer is not None and attempts[0].answer.confirmed


def _by_command(host: Connection, after_s: float, folder: Path) -> tuple[float, bool]:
    host.send("run")
    host.recv()
    time.sleep(after_s)
    at = time.monotonic()
    code = stop_command(folder)
    host.recv()
    return at, code == 0


def stop_command(folder: Path, run_process: Callable[..., Any] = subprocess.run) -> int:
    """Runs `daq stop` in a folder of its own, where it finds only the robots of this benchmark; returns its exit
    code.
    """
    command = [str(Path(sys.executable).with_name("daq")), "stop"]
    environment = environment_of(folder)
    ended = run_process(command, stdout=subprocess.DEVNULL, check=False, cwd=folder, env=environment)
    code: int = ended.returncode
    return code


def record_of_stop(control: MockControl, number: int) -> tuple[float, float]:
    """Returns when stop `number` was in the memory and when it was first used (s, monotonic clock). Raises
    RuntimeError.
    """
    give_up = time.monotonic() + LONGEST_WAIT_S
    while time.monotonic() < give_up:
        state = control.ask("state")
        stop, zero_us = state["stop"], state["clock"]["monotonic_us_at_zero"]
        if stop["count"] == number and stop["first_used_us"] is not None:
            return (zero_us + stop["frozen_us"]) * 1e-6, (zero_us + stop["first_used_us"]) * 1e-6
        time.sleep(0.01)
    raise RuntimeError(f"stop {number} never had an effect: the mock recorded {stop}")


def measure(url: str, repeats: int, folder: Path) -> tuple[dict[str, Stops], int, dict[str, int]]:
    """Measures stops by thread, socket and command, in `folder`; returns also the host's retries and the mock's
    lateness.
    """
    dice = random.Random(1991)
    ways: list[tuple[str, Callable[[Connection, float, Path], tuple[float, bool]], int]] = [
        ("by a thread", _by_thread, repeats),
        ("by `daq stop`'s socket", _by_socket, repeats),
        (WITH_START, _by_command, max(3, repeats // 10)),
    ]
    results = {where: Stops() for where, _, _ in ways}
    context = multiprocessing.get_context("spawn")
    host, child = context.Pipe()
    process = context.Process(target=_host, args=(url, child))
    process.start()
    with MockControl(host.recv()) as control:
        number = 0
        for where, way, times in ways:
            stops = results[where]
            for _ in range(times):
                at, confirmed = way(host, dice.uniform(3 * PERIOD_S, 4 * PERIOD_S), folder)
                number += 1
                frozen, used = record_of_stop(control, number)
                stops.frozen.append(1e3 * (frozen - at))
                stops.used.append(1e3 * (used - at))
                stops.unconfirmed += not confirmed
        clock = control.ask("state")["clock"]
    host.send("end")
    retries = host.recv()
    process.join()
    return results, retries, clock


def figures_of(line: str, results: dict[str, Stops], retries: int, clock: dict[str, int]) -> list[Figure]:
    """Returns the table's rows of one line."""
    rows = []
    for where, stops in results.items():
        for what, times, target in (
            ("frozen in memory", stops.frozen, FROZEN_TARGET_MS),
            ("first used", stops.used, USED_TARGET_MS),
        ):
            beside = f"p50 {quantile(times, 0.5):.1f}, max {max(times):.1f} ms, {len(times)} stops"
            name = f"{line}, {where}: {what}, p99"
            limit = target + (START_TARGET_MS if where == WITH_START else 0.0)
            rows.append(at_most(name, quantile(times, 0.99), limit, "ms", beside))
    unconfirmed = sum(stops.unconfirmed for stops in results.values())
    late = f"mock behind its clock by more than 2 ms in {clock['late_ticks']} periods"
    return [*rows, none(f"{line}: stops without confirmation", unconfirmed, f"{retries} repetitions; {late}")]


def main() -> int:
    """Returns the exit code: 1 when a target was missed."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks stop_latency", description=__doc__)
    parser.add_argument("--repeats", type=int, default=300, help="stops of each kind")
    repeats = parser.parse_args().repeats
    figures = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        os.environ[FOLDER_VARIABLE] = environment_of(folder)[FOLDER_VARIABLE]
        for line, url in (("clean", URL), ("1 % damaged", URL + FAULTS)):
            figures += figures_of(line, *measure(url, repeats, folder))
    return show("Stop, at 115200 baud", "python -m benchmarks stop_latency", figures)


if __name__ == "__main__":
    sys.exit(main())
