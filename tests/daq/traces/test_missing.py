"""What is missing from a trace is counted in samples, by the trace as by the recorder that makes it."""

from pathlib import Path

import pytest

from daq.contracts.sample import SampleRow
from daq.contracts.trace import TraceEvent
from daq.runner.recorder import Recorder
from daq.traces.reader import read_trace
from daq.traces.writer import TraceWriter
from tests.daq.traces.samples import JOINTS, record, row


class _Nobody:
    def progress(self, fraction: float, text: str) -> None:
        return

    def sampled(self, joints: tuple[int, ...], row: SampleRow) -> None:
        return

    def happened(self, event: TraceEvent) -> None:
        return


@pytest.mark.parametrize(
    ("every", "ticks", "missing"),
    [
        (1, [7], 0),
        (1, [0, 1, 4], 2),
        (3, [0, 3, 6], 0),
        (3, [0, 3, 7, 10], 0),
        (3, [0, 3, 8, 11], 1),
        (3, [0, 3, 9, 12], 1),
        (3, [0, 4, 8, 12], 1),
        (20, [0, 22, 41, 69, 81], 0),
        (20, list(range(0, 2900, 29)), 45),
        (20, [0, 10, 50], 1),
        (20, [0, 30, 50, 99], 2),
        (3, [0, 3, 4, 7, 10, 16], 1),
    ],
    ids=str,
)
def test_missing_samples(tmp_path: Path, every: int, ticks: list[int], missing: int) -> None:
    with TraceWriter(tmp_path / "a.mcap", record(every=every), JOINTS, patience=10) as writer:
        recorder = Recorder(writer, JOINTS, _Nobody(), every)
        for tick in ticks:
            recorder.row(row(tick))
        path = writer.close("complete", {})
    assert (recorder.missing, read_trace(path).missing) == (missing, missing)
