"""What a user installs is whole; the plug-in in examples/ works, and the core works without any."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import sysconfig
import tomllib
import zipfile
from pathlib import Path
from typing import get_args

import pytest

from daq.config.documents import BROUGHT
from daq.plugins import GROUP, Group
from daq.traces.reader import read_trace
from daq_cli.app.subcommands import CORE
from hatch_readme import absolute
from tests.repository.fresh import UV, build
from tests.repository.tracked import ROOT, tracked_files

PAGE = "server/dashboard/dist"
EXAMPLE = ROOT / "examples" / "plugin"
ROUTES = "import json; from server.app import bare_app; print(json.dumps(bare_app(None).openapi()))"
PANELS = """
import asyncio, httpx
from daq.plugins import plugins
from server.app import bare_app
async def kind(path):
    async with httpx.AsyncClient(transport=httpx.ASGITransport(bare_app(None)), base_url="http://here") as client:
        return (await client.get(f"/{path}")).headers["content-type"]
print(*(f"{title}: {asyncio.run(kind(path))}" for one in plugins() for title, path in one.panels.items()), sep="\\n")
"""
LOADED = "import sys; sys.argv = ['daq', '--help']; from daq_cli import main\ntry: main()\nexcept SystemExit: pass\n"
LOADED += "print(*(name for name in sys.modules if name.startswith(('extras', 'trials'))), file=sys.stderr)"


def installed(folder: Path, name: str, entry: str) -> None:
    """What pip would write of a package that has an entry point."""
    information = folder / f"{name}-1.0.dist-info"
    information.mkdir(parents=True)
    (information / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
    (information / "entry_points.txt").write_text(f"[{GROUP}]\n{entry}\n")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """With the example, installed."""
    shutil.copytree(EXAMPLE / "lab_log", tmp_path / "lab_log")
    points = tomllib.loads((EXAMPLE / "pyproject.toml").read_text("utf-8"))["project"]["entry-points"][GROUP]
    installed(tmp_path, "lab_log", "".join(f"{name} = {value}" for name, value in points.items()))
    return tmp_path


def python(folder: Path, *arguments: str | Path) -> subprocess.CompletedProcess[str]:
    environment = os.environ | {"PYTHONPATH": f"{folder}{os.pathsep}{ROOT}", "XDG_CONFIG_HOME": str(folder)}
    return subprocess.run(
        [sys.executable, *arguments], cwd=folder, env=environment, check=False, capture_output=True, text=True,
        timeout=100,
    )  # fmt: skip


def daq(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    return python(folder, "-c", f"import sys; sys.argv = ['daq', *{words!r}]; from daq_cli import main; main()")


def test_the_example_adds_a_command_an_importer_a_route_and_a_panel(folder: Path) -> None:
    (folder / "a.log").write_text("lab log\n0 0\n0.5 90\n")
    assert re.search(r"\n  lab-log +Show the rows of a laboratory's log\.\n", daq(folder, "--help").stdout)
    assert daq(folder, "lab-log", "a.log").stdout == "a.log: 2 rows in 0.5 s\n"
    made = daq(folder, "traces", "import", "a.log", "--json")
    trace = read_trace(folder / json.loads(made.stdout)["file"])
    assert trace.position[:, 0] == pytest.approx([0.0, 1.5707963])
    assert "/api/v1/lab-log/robots" in json.loads(python(folder, "-c", ROUTES).stdout)["paths"]
    assert "Largest error: text/javascript" in python(folder, "-c", PANELS).stdout  # its module is served
    (folder / "a.log").write_text("lab log\n0 zero\n")
    wrong = daq(folder, "traces", "import", "a.log")
    assert (wrong.returncode, len(wrong.stderr.splitlines())) == (2, 1)


@pytest.mark.parametrize(
    ("text", "said"),
    [("1 / 0", "division by zero"), ("import nothing_here", "No module named"), ("PLUGIN = 1", "1")],
)
def test_a_plug_in_that_cannot_be_loaded_is_left_out_with_a_warning(tmp_path: Path, text: str, said: str) -> None:
    (tmp_path / "broken.py").write_text(f"{text}\n")
    installed(tmp_path, "broken", "mine = broken:PLUGIN")
    done = daq(tmp_path, "--help")
    assert "  status " in done.stdout
    assert done.stderr.startswith("plug-in mine (broken:PLUGIN) is left out: ")
    assert said in done.stderr
    assert daq(tmp_path, "ports").stderr == ""


def test_a_plug_in_whose_package_was_taken_away_is_none(tmp_path: Path) -> None:
    installed(tmp_path, "gone", "mine = gone.deep:PLUGIN")
    assert daq(tmp_path, "--help").stderr == ""


def test_help_loads_of_the_extras_only_what_describes_them() -> None:
    loaded = set(python(ROOT, "-c", LOADED).stderr.split())
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    described = {value.partition(":")[0] for value in project["entry-points"][GROUP].values()}
    assert described <= loaded
    assert {name for name in loaded if not any(f"{one}.".startswith(f"{name}.") for one in described)} == set()


@pytest.fixture(scope="module")
def core(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of this tree without the extras, its wheel installed into an environment of its own."""
    tree = tmp_path_factory.mktemp("core") / "tree"
    for path in tracked_files():
        name = path.relative_to(ROOT)
        if "extras" not in name.parts:
            (tree / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(path, tree / name, follow_symlinks=False)
    shutil.copytree(ROOT / PAGE, tree / PAGE)
    modules = Path("server", "dashboard", "node_modules")
    (tree / modules).symlink_to(ROOT / modules)  # the gallery is built with them
    wheel = build(tree.parent / "built", tree).wheel
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", tree / ".venv"], check=True, timeout=60)
    (site,) = (tree / ".venv" / "lib").glob("python*/site-packages")
    # The libraries of this environment, without what is installed here to be edited: that would bring the extras.
    libraries = Path(sysconfig.get_path("purelib"))
    (site / "libraries.pth").write_text(f"{libraries}\n{(libraries / 'cmeel.pth').read_text('utf-8')}")
    for program in Path(sys.executable).parent.iterdir():
        if not (tree / ".venv" / "bin" / program.name).exists():
            (tree / ".venv" / "bin" / program.name).symlink_to(program)
    install = [UV, "pip", "install", "--quiet", "--no-deps", "--no-index", "--python", tree / ".venv", wheel]
    subprocess.run(install, check=True, timeout=100)
    for command in (["init", "--quiet"], ["add", "--all"]):
        subprocess.run(["git", *command], cwd=tree, check=True, timeout=60)
    return tree


def in_core(core: Path, *words: str | Path, limit: float = 600) -> str:
    """What a command prints, that must end well."""
    kept = {key: value for key, value in os.environ.items() if key != "PYTHONPATH" and not key.startswith("DAQ_")}
    own = {"DAQ_RUNTIME_FOLDER": str(core.parent / "run"), "XDG_CONFIG_HOME": str(core.parent)}
    done = subprocess.run(
        [str(word) for word in words], cwd=core, env=kept | own, check=False, capture_output=True, text=True,
        timeout=limit,
    )  # fmt: skip
    assert done.returncode == 0, f"{done.stdout[-4000:]}\n{done.stderr[-4000:]}"
    return done.stdout


@pytest.mark.timeout(600)
def test_without_the_extras_the_core_runs_and_every_command_that_it_shows_works(core: Path) -> None:
    shown = in_core(core, core / ".venv/bin/daq", "--help").partition(f"{get_args(Group)[0]}:\n")[2]
    names = re.findall(r"^  (\S+)  ", shown, re.MULTILINE)
    assert set(names) == set(CORE)
    every = (
        "import sys\nfrom daq_cli.app.command import app, typer\nfor name in sys.argv[1:]:\n"
        "    try: app([name, '--help'], standalone_mode=False)\n    except SystemExit as end: assert not end.code, name"
    )
    in_core(core, core / ".venv/bin/python", "-P", "-c", every, *(name for name in names if name != "mock"))
    assert "trace" in in_core(core, "make", "-o", ".venv/installed-for-use", "demo")


@pytest.mark.slow
@pytest.mark.timeout(3000)
def test_without_the_extras_the_quick_tests_of_the_core_pass(core: Path) -> None:
    quick = ["-m", "pytest", "-q", "-n", "2", "-m", "not slow", "--part", "quick"]
    in_core(core, core / ".venv/bin/python", *quick, limit=2900)


# ---- What a user installs is whole

DASHBOARD = "server/dashboard/"
NOT_INSTALLED = (DASHBOARD, "firmware_protocol/bridge/")
"""What the page and the bridges on boards are built from."""
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
PACKAGES = PROJECT["tool"]["hatch"]["build"]["targets"]["wheel"]["packages"]


def test_the_wheel_holds_every_tracked_file_of_the_packages(tmp_path: Path) -> None:
    build = [sys.executable, "-m", "hatchling", "build", "--target", "wheel", "--directory", str(tmp_path)]
    subprocess.run(build, cwd=ROOT, check=True, capture_output=True, timeout=100)
    (wheel,) = tmp_path.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        packed = set(archive.namelist())
        (metadata,) = (archive.read(name).decode() for name in packed if name.endswith(".dist-info/METADATA"))
    tracked = {str(path.relative_to(ROOT)) for path in tracked_files()}
    expected = {name for name in tracked if name.startswith(tuple(f"{package}/" for package in PACKAGES))}
    expected -= {name for name in expected if name.startswith(NOT_INSTALLED)}
    assert {Path(name).suffix for name in expected} >= {".py", ".toml", ".msg"}
    assert expected - packed == set()
    examples = {f"ma2000/{name}" for name in tracked if name.startswith("examples/")}
    assert {name for name in packed if name.startswith("ma2000/examples/")} == examples != set()
    assert not any(name.startswith("tests/") for name in packed)
    page = {name.removeprefix(DASHBOARD) for name in packed if name.startswith(DASHBOARD)}
    assert "dist/index.html" in page
    for form in (".js.gz", ".js.br"):
        assert any(name.startswith("dist/assets/") and name.endswith(form) for name in page)
    assert not any("node_modules" in name or name.startswith("src/") for name in page)
    _, _, description = metadata.partition("\n\n")
    assert description.startswith("# MA2000 DAQ\n")
    assert re.findall(r"\]\((?!https?:)[^)]*\)|<img", description) == [], "an index shows no file of the repository"
    built = (ROOT / "docs" / "_site" / "index.html").is_file()
    assert ("ma2000/docs_site/index.html" in packed) == built
    documents = {name.removeprefix("ma2000/documents/") for name in packed if name.startswith("ma2000/documents/")}
    pages = {name for name in tracked if name.startswith("docs/") and name.endswith((".md", ".png", ".svg", ".webp"))}
    assert documents == (set() if built else pages | ({"README.md", *BROUGHT.values()} - expected))


def test_where_the_project_has_an_address_the_description_keeps_its_pictures_and_pages() -> None:
    readme = (ROOT / "README.md").read_text("utf-8")
    text = absolute(readme, "https://example.org/us/arm/", "9.8.7")
    targets = re.findall(r"\]\(([^)]*)\)", text)
    assert len(targets) == len(re.findall(r"\]\(([^)]*)\)", readme))
    assert [target for target in targets if not target.startswith("https://")] == []
    own = [target for target in targets if target.startswith("https://example.org/us/arm/")]
    assert "https://example.org/us/arm/raw/v9.8.7/docs/images/dashboard-live.png" in own
    assert "https://example.org/us/arm/blob/v9.8.7/docs/how-well.md" in own
    for target in own:
        assert (ROOT / re.sub(r".*?/v9\.8\.7/", "", target).partition("#")[0]).exists(), target
