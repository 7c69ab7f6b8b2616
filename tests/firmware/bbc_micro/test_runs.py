"""A host at the emulated BBC Micro: what a line of 19200 baud gives, a run, and the contract of every controller."""

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from tests.firmware.bbc_micro import needs

needs.require()

from daq.contracts.machine import load_machine  # noqa: E402
from daq.driver import Controller  # noqa: E402
from daq.runner.arm_control import ArmControl  # noqa: E402
from tests.daq.runner.rig import SHORT, Rig  # noqa: E402

ROOT = Path(__file__).parents[3]
pytestmark = pytest.mark.slow


@contextmanager
def served(*options: str) -> Iterator[str]:
    """The URL of a BBC Micro in lock-step, in a process of its own."""
    command = [sys.executable, "-m", "tests.firmware.bbc_micro.lock_step", *options]
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True) as process:
        try:
            yield process.stdout.readline().strip()
        finally:
            process.kill()


@pytest.mark.parametrize(("image", "every"), [("BRIDGE", 2), ("BRIDG96", 4)])
def test_a_ramp_runs_at_the_rate_that_the_line_allows(tmp_path: Path, image: str, every: int) -> None:
    with served("--image", image) as url, Controller.connect(url) as controller:
        controller.release(controller.status().stop)
        arm = Rig(controller, ArmControl(controller), tmp_path, load_machine("ma2000"), "")
        trace = arm.trace(result := arm.run(SHORT))
    assert (result.outcome, result.missing) == ("complete", 0)
    assert trace.record.every == every
    assert set(np.diff(trace.tick)) == {every}
    assert result.counters["missed_set_points"] == 0


@pytest.mark.timeout(900)
def test_the_contract_of_every_controller_holds() -> None:
    with served() as url:
        command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-n0", "tests/contract"]
        command += ["-m", "hardware", "--port", url, "--allow-motion"]
        environment = {name: value for name, value in os.environ.items() if name != "CI"}
        done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout[-2000:]
