"""The guide and the service say the same."""

from __future__ import annotations

import re
from pathlib import Path

from daq.config.service import ServiceSettings

ROOT = Path(__file__).parents[3]
GUIDE = (ROOT / "docs" / "service.md").read_text("utf-8")


def test_every_kind_of_problem_is_in_the_guide() -> None:
    made = re.compile(r'(?:ProblemError\(\s*(?:\d+|error\.status_code),|conflict\()\s*"([a-z-]+)"')
    text = "\n".join(path.read_text("utf-8") for path in (ROOT / "server").rglob("*.py"))
    kinds = set(made.findall(text)) | set(re.findall(r'40[45]: "([a-z-]+)"', text)) | {"http"}
    assert kinds == set(re.findall(r'<a id="([a-z-]+)"></a>', GUIDE))


def test_every_setting_is_in_the_guide() -> None:
    section = GUIDE.split("[server]\n")[1].split("```")[0]
    named = set(re.findall(r"^(\w+) =", section, re.MULTILINE))
    assert named == set(ServiceSettings.model_fields) - {"database", "oidc"}  # which is a section of its own


def test_the_unit_keeps_what_the_guide_says() -> None:
    unit = (ROOT / "deploy" / "ma2000-daq.service").read_text("utf-8")
    # Else the owner of the port would freeze an idle arm at every stop of the service (control-group), or be killed
    # before it has frozen a moving one (mixed).
    assert "KillMode=process" in unit
    assert "DAQ_RUNTIME_FOLDER=/run/ma2000-daq" in unit
    assert "UMask=0077" in unit


def test_the_stop_command_of_the_guide_is_that_of_the_unit() -> None:
    unit = (ROOT / "deploy" / "ma2000-daq.service").read_text("utf-8")
    started = re.search(r"^ExecStart=(.*) serve$", unit, re.MULTILINE)
    folder = re.search(r"^Environment=(.*)$", unit, re.MULTILINE)
    user = re.search(r"^User=(.*)$", unit, re.MULTILINE)
    assert started is not None
    assert folder is not None
    assert user is not None
    escaped = folder[1].replace("=", r"\=")  # as sudoers(5) wants it
    assert f"sudo -u {user[1]} env {folder[1]} {started[1]} stop\n" in GUIDE
    assert f"ALL=({user[1]}) NOPASSWD: /usr/bin/env {escaped} {started[1]} stop\n" in GUIDE
