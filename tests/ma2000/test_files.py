"""A folder of traces as a data set."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

import ma2000
from daq.contracts.errors import SpecError, TraceError
from daq.contracts.trace import as_sequence
from tests.daq.traces.samples import write


def test_traces_of_a_folder_are_selected_by_what_they_say_of_themselves(tmp_path: Path) -> None:
    for name, robot in (("a", "left"), ("b", "right"), ("c", "left")):
        write(tmp_path / f"{name}.mcap", 5, robot=robot, notes=name)
    assert [trace.record.notes for trace in ma2000.read_traces(tmp_path)] == ["a", "b", "c"]
    assert [trace.record.notes for trace in ma2000.read_traces(tmp_path, notes="b")] == ["b"]
    assert [trace.record.notes for trace in ma2000.read_traces(tmp_path, outcome="complete", samples=5)] == list("abc")
    assert ma2000.read_traces(tmp_path, outcome="fault") == ()
    with pytest.raises(SpecError, match="read_traces: outcome: Input should be 'complete', 'stopped'"):
        ma2000.read_traces(tmp_path, outcome="completed")
    with pytest.raises(TraceError, match="elsewhere: cannot be read: No such file or directory"):
        ma2000.read_traces(tmp_path / "elsewhere", kind="ramp")
    with pytest.raises(TraceError, match=r"a\.mcap: is no folder; `read_trace` reads one file"):
        ma2000.read_traces(tmp_path / "a.mcap")
    with pytest.raises(SpecError, match="read_traces: robo: traces are selected by path, state, size, trace_id"):
        ma2000.read_traces(tmp_path, robo="left")


def test_a_model_is_saved_and_loaded_by_a_path_or_its_text(tmp_path: Path) -> None:
    model = ma2000.base_model(ma2000.load_machine("ma2000"))
    assert ma2000.save_model(model, f"{tmp_path}/m.json") == tmp_path / "m.json"
    assert ma2000.load_model(f"{tmp_path}/m.json") == ma2000.load_model(tmp_path / "m.json") == model


def test_a_choice_says_what_is_taken_of_a_file_of_another_program(tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text("stamp,angle\n0,90\n10,180\n")
    trace = ma2000.read_trace(tmp_path / "log.csv", map={"time": "stamp in ms", "position": "angle in deg"})
    assert trace.position[1, 0] == pytest.approx(3.14159, abs=1e-5)
    assert (as_sequence(trace), as_sequence([trace, trace])) == ((trace,), [trace, trace])
    with pytest.raises(SpecError, match="read_trace: maps: a choice is one of topic, set_points, joints"):
        ma2000.read_trace(tmp_path / "log.csv", maps={})
    with pytest.raises(SpecError, match="plot: ax: found 3, must be axes of matplotlib"):
        trace.plot(ax=3)  # type: ignore[arg-type]
    named = replace(trace, record=trace.record.model_copy(update={"joint_names": ("elbow",)}))
    assert named.column("elbow") == 0
    with pytest.raises(TraceError, match=r"joint wrist is not recorded; the joints are \('elbow',\)"):
        named.column("wrist")


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (
            lambda: ma2000.read_trace("x.csv", map=["a=q"]),
            "read_trace: map: found ['a=q'], must be Mapping",
        ),
        (
            lambda: ma2000.read_trace("x.csv", joints="a,b"),
            "read_trace: joints: found 'a,b', must be tuple[str, ...]",
        ),
        (lambda: ma2000.read_trace("x.csv", where=3), "read_trace: where: found 3, must be str or None"),
        (lambda: ma2000.read_trace(None), "read_trace: path: found None, must be Path or str"),
        (lambda: ma2000.load_machine(None), "load_machine: name_or_path: found None, must be str"),
        (lambda: ma2000.diagnose("ur10e", 5), "traces: give a Trace or several, not int"),
        (lambda: ma2000.fit("ma2000", (), {}), "fit: options: found {}, must be FitOptions or None"),
        (lambda: ma2000.simulate("nosuch", 3), "machine 'nosuch': no such file, and not a packaged machine"),
        (lambda: ma2000.profile("ma2000", (), "x"), "profile: fitted: found 'ma2000', must be FitResult"),
        (lambda: ma2000.ExperimentSpec.model_validate({"joints": "a"}), "joints: Input should be a valid"),
    ],
)
def test_an_argument_of_another_kind_is_one_line(call: Callable[[], object], said: str) -> None:
    with pytest.raises(SpecError) as refused:
        call()
    assert str(refused.value).startswith(said), refused.value
    assert "\n" not in str(refused.value)
