"""Wheel and source distribution as a user gets them: checked, installed into fresh environments, and used there."""

import hashlib
import json
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

import ma2000
from daq_cli.app.subcommands import subcommands
from tests.repository.fresh import Distributions, build, installed, pythons, run, unpacked
from tests.repository.tracked import ROOT

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]

PACKAGED = {name: one for name, one in subcommands().items() if not one.module.startswith("trials.")}
"""The wheel has no trials."""
MODEL = {name for name, command in PACKAGED.items() if command.needs == "model"}
SERVER = {name for name, command in PACKAGED.items() if command.needs == "server"}
PYTHONS = dict(pythons())
WORDS = {
    "batch": "fit {folder} --out batch",
    "check": "{trace}",
    "compare": "ma2000 {trace}",
    "design": "ma2000",
    "diagnose": "{trace}",
    "fit": "{trace} --out fitted.json",
    "follow": "run ramp --model ma2000 --dry-run",
    "hide": "",
    "profile": "ma2000 {trace} --parameter load.mass",
    "simulate": "ma2000 {trace}",
    "thesis": "",
    "validate": "ma2000 {trace}",
    "audit": "",
    "backup": "saved.tar",
    "restore": "saved.tar",
    "serve": "",
    "token": "ls",
}
"""What each command is called with."""
READ = """
import sys
import ma2000
trace = ma2000.read_trace(sys.argv[1])
print(len(trace), trace.joints, sorted({"numba", "scipy", "typer"} & set(sys.modules)))
"""
PROGRAM = """
import ma2000
trace = ma2000.read_trace("trace.mcap")
model = ma2000.base_model(ma2000.load_machine("ma2000"))
with ma2000.Client("http://127.0.0.1:8300") as client:
    print(len(trace), model.machine.name, client.robot().status())
"""
SERVICE = """
import subprocess, sys
import ma2000
from daq.contracts.service.jobs import FitRequest
service = subprocess.Popen([sys.argv[1], "serve", "--port", "0"], stdout=subprocess.PIPE, text=True)
try:
    with ma2000.Client(service.stdout.readline().strip()) as client:
        robot = client.robot()
        robot.connect()
        asked = robot.experiments.submit(ma2000.PRESETS["ramp"].spec)
        done = robot.experiments.wait(asked.id)
        job = robot.jobs.wait(robot.jobs.submit(FitRequest(traces=(done.trace,))).id)
        print(f"{done.state}; {job.state}: {job.reason}")
finally:
    service.terminate()
    service.wait()
"""
WRONG = 'import ma2000\nnumber: int = ma2000.read_trace("trace.mcap").record.trace_id\n'


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Distributions:
    return build(tmp_path_factory.mktemp("built"))


@pytest.fixture(scope="module")
def trace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("recorded")
    done = run([Path(sys.executable).with_name("daq"), "run", "ramp", "--folder", folder], folder, PYTHONPATH=str(ROOT))
    assert done.returncode == 0, done.stderr
    (file,) = folder.glob("*.mcap")
    return file


def contents(wheel: Path) -> dict[str, str]:
    with zipfile.ZipFile(wheel) as archive:
        return {name: hashlib.sha256(archive.read(name)).hexdigest() for name in archive.namelist()}


def check(*command: str | Path) -> None:
    done = subprocess.run([sys.executable, "-m", *map(str, command)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_checks_of_indexes_and_of_wheels_pass(built: Distributions) -> None:
    check("twine", "check", "--strict", built.wheel, built.sdist)
    check("check_wheel_contents", built.wheel)


def test_the_source_distribution_makes_the_same_wheel(built: Distributions, tmp_path: Path) -> None:
    again = build(tmp_path / "again", unpacked(built.sdist, tmp_path / "tree"))
    assert contents(again.wheel) == contents(built.wheel)


@pytest.mark.parametrize("version", PYTHONS)
def test_everything_records_and_reads_and_has_types(built: Distributions, version: str, tmp_path: Path) -> None:
    programs = installed(PYTHONS[version], f"{built.wheel}[all]", tmp_path / "environment")
    assert run([programs / "daq", "--version"], tmp_path).stdout.startswith("daq ")
    done = run([programs / "daq", "demo"], tmp_path)
    assert done.returncode == 0, done.stderr
    (file,) = tmp_path.glob("**/*.mcap")
    assert run([programs / "python", "-c", READ, file], tmp_path).stdout.endswith("(1, 2, 3, 4, 5, 6) []\n")
    assert types(programs, version, tmp_path) == (0, 1)


@pytest.mark.parametrize("version", PYTHONS)
def test_a_client_reads_and_has_types(built: Distributions, trace: Path, version: str, tmp_path: Path) -> None:
    programs = installed(PYTHONS[version], f"{built.wheel}[client]", tmp_path / "environment")
    assert run([programs / "python", "-c", READ, trace], tmp_path).stdout.endswith("(1, 2, 3, 4, 5, 6) []\n")
    assert types(programs, version, tmp_path) == (0, 1)
    done = run([programs / "daq", "fit", trace], tmp_path)
    line = "daq: daq fit needs the package typer: pip install 'ma2000-daq[model]'\n"
    assert (done.returncode, done.stdout, done.stderr) == (2, "", line)


def types(programs: Path, version: str, folder: Path) -> tuple[int, int]:
    """The exit codes of mypy for a program that is right, and for one that is wrong."""
    codes = []
    for name, text in (("right.py", PROGRAM), ("wrong.py", WRONG)):
        (folder / name).write_text(text, "utf-8")
        options = ["--strict", "--python-version", version, "--python-executable", programs / "python"]
        done = run([sys.executable, "-m", "mypy", *options, "--cache-dir", folder / "cache", name], folder)
        codes.append(done.returncode)
        assert done.returncode in (0, 1), done.stderr
        if name == "right.py":
            assert done.returncode == 0, done.stdout
        else:
            assert "[assignment]" in done.stdout
    return codes[0], codes[1]


def test_the_source_distribution_is_installed(built: Distributions, tmp_path: Path) -> None:
    version, python = next(iter(PYTHONS.items()))
    programs = installed(python, f"{built.sdist}[client]", tmp_path / "environment")
    done = run([programs / "python", "-c", "import ma2000; print(ma2000.__version__)"], tmp_path)
    assert done.stdout == f"{ma2000.__version__}\n", version


def test_with_a_robot_only_each_command_of_models_and_service_says_which_extra_it_needs(
    built: Distributions, trace: Path, tmp_path: Path
) -> None:
    version = next(reversed(PYTHONS))
    programs = installed(PYTHONS[version], f"{built.wheel}[robot]", tmp_path / "environment")
    assert run([programs / "daq", "run", "ramp", "--folder", tmp_path / "traces"], tmp_path).returncode == 0
    for name in sorted(MODEL | SERVER):
        done = run([programs / "daq", name, *WORDS[name].format(trace=trace, folder=trace.parent).split()], tmp_path)
        extra = "model" if name in MODEL else "server"
        line = rf"daq: .* needs the package \w+: pip install 'ma2000-daq\[{extra}\]'\n"
        assert (done.returncode, bool(re.fullmatch(line, done.stderr))) == (2, True), f"{name}: {done.stderr}"


def test_a_service_without_models_records_and_names_the_extra_of_a_job(built: Distributions, tmp_path: Path) -> None:
    version = next(reversed(PYTHONS))
    programs = installed(PYTHONS[version], f"{built.wheel}[server]", tmp_path / "environment")
    done = run([programs / "python", "-c", SERVICE, programs / "daq"], tmp_path)
    line = "failed: a job of the kind fit needs the package numba: pip install 'ma2000-daq[model]'"
    assert done.stdout == f"done; {line}\n", done.stderr


def test_a_list_of_what_a_client_consists_of_is_short(built: Distributions, tmp_path: Path) -> None:
    python = next(iter(PYTHONS.values()))
    client = installed(python, f"{built.wheel}[client]", tmp_path / "client")
    tools = installed(python, "cyclonedx-bom", tmp_path / "tools", "requirements-release.txt")
    options = ["--pyproject", ROOT / "pyproject.toml", "--mc-type", "application", "--spec-version", "1.6"]
    done = run([tools / "cyclonedx-py", "environment", "--validate", *options, client / "python"], tmp_path)
    assert done.returncode == 0, done.stderr
    listed = json.loads(done.stdout)
    assert listed["metadata"]["component"]["name"] == "ma2000-daq"
    names = {component["name"] for component in listed["components"]} - {"ma2000-daq"}
    assert {"httpx", "mcap", "numpy", "Pint", "pydantic", "lz4", "zstandard"} <= names
    assert len(names) <= 19, names  # the seven that we name, and what they bring
