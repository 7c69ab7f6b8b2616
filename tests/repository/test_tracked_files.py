"""What must not be in the repository: registries, this machine's paths, large files, circles of imports."""

import re
import tomllib
from collections.abc import Iterator
from pathlib import Path

import grimp
import pytest

from tests.repository.tracked import ROOT, tracked_files, tracked_texts

LARGEST_BYTES = 1024 * 1024

REGISTRY = re.compile(
    r"""(?x)
    (registry\ =\ "|"resolved":\ "|index-url[ =]|find-links[ =])\s*["']?(https?|file):  # lock files, options
    | ^\s*(--index-url|--extra-index-url|--find-links|-i|-f)[ =]\S  # lines of a requirements file
    | https?://([a-z0-9-]+\.)*(pythonhosted\.org|pypi\.org/simple|npmjs\.(org|com)|registry\.[a-z0-9.-]+)
    """,
    re.MULTILINE,
)


@pytest.mark.parametrize(
    "line",
    [
        'source = { registry = "' + "https://packages.example/simple" + '" }',
        '"resolved": "' + "https://packages.example/vite.tgz" + '"',
        "pip install --index-url " + "https://packages.example/simple",
        "--find-links" + " /wheels",
        "--extra-index-url" + "=file:///packages",
        "https://files." + "pythonhosted.org/packages/x.whl",
        "https://registry." + "npmjs.org/vite",
    ],
)
def test_the_search_knows_the_address_of_a_registry(line: str) -> None:
    assert REGISTRY.search(line)


def test_no_tracked_file_holds_a_registry_a_path_of_this_machine_or_too_much() -> None:
    found = {f"{path.relative_to(ROOT)}: {hit[0]}" for path, text in tracked_texts() if (hit := REGISTRY.search(text))}
    assert not found
    here = [f"{folder}/" for folder in (ROOT, Path.home()) if folder != Path("/")]
    found = {f"{path.relative_to(ROOT)}: {place}" for path, text in tracked_texts() for place in here if place in text}
    assert not found
    sizes = {str(path.relative_to(ROOT)): path.stat().st_size for path in tracked_files()}
    assert {name: size for name, size in sizes.items() if size > LARGEST_BYTES} == {}
    floors = ["firmware_protocol", "daq", "daq/contracts", "daq_cli", "mock_controller", "model", "server", "tests"]
    tracked_folders = {folder for path in tracked_files() for folder in path.parents}
    assert [floor for floor in floors if ROOT / floor not in tracked_folders] == []


# ---- No file imports, directly or through others, a file that imports it

NAMES = tomllib.loads(Path(__file__).parents[2].joinpath("pyproject.toml").read_text("utf-8"))["tool"]["importlinter"][
    "root_packages"
]
PACKAGES = [name for name in NAMES if Path(__file__).parents[2].joinpath(name).is_dir()]


def circles(graph: grimp.ImportGraph) -> Iterator[set[str]]:
    """Sets of files, of two or more, each of which reaches every other by imports."""
    left = set(graph.modules)
    while left:
        module = left.pop()
        together = {other for other in graph.find_upstream_modules(module) if other in left}
        together &= graph.find_downstream_modules(module)
        left -= together
        if together:
            yield together | {module}


def test_no_file_is_imported_by_what_it_imports() -> None:
    graph = grimp.build_graph(*PACKAGES, cache_dir=None)
    found = [sorted(circle) for circle in circles(graph)]
    assert found == []
    circular = grimp.ImportGraph()
    for importer, imported in (("a", "b"), ("b", "c"), ("c", "b"), ("c", "d")):
        circular.add_import(importer=importer, imported=imported)
    assert list(circles(circular)) == [{"b", "c"}]
