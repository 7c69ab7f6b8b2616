"""The workflows of tests and releases: what they run is pinned, and they may do no more than they need."""

import re
import sys
import tomllib
from pathlib import Path

import pytest
import yaml

from tests.repository.fresh import installed, run
from tests.repository.tracked import ROOT

FOLDER = ROOT / ".github" / "workflows"
WORKFLOWS = {path.name: path.read_text("utf-8") for path in sorted(FOLDER.glob("*.yml"))}
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]


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


def test_an_action_has_one_commit_everywhere() -> None:
    used = {match for text in WORKFLOWS.values() for match in re.findall(r"uses: ([^@\s]+)@(\S+)", text)}
    assert len({action for action, _ in used}) == len(used)


@pytest.mark.parametrize("name", WORKFLOWS)
def test_each_job_names_its_permissions_and_its_longest_time(name: str) -> None:
    assert "\npermissions: {}\n" in WORKFLOWS[name]
    for job in jobs(name).values():
        assert "    permissions:\n" in job
        assert "    timeout-minutes: " in job or "    uses: ./" in job


def test_only_what_signs_and_publishes_has_an_identity_and_it_builds_nothing() -> None:
    trusted = {name for name, job in jobs("release.yml").items() if "id-token: write" in job}
    assert trusted == {"attest", "publish"}
    for name in trusted:
        assert "run:" not in jobs("release.yml")[name]
        assert "actions/checkout" not in jobs("release.yml")[name]


def test_nothing_is_published_before_it_is_described_tested_built_and_attested() -> None:
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


def test_the_tests_run_on_each_python_that_the_package_names() -> None:
    named = [line.rpartition(" ")[2] for line in PROJECT["classifiers"] if line.startswith("Programming Language")]
    (tried,) = re.findall(r"python: \[(.*)\]", WORKFLOWS["ci.yml"])
    assert re.findall(r"[\d.]+", tried) == named


@pytest.mark.parametrize("name", WORKFLOWS)
def test_files_and_commands_that_a_workflow_names_are_there(name: str) -> None:
    text = WORKFLOWS[name]
    for file in re.findall(r"(?:--requirement|--constraint) (\S+)", text):
        assert (ROOT / file).is_file()
    for path in re.findall(r"(?:\.ci/run|tests/\S+\.py|server/dashboard/\S+\.json)", text):
        assert (ROOT / path).is_file()
    for module in re.findall(r"-m (tools\.\w+)", text):
        assert (ROOT / module.replace(".", "/")).with_suffix(".py").is_file()


def test_newer_versions_are_proposed_of_all_that_is_pinned() -> None:
    bot = FOLDER.parent / "dependabot.yml"
    done = run([Path(sys.executable).with_name("check-jsonschema"), "--builtin-schema", "vendor.dependabot", bot], ROOT)
    assert done.returncode == 0, done.stdout
    asked = {
        one["package-ecosystem"]: ROOT / one["directory"][1:] for one in yaml.safe_load(bot.read_text())["updates"]
    }
    assert list(asked["pip"].glob("requirements*.txt"))
    assert (asked["npm"] / "package-lock.json").is_file()
    assert asked["github-actions"] == ROOT


@pytest.mark.slow
def test_an_auditor_of_workflows_finds_nothing(tmp_path: Path) -> None:
    programs = installed(Path(sys.executable), "zizmor", tmp_path / "environment", "requirements-release.txt")
    done = run([programs / "zizmor", "--offline", "--pedantic", FOLDER.parent], tmp_path)
    assert done.returncode == 0, done.stdout
    unpinned = re.sub(r"@[0-9a-f]{40}", "@main", WORKFLOWS["release.yml"])
    (tmp_path / "bad.yml").write_text(unpinned, "utf-8")
    assert "unpinned-uses" in run([programs / "zizmor", "--offline", "bad.yml"], tmp_path).stdout
