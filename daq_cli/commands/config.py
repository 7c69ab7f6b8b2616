"""`daq config`: shows and checks the configuration."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from daq.contracts.errors import SpecError
from daq_cli.app.context import JsonOption, console, invocation, print_json

PLACES = (Path(__file__).parents[2] / "ma2000" / "examples", Path(__file__).parents[2] / "examples")
"""Folders in an installed package (pyproject.toml) and in the source tree. Beside an installed package, a folder with
the second name may belong to another project."""


def example_files() -> tuple[Path, ...]:
    """Returns the example files, sorted by name; empty if the installation lacks them."""
    folder = next((place for place in PLACES if place.is_dir()), None)
    return tuple(sorted(path for path in folder.iterdir() if path.is_file())) if folder else ()


app = typer.Typer(add_completion=False, help="Show and check the configuration.", no_args_is_help=True)


@app.command()
def show(context: typer.Context, json: JsonOption = False) -> None:
    """Show every setting as a daq.toml, without passwords, and where a configuration was looked for."""
    from daq.config.settings import config_files, load_settings
    from daq.config.toml_text import settings_text

    call = invocation(context)
    settings, path = load_settings(call.config_file)
    if json:
        print_json({"file": path, "settings": settings.model_dump(mode="json")})
        return
    places = ", ".join(str(file) for file in config_files(call.config_file))
    console().print(f"from {path}" if path else f"nothing is configured (looked for {places}): these are the defaults")
    print(settings_text(settings), end="")


@app.command()
def copy(
    what: Annotated[str, typer.Argument(help="memory-map, machine, or examples.")],
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="File to write, for examples a folder (default: its own name)."),
    ] = None,
    json: JsonOption = False,
) -> None:
    """Copy a packaged file, to change the copy: the memory map, the machine file, or the documentation's examples."""
    from importlib import resources

    files = {
        "memory-map": resources.files("firmware_protocol") / "memory_map.toml",
        "machine": resources.files("daq.contracts") / "machines" / "ma2000.toml",
    }
    if what == "examples":
        path = output or Path("examples")
        _copy_examples(path)
    elif what in files:
        path = output or Path("memory_map.toml" if what == "memory-map" else "ma2000.toml")
        _copy_file(files[what].read_text("utf-8"), path, what)
    else:
        raise SpecError(f"config copy {what!r}: allowed are {', '.join(files)}, examples")
    if json:
        print_json({"file": path})
    else:
        print(path)


def _copy_file(text: str, path: Path, what: str) -> None:
    from daq_cli.app.output_file import check_folder, replacing

    check_folder(path, what)
    if path.exists():
        raise SpecError(f"{path}: exists; name another file with -o")
    with replacing(path) as part:
        part.write_text(text, "utf-8")


def _copy_examples(folder: Path) -> None:
    """Copies the examples into a new folder: all of them, or none and no folder."""
    import shutil
    import tempfile

    files = example_files()
    if not files:
        raise SpecError("the examples are not in this installation: they are in the source distribution")
    if folder.exists():
        raise SpecError(f"{folder}: exists; name another folder with -o")
    try:
        with tempfile.TemporaryDirectory(prefix=f".{folder.name}.", dir=folder.absolute().parent) as beside:
            part = Path(beside) / folder.name
            part.mkdir()
            for file in files:
                shutil.copyfile(file, part / file.name)
            part.rename(folder)
    except OSError as error:
        raise SpecError(f"{folder}: cannot be written: {error.strerror}") from error


@app.command()
def check(context: typer.Context, json: JsonOption = False) -> None:
    """Check the configuration, the machine file, the memory map and the port. An error is printed as one line."""
    from daq.config.robot_files import load_memory_map
    from daq.config.settings import load_settings
    from daq.link.dialects import dialect_of
    from daq.plugins import named, plugins
    from daq.safety import unchecked
    from daq.transport import parse_port_url
    from daq.transport.url import FRAMED

    call = invocation(context)
    settings, path = load_settings(call.config_file)
    for plugin in plugins():
        for reference in plugin.checks:
            named(reference)(settings)
    found: dict[str, dict[str, Any]] = {}
    titles: dict[str, str] = {}
    for own in settings.each_robot() if call.robot_option is None else (settings.of_robot(call.robot_option),):
        port = call.port_option or own.robot.port
        machine, memory_map = own.machine(), load_memory_map(own.robot.memory_map)
        dialect_of(port or own.port)
        found[own.robot.name] = {
            "machine": machine.name,
            "joints": len(machine.joints),
            "memory_map": memory_map.name,
            "assumed_addresses": len(memory_map.assumed),
            "limits_not_set": list(unchecked(machine, machine.limits)),
            "port": port,
            "dialect": parse_port_url(port or own.port).dialect,
        }
        titles[own.robot.name] = machine.title
    if json:
        print_json({"file": path, "robots": found} if settings.robots else {"file": path, **found[settings.robot.name]})
        return
    print(f"configuration: {path or 'none, defaults'}")
    for name, told in found.items():
        if settings.robots:
            print(f"robot:         {name}")
        print(f"machine:       {told['machine']}, {told['joints']} joints ({titles[name]})")
        if told["dialect"] == FRAMED:
            print(f"memory map:    {told['memory_map']}; {told['assumed_addresses']} addresses are assumed")
        else:
            print(f"dialect:       {told['dialect']}, which needs no memory map")
        print(f"limits:        {'; '.join(told['limits_not_set']) or 'all set'}")
        print(f"port:          {told['port'] or 'none: the mock is used'}")
