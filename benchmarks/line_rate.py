"""What a line carries: the share that sampling needs, round trips beside its limit, and samples on slow lines.

    python -m benchmarks line_rate

The mock emulates the line behind a real pseudo-terminal, in real time; every byte that passes is counted at the
host's descriptor. Ten bits carry a byte. A round trip cannot take less than its bytes do, one direction after the
other: that is the floor. Memory accesses of the board come on top of it, as they do on a real one. On slow lines every
sample comes with a set point for each of its joints; the rate is kept if every n-th period was delivered, evenly.
"""

from __future__ import annotations

import argparse
import itertools
import statistics
import sys
import time
from collections import Counter

from benchmarks.figures import Figure, at_most, show
from daq.driver import Controller
from daq.driver.line_rate import bound_ms
from daq.link import Link
from daq.transport import ByteChannel, Endpoint, open_endpoint
from firmware_protocol.commands import ReadBlock, ReadStatus, Sample
from firmware_protocol.framing import FRAME_OVERHEAD
from firmware_protocol.joints import mask_of
from firmware_protocol.message import Request

BAUD = 115200
BITS_A_BYTE = 10
JOINTS = (1, 2, 3)
SHARE_TARGET = 25.0
TRIP_TARGET = 85.0
BAUD_RATES = (9600, 19200, 38400, 57600, BAUD)
TERMINAL = "mock://?pty=1"
URL = f"{TERMINAL}&baud={BAUD}"


def counted(endpoint: Endpoint) -> Counter[str]:
    """Counts the bytes (`out` and `into`) of every channel that the endpoint opens from now on."""
    passed, connect = Counter[str](), endpoint.connect

    def opened() -> ByteChannel:
        channel = connect()
        read, write = channel.read, channel.write

        def counting_read(timeout_s: float) -> bytes:
            data = read(timeout_s)
            passed["into"] += len(data)
            return data

        def counting_write(data: bytes) -> None:
            passed["out"] += len(data)
            write(data)

        vars(channel).update(read=counting_read, write=counting_write)
        return channel

    vars(endpoint).update(connect=opened)
    return passed


def share_of_line(controller: Controller, passed: Counter[str], periods: int, moving: bool) -> tuple[float, float]:
    """Returns shares (%) of one direction's capacity that sampling takes: both directions added, and the busier one."""
    snapshot = controller.next_snapshot(joints=JOINTS)
    here = snapshot.set_points
    before = passed.copy()
    for _ in range(periods):
        snapshot = controller.next_snapshot(snapshot.tick, JOINTS, here if moving else None)
    room = periods * controller.period_s * BAUD / BITS_A_BYTE
    out, into = (passed[way] - before[way] for way in ("out", "into"))
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


def kept_rate(baud: int, options: str, joints: tuple[int, ...], samples: int) -> Figure:
    """Returns the rate of samples beside the promised one. Late ones are told: a busy machine causes some."""
    with Controller.connect(f"{TERMINAL}{options}&baud={baud}") as controller:
        rate = controller.line_rate(joints, joints)
        snapshot = controller.next_snapshot(joints=joints)
        here, ticks, late = snapshot.set_points, [snapshot.tick], controller.counters.late
        for _ in range(samples):
            snapshot = controller.next_snapshot(snapshot.tick + rate.every - 1, joints, here)
            ticks.append(snapshot.tick)
        late, retries = controller.counters.late - late, controller.counters.retries
        found, promised = samples / ((ticks[-1] - ticks[0]) * controller.period_s), rate.samples_per_second
    even = ticks == list(range(ticks[0], ticks[-1] + 1, rate.every))
    turn = "one frame each way" if rate.compact else "two frames each way"
    told = f"{'even' if even else 'UNEVEN'}, {late} late, {retries} retries; stop ≤ {bound_ms(rate.stop_s)} ms"
    named, beside = f"{baud} baud, joints {joints}", f"{100 * rate.share:.0f} % of the line, {turn}; {told}"
    met = even and abs(found - promised) < 0.01 * promised
    return Figure(named, f"{found:.3g} samples/s", f"{promised:.3g} samples/s", met, beside)


def main() -> int:
    """Returns the exit code: 1 when a target was missed."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks line_rate", description=__doc__)
    parser.add_argument("--periods", type=int, default=250, help="control periods sampled")
    parser.add_argument("--trips", type=int, default=1000, help="round trips of each kind")
    parser.add_argument("--samples", type=int, default=100, help="samples at each rate")
    given = parser.parse_args()
    endpoint = open_endpoint(URL)
    passed = counted(endpoint)
    with Controller(Link(endpoint)) as controller:
        alone, _ = share_of_line(controller, passed, given.periods, moving=False)
        both, busier = share_of_line(controller, passed, given.periods, moving=True)
        kept = Sample(controller.status().tick - 1, mask_of(JOINTS))
        figures = [
            at_most("a sample of 3 joints every 20 ms", alone, SHARE_TARGET, "% of the line", "both directions added"),
            Figure(
                "the same with 3 set points",
                f"{both:.3g} % of the line",
                beside=f"both directions added; the busier one {busier:.3g} %",
            ),
            trip_figure("status", controller, ReadStatus(), 15, given.trips),
            trip_figure("available sample of 3 joints", controller, kept, 27, min(given.trips, 200)),
            trip_figure("48 bytes of memory", controller, ReadBlock(controller.memory_map.base, 48), 48, given.trips),
        ]
    with Controller.connect(TERMINAL) as controller:
        took, _ = trips(controller, ReadStatus(), 15, given.trips)
        figures.append(Figure("status without a line", f"{1e3 * took:.3g} ms", beside="link, system and mock together"))
    failed = show(f"The line at {BAUD} baud", "python -m benchmarks line_rate", figures)
    for title, options in (("Slow lines", ""), ("The same with a bridge without COMPACT", "&no_compact=1")):
        cases = itertools.product(BAUD_RATES, ((1,), JOINTS, (1, 2, 3, 4, 5, 6)))
        figures = [kept_rate(baud, options, joints, given.samples) for baud, joints in cases]
        failed |= show(title, "python -m benchmarks line_rate", figures)
    return failed


if __name__ == "__main__":
    sys.exit(main())
