"""`daq reset`: the explicit end of a stop."""

from __future__ import annotations

import typer

from daq.cli.context import invocation
from daq.cli.robot import connected

app = typer.Typer(add_completion=False)


@app.command()
def reset(context: typer.Context) -> None:
    """End the freeze of a stop. Nothing moves: set points stay where the stop put them."""
    from firmware_protocol.commands import StatusFlag

    with connected(invocation(context)) as controller:
        frozen = StatusFlag.FROZEN in controller.status().flags
        controller.release()
    print("released: the arm holds its posture and takes set points again" if frozen else "was not stopped")
