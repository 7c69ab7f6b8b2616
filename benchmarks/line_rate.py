"""What a 115200 baud line carries: the share that sampling needs, and how close round trips come to its limit.

    python -m benchmarks line_rate

The mock emulates the line behind a real pseudo-terminal, in real time; every byte that passes is counted at the
host's descriptor. Ten bits carry a byte. A round trip cannot take less than its bytes do, one direction after the
other: that is the floor. Memory accesses of the board come on top of it, as they do on a real one.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import time
from dataclasses import dataclass

from benchmarks.figures import Figure, at_most, show
from daq.driver import Controller
from daq.link import Link
from daq.transport import ByteChannel, Endpoint, open_endpoint
from firmware_protocol.commands import ReadBlock, ReadStatus, Request, Sample, mask_of
from firmware_protocol.framing import FRAME_OVERHEAD

BAUD = 115200
BITS_A_BYTE = 10
JOINTS = (1, 2, 3)
SHARE_TARGET = 25.0
TRIP_TARGET = 85.0
URL = f"mock://?pty=1&baud={BAUD}"


@dataclass
class Passed:
    """Bytes that have passed the host's descriptor."""

    out: int = 0
    into: int = 0


def counted(endpoint: Endpoint) -> Passed:
    """Counts the bytes of every channel that the endpoint opens from now on."""
    passed, connect = Passed(), endpoint.connect

    def opened() -> ByteChannel:
        channel = connect()
        read, write = channel.read, channel.write

        def counting_read(timeout_s: float) -> bytes:
            data = read(timeout_s)
            passed.into += len(data)
            return data

        def counting_write(data: bytes) -> None:
            passed.out += len(data)
            write(data)

        vars(channel).update(read=counting_read, write=counting_write)
        return channel

    vars(endpoint).update(connect=opened)
    return passed


def share_of_line(controller: Controller, passed: Passed, periods: int, moving: bool) -> tuple[float, float]:
    """Returns shares (%) of one direction's capacity that sampling takes: both directions added, and the busier one."""
    snapshot = controller.next_snapshot(joints=JOINTS)
    here = snapshot.set_points
    out, into = passed.out, passed.into
    for _ in range(periods):
        snapshot = controller.next_snapshot(snapshot.tick, JOINTS, here if moving else None)
    room = periods * controller.period_s * BAUD / BITS_A_BYTE
    out, into = passed.out - out, passed.into - into
    return 100 * (out + into) / room, 100 * max(out, into) / room


def trips(controller: Controller, request: Request, reply_bytes: int, repeats: int) -> tuple[float, float]:
    """Returns the median time (s) of consecutive round trips, and the line's own time for their bytes (s)."""
    times = []
    for _ in range(repeats):
        begun = time.perf_counter()
        controller.link.exchange(request)
        times.append(time.perf_counter() - begun)
    on_line = len(request.pack()) + reply_bytes + 2 * FRAME_OVERHEAD
    return statistics.median(times), on_line * BITS_A_BYTE / BAUD


def trip_figure(name: str, controller: Controller, request: Request, reply_bytes: int, repeats: int) -> Figure:
    """Returns round trips of one kind, as a share of the line's limit."""
    took, floor = trips(controller, request, reply_bytes, repeats)
    beside = f"{1e3 * took:.2f} ms per trip, its bytes alone {1e3 * floor:.2f} ms"
    share = 100 * floor / took
    target = f"≥ {TRIP_TARGET:g} %"
    return Figure(f"round trips: {name}", f"{share:.3g} % of the line", target, share >= TRIP_TARGET, beside)


def main() -> int:
    """Returns the exit code: 1 when a target was missed."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks line_rate", description=__doc__)
    parser.add_argument("--periods", type=int, default=250, help="control periods sampled")
    parser.add_argument("--trips", type=int, default=1000, help="round trips of each kind")
    given = parser.parse_args()
    periods, repeats = given.periods, given.trips
    endpoint = open_endpoint(URL)
    passed = counted(endpoint)
    with Controller(Link(endpoint)) as controller:
        alone, _ = share_of_line(controller, passed, periods, moving=False)
        both, busier = share_of_line(controller, passed, periods, moving=True)
        kept = Sample(controller.status().tick - 1, mask_of(JOINTS))
        figures = [
            at_most("a sample of 3 joints every 20 ms", alone, SHARE_TARGET, "% of the line", "both directions added"),
            Figure(
                "the same with 3 set points",
                f"{both:.3g} % of the line",
                beside=f"both directions added; the busier one {busier:.3g} %",
            ),
            trip_figure("status", controller, ReadStatus(), 15, repeats),
            trip_figure("available sample of 3 joints", controller, kept, 27, min(repeats, 200)),
            trip_figure("48 bytes of memory", controller, ReadBlock(controller.memory_map.base, 48), 48, repeats),
        ]
    with Controller.connect("mock://?pty=1") as controller:
        took, _ = trips(controller, ReadStatus(), 15, repeats)
        figures.append(Figure("status without a line", f"{1e3 * took:.3g} ms", beside="link, system and mock together"))
    return show(f"The line at {BAUD} baud", "python -m benchmarks line_rate", figures)


if __name__ == "__main__":
    sys.exit(main())
