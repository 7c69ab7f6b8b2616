"""What needs an extra says in one line which one; and the command starts fast."""

import json
import re
import sys
import tomllib
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any, get_args

import pytest
from packaging.requirements import Requirement

import ma2000
from daq.client.live import WebSocket
from daq.contracts.extras import CONTAINS, EXTRA_OF, Extra, MissingExtraError, missing_extras_named
from daq.contracts.trace import Trace
from daq.transport import MockPort
from daq.transport.mock_process import start_mock
from daq_cli.app.subcommands import called, extra_of, subcommands
from tests.repository.tracked import ROOT
from tests.repository.without_extras import packages_beyond, run_without

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
EXTRAS = {name: [Requirement(line) for line in lines] for name, lines in PROJECT["optional-dependencies"].items()}
OTHER_NAMES = {"serial": "pyserial", "pydantic_settings": "pydantic-settings", "prometheus_client": "prometheus-client"}
OTHER_NAMES |= {"google": "protobuf", "markdown_it": "markdown-it-py"}
OTHER_NAMES["PIL"] = "pillow"

NO_TRACE: Any = Trace.__new__(Trace)
PULLED = {"starlette": "fastapi"}
"""Packages that come with another one."""

NAMES = """
import json, pydoc
import ma2000
said = {}
for name in ma2000.__all__:
    try:
        getattr(ma2000, name)
    except Exception as error:
        said[name] = f"{type(error).__name__}: {error}"
assert "read_trace" in pydoc.render_doc(ma2000, renderer=pydoc.plaintext)
print(json.dumps({"said": said, "offered": dir(ma2000)}))
"""
COMMANDS = """
import contextlib, io, json, sys
from daq_cli import main
said = {}
for words in json.loads(WORDS):
    sys.argv = ["daq", *words]
    errors, printed = io.StringIO(), io.StringIO()
    with contextlib.redirect_stderr(errors), contextlib.redirect_stdout(printed):
        try:
            main()
        except SystemExit as end:
            code = end.code
    said[" ".join(words)] = [code, errors.getvalue(), printed.getvalue()]
print(json.dumps(said))
"""


def of_this_project(requirement: Requirement) -> bool:
    return requirement.name == PROJECT["name"]


def test_the_table_of_packages_and_extras_is_that_of_the_package() -> None:
    told = {(OTHER_NAMES.get(package, package), extra) for package, extra in EXTRA_OF.items() if package not in PULLED}
    listed = {(line.name, name) for name, lines in EXTRAS.items() for line in lines if not of_this_project(line)}
    assert listed - told == {("scipy", "tables")}, "scipy comes with the extra robot, too"
    assert told - listed == set()
    contained = {
        name: {extra for line in lines if of_this_project(line) for extra in line.extras}
        for name, lines in EXTRAS.items()
    }
    assert {name for name, found in contained.items() if found and name != "all"} == set(CONTAINS)
    for name, found in CONTAINS.items():
        assert set(found) == contained[name] | {deeper for extra in contained[name] for deeper in contained[extra]}


def test_all_is_everything_and_a_client_needs_little() -> None:
    (line,) = EXTRAS["all"]
    found = {*line.extras, "webrtc"}  # with parts under the GPL: it is asked for by name
    found |= {inner for extra in found for inner in CONTAINS.get(extra, ())}
    assert found | {"all", "client"} == set(EXTRAS)
    assert set(get_args(Extra)) == found
    asked = {Requirement(line).name for line in PROJECT["dependencies"]}
    assert asked == {"httpx", "lz4", "mcap", "numpy", "pint", "pydantic", "zstandard"}
    assert EXTRAS["client"] == []


def test_each_public_name_works_for_a_client_or_says_which_extra_it_needs(tmp_path: Path) -> None:
    found = run_without(packages_beyond(), NAMES, tmp_path)
    for name, said in found["said"].items():
        line = rf"MissingExtraError: ma2000\.{name} needs the package \w+: "
        line += r"pip install 'ma2000-daq\[(robot|model|server)\]'"
        assert re.fullmatch(line, said)
    assert not {"Client", "read_trace", "read_traces", "write_trace", "load_machine"} & set(found["said"])
    only_when_called = {"plot", "batch", "write_urdf", "write_mjcf"}
    assert set(found["offered"]) == set(ma2000.__all__) - set(found["said"]) - only_when_called


@pytest.mark.slow
def test_with_a_robot_only_what_needs_models_is_missing(tmp_path: Path) -> None:
    found = run_without(packages_beyond("robot"), NAMES, tmp_path)
    assert {"simulate", "fit", "diagnose"} <= set(found["said"])
    assert not {"run", "connect", "plot", "machine_from_urdf"} & set(found["said"])
    assert {said.partition("'")[2] for said in found["said"].values()} == {"ma2000-daq[model]'"}


def test_each_command_says_to_a_client_which_extra_it_needs(tmp_path: Path) -> None:
    words = [[], ["--help"], ["--version"], *([name] for name in subcommands())]
    said = run_without(packages_beyond(), f"WORDS = {json.dumps(words)!r}\n{COMMANDS}", tmp_path)
    for name in subcommands():
        line = f"daq: daq {name} needs the package typer: pip install 'ma2000-daq[{extra_of(name)}]'\n"
        nothing = "NOTHING WAS STOPPED: no program here moves a robot\n" if name == "stop" else ""
        assert said[name] == [2, line, nothing]
    for words in ("", "--help"):
        assert said[words] == [2, "daq: daq needs the package typer: pip install 'ma2000-daq[robot]'\n", ""]
    assert said["--version"] == [0, "", f"daq {ma2000.__version__}\n"]


@pytest.mark.parametrize(
    ("words", "subcommand"),
    [
        ([], ""),
        (["--version"], ""),
        (["fit", "last"], "fit"),
        (["--port", "serve", "fit"], "fit"),
        (["--port=serve", "fit"], "fit"),
        (["--config", "x"], ""),
        (["traces", "serve"], "traces"),
    ],
)
def test_the_subcommand_is_found_behind_the_options(words: list[str], subcommand: str) -> None:
    assert called(words) == subcommand


@pytest.mark.parametrize(
    ("package", "extra", "named"),
    [
        ("typer", None, "robot"),
        ("typer", "model", "model"),
        ("websockets", "server", "server"),
        ("numba", "server", "model"),
        ("xarray", "model", "tables"),
    ],
)
def test_the_extra_that_is_named_suffices_for_the_whole(
    package: str, extra: Extra | None, named: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, package, None)
    with (
        pytest.raises(MissingExtraError, match=rf"^this needs the package {package}: .* 'ma2000-daq\[{named}\]'$"),
        missing_extras_named("this", extra),
    ):
        import_module(f"{package}.part")


@pytest.mark.parametrize("name", ["no_such_package", "numpy.no_such_part", "typer.no_such_part"])
def test_a_failed_import_of_anything_else_stays_what_it_is(name: str) -> None:
    with pytest.raises(ModuleNotFoundError), missing_extras_named("this"):
        import_module(name)


@pytest.mark.parametrize(
    ("package", "needs_it", "line"),
    [
        ("websockets", lambda: WebSocket("ws://127.0.0.1:9", None, 1.0, 1, None), "live stream .*websockets.*[live]"),
        ("mujoco", lambda: start_mock(MockPort()), "the mock controller .*mujoco.*[robot]"),
        ("matplotlib", lambda: ma2000.plot(NO_TRACE), "ma2000.plot .*matplotlib.*[robot]"),
    ],
)
def test_what_needs_a_package_only_when_it_is_called_says_so_then(
    package: str, needs_it: Callable[[], object], line: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(MissingExtraError, match=line.replace("[", r"\[")):
        needs_it()
