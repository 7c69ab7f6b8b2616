"""A run that did not come to its end is not used as if it had: the command ends with the run's exit code."""

from pathlib import Path

import pytest

from daq.contracts.labels import Outcome
from daq.contracts.machine import Machine, load_machine
from daq.contracts.trace import Trace
from daq.owner.messages import Finished
from daq_cli.app.subcommands import subcommands
from daq_cli.robot.local import LocalRobot
from tests.daq.traces.samples import record, write
from tests.daq_cli.invoke import CommandLine


@pytest.mark.parametrize("words", ["calibrate gain", *sorted({"demo", "thesis"} & set(subcommands()))])
@pytest.mark.parametrize(("outcome", "code"), [("stopped", 6), ("fault", 5), ("interrupted", 5)])
def test_no_result_is_made_of_an_incomplete_run(
    daq: CommandLine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: str, outcome: Outcome, code: int
) -> None:
    made = Finished(
        trace=write(tmp_path / "stump.mcap"),
        outcome=outcome,
        reason="why it ended",
        samples=100,
        missing=0,
        counters={},
    )
    monkeypatch.setattr(LocalRobot, "acquire", lambda *_, **__: made)
    said = daq(*words.split())
    assert said.code == code
    assert said.out == ""
    assert said.err.splitlines()[-1].startswith(f"daq: {outcome}: why it ended; the run is not complete")


@pytest.mark.parametrize("stated", [True, False], ids=["stated", "not stated"])
def test_a_gain_is_measured_with_the_calibration_of_the_trace(
    daq: CommandLine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, stated: bool
) -> None:
    """The configured one is for traces that name no machine."""
    other = load_machine("ma2000").model_copy(update={"title": "the arm as it was"})
    given: list[tuple[str, Machine]] = []

    def gains(trace: Trace, machine: Machine) -> list[object]:
        given.append((trace.record.trace_id, machine))
        return []

    monkeypatch.setattr("daq.calibration.gains_from_trace", gains)
    path = write(tmp_path / "old.mcap", machine=other if stated else None)
    assert daq("calibrate", "gain", "--trace", path).code == 0
    assert given == [(record().trace_id, other if stated else load_machine("ma2000"))]
