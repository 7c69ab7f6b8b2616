"""`daq config`: what is configured, and whether it is right."""

from __future__ import annotations

import typer

from daq.cli.context import JsonOption, console, invocation, print_json

app = typer.Typer(add_completion=False, help="Show and check the configuration.", no_args_is_help=True)


@app.command()
def show(context: typer.Context, json: JsonOption = False) -> None:
    """Show every setting, and where it was looked for."""
    from daq.config import config_files, load_settings

    call = invocation(context)
    settings, path = load_settings(call.config_file)
    data = settings.model_dump(mode="json")
    if json:
        print_json({"file": path, "settings": data})
        return
    places = ", ".join(str(file) for file in config_files(call.config_file))
    console().print(f"from {path}" if path else f"nothing is configured (looked for {places}): these are the defaults")
    for section, value in data.items():
        if isinstance(value, dict):
            print(f"[{section}]")
            for key, entry in value.items():
                print(f"{key} = {entry!r}")
        else:
            print(f"{section} = {value!r}")


@app.command()
def check(context: typer.Context) -> None:
    """Check the configuration, the machine file and the memory map; one line says what is wrong."""
    from daq.config import load_settings
    from daq.config.robot_files import load_memory_map
    from daq.safety import unchecked
    from daq.transport import parse_port_url

    settings, path = load_settings(invocation(context).config_file)
    machine = settings.machine()
    memory_map = load_memory_map(settings.robot.memory_map)
    parse_port_url(settings.port)
    unset = unchecked(machine, machine.limits)
    print(f"configuration: {path or 'none, defaults'}")
    print(f"machine:       {machine.name}, {len(machine.joints)} joints ({machine.title})")
    print(f"memory map:    {memory_map.name}; {len(memory_map.assumed)} addresses are assumed")
    print(f"limits:        {'; '.join(unset) or 'all set'}")
    print(f"port:          {settings.robot.port or 'none: the mock is used'}")
