"""What must not be in the repository: package registries, this machine's paths, large files."""

import re
from pathlib import Path

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


def test_no_tracked_file_holds_the_address_of_a_package_registry() -> None:
    found = {f"{path.relative_to(ROOT)}: {hit[0]}" for path, text in tracked_texts() if (hit := REGISTRY.search(text))}
    assert not found


def test_no_tracked_file_holds_a_path_of_this_machine() -> None:
    here = [f"{folder}/" for folder in (ROOT, Path.home()) if folder != Path("/")]
    found = {f"{path.relative_to(ROOT)}: {place}" for path, text in tracked_texts() for place in here if place in text}
    assert not found


def test_no_tracked_file_is_large() -> None:
    sizes = {str(path.relative_to(ROOT)): path.stat().st_size for path in tracked_files()}
    assert {name: size for name, size in sizes.items() if size > LARGEST_BYTES} == {}


def test_the_floors_of_the_house_are_folders() -> None:
    floors = ["firmware_protocol", "daq", "daq/contracts", "daq_cli", "mock_controller", "model", "server", "tests"]
    tracked_folders = {folder for path in tracked_files() for folder in path.parents}
    assert [floor for floor in floors if ROOT / floor not in tracked_folders] == []
