"""`daq ports`: lists serial ports."""

from __future__ import annotations

from dataclasses import asdict

import typer

from daq_cli.app.context import JsonOption, print_json

app = typer.Typer(add_completion=False)


@app.command()
def ports(json: JsonOption = False) -> None:
    """List serial ports that could lead to a robot, with the URL to give to --port."""
    from daq.transport.discovery import ports as find_ports

    found = find_ports()
    if json:
        print_json([asdict(port) for port in found])
        return
    if not found:
        print("no serial port found; the mock needs none (`daq --port mock:// …`)")
    for port in found:
        shown = ", ".join(text for text in (port.description, port.maker, port.serial_number) if text)
        print(f"{port.url}  {shown}")
