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
