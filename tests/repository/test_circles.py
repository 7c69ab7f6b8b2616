"""No file imports, directly or through others, a file that imports it; imports inside functions count as well."""

import tomllib
from collections.abc import Iterator
from pathlib import Path

import grimp

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


def test_a_circle_is_found_whatever_leads_into_it() -> None:
    graph = grimp.ImportGraph()
    for importer, imported in (("a", "b"), ("b", "c"), ("c", "b"), ("c", "d")):
        graph.add_import(importer=importer, imported=imported)
    assert list(circles(graph)) == [{"b", "c"}]
