"""`daq ports`: which serial ports there are."""

from __future__ import annotations

import typer

from daq.cli.context import JsonOption, print_json

app = typer.Typer(add_completion=False)


@app.command()
def ports(json: JsonOption = False) -> None:
    """List serial ports that could lead to a robot, with the URL to give to --port."""
    from daq.transport.discovery import ports as find_ports

    found = find_ports()
    if json:
        print_json([vars(port) if hasattr(port, "__dict__") else port for port in found])
    elif not found:
        print("no serial port found; `daq --port mock:// …` needs none")
    for port in [] if json else found:
        print(port)
