"""Prints the section of CHANGELOG.md about a version, or says why that version cannot be released.

    python -m tools.release_notes v0.2.0      the tag's name, or the version alone

The version must be that of pyproject.toml and of CITATION.cff, and its section must come first, bear the date of the
release and say something.
"""

from __future__ import annotations

import re
import sys
import tomllib
from datetime import date
from pathlib import Path

ROOT = Path(__file__).parents[1]
SECTION = re.compile(r"^## (\S+)(?: \(([^)\n]*)\))?[^\n]*\n(.*?)(?=^## |\Z)", re.MULTILINE | re.DOTALL)


class NotReleasableError(Exception):
    """What keeps a version from being released, in one line."""


def release_notes(tag: str, root: Path = ROOT) -> str:
    """The text of a version's section, without its heading. Raises NotReleasableError."""
    version = tag.removeprefix("v")
    for name, found in versions(root).items():
        if found != version:
            raise NotReleasableError(f"{tag}: {name} says version {found}")
    sections = SECTION.findall((root / "CHANGELOG.md").read_text("utf-8"))
    if not sections or sections[0][0] != version:
        first = sections[0][0] if sections else "missing"
        raise NotReleasableError(f"{tag}: the first section of CHANGELOG.md is {first}")
    _, released, text = sections[0]
    try:
        date.fromisoformat(released)
    except ValueError:
        shown = f"`{released}`" if released else "nothing"
        line = f"its section of CHANGELOG.md says {shown} where its date belongs: ## {version} ({date.today()})"
        raise NotReleasableError(f"{tag}: {line}") from None
    if not text.strip():
        raise NotReleasableError(f"{tag}: its section of CHANGELOG.md is empty")
    return str(text).strip()


def versions(root: Path) -> dict[str, str]:
    """The version that each file says."""
    project = tomllib.loads((root / "pyproject.toml").read_text("utf-8"))["project"]
    citation = re.findall(r"^version: (.+)$", (root / "CITATION.cff").read_text("utf-8"), re.MULTILINE)
    return {"pyproject.toml": project["version"], "CITATION.cff": citation[0] if citation else "none"}


def main(arguments: list[str]) -> int:
    """The exit code: 0 with the section on standard output, 1 with one line on standard error."""
    if len(arguments) != 1 or arguments[0].startswith("-"):
        print(__doc__)
        return 2
    try:
        print(release_notes(arguments[0]))
    except NotReleasableError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
