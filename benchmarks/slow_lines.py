"""Measures samples per second on slow lines: requested and received, on a line with real transmission times.

    python -m benchmarks slow_lines

The mock emulates the line behind a real pseudo-terminal, in real time: ten bits per byte, bytes of one direction one
after the other. Every sample comes with a set point for each of its joints. A target is met if every n-th period was
delivered, evenly. Late samples, after the time of the next one, are reported: a busy machine causes some. (In lock-step
the host's requests to advance time would also take time on the line.)
"""

from __future__ import annotations

import argparse
import sys

from benchmarks.figures import Figure, show
from daq.driver import Controller, LineRate
from daq.driver.line_rate import bound_ms

URL = "mock://?pty=1"
BAUD_RATES = (9600, 19200, 38400, 57600, 115200)
JOINTS = ((1,), (1, 2, 3), (1, 2, 3, 4, 5, 6))


def measured(controller: Controller, joints: tuple[int, ...], samples: int) -> tuple[LineRate, list[int], int]:
    """Returns the promised rate, the received ticks, and the number of late samples."""
    rate = controller.line_rate(joints, joints)
    snapshot = controller.next_snapshot(joints=joints)
    here = snapshot.set_points
    ticks = [snapshot.tick]
    late = controller.counters.late
    for _ in range(samples):
        snapshot = controller.next_snapshot(snapshot.tick + rate.every - 1, joints, here)
        ticks.append(snapshot.tick)
    return rate, ticks, controller.counters.late - late


def figure(baud: int, url: str, joints: tuple[int, ...], samples: int) -> Figure:
    """Returns one line of the table."""
    with Controller.connect(f"{url}&baud={baud}") as controller:
        rate, ticks, late = measured(controller, joints, samples)
        per_second = (len(ticks) - 1) / ((ticks[-1] - ticks[0]) * controller.period_s)
    even = ticks == list(range(ticks[0], ticks[-1] + 1, rate.every))
    retries = controller.counters.retries
    turn = "one frame each way" if rate.compact else "two frames each way"
    found = f"{'even' if even else 'UNEVEN'}, {late} late, {retries} retries"
    beside = f"{100 * rate.share:.0f} % of the line, {turn}; {found}; stop ≤ {bound_ms(rate.stop_s)} ms"
    named = f"{baud} baud, {len(joints)} joint{'s' * (len(joints) > 1)}"
    promised = rate.samples_per_second
    met = even and abs(per_second - promised) < 0.01 * promised
    return Figure(named, f"{per_second:.3g} samples/s", f"{promised:.3g} samples/s", met, beside)


def main() -> int:
    """Returns the exit code: 1 when a promised rate was not kept."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks slow_lines", description=__doc__)
    parser.add_argument("--samples", type=int, default=100, help="samples at each rate")
    samples = parser.parse_args().samples
    for title, options in (("Slow lines", ""), ("The same with a bridge without COMPACT", "&no_compact=1")):
        figures = [figure(baud, URL + options, joints, samples) for baud in BAUD_RATES for joints in JOINTS]
        failed = show(title, "python -m benchmarks slow_lines", figures)
        if failed:
            return failed
    return 0


if __name__ == "__main__":
    sys.exit(main())
