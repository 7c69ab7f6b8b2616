"""What the pages show is run by a test, or it is said why not."""

import ast
import importlib
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from docs.extensions.snippets import RUN, blocks, wrong
from tests.repository.tracked import ROOT

PROGRAMS = [(page, text) for page, language, text in blocks() if language == "python"]
OF_THIS_FILE = sorted(page for (page, _), test in RUN.items() if test.endswith(Path(__file__).name))


def test_every_block_is_run_by_a_test_or_has_a_reason() -> None:
    assert wrong() == []


def test_a_block_that_nobody_runs_is_named(tmp_path: Path) -> None:
    shutil.copytree(ROOT / "docs", tmp_path / "docs", ignore=shutil.ignore_patterns("_site", "images"))
    (tmp_path / "docs" / "new.md").write_text("# New\n\n```console\n$ daq new\n```\n")
    (tmp_path / "docs" / "thesis.md").write_text("# The source\n")
    found = wrong(tmp_path / "docs")
    assert any(line.startswith("new.md: no test runs its console blocks") for line in found)
    assert "thesis.md: has no python blocks any more" in found


@pytest.mark.slow
@pytest.mark.parametrize(("page", "program"), PROGRAMS, ids=[page for page, _ in PROGRAMS])
def test_what_a_program_imports_exists(page: str, program: str) -> None:
    for node in ast.walk(ast.parse(program)):
        if isinstance(node, ast.ImportFrom) and node.module is not None:
            module = importlib.import_module(node.module)
            assert [alias.name for alias in node.names if not hasattr(module, alias.name)] == [], page


@pytest.mark.slow
def test_programs_that_no_other_test_runs_work(tmp_path: Path) -> None:
    """index.md records a trace, traces.md reads it."""
    assert OF_THIS_FILE == ["index.md", "traces.md"]
    for name in OF_THIS_FILE:
        for program in (text for page, text in PROGRAMS if page == name):
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
