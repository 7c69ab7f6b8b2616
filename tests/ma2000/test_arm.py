"""An arm at a port: state, runs, stop; a service of a program's own, on a mock alone, which ends with its block."""

import math
from pathlib import Path

import pytest

import ma2000
from daq.contracts.errors import SpecError

SHORT = ma2000.ExperimentSpec.model_validate(
    {"trajectory": {"kind": "ramp", "amplitude": 0.1, "duration": 0.2}, "joints": [1], "settle": 0.1, "hold": 0.1}
)


def test_an_arm_is_asked_run_stopped_and_released(tmp_path: Path) -> None:
    said: list[float] = []
    with ma2000.connect("mock://?lock_step=1&seed=3") as arm:
        before = arm.state()
        assert (before.simulated, before.stopped, set(before.position)) == (True, False, {1, 2, 3})
        done = arm.run(SHORT, folder=tmp_path, progress=lambda fraction, _text: said.append(fraction))
        assert (done.outcome, done.reason, done.missing) == ("complete", "", 0)
        assert done.trace.position[-1, 0] - done.trace.position[0, 0] == pytest.approx(0.1, abs=0.02)
        assert said
        assert said == sorted(said)
        assert arm.stop().acknowledged
        assert arm.state().stopped
        with pytest.raises(ma2000.RunError, match="stopped"):
            arm.run(SHORT, folder=tmp_path)
        arm.release()
        assert not arm.state().stopped
    assert [trace.record.trace_id for trace in ma2000.read_traces(tmp_path)] == [done.trace.record.trace_id]
    assert len(repr(done.trace)) < 120
    assert done.trace.plot((2,)).axes


def test_a_motion_outside_the_limits_is_refused_in_one_line(tmp_path: Path) -> None:
    far = SHORT.model_copy(update={"trajectory": SHORT.trajectory.model_copy(update={"amplitude": math.pi})})
    with pytest.raises(ma2000.RunError) as refused:
        ma2000.run(far, folder=tmp_path)
    assert "\n" not in str(refused.value)
    assert not list(tmp_path.iterdir())


def test_an_unknown_preset_and_a_port_that_is_none_are_refused(tmp_path: Path) -> None:
    with pytest.raises(SpecError, match="preset 'rampe': unknown; allowed are ramp"):
        ma2000.run("rampe", folder=tmp_path)
    with pytest.raises(ma2000.DaqError, match="must begin with serial://"):
        ma2000.run(port="/dev/ttyUSB0", folder=tmp_path)


@pytest.mark.parametrize("word", ["yes", 1])
def test_consent_is_the_word_true_and_nothing_else(tmp_path: Path, word: object) -> None:
    with pytest.raises(SpecError, match="must be True \\(the operator consents\\) or False"):
        ma2000.run(folder=tmp_path, moves_real_arm=word)  # type: ignore[arg-type]


def test_an_interrupt_stops_the_arm_and_names_the_trace(tmp_path: Path) -> None:
    def interrupted(fraction: float, _text: str) -> None:
        if fraction > 0:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt) as stopped:
        ma2000.run("ramp", folder=tmp_path, progress=interrupted)
    (file,) = tmp_path.glob("*.mcap")
    assert stopped.value.__notes__ == [f"the arm was stopped; recorded until then: {file}"]
    assert ma2000.read_trace(file).record.outcome in ("stopped", "interrupted", "complete")


# ---- a service of a program's own


def test_a_port_that_is_no_mock_is_refused_before_anything_starts(tmp_path: Path) -> None:
    with pytest.raises(SpecError, match="runs only on mock://; for an arm, use `daq serve`"):
        ma2000.LocalService(tmp_path / "lab", "serial:///dev/ttyUSB0")
    assert not (tmp_path / "lab").exists()


@pytest.mark.slow
def test_a_local_service_answers_within_its_block_and_is_gone_after_it(tmp_path: Path) -> None:
    with ma2000.LocalService(tmp_path / "lab") as service, ma2000.Client(service.url) as client:
        assert [one.robot for one in client.robots()] == ["ma2000"]
        assert service.url in repr(service)
    assert "ended" in repr(service)
    with ma2000.Client(service.url) as client, pytest.raises(ma2000.DaqError):
        client.robots(within=1.0)
