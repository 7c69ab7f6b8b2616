"""docs/any-arm.md and docs/robots-from-urdf.md: what they type prints what they show, and their programs run."""

import re
import shlex
import shutil
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from tests.daq_cli.invoke import CommandLine
from tests.extras.formats.bags.test_other_messages import bag
from tests.extras.formats.tables.test_tables import data_set

# ---- docs/any-arm.md, on files that others' libraries write


ROOT = Path(__file__).parents[4]
PAGE = (ROOT / "docs" / "any-arm.md").read_text("utf-8")
BLOCKS = re.findall(r"^```(\w*)\n(.*?)^```$", PAGE, re.DOTALL | re.MULTILINE)
SESSIONS = [block for language, block in BLOCKS if not language and "$ daq" in block]
SO101 = ["shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll", "gripper"]


def rtde(path: Path) -> None:
    """A record as UR's client writes it, with spaces between columns."""
    names = ("target_q", "actual_q", "actual_qd", "actual_current")
    time = np.arange(1000) * 0.008
    angle = np.stack([np.sin((1 + 0.1 * k) * time) for k in range(6)], axis=1)
    table = np.concatenate([time[:, None] + 100, angle, angle - 0.001, np.gradient(angle, time, axis=0), angle], axis=1)
    head = " ".join(["timestamp", *(f"{name}_{k}" for name in names for k in range(6))])
    np.savetxt(path, table, header=head, comments="")


def bench(path: Path) -> None:
    """A motor in MATLAB's own form: volts that turn a shaft against viscous and Coulomb friction."""
    time = np.arange(4000) * 0.005
    volts, speed = 6 * np.sin(1.3 * time) + 3 * np.sin(4.1 * time), np.zeros(4000)
    inertia = 0.5 * 0.2 * 0.03**2 + 1e-4
    for k in range(3999):
        torque = 0.05 * (volts[k] - 0.05 * speed[k]) / 2.0 - 1e-5 * speed[k] - 0.008 * np.tanh(speed[k])
        speed[k + 1] = speed[k] + 0.005 * torque / inertia
    noisy = speed + np.random.default_rng(1).normal(0, 0.02, 4000)
    savemat(path, {"rec": {"t": time, "rpm": noisy * 60 / (2 * np.pi), "volts": volts}})


@pytest.fixture
def files(daq: CommandLine) -> None:
    """What the page's commands read, in the folder in which they run."""
    del daq
    data_set(Path("pick"), joints=SO101)
    rtde(Path("robot_data.csv"))
    bag(Path("run"), "jazzy", with_states=True, effort=[1.0, 2.0])
    bench(Path("bench.mat"))
    shutil.copy(ROOT / "examples" / "motor_bench.toml", "motor_bench.toml")


@pytest.mark.usefixtures("files")
@pytest.mark.timeout(300)
def test_the_page_s_commands_print_what_it_shows(daq: CommandLine, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "100")
    commands = [part for session in SESSIONS for part in session.split("$ daq ")[1:]]
    assert len(commands) == 13
    for part in commands:
        line, _, shown = part.partition("\n")
        said = daq(*shlex.split(line))
        printed = " ".join((said.out + said.err).split())
        for expected in shown.splitlines():
            assert " ".join(expected.split()) in printed, (line, printed)


@pytest.mark.usefixtures("files")
def test_the_page_s_program_reads_a_data_set() -> None:
    (program,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    exec(compile(program, "any-arm.md", "exec"), {})


# ---- docs/robots-from-urdf.md


URDF_PAGE = (ROOT / "docs" / "robots-from-urdf.md").read_text("utf-8")
URDF_SESSIONS = [
    block for block in re.findall(r"^```\n(.*?)^```", URDF_PAGE, re.DOTALL | re.MULTILINE) if "$ daq" in block
]


def test_the_commands_print_what_the_page_of_urdf_shows(daq: CommandLine) -> None:
    shutil.copy(ROOT / "examples" / "reach_arm.urdf", "reach_arm.urdf")
    commands = [part for session in URDF_SESSIONS for part in session.split("$ daq ")[1:]]
    assert len(commands) == 3
    for part in commands:
        line, _, shown = part.partition("\n")
        said = daq(*shlex.split(line))
        assert (said.code, said.err + said.out) == (0, shown)


def test_the_page_s_program_writes_what_the_commands_write(daq: CommandLine) -> None:
    shutil.copy(ROOT / "examples" / "reach_arm.urdf", "reach_arm.urdf")
    (program,) = re.findall(r"```python\n(.*?)```", URDF_PAGE, re.DOTALL)
    exec(compile(program, "page", "exec"), {})
    by_program = [Path(name).read_text("utf-8") for name in ("reach.toml", "reach.urdf", "reach.xml")]
    for name in ("reach.toml", "reach.urdf", "reach.xml"):
        Path(name).unlink()
    for part in [part for session in URDF_SESSIONS for part in session.split("$ daq ")[1:4]][:3]:
        daq(*shlex.split(part.partition("\n")[0]))
    assert [Path(name).read_text("utf-8") for name in ("reach.toml", "reach.urdf", "reach.xml")] == by_program
