"""The notebooks of the gallery, run as readers run them, each in a fresh folder."""

import re
import shutil
from pathlib import Path

import pytest

from tests.compile_ahead import compile_simulation
from tests.gallery.notebooks import NAMES, ROOT, executed, notebook, outputs_of, printed

MACHINE = ROOT / "examples" / "double_pendulum.toml"
LONGEST_OUTPUT = 2500
"""Characters of text that one output may have: a reader is shown figures, not logs."""
FIGURES = {
    "first-ramp": (2, r"joint 2: asked 21\.6°, lags up to [34]\.\d°"),
    "reading-traces": (1, r"the same table: True"),
    "fit-and-identifiability": (1, r"not determined: together joint2\.motor\.back_emf_constant"),
    "design-of-experiments": (1, r"experiment 2: .* nats of information"),
    "hidden-effect": (1, r"^named\n"),
    "thesis-chapters-6-and-7": (2, r"viscous \+ Coulomb +0\.9313 +0\.9295 +1\.3270"),
    "real-rig": (0, r"The records are not here: double_pendulum has 0 of 10"),
    "day-with-the-service": (1, r"tones: done, trace [0-9a-f]{12}"),
}
"""Of each notebook: how many pictures it shows at least, and a line that it prints. Its own cells check more."""


@pytest.fixture(scope="module")
def compiled() -> None:
    """The machine code of the simulations is there, as at every run of a notebook but a reader's first."""
    compile_simulation()


@pytest.mark.slow
@pytest.mark.timeout(1200)
@pytest.mark.usefixtures("compiled")
@pytest.mark.parametrize("name", NAMES)
def test_a_notebook_runs_and_shows_figures_and_no_noise(name: str, tmp_path: Path) -> None:
    done = executed(notebook(name), tmp_path)
    pictures, line = FIGURES[name]
    outputs = outputs_of(done)
    assert sum("image/png" in output.get("data", {}) for output in outputs) >= pictures
    assert re.search(line, printed(done)), printed(done)
    for output in outputs:
        assert output.get("name") != "stderr", output.text
        assert len(output.get("text", "")) <= LONGEST_OUTPUT
        assert len(output.get("data", {}).get("text/plain", "")) <= LONGEST_OUTPUT
        assert "Warning" not in output.get("text", "")
        shown = output.get("data", {})
        if "image/png" not in shown:
            assert not re.match(r"<matplotlib|Text\(|\[Text|<.*Figure", shown.get("text/plain", "")), shown[
                "text/plain"
            ]


@pytest.mark.slow
@pytest.mark.lab_data
@pytest.mark.timeout(1200)
def test_the_real_rig_s_notebook_analyses_records_that_are_there(lab_data: Path, tmp_path: Path) -> None:
    """The published shares of torque, which a linear fit made elsewhere bears out: its own cells hold them."""
    pd = pytest.importorskip("pandas")
    folder = lab_data / "double_pendulum"
    if not folder.is_dir():
        pytest.skip(f"needs {folder}")
    theirs = {"position": "pos_meas", "velocity": "vel_meas", "drive": "tau_meas"}
    for number in range(1, 11):
        frame = pd.read_csv(folder / f"run_{number:02d}.csv")
        own = tmp_path / "fetched" / f"{number:02d}"
        own.mkdir(parents=True)
        frame.rename(columns=lambda name: re.sub(r"(\w+)_(\d)", lambda m: theirs[m[1]] + m[2], name)).to_csv(
            own / "trajectory.csv", index=False
        )
    shutil.copy(MACHINE, tmp_path)
    done = executed(notebook("real-rig"), tmp_path, {"DOUBLE_PENDULUM": str(tmp_path / "fetched")})
    assert sum("image/png" in output.get("data", {}) for output in outputs_of(done)) == 1
    assert "links and rotors                 leaves 6" in printed(done)
