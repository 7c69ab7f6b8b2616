"""The texts of the gallery: they parse, use the public interface alone, and are listed."""

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

import ma2000
from tests.gallery.notebooks import FOLDER, NAMES, OF_EXTRAS, ROOT, code_of, notebook

ALLOWED = {"ma2000", "matplotlib", "numpy", "os", "pandas", "pathlib", "xarray"}
"""What a notebook may import: the public interface, and what readers have."""


@pytest.mark.parametrize("name", [name for name in NAMES if name not in OF_EXTRAS])
def test_a_notebook_parses_and_uses_the_public_interface_alone(name: str) -> None:
    found = notebook(name)
    code = "\n".join(code_of(found))
    tree = ast.parse(code)
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            assert {alias.name.partition(".")[0] for alias in node.names} <= ALLOWED
        if isinstance(node, ast.ImportFrom):
            assert node.module in {"numpy.typing", "pathlib"}
    used = set(re.findall(r"\bma2000\.(\w+)", "\n".join(cell.source for cell in found.cells)))
    assert used
    assert used <= set(ma2000.__all__)
    assert "assert" in code, "its key figures are checked"


@pytest.mark.parametrize("name", NAMES)
def test_a_notebook_is_text_without_outputs_and_ends_with_two_things_to_try(name: str) -> None:
    found = notebook(name)
    assert all(not cell.outputs and cell.execution_count is None for cell in found.cells if cell.cell_type == "code")
    assert found.cells[0].source.startswith("# ")
    last = found.cells[-1].source.rpartition("## ")[2]
    assert last.startswith("Two things to try\n")
    assert re.findall(r"^(\d)\. ", last, re.MULTILINE) == ["1", "2"]


def test_the_index_lists_every_notebook_in_its_table_and_in_its_tree() -> None:
    index = (FOLDER / "index.md").read_text("utf-8")
    tree = index.partition("```{toctree}")[2].split()
    assert sorted(entry for entry in tree if entry in NAMES) == list(NAMES)
    rows = re.findall(r"^\| \[(.+?)\]\((\S+?)\.md\) \|", index, re.MULTILINE)
    assert [name for _, name in rows] == [entry for entry in tree if entry in NAMES]
    for title, name in rows:
        assert notebook(name).cells[0].source.splitlines()[0] == f"# {title}"


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_the_notebooks_programs_pass_a_strict_check_of_types(tmp_path: Path) -> None:
    for name in NAMES:
        text = "\n\n".join(code_of(notebook(name)))
        (tmp_path / f"{name.replace('-', '_')}.py").write_text(text + "\n", "utf-8")
    command = [sys.executable, "-m", "mypy", "--strict", "--no-error-summary", "--ignore-missing-imports", "."]
    checked = subprocess.run(
        command, cwd=tmp_path, env={"PYTHONPATH": str(ROOT)}, capture_output=True, text=True, check=False
    )
    assert checked.returncode == 0, checked.stdout + checked.stderr
