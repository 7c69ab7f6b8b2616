"""What a user installs is whole: the code, and the data files that the code reads."""

import subprocess
import sys
import zipfile
from pathlib import Path

from tests.repository.tracked import ROOT, tracked_files

PACKAGES = ("firmware_protocol", "daq", "mock_controller", "model", "server")


def test_the_wheel_holds_every_tracked_file_of_the_packages(tmp_path: Path) -> None:
    build = [sys.executable, "-m", "hatchling", "build", "--target", "wheel", "--directory", str(tmp_path)]
    subprocess.run(build, cwd=ROOT, check=True, capture_output=True, timeout=100)
    (wheel,) = tmp_path.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        packed = set(archive.namelist())
    tracked = {str(path.relative_to(ROOT)) for path in tracked_files()}
    expected = {name for name in tracked if name.startswith(tuple(f"{package}/" for package in PACKAGES))}
    assert any(name.endswith(".toml") for name in expected)
    assert expected - packed == set()
    assert not any(name.startswith("tests/") for name in packed)
