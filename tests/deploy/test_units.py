"""The units of systemd: accepted by systemd itself, hardened, and what the guide says of them."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.repository.tracked import ROOT

DEPLOY = ROOT / "deploy"
GUIDE = (ROOT / "docs" / "service.md").read_text("utf-8")
UNITS = sorted(path.name for path in DEPLOY.glob("*@.*"))
SERVICES = [name for name in UNITS if name.endswith(".service")]
MOST_EXPOSURE = 3.0
"""systemd rates what a unit may do from 0 (nothing) to 10 (everything)."""
PROGRAM = "/opt/ma2000-daq/.venv/bin/daq"


def systemd_analyze(*words: object) -> subprocess.CompletedProcess[str]:
    """systemd's own judgement of a unit. No systemd needs to run."""
    program = shutil.which("systemd-analyze")
    if program is None:
        pytest.skip("needs systemd-analyze: apt install systemd")
    return subprocess.run([program, *map(str, words)], capture_output=True, text=True, check=False)


def settings(name: str) -> dict[str, list[str]]:
    """Each setting of a unit with its values."""
    found: dict[str, list[str]] = {}
    for key, value in re.findall(r"^(\w+)=(.*)$", (DEPLOY / name).read_text("utf-8"), re.MULTILINE):
        found.setdefault(key, []).append(value)
    return found


@pytest.fixture
def installed(tmp_path: Path) -> Path:
    """A folder of units, as on a computer where the program is at the place that they name."""
    for name in UNITS:
        text = (DEPLOY / name).read_text("utf-8").replace(PROGRAM, sys.executable)
        (tmp_path / name).write_text(text, "utf-8")
    return tmp_path


@pytest.mark.parametrize("name", UNITS)
def test_systemd_finds_nothing_wrong(installed: Path, name: str) -> None:
    done = systemd_analyze("verify", "--man=no", installed / name.replace("@.", "@arm."))
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_systemd_would_find_a_wrong_setting(installed: Path) -> None:
    unit = installed / "ma2000-daq@.service"
    unit.write_text(unit.read_text("utf-8").replace("ProtectHome=", "ProtectHouse="), "utf-8")
    done = systemd_analyze("verify", "--man=no", installed / "ma2000-daq@arm.service")
    assert "ProtectHouse" in done.stderr


@pytest.mark.parametrize("name", SERVICES)
def test_a_unit_may_do_little_by_systemds_own_rating(name: str) -> None:
    words = ("security", "--offline=true", f"--threshold={MOST_EXPOSURE * 10:.0f}", "--no-pager", DEPLOY / name)
    done = systemd_analyze(*words)
    assert done.returncode == 0, done.stdout
    (rating,) = re.findall(r"Overall exposure level for \S+: ([\d.]+)", done.stdout)
    assert float(rating) <= MOST_EXPOSURE


def test_the_ports_of_arms_stay_open_to_the_service_and_instances_share_no_folder() -> None:
    unit = settings("ma2000-daq@.service")
    assert unit["DeviceAllow"] == ["char-ttyUSB rw", "char-ttyACM rw", "char-ttyS rw"]
    assert unit["SupplementaryGroups"] == ["dialout"]
    # Either would hide the devices, whatever DeviceAllow says.
    assert not {"PrivateDevices", "PrivateUsers"} & unit.keys()
    for key in ("RuntimeDirectory", "StateDirectory", "CacheDirectory"):
        assert unit[key] == ["ma2000-daq/%i"]
    assert "%i" in unit["ExecStart"][0]
    assert "%i" in unit["WorkingDirectory"][0]


def test_the_unit_keeps_what_the_guide_says() -> None:
    unit = settings("ma2000-daq@.service")
    # Else the owner of the port would freeze an idle arm at every stop of the service (control-group), or be killed
    # before it has frozen a moving one (mixed).
    assert unit["KillMode"] == ["process"]
    assert unit["UMask"] == ["0077"]
    folders = [line for line in unit["Environment"] if line.startswith("DAQ_RUNTIME_FOLDER")]
    assert folders == ["DAQ_RUNTIME_FOLDER=/run/ma2000-daq/%i"]
    for name in (*UNITS, "journald@ma2000-daq.conf"):
        assert f"(../deploy/{name})" in GUIDE, name


def test_the_stop_command_of_the_guide_is_that_of_the_unit() -> None:
    unit = settings("ma2000-daq@.service")
    started = unit["ExecStart"][0].removesuffix(" serve").replace("%i", "arm")
    (folder,) = (line.replace("%i", "arm") for line in unit["Environment"] if line.startswith("DAQ_RUNTIME_FOLDER"))
    (user,) = unit["User"]
    escaped = folder.replace("=", r"\=")  # as sudoers(5) wants it
    assert f"sudo -u {user} env {folder} {started} stop\n" in GUIDE
    assert f"ALL=({user}) NOPASSWD: /usr/bin/env {escaped} {started} stop\n" in GUIDE


def test_what_the_backup_unit_does_is_a_backup_and_then_old_ones_go(tmp_path: Path) -> None:
    """Its two commands, as systemd would give them, on a service's folder and a folder of backups."""
    unit = settings("ma2000-daq-backup@.service")
    backups = tmp_path / "backups"
    backups.mkdir()
    (tmp_path / "arm.toml").write_text(
        f'[traces]\nfolder = "{tmp_path}/traces"\n[server]\nfolder = "{tmp_path}/service"\n', "utf-8"
    )
    (tmp_path / "traces").mkdir()
    old, other = backups / "arm-2020-01-01T040000.zip", backups / "arm-2020.txt"
    kept_of_another = backups / "second-arm-2020-01-01T040000.zip"
    for path in (old, other, kept_of_another):
        path.touch()
        subprocess.run(["touch", "--date=2020-01-01", path], check=True)
    daq = tmp_path / "daq"
    daq.write_text(f'#!/bin/sh\nexec {sys.executable} -c "import daq_cli; daq_cli.main()" "$@"\n', "utf-8")
    daq.chmod(0o755)
    added = [daq, "--config", tmp_path / "arm.toml", "token", "add", "anna"]
    assert subprocess.run(added, capture_output=True, check=False).returncode == 0  # makes the database
    for command in (*unit["ExecStart"], *unit["ExecStartPost"]):
        words = command.replace("%i", "arm").replace("%%", "%").replace("/var/backups/ma2000-daq", str(backups))
        words = words.replace("/etc/ma2000-daq", str(tmp_path)).replace(PROGRAM, str(daq))
        done = subprocess.run(["sh", "-c", words], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
    assert not old.exists()
    assert other.exists()
    assert kept_of_another.exists()
    (new,) = set(backups.iterdir()) - {other, kept_of_another}
    assert re.fullmatch(r"arm-\d{4}-\d\d-\d\dT\d{6}\.zip", new.name)
    check = [daq, "--config", tmp_path / "arm.toml", "restore", new, "--check"]
    assert subprocess.run(check, capture_output=True, check=False).returncode == 0


def test_the_journal_of_the_service_has_a_limit_and_compiled_code_may_run() -> None:
    told = (DEPLOY / "journald@ma2000-daq.conf").read_text("utf-8")
    assert re.search(r"^SystemMaxUse=\d+M$", told, re.MULTILINE)
    for name in SERVICES:
        assert settings(name)["LogNamespace"] == ["ma2000-daq"]
        assert "MemoryDenyWriteExecute" not in settings(name)  # compiled code may run
