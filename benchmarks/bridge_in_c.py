"""Measures the bridge in C beside the mock's own: stops, accesses to the bus, size of the code and depth of the stack.

    python -m benchmarks bridge_in_c [--stops 200]

The core runs as a library on this computer, and as the firmware image of the Mega 2560 on a simulated board. Both use
the mock's board and a line of 115200 baud. A host samples three joints, and stops at random times. All times are the
board's, not a clock's, so the load of this machine has no influence. Needs gcc, gcc-avr, avr-libc, libsimavr-dev and
libelf-dev.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from random import Random
from typing import Any

from benchmarks.figures import Figure, at_most, quantile, show
from firmware_protocol import commands as c
from firmware_protocol.framing import FrameDecoder, encode_frame
from firmware_protocol.message import Request, Stamp
from firmware_protocol.session import parse_reply, to_frame
from mock_controller.device import build_device
from mock_controller.options import Options
from tests.firmware.compiled import BUILD, SOURCES, made
from tests.firmware.hosted_link import HostedLink
from tests.firmware.mega_link import MegaLink, board_on_the_bus

BAUD = 115_200
LINE_US = 9 * 10_000_000 // BAUD  # a stop's frame has nine bytes
PERIOD_US = 20_000
STEP_US = 200
JOINTS = 0b000111
FROZEN_TARGET_MS = 10.0
"""A stop whose posture must be read again is answered within 10 ms (PROTOCOL.md, section 3)."""
USED_TARGET_MS = 45.0


class Host:
    """Requests and replies on the board's time."""

    def __init__(self, link: Any, *, line_is_modelled: bool) -> None:
        self.link = link
        self._line_is_modelled = line_is_modelled
        self._decoder = FrameDecoder()
        self._sequence = 0
        self._stamp = Stamp(0, 0)
        self._replies: dict[int, Any] = {}

    def run_until(self, time_us: int) -> None:
        """Advances time, and receives what arrives."""
        while self.link.time_us < time_us:
            self.link.run_until(min(self.link.time_us + STEP_US, time_us))
            for frame in self._decoder.feed(self.link.take_output()):
                self._replies[frame.sequence] = parse_reply(frame)

    def send(self, request: Request) -> int:
        """Sends a request; returns its sequence number."""
        self._sequence += 1
        if request.IS_COMMAND:
            self._stamp = Stamp(self._stamp.session, self._stamp.number + 1)
        line = encode_frame(to_frame(self._sequence, request, self._stamp))
        if not self._line_is_modelled:
            self.run_until(self.link.time_us + len(line) * 10_000_000 // BAUD)
        self.link.receive(line)
        return self._sequence

    def ask(self, request: Request) -> Any:
        """Returns the reply to a request."""
        sequence = self.send(request)
        give_up_us = self.link.time_us + 10 * PERIOD_US
        while sequence not in self._replies:
            if self.link.time_us > give_up_us:
                raise RuntimeError(f"no reply to {request}")
            self.run_until(self.link.time_us + STEP_US)
        return self._replies.pop(sequence)

    def greet(self) -> None:
        """Begins a session."""
        reply = self.ask(c.Hello(c.PROTOCOL_VERSION, 0x600D0000 | self._sequence))
        self._stamp = Stamp(reply.session, 0)

    def release(self) -> None:
        """Ends the freeze."""
        self.ask(c.Release(self.ask(c.ReadStatus()).stop))


class BlindHost(Host):
    """A host for a bridge without SAMPLE, which reads the memory instead."""

    def ask(self, request: Request) -> Any:
        if isinstance(request, c.Sample):
            joints = super().ask(c.ReportErrorsPositionsPowers(JOINTS)).joints
            return c.Snapshot(0, 0, joints)
        return super().ask(request)

    def send(self, request: Request) -> int:
        return 0 if isinstance(request, c.Sample) else super().send(request)


@dataclass
class Stops:
    """Times (ms) from the first bit of a stop on the line."""

    frozen: list[float] = field(default_factory=list)
    used: list[float] = field(default_factory=list)


def measure(host: Host, frozen_us: Callable[[], int], board: Any, count: int) -> Stops:
    """Measures stops at random times while a sample is waited for."""
    dice, stops = Random(1991), Stops()
    host.run_until(5 * PERIOD_US)
    host.greet()
    host.release()
    for _ in range(count):
        host.run_until(host.link.time_us + dice.randrange(2 * PERIOD_US))
        here = host.ask(c.Sample(c.AFTER_NEWEST, JOINTS))
        host.ask(c.WriteSetPoints(tuple((joint, reading.set_point ^ 1) for joint, reading in here.joints)))
        host.send(c.Sample(here.tick, JOINTS))
        host.run_until(host.link.time_us + dice.randrange(PERIOD_US))
        at_us = host.link.time_us
        host.ask(c.Stop())
        written_us = frozen_us()
        host.run_until(host.link.time_us + 3 * PERIOD_US)
        used_us = min(each.time_us for each in board.snapshots.after(0) if each.time_us >= written_us)
        stops.frozen.append((written_us - at_us) * 1e-3)
        stops.used.append((used_us - at_us) * 1e-3)
        host.release()
    return stops


def rows(name: str, stops: Stops) -> list[Figure]:
    """Returns the table's rows of one bridge."""
    found = []
    columns = (("frozen in memory", stops.frozen, FROZEN_TARGET_MS), ("first used", stops.used, USED_TARGET_MS))
    for what, times, target in columns:
        beside = f"p50 {quantile(times, 0.5):.2f}, max {max(times):.2f} ms, {len(times)} stops"
        found.append(at_most(f"{name}: stop {what}, p99", quantile(times, 0.99), target, "ms", beside))
    return found


def mock_rows(count: int) -> list[Figure]:
    """Returns rows of the mock's own bridge."""
    device = build_device(Options(tcp="nowhere:0", baud=BAUD), lambda _: None)
    stops = device.bridge.stops
    host = Host(device.link, line_is_modelled=True)
    return rows("mock", measure(host, lambda: stops.frozen_us or 0, device.board, count))


def hosted_rows(name: str, count: int, *, sees_period: bool) -> list[Figure]:
    """Returns rows of the core as a library on this computer."""
    device = build_device(Options(tcp="nowhere:0"), lambda _: None)
    link = HostedLink(device, sees_period=sees_period)
    host = (Host if sees_period else BlindHost)(link, line_is_modelled=False)
    return rows(name, measure(host, lambda: link.set_points_written_us, device.board, count))


def mega_rows(count: int) -> list[Figure]:
    """Returns rows of the firmware image on a simulated board."""
    device = build_device(board_on_the_bus(Options(tcp="nowhere:0")), lambda _: None)
    link = MegaLink(device)
    began, host = time.perf_counter(), Host(link, line_is_modelled=True)
    found = rows("Mega 2560", measure(host, lambda: link.set_points_written_us, device.board, count))
    speed = link.time_us * 1e-6 / (time.perf_counter() - began)
    bus = link.simulator.bus
    broken = sum(bus.faults)
    return [
        *found,
        Figure(f"Mega 2560: {bus.reads + bus.writes} bus cycles, rules broken", f"{broken}", "0", broken == 0),
        Figure("Mega 2560: NPGFC before 1MHzE rises, least", f"{bus.least_select_setup_ns} ns", "≥ 250 ns"),
        Figure("Mega 2560: address and R/W before 1MHzE rises, least", f"{bus.least_address_setup_ns} ns", "≥ 300 ns"),
        Figure("Mega 2560: address, R/W, NPGFC after 1MHzE falls, least", f"{bus.least_hold_ns} ns", "≥ 30 ns"),
        Figure("Mega 2560: data written after 1MHzE falls, least", f"{bus.least_data_hold_ns} ns", "≥ 50 ns"),
        Figure("Mega 2560: stack used, most", f"{link.simulator.stack_bytes} bytes", beside="bound: stack.py below"),
        Figure("simulated time per second of this machine's", f"{speed:.1f} s"),
    ]


def main(arguments: list[str]) -> int:
    """Returns the exit code: 1 when a target was missed."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--stops", type=int, default=200, help="stops of each bridge (200)")
    count = parser.parse_args(arguments).stops
    for file in ("libbridge-32.so", "libmega2560.so", "mega2560.elf"):
        made(file)
    figures = [
        *mock_rows(count),
        *hosted_rows("core in C", count, sees_period=True),
        *hosted_rows("core in C, no SAMPLE", count, sees_period=False),
        *mega_rows(count),
    ]
    code = show("The bridge in C", "python -m benchmarks bridge_in_c", figures)
    subprocess.run(["make", "-s", "-C", SOURCES, f"BUILD={BUILD}", "mega2560", "size"], check=True)
    return code


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
