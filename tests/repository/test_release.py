"""What a release needs: one version everywhere, its notes, pinned requirements, workflows that may do little."""

import re
import sys
import tomllib
from pathlib import Path

import pytest
import yaml
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from tests.repository.fresh import installed, run
from tests.repository.tracked import ROOT
from tools.release_notes import NotReleasableError, main, release_notes, versions

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]


# ---- The section of the changelog that a release shows, and what is refused

A_PROJECT = '[project]\nname = "ma2000-daq"\nversion = "0.2.0"\n'
CHANGELOG = """# Changelog

Newest first.

## 0.2.0 (2026-11-23)

- **Extras**: less.

## 0.1.0 (2026-10-01)

- First.
"""


def tree(folder: Path, changelog: str = CHANGELOG, citation: str = "0.2.0") -> Path:
    (folder / "pyproject.toml").write_text(A_PROJECT, "utf-8")
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


def test_this_tree_can_be_released_once_it_has_a_date(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    version = versions(ROOT)["pyproject.toml"]
    changelog = (ROOT / "CHANGELOG.md").read_text("utf-8")
    (tmp_path / "pyproject.toml").write_text((ROOT / "pyproject.toml").read_text("utf-8"), "utf-8")
    (tmp_path / "CITATION.cff").write_text((ROOT / "CITATION.cff").read_text("utf-8"), "utf-8")
    (tmp_path / "CHANGELOG.md").write_text(changelog.replace("(unreleased)", "(2026-12-01)", 1), "utf-8")
    assert release_notes(f"v{version}", tmp_path)
    assert main(["v99.0.0"]) == 1
    assert capsys.readouterr().err == f"error: v99.0.0: pyproject.toml says version {version}\n"


# ---- The pinned requirements belong to pyproject.toml, and every one has hashes

PYPROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
EXTRAS = [
    line
    for extra in PYPROJECT["project"]["optional-dependencies"].values()
    for line in extra
    if not line.startswith("ma2000-daq[")
]
NOT_IN_ALL = {"aiortc"}
FOR_USE = [
    *PYPROJECT["project"]["dependencies"],
    *(line for line in EXTRAS if Requirement(line).name not in NOT_IN_ALL),
    *PYPROJECT["dependency-groups"]["build"],
]
FOR_INSTALLING = PYPROJECT["dependency-groups"]["installer"]
FOR_A_RELEASE = PYPROJECT["dependency-groups"]["release"]
FOR_DEVELOPMENT = [
    *FOR_USE,
    *FOR_INSTALLING,
    *(line for name in ("dev", "docs") for line in PYPROJECT["dependency-groups"][name] if isinstance(line, str)),
]

FOR_ALL_TESTS = [
    *PYPROJECT["dependency-groups"]["thorough"],
    *(line for line in EXTRAS if Requirement(line).name in NOT_IN_ALL),
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
        ("requirements-thorough.txt", FOR_ALL_TESTS),
        ("requirements-release.txt", FOR_A_RELEASE),
    ],
    ids=["for installing", "for use", "for development", "for all tests", "for a release"],
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


# ---- The workflows of tests and releases: what they run is pinned, and they may do no more than they need

FOLDER = ROOT / ".github" / "workflows"
WORKFLOWS = {path.name: path.read_text("utf-8") for path in sorted(FOLDER.glob("*.yml"))}


def jobs(name: str) -> dict[str, str]:
    """The text of each job of a workflow."""
    _, _, text = WORKFLOWS[name].partition("\njobs:\n")
    parts = re.split(r"^  ([\w-]+):\n", text, flags=re.MULTILINE)
    return dict(zip(parts[1::2], parts[2::2], strict=True))


@pytest.mark.parametrize("name", WORKFLOWS)
def test_each_action_is_pinned_to_a_commit_and_says_its_version(name: str) -> None:
    used = re.findall(r"uses: (\S+)(.*)", WORKFLOWS[name])
    assert used
    for action, rest in used:
        if not action.startswith("./"):
            assert re.fullmatch(r"[\w.-]+/[\w./-]+@[0-9a-f]{40}", action)
            assert re.fullmatch(r" # v\d+\.\d+\.\d+", rest)


@pytest.mark.parametrize("name", WORKFLOWS)
def test_each_job_names_its_permissions_and_its_longest_time(name: str) -> None:
    assert "\npermissions: {}\n" in WORKFLOWS[name]
    for job in jobs(name).values():
        assert "    permissions:\n" in job
        assert "    timeout-minutes: " in job or "    uses: ./" in job


def test_jobs_that_publish_need_all_others_and_build_nothing() -> None:
    # Only what signs and publishes has an identity and it builds nothing
    trusted = {name for name, job in jobs("release.yml").items() if "id-token: write" in job}
    assert trusted == {"attest", "publish"}
    for name in trusted:
        assert "run:" not in jobs("release.yml")[name]
        assert "actions/checkout" not in jobs("release.yml")[name]
    # Nothing is published before it is described tested built and attested
    needs = {
        name: re.findall(r"^    needs: \[?([\w, ]+)\]?$", job, re.MULTILINE)
        for name, job in jobs("release.yml").items()
    }
    assert needs == {
        "notes": [],
        "tests": ["notes"],
        "build": ["notes"],
        "attest": ["build, tests"],
        "publish": ["attest"],
        "page": ["publish"],
    }
    # An action has one commit everywhere
    used = {match for text in WORKFLOWS.values() for match in re.findall(r"uses: ([^@\s]+)@(\S+)", text)}
    assert len({action for action, _ in used}) == len(used)


def test_tests_run_on_each_python_and_what_is_pinned_is_renewed() -> None:
    named = [line.rpartition(" ")[2] for line in PROJECT["classifiers"] if line.startswith("Programming Language")]
    (tried,) = re.findall(r"python: \[(.*)\]", WORKFLOWS["ci.yml"])
    assert re.findall(r"[\d.]+", tried) == named
    bot = FOLDER.parent / "dependabot.yml"
    done = run([Path(sys.executable).with_name("check-jsonschema"), "--builtin-schema", "vendor.dependabot", bot], ROOT)
    assert done.returncode == 0, done.stdout
    asked = {
        one["package-ecosystem"]: ROOT / one["directory"][1:] for one in yaml.safe_load(bot.read_text())["updates"]
    }
    assert list(asked["pip"].glob("requirements*.txt"))
    assert (asked["npm"] / "package-lock.json").is_file()
    assert asked["github-actions"] == ROOT
    pins = pinned("requirements.txt")
    asked = [Requirement(line) for line in PYPROJECT["build-system"]["requires"]]
    assert [requirement.name for requirement in asked if canonicalize_name(requirement.name) not in pins] == []


@pytest.mark.parametrize("name", WORKFLOWS)
def test_files_and_commands_that_a_workflow_names_are_there(name: str) -> None:
    text = WORKFLOWS[name]
    for file in re.findall(r"(?:--requirement|--constraint) (\S+)", text):
        assert (ROOT / file).is_file()
    for path in re.findall(r"(?:\.ci/run|tests/\S+\.py|server/dashboard/\S+\.json)", text):
        assert (ROOT / path).is_file()
    for module in re.findall(r"-m (tools\.\w+)", text):
        assert (ROOT / module.replace(".", "/")).with_suffix(".py").is_file()


@pytest.mark.slow
def test_an_auditor_of_workflows_finds_nothing(tmp_path: Path) -> None:
    programs = installed(Path(sys.executable), "zizmor", tmp_path / "environment", "requirements-release.txt")
    done = run([programs / "zizmor", "--offline", "--pedantic", FOLDER.parent], tmp_path)
    assert done.returncode == 0, done.stdout
    unpinned = re.sub(r"@[0-9a-f]{40}", "@main", WORKFLOWS["release.yml"])
    (tmp_path / "bad.yml").write_text(unpinned, "utf-8")
    assert "unpinned-uses" in run([programs / "zizmor", "--offline", "bad.yml"], tmp_path).stdout
