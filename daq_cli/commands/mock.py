"""`daq mock`: runs a mock controller, to which other programs can connect, as a separate process."""

from __future__ import annotations

import os
import sys

import typer

app = typer.Typer(add_completion=False)


@app.command(context_settings={"allow_extra_args": True, "ignore_unknown_options": True, "help_option_names": []})
def mock(context: typer.Context) -> None:
    """Start the mock controller; `daq mock --help` lists its own options. `daq mock dynamixel` starts a bench of
    servos instead, with options of its own."""
    # The mock is reached only through a port, so this process becomes the mock.
    sys.stdout.flush()
    servos = context.args[:1] == ["dynamixel"]
    module, arguments = ("mock_controller.servos", context.args[1:]) if servos else ("mock_controller", context.args)
    os.execv(sys.executable, [sys.executable, "-m", module, *arguments])
