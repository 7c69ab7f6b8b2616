"""Progress of the long calls: a bar, nothing, or the caller's own."""

import inspect
import os
import subprocess
import sys
from pathlib import Path

import pytest

import ma2000
from ma2000.progress import told
from tests.gallery.notebooks import executed, outputs_of

ROOT = Path(__file__).parents[2]
LONG = {"batch", "design", "diagnose", "fit", "fit_torques", "run", "validate"} & set(ma2000.__all__)
"""Of these, a core without extras has not all."""
CALL = "ma2000.run(ma2000.ExperimentSpec.model_validate({'trajectory': {'kind': 'step'}, 'joints': [1], 'hold': 0.1})"

HEARD = """
from IPython.display import DisplayHandle
pages, display, update = [], DisplayHandle.display, DisplayHandle.update

def heard(kept):
    def show(self, data, **rest):
        pages.append(data["text/html"])
        return kept(self, data, **rest)
    return show

DisplayHandle.display, DisplayHandle.update = heard(display), heard(update)
"""
"""Cell of a notebook that keeps what is shown in it."""


@pytest.mark.parametrize("name", sorted(LONG))
def test_every_long_call_shows_progress_unless_it_is_turned_off(name: str) -> None:
    asked = inspect.signature(getattr(ma2000, name)).parameters["progress"]
    assert asked.default is True
    assert inspect.signature(ma2000.Arm.run).parameters["progress"].default is True


def test_false_is_silence_and_a_function_is_told_itself() -> None:
    said: list[tuple[float, str]] = []
    with told(False, "fitting") as tell:
        tell(0.5, "half")
    with told(lambda fraction, text: said.append((fraction, text)), "fitting") as tell:
        tell(0.5, "half")
    assert said == [(0.5, "half")]


def test_a_program_whose_output_is_a_log_says_nothing(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", "from ma2000.progress import told\nwith told(True, 'fit') as tell: tell(0.5, 'half')"],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(ROOT), "FORCE_COLOR": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


@pytest.mark.slow
@pytest.mark.parametrize(("progress", "pictures"), [("True", True), ("False", False)])
def test_a_notebook_without_widgets_shows_the_bar_in_place_and_is_left_clean(
    tmp_path: Path, progress: str, pictures: bool
) -> None:
    import nbformat

    cells = [HEARD, f"import ma2000\nrun = {CALL}, progress={progress})", "print(len(pages), 'step' in pages[0])"]
    if not pictures:
        cells[-1] = "print(len(pages))"
    blank = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(cell) for cell in cells])
    outputs = outputs_of(executed(blank, tmp_path))
    if pictures:
        assert [output.data for output in outputs[:-1]] == [{"text/html": "", "text/plain": ""}]
        assert outputs[-1].text.endswith("True\n")
        assert int(outputs[-1].text.split()[0]) >= 2
    else:
        assert [output.get("text") for output in outputs] == ["0\n"]
