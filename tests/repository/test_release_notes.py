"""The section of the changelog that a release shows, and what is refused."""

from pathlib import Path

import pytest

from tests.repository.tracked import ROOT
from tools.release_notes import NotReleasableError, main, release_notes, versions

PROJECT = '[project]\nname = "ma2000-daq"\nversion = "0.2.0"\n'
CHANGELOG = """# Changelog

Newest first.

## 0.2.0 (2026-11-23)

- **Extras**: less.

## 0.1.0 (2026-10-01)

- First.
"""


def tree(folder: Path, changelog: str = CHANGELOG, citation: str = "0.2.0") -> Path:
    (folder / "pyproject.toml").write_text(PROJECT, "utf-8")
    (folder / "CITATION.cff").write_text(f"cff-version: 1.2.0\nversion: {citation}\n", "utf-8")
    (folder / "CHANGELOG.md").write_text(changelog, "utf-8")
    return folder


@pytest.mark.parametrize("tag", ["v0.2.0", "0.2.0"])
def test_a_version_has_the_text_of_its_section_and_no_more(tag: str, tmp_path: Path) -> None:
    assert release_notes(tag, tree(tmp_path)) == "- **Extras**: less."


@pytest.mark.parametrize(
    ("tag", "changelog", "citation", "reason"),
    [
        ("v0.2.1", CHANGELOG, "0.2.0", r"v0\.2\.1: pyproject\.toml says version 0\.2\.0"),
        ("v0.2.0", CHANGELOG, "0.1.0", r"CITATION\.cff says version 0\.1\.0"),
        ("v0.2.0", CHANGELOG.replace("## 0.2.0", "## 0.3.0"), "0.2.0", r"first section of CHANGELOG\.md is 0\.3\.0"),
        ("v0.2.0", "# Changelog\n", "0.2.0", "is missing"),
        ("v0.2.0", CHANGELOG.replace("2026-11-23", "unreleased"), "0.2.0", r"says `unreleased` where its date belongs"),
        ("v0.2.0", CHANGELOG.replace(" (2026-11-23)", ""), "0.2.0", "says nothing where its date belongs"),
        ("v0.2.0", CHANGELOG.replace("- **Extras**: less.", ""), "0.2.0", "is empty"),
    ],
)
def test_a_version_that_cannot_be_released_is_refused_with_the_reason(
    tag: str, changelog: str, citation: str, reason: str, tmp_path: Path
) -> None:
    with pytest.raises(NotReleasableError, match=reason):
        release_notes(tag, tree(tmp_path, changelog, citation))


def test_this_tree_can_be_released_once_its_section_has_a_date(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    version = versions(ROOT)["pyproject.toml"]
    changelog = (ROOT / "CHANGELOG.md").read_text("utf-8")
    (tmp_path / "pyproject.toml").write_text((ROOT / "pyproject.toml").read_text("utf-8"), "utf-8")
    (tmp_path / "CITATION.cff").write_text((ROOT / "CITATION.cff").read_text("utf-8"), "utf-8")
    (tmp_path / "CHANGELOG.md").write_text(changelog.replace("(unreleased)", "(2026-12-01)", 1), "utf-8")
    assert release_notes(f"v{version}", tmp_path)
    assert main(["v99.0.0"]) == 1
    assert capsys.readouterr().err == f"error: v99.0.0: pyproject.toml says version {version}\n"
