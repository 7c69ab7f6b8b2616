"""The pinned requirements belong to pyproject.toml, and every one has hashes."""

import re
import tomllib

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from tests.repository.tracked import ROOT

PYPROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
EXTRAS = [
    line
    for extra in PYPROJECT["project"]["optional-dependencies"].values()
    for line in extra
    if not line.startswith("ma2000-daq[")
]
FOR_USE = [*PYPROJECT["project"]["dependencies"], *EXTRAS, *PYPROJECT["dependency-groups"]["build"]]
FOR_INSTALLING = PYPROJECT["dependency-groups"]["installer"]
FOR_A_RELEASE = PYPROJECT["dependency-groups"]["release"]
FOR_DEVELOPMENT = [
    *FOR_USE,
    *FOR_INSTALLING,
    *(line for name in ("dev", "docs") for line in PYPROJECT["dependency-groups"][name] if isinstance(line, str)),
]


def pinned(name: str) -> dict[str, list[tuple[str, int]]]:
    """By package: the pinned versions (one for each range of Python versions), each with its number of hashes."""
    text = (ROOT / name).read_text(encoding="utf-8").replace("\\\n", " ")
    pins: dict[str, list[tuple[str, int]]] = {}
    for line in text.splitlines():
        if line.strip() and not line.lstrip().startswith("#"):
            requirement = Requirement(re.split(r"\s+--hash=", line)[0].strip())
            versions = [specifier.version for specifier in requirement.specifier if specifier.operator == "=="]
            assert len(versions) == 1, f"{name} does not pin {requirement.name}"
            pins.setdefault(canonicalize_name(requirement.name), []).append((versions[0], line.count("--hash=sha256:")))
    return pins


@pytest.mark.parametrize(
    ("name", "asked"),
    [
        ("requirements-installer.txt", FOR_INSTALLING),
        ("requirements.txt", FOR_USE),
        ("requirements-dev.txt", FOR_DEVELOPMENT),
        ("requirements-release.txt", FOR_A_RELEASE),
    ],
    ids=["for installing", "for use", "for development", "for a release"],
)
def test_each_direct_dependency_is_pinned_to_versions_that_pyproject_allows(name: str, asked: list[str]) -> None:
    pins = pinned(name)
    for requirement in map(Requirement, asked):
        versions = [version for version, _ in pins.get(canonicalize_name(requirement.name), [])]
        assert versions, f"{name} lacks {requirement.name}: make requirements"
        assert all(requirement.specifier.contains(version) for version in versions), (
            f"{name} pins {requirement.name} to {versions}, pyproject.toml asks for {requirement}: make requirements"
        )


@pytest.mark.parametrize("name", sorted(path.name for path in ROOT.glob("requirements*.txt")))
def test_each_pin_has_a_hash(name: str) -> None:
    assert [package for package, pins in pinned(name).items() for _, hashes in pins if hashes == 0] == []


@pytest.mark.parametrize("name", ["requirements-installer.txt", "requirements.txt"])
def test_users_and_developers_get_the_same_versions(name: str) -> None:
    for_development = {
        package: {version for version, _ in pins} for package, pins in pinned("requirements-dev.txt").items()
    }
    for package, pins in pinned(name).items():
        assert {version for version, _ in pins} == for_development[package]


def test_building_asks_for_nothing_that_is_not_pinned() -> None:
    pins = pinned("requirements.txt")
    asked = [Requirement(line) for line in PYPROJECT["build-system"]["requires"]]
    assert [requirement.name for requirement in asked if canonicalize_name(requirement.name) not in pins] == []
