"""What the pages tell a reader to type, to open or to run is there."""

import ast
import importlib
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from docs.extensions.machine_file import PARTS, page
from docs.extensions.snippets import RUN, blocks, wrong
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


def test_every_make_command_that_is_named_exists_and_every_one_is_in_its_help() -> None:
    targets = set(re.findall(r"^([a-z-]+):", MAKEFILE, re.MULTILINE))
    named = {(str(path.relative_to(ROOT)), command) for path, text in PAGES for command in make_commands(text)}
    assert {(page, command) for page, command in named if command not in targets} == set()
    assert {"demo", "test"} <= make_commands((ROOT / "README.md").read_text(encoding="utf-8"))
    commands = re.findall(r"^\.PHONY: (.+)$", MAKEFILE, re.MULTILINE)[0].split()
    printed = subprocess.run(["make", "help"], cwd=ROOT, check=True, capture_output=True, text=True).stdout
    assert set(re.findall(r"^  make (\S+) +\S", printed, re.MULTILINE)) == set(commands)
    # Two of them that install the page's packages at once would spoil each other's
    assert re.search(r"^\.NOTPARALLEL:$", MAKEFILE, re.MULTILINE)


def test_the_index_of_decisions_names_every_one_by_its_title() -> None:
    folder = ROOT / "docs" / "decisions"
    index = (folder / "README.md").read_text(encoding="utf-8")
    rows = re.findall(r"^- \[(\d{4})\]\((\S+)\): (.+)$", index, re.MULTILINE)
    files = sorted(path for path in folder.glob("*.md") if path.name != "README.md")
    titles = [path.read_text(encoding="utf-8").partition("\n")[0] for path in files]
    assert [(name, f"# {number}: {title}") for number, name, title in rows] == [
        (path.name, title) for path, title in zip(files, titles, strict=True)
    ]


# ---- The page of the machine file explains every field of the schema


def test_every_field_has_a_meaning() -> None:
    rows = [line for line in page().splitlines() if line.startswith("| `")]
    expected = {name for part in PARTS for name in part.model_fields if name not in ("kind", "shape")} | {"kind"}
    assert {row.split("`")[1] for row in rows} == expected
    assert [row for row in rows if row.endswith("|  |")] == []


# ---- What the pages show is run by a test, or it is said why not

PROGRAMS = [(shown, text) for shown, language, text in blocks() if language == "python"]
OF_THIS_FILE = sorted(shown for (shown, _), test in RUN.items() if test.endswith(Path(__file__).name))


def test_every_block_is_run_by_a_test_or_named(tmp_path: Path) -> None:
    assert wrong() == []
    shutil.copytree(ROOT / "docs", tmp_path / "docs", ignore=shutil.ignore_patterns("_site", "images"))
    (tmp_path / "docs" / "new.md").write_text("# New\n\n```console\n$ daq new\n```\n")
    (tmp_path / "docs" / "thesis.md").write_text("# The source\n")
    found = wrong(tmp_path / "docs")
    assert any(line.startswith("new.md: no test runs its console blocks") for line in found)
    assert "thesis.md: has no python blocks any more" in found


@pytest.mark.slow
@pytest.mark.parametrize(("shown", "program"), PROGRAMS, ids=[shown for shown, _ in PROGRAMS])
def test_what_a_program_imports_exists(shown: str, program: str) -> None:
    for node in ast.walk(ast.parse(program)):
        if isinstance(node, ast.ImportFrom) and node.module is not None:
            module = importlib.import_module(node.module)
            assert [alias.name for alias in node.names if not hasattr(module, alias.name)] == [], shown


@pytest.mark.slow
def test_programs_that_no_other_test_runs_work(tmp_path: Path) -> None:
    """index.md records a trace, traces.md reads it."""
    assert OF_THIS_FILE == ["index.md", "traces.md"]
    for name in OF_THIS_FILE:
        for program in (text for shown, text in PROGRAMS if shown == name):
            traces = sorted((tmp_path / "traces").glob("*.mcap"))
            here = program.replace("traces/2026-11-21T05-14-42Z_ramp_ab12cd.mcap", str(traces[0]) if traces else "")
            done = subprocess.run(
                [sys.executable, "-c", here],
                cwd=tmp_path,
                env={"PYTHONPATH": str(ROOT), "DAQ_RUNTIME_FOLDER": str(tmp_path / "run")},
                capture_output=True,
                text=True,
                timeout=100,
                check=False,
            )
            assert done.returncode == 0, (name, done.stderr)
