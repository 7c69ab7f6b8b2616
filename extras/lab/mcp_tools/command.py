"""`daq mcp`: a service's tools over the Model Context Protocol."""

from __future__ import annotations

import logging
import os
from typing import Annotated

import typer

from daq.contracts.errors import SpecError
from daq_cli.app.context import invocation

app = typer.Typer(add_completion=False)


@app.command()
def mcp(
    context: typer.Context,
    http: Annotated[
        int | None,
        typer.Option(
            min=0, max=65535, help="Listen at this port of 127.0.0.1, path /mcp, in place of standard input and output."
        ),
    ] = None,
) -> None:
    """Offer a service's tools over the Model Context Protocol: read, preview, submit for review, fit, diagnose, stop.

    On standard input and output, DAQ_TOKEN says who asks. Over HTTP each request brings a token of its own.
    """
    from daq_cli.robot.remote.connection import TOKEN_VARIABLE
    from extras.lab.mcp_tools.tools import tools_of

    call = invocation(context)
    if call.server is None:
        raise SpecError("mcp: only a service has this: `daq --server http://host:8300 mcp`, or set DAQ_SERVER")
    served = tools_of(call.server, os.environ.get(TOKEN_VARIABLE) or None, call.robot_option)
    if http is None:
        logging.getLogger("mcp").setLevel(logging.ERROR)  # whoever started this shows standard error to people
        served.run("stdio")
    else:
        served.run("streamable-http", host="127.0.0.1", port=http, stateless_http=True)
