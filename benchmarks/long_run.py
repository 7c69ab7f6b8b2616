"""Minutes of recording in real time over a line that damages one frame in a hundred: is anything lost, or wrong?

python -m benchmarks long_run [--minutes 10]

A complete run as `daq run` makes it: the acquisition process, a pseudo-terminal at 115200 baud, three joints, a trace
on disk. The mock loses 0.5 % of the frames and flips a bit in another 0.5 %, in both directions. Meanwhile its own
record of every control period is fetched through the control port, which never touches the line. At the end the
trace is opened from disk and compared, count by count, with that record; and the damage done with what both ends have
noticed: every frame struck ends one attempt of the host, which shows as one time-out.
"""

from __future__ import annotations

import argparse
import math
import sys
import tempfile
import threading
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from benchmarks.figures import Figure, none, show
from benchmarks.mock_process import MockControl, is_kept, started_mock
from daq.contracts.experiment import ExperimentSpec, Sine
from daq.contracts.machine import Machine, load_machine
from daq.contracts.trace import Trace
from daq.owner.client import OwnerOnDemand
from daq.owner.messages import Finished, Open
from daq.traces.reader import read_trace

BAUD = 115200
RATE = 0.005
# A lost frame is not flipped too: every frame is affected at most once, so the faults can be counted one by one.
FAULTS = ("--fault", f"drop:rate={RATE}", "--fault", f"flip:rate={RATE}")
JOINTS = (1, 2, 3)
SINE_S = 4.0
FETCH_EVERY_S = 0.4
"""Time (s) between fetches; the mock's ring keeps 1.28 s."""


@dataclass
class BoardRecord:
    """The mock's own record of its control periods, fetched bit by bit while a run goes on."""

    control: MockControl
    periods: dict[int, dict[str, Any]] = field(default_factory=dict)
    _over: threading.Event = field(default_factory=threading.Event)

    def fetch_until_over(self) -> None:
        """Fetches until the run is over; runs in a separate thread."""
        last = 0
        while True:
            over = self._over.wait(FETCH_EVERY_S)
            for snapshot in self.control.ask("snapshots", after=last)["snapshots"]:
                last = snapshot["tick"]
                self.periods[last] = snapshot
            if over:
                return

    def over(self) -> None:
        """Ends the fetching after one last time."""
        self._over.set()


@dataclass(frozen=True)
class Recorded:
    """Files of a run, and the mock's knowledge of it."""

    trace: Trace
    report: Finished
    board: dict[int, dict[str, Any]]
    counts: dict[str, Any]


def record(minutes: float, folder: Path) -> Recorded:
    """Makes the run. Raises RuntimeError if it did not complete."""
    machine = load_machine("ma2000")
    sine = Sine(amplitude=math.radians(6.0), period=SINE_S, cycles=60 * minutes / SINE_S)
    spec = ExperimentSpec(trajectory=sine, joints=JOINTS, record=JOINTS, hold=0.5)
    with started_mock("--pty", "--baud", str(BAUD), *FAULTS) as mock, MockControl(mock.control) as control:
        board = BoardRecord(control)
        fetching = threading.Thread(target=board.fetch_until_over)
        fetching.start()
        url = f"{mock.url}?baud={BAUD}"
        with OwnerOnDemand(Open(url=url, machine=machine, limits=machine.limits, folder=folder)) as owner:
            last = owner.run(spec)
        board.over()
        fetching.join()
        counts = control.ask("counts")
    return Recorded(read_trace(last.trace), last, board.periods, counts)


def wrong_samples(trace: Trace, board: dict[int, dict[str, Any]], machine: Machine) -> tuple[int, int]:
    """Returns the number of samples that differ from the board's record in any count of any joint, and of those without
    a record.
    """
    assert trace.tick is not None
    wrong = unknown = 0
    for row, tick in enumerate(trace.tick.tolist()):
        kept = board.get(tick)
        if kept is None:
            unknown += 1
            continue
        wrong += not is_kept(trace, row, kept, machine)
    return wrong, unknown


def accuracy_figures(done: Recorded, machine: Machine) -> list[Figure]:
    """Returns measurements: nothing lost, nothing wrong, all damage noticed."""
    trace, counters = done.trace, done.report.counters
    wrong, unknown = wrong_samples(trace, done.board, machine)
    faults = done.counts["faults"]
    struck = sum(sum(where.values()) for where in faults.values())
    flips_in, flips_out = (faults.get("flip", {}).get(where, 0) for where in ("to_host", "to_controller"))
    timeouts, damaged = round(counters["timeouts"]), round(counters["damaged"])
    seen_by_board = done.counts["bridge"]["damaged"]
    dropped = faults.get("drop", {}).get("to_controller", 0)
    bridge = done.counts["bridge"]
    frames = bridge["frames_received"] + bridge["damaged"] + dropped + bridge["frames_sent"]
    return [
        Figure("outcome", done.report.outcome, "complete", done.report.outcome == "complete", done.report.reason),
        none("ticks lost", trace.missing, f"of {len(trace)}"),
        none("wrong samples", wrong, "against the board's own record"),
        none("samples the record lacks", unknown, "not compared"),
        Figure("frames affected", f"{struck}", beside=f"{100 * struck / (frames or 1):.2f} % of {frames} frames"),
        none(
            "affected and not noticed",
            max(0, struck - timeouts),
            f"{timeouts} time-outs, of which {max(0, timeouts - struck)} for a late answer",
        ),
        none(
            "flipped to the host, not found damaged",
            max(0, flips_in - damaged),
            f"{damaged} pieces found damaged, {flips_in} flipped",
        ),
        none(
            "flipped to the board, not found damaged",
            max(0, flips_out - seen_by_board),
            f"{seen_by_board} pieces found damaged, {flips_out} flipped",
        ),
    ]


def main() -> int:
    """Returns the exit code: 1 when a target was missed."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks long_run", description=__doc__)
    parser.add_argument("--minutes", type=float, default=10.0)
    minutes = parser.parse_args().minutes
    with tempfile.TemporaryDirectory() as folder:
        done = record(minutes, Path(folder))
    figures = accuracy_figures(done, load_machine("ma2000"))
    title = f"{minutes:g} minutes at 50 Hz, 1 % of frames damaged"
    return show(title, f"python -m benchmarks long_run --minutes {minutes:g}", figures)


if __name__ == "__main__":
    sys.exit(main())
