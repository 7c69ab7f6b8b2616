"""`import ma2000`: its names, what it loads, and what it says of files in its way."""

import ast
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from matplotlib.figure import Figure

import ma2000
from daq.contracts.experiment import Ramp
from daq.contracts.machine import load_machine
from ma2000 import _HOME
from tests.model.discrepancy.answers import an_answer
from tests.model.discrepancy.motions import trace_of

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "python.md").read_text("utf-8")
BLOCKS = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)


def python(*arguments: str, folder: Path) -> subprocess.CompletedProcess[str]:
    command, environment = [sys.executable, *arguments], {"PYTHONPATH": str(ROOT)}
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)


def test_every_public_name_is_there_and_has_a_docstring() -> None:
    for name in ma2000.__all__:
        found = getattr(ma2000, name)
        assert found.__doc__, name
        assert name in dir(ma2000)


def test_every_method_has_a_docstring_too_and_every_name_a_place_in_the_reference() -> None:
    from docs.extensions import public_api  # here: what collects the tests need not wait for Sphinx

    assert [one for name in ma2000.__all__ for one in public_api.undocumented(name)] == []
    page = public_api.page()
    assert [name for name in ma2000.__all__ if f":: ma2000.{name}\n" not in page] == []


def test_types_see_the_names_that_programs_get() -> None:
    tree = ast.parse(Path(ma2000.__file__).read_text("utf-8"))
    imports = [node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and node.module]
    seen = {alias.asname: node.module for node in imports for alias in node.names if alias.asname}
    assert seen == _HOME


def test_the_page_names_what_is_public_and_nothing_else() -> None:
    table = PAGE.partition("## The public names")[2]
    rows = [line.split("|")[1] for line in table.splitlines() if line.startswith("| `")]
    assert {name for row in rows for name in re.findall(r"`(\w+)`", row)} == set(ma2000.__all__)
    used = {name for block in BLOCKS for name in re.findall(r"ma2000\.(\w+)", block)}
    assert used <= set(ma2000.__all__)


def test_an_unknown_name_is_told_with_those_there_are() -> None:
    with pytest.raises(AttributeError, match=r"no attribute 'simulat'; it has .*simulate"):
        ma2000.simulat  # noqa: B018


def test_reading_traces_loads_no_compiler_and_no_service(tmp_path: Path) -> None:
    heavy = "{'numba', 'scipy', 'fastapi', 'matplotlib', 'mujoco'}"
    done = python(
        "-c", f"import sys, ma2000; ma2000.read_trace; print(sorted({heavy} & set(sys.modules)))", folder=tmp_path
    )
    assert (done.returncode, done.stdout.strip(), done.stderr) == (0, "[]", "")


@pytest.mark.parametrize("name", ["model.py", "server/__init__.py"])
def test_a_file_that_hides_a_package_is_named_in_one_line(tmp_path: Path, name: str) -> None:
    hiding = tmp_path / name
    hiding.parent.mkdir(exist_ok=True)
    hiding.write_text("mine = 1\n")
    done = python("-c", "import ma2000", folder=tmp_path)
    last = done.stderr.strip().splitlines()[-1]
    assert last.startswith(f"ma2000.own_packages.HiddenPackageError: {tmp_path / Path(name).parts[0]}: has the name of")
    assert "rename it" in last


def test_what_a_notebook_shows_of_a_machine_or_model_is_short() -> None:
    model = ma2000.base_model(load_machine("ma2000"))
    assert (
        repr(model.machine)
        == "Machine(name='ma2000', title='TQ MA2000 educational robot arm', modelled_joints=(1, 2, 3))"
    )
    assert len(repr(model)) < 500
    assert model.identity in repr(model)


@pytest.mark.parametrize(
    ("name", "given", "words"),
    [
        (
            "ExperimentSpec",
            {"trajectory": {"kind": "ramp", "amplitude": 10}},
            "trajectory.amplitude: must lie between -360° and 360°, that is ±6.283 rad (got 10 rad, 572.958°)",
        ),
        (
            "ExperimentSpec",
            {"trajectory": {"kind": "ramp", "amplitude": {1: 10}}},
            "trajectory.amplitude.1: must lie between -360° and 360°, that is ±6.283 rad (got 10 rad, 572.958°)",
        ),
        ("ExperimentSpec", {"amplitude": 0.1}, "amplitude: Extra inputs are not permitted"),
        ("FitOptions", {"starts": 0}, "starts: "),
        ("DesignOptions", {"duration": -1}, "duration: "),
        ("DiagnosisOptions", {"joints": 3}, "joints: "),
        ("FitRequest", {"traces": "all"}, "traces: "),
    ],
)
def test_wrong_arguments_are_refused_in_one_line(name: str, given: dict[str, Any], words: str) -> None:
    with pytest.raises(ma2000.DaqError) as refused:
        getattr(ma2000, name)(**given)
    assert str(refused.value).startswith(f"{name}: {words}")
    assert str(refused.value).isprintable()


def test_a_wrong_part_of_an_experiment_is_refused_in_one_line() -> None:
    with pytest.raises(ma2000.DaqError) as refused:
        Ramp(amplitude=10)
    words = "amplitude: must lie between -360° and 360°, that is ±6.283 rad (got 10 rad, 572.958°)"
    assert str(refused.value) == f"Ramp: {words}"


def test_a_machine_s_name_stands_for_its_model_and_anything_else_is_refused_in_one_line() -> None:
    assert ma2000.base_model("ma2000").identity == ma2000.base_model(load_machine("ma2000")).identity
    found = ma2000.base_parameters("ma2000")
    assert found == ma2000.base_parameters(load_machine("ma2000"))
    wrong: Any = 3
    with pytest.raises(
        ma2000.DaqError, match="model: give a Model, a Machine, or the name or file of a machine, not int"
    ):
        ma2000.fit(wrong, [])
    with pytest.raises(ma2000.DaqError, match="traces: give a Trace or several, not str; `read_trace` reads a file"):
        ma2000.fit("ma2000", ["trace.mcap"])  # type: ignore[list-item]


def test_completion_shows_a_record_s_own_names() -> None:
    names = set(dir(ma2000.base_model("ma2000")))
    assert {"machine", "with_effect", "parameters"} <= names
    assert not {name for name in names if name.startswith("model_")}


def test_results_draw_on_axes_of_the_caller_s_and_become_tables() -> None:
    found, _ = an_answer(6.0)
    axes = Figure().subplots()
    assert found.plot(axes) is axes
    assert [line.get_label() for line in axes.lines][:2] == ["joint 1", "joint 1, held out"]
    trace = trace_of(found.model_before, 6.0)
    assert trace.plot((2,), ax=Figure().subplots()).axes[0].get_xlabel() == "time / s"
    fitted = ma2000.fit(found.model_before, trace, ma2000.FitOptions(parameters=("load.mass",)), progress=False)
    assert (fitted.success, fitted.nfev) == (fitted.converged, fitted.evaluations)
    assert fitted.x.tolist() == list(fitted.values)
    assert fitted.to_pandas().loc["load.mass", "unit"] == "kg"
    assert fitted.plot().get_figure() is not None
    arrays = ma2000.simulate(found.model_before, trace).to_xarray()
    assert arrays["reading"].sel(joint=2).shape == (len(trace),)


def test_the_presets_are_printed_on_a_page() -> None:
    assert len(str(ma2000.PRESETS)) < 2000


@pytest.mark.slow
def test_the_page_s_programs_run_and_pass_a_strict_check_of_types(tmp_path: Path) -> None:
    program = "\n".join(BLOCKS).replace("first_file", "sorted(Path('traces').glob('*.mcap'))[0]")
    file = tmp_path / "program.py"
    file.write_text(f"from pathlib import Path\n{program}\n")
    checked = python(
        "-m", "mypy", "--strict", "--no-error-summary", "--ignore-missing-imports", file.name, folder=tmp_path
    )
    assert checked.returncode == 0, checked.stdout
    done = python(file.name, folder=tmp_path)
    assert done.returncode == 0, done.stderr
