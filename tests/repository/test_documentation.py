"""What the pages tell a reader to type or to open is there."""

import re
import subprocess
from pathlib import Path

import pytest

from tests.repository.tracked import ROOT, tracked_texts

MAKEFILE = (ROOT / "Makefile").read_text(encoding="utf-8")
PAGES = tracked_texts("*.md")
LINK = re.compile(r"!?\[[^\]]*\]\(<?([^)\s>]+)>?[^)]*\)|<(?:img|a|source)\b[^>]*?\b(?:src|href|srcset)=\"([^\"]+)\"")
CODE = re.compile(r"```\w*\n(.*?)```|`([^`\n]+)`", re.DOTALL)


def without_code(text: str) -> str:
    return re.sub(r"```.*?```|`[^`\n]*`", "", text, flags=re.DOTALL)


def anchors(page: str) -> set[str]:
    """The names a link may use for the headings of a page, made as the common renderers make them."""
    headings = re.findall(r"^#+ (.+?)\s*$", re.sub(r"```.*?```", "", page, flags=re.DOTALL), re.MULTILINE)
    plain = (re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).lower() for heading in headings)
    return {re.sub(r"[^\w\- ]", "", heading).replace(" ", "-") for heading in plain}


@pytest.mark.parametrize(("path", "text"), PAGES, ids=[str(path.relative_to(ROOT)) for path, _ in PAGES])
def test_relative_links_lead_somewhere(path: Path, text: str) -> None:
    broken = []
    for target in (first or second for first, second in LINK.findall(without_code(text))):
        if re.match(r"[a-z][a-z+.-]*:", target):
            continue
        name, _, anchor = target.partition("#")
        file = (path.parent / name).resolve() if name else path
        leads_somewhere = file.exists() and file.is_relative_to(ROOT)
        if leads_somewhere and anchor and file.suffix == ".md":
            leads_somewhere = anchor in anchors(file.read_text(encoding="utf-8"))
        if not leads_somewhere:
            broken.append(target)
    assert broken == []


def make_commands(page: str) -> set[str]:
    """The commands of make that the code on a page shows: `make test`, `make demo PYTHON=python3.12  # why`."""
    lines = (line for block, span in CODE.findall(page) for line in (block or span).splitlines())
    calls = [hit[1] for line in lines if (hit := re.match(r"\s*(?:\$ )?make ([^#]*)", line))]
    return {word for call in calls for word in call.split() if "=" not in word}


def test_each_make_command_that_a_page_names_exists() -> None:
    targets = set(re.findall(r"^([a-z-]+):", MAKEFILE, re.MULTILINE))
    named = {(str(path.relative_to(ROOT)), command) for path, text in PAGES for command in make_commands(text)}
    assert {(page, command) for page, command in named if command not in targets} == set()


def test_the_readme_shows_the_two_commands_of_a_new_user() -> None:
    assert {"demo", "test"} <= make_commands((ROOT / "README.md").read_text(encoding="utf-8"))


def test_the_index_of_decisions_names_every_one_by_its_title() -> None:
    folder = ROOT / "docs" / "decisions"
    index = (folder / "README.md").read_text(encoding="utf-8")
    rows = re.findall(r"^- \[(\d{4})\]\((\S+)\): (.+)$", index, re.MULTILINE)
    files = sorted(path for path in folder.glob("*.md") if path.name != "README.md")
    titles = [path.read_text(encoding="utf-8").partition("\n")[0] for path in files]
    assert [(name, f"# {number}: {title}") for number, name, title in rows] == [
        (path.name, title) for path, title in zip(files, titles, strict=True)
    ]


def test_make_help_names_every_command() -> None:
    commands = re.findall(r"^\.PHONY: (.+)$", MAKEFILE, re.MULTILINE)[0].split()
    printed = subprocess.run(["make", "help"], cwd=ROOT, check=True, capture_output=True, text=True).stdout
    assert set(re.findall(r"^  make (\S+) +\S", printed, re.MULTILINE)) == set(commands)


def test_make_runs_one_thing_at_a_time() -> None:
    """Two of them that install the page's packages at once would spoil each other's."""
    assert re.search(r"^\.NOTPARALLEL:$", MAKEFILE, re.MULTILINE)
