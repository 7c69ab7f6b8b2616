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
from dataclasses import dataclass, field

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


@dataclass
class CountedChannel:
    """A channel whose bytes are counted."""

    inner: ByteChannel
    passed: Passed

    @property
    def description(self) -> str:
        """Returns the channel's address."""
        return self.inner.description

    def read(self, timeout_s: float) -> bytes:
        """Returns the bytes that have arrived."""
        data = self.inner.read(timeout_s)
        self.passed.into += len(data)
        return data

    def write(self, data: bytes) -> None:
        """Writes all of `data`."""
        self.passed.out += len(data)
        self.inner.write(data)

    def close(self) -> None:
        """Ends the connection."""
        self.inner.close()


@dataclass
class CountedEndpoint:
    """An endpoint of a controller that counts the bytes."""

    inner: Endpoint
    passed: Passed = field(default_factory=Passed)

    def __post_init__(self) -> None:
        self.url = self.inner.url
        self.lock_step = self.inner.lock_step
        self.bytes_per_second = self.inner.bytes_per_second
        self.control = self.inner.control

    def waited(self) -> float:
        """Returns the wrapped endpoint's value."""
        return self.inner.waited()

    def connect(self) -> ByteChannel:
        """Returns a counted channel."""
        return CountedChannel(self.inner.connect(), self.passed)

    def close(self) -> None:
        """Releases its resources."""
        self.inner.close()


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
    endpoint = CountedEndpoint(open_endpoint(URL))
    with Controller(Link(endpoint)) as controller:
        alone, _ = share_of_line(controller, endpoint.passed, periods, moving=False)
        both, busier = share_of_line(controller, endpoint.passed, periods, moving=True)
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
