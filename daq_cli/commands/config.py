"""`daq config`: shows and checks the configuration."""

from __future__ import annotations

import typer

from daq_cli.app.context import JsonOption, console, invocation, print_json

app = typer.Typer(add_completion=False, help="Show and check the configuration.", no_args_is_help=True)


@app.command()
def show(context: typer.Context, json: JsonOption = False) -> None:
    """Show every setting as a daq.toml, and the places where a configuration was looked for."""
    from daq.config import config_files, load_settings
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
def check(context: typer.Context, json: JsonOption = False) -> None:
    """Check the configuration, the machine file, the memory map and the port; an error is one line."""
    from daq.config import load_settings
    from daq.config.robot_files import load_memory_map
    from daq.safety import unchecked
    from daq.transport import parse_port_url
    from server.store.address import parse_address

    call = invocation(context)
    settings, path = load_settings(call.config_file)
    port = call.port_option or settings.robot.port
    machine = settings.machine()
    memory_map = load_memory_map(settings.robot.memory_map)
    parse_port_url(port or settings.port)
    parse_address(settings.server.database_url)
    unset = unchecked(machine, machine.limits)
    if json:
        found = {"machine": machine.name, "joints": len(machine.joints), "memory_map": memory_map.name}
        found |= {"assumed_addresses": len(memory_map.assumed), "limits_not_set": list(unset)}
        print_json({"file": path, **found, "port": port})
        return
    print(f"configuration: {path or 'none, defaults'}")
    print(f"machine:       {machine.name}, {len(machine.joints)} joints ({machine.title})")
    print(f"memory map:    {memory_map.name}; {len(memory_map.assumed)} addresses are assumed")
    print(f"limits:        {'; '.join(unset) or 'all set'}")
    print(f"port:          {port or 'none: the mock is used'}")
