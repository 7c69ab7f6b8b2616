"""`daq serve`: runs the service until a signal ends it."""

from __future__ import annotations

import gc
import logging
from typing import Annotated

import typer

from daq.contracts.errors import SpecError
from daq_cli.app.context import invocation

app = typer.Typer(add_completion=False)


@app.command()
def serve(
    context: typer.Context,
    host: Annotated[
        str | None, typer.Option(help="Address to listen on (default: the configured one, else 127.0.0.1).")
    ] = None,
    port: Annotated[int | None, typer.Option(min=0, max=65535, help="Port to listen on; 0 for any free one.")] = None,
) -> None:
    """Serve experiments, traces and the dashboard to people and programs."""
    from daq.contracts.extras import require_extra
    from daq.transport.url import parse_port_url
    from server import logs

    require_extra("server", "daq serve", "uvicorn", "fastapi", "sqlalchemy", "prometheus_client")
    logs.begin()  # first, so that errors of the configuration are logged too
    call = invocation(context)
    settings = call.configuration
    section = settings.server.model_copy(
        update={key: value for key, value in (("host", host), ("port", port)) if value is not None}
    )
    if not settings.robots:
        settings = settings.model_copy(update={"robot": settings.robot.model_copy(update={"port": call.port})})
    elif call.port_option is not None:
        raise SpecError("--port: several robots are configured, each with a port of its own: robots.NAME.port")
    for own in settings.each_robot():  # reject an invalid port now, instead of retrying it
        parse_port_url(own.port)
    gc.disable()  # collections would take a tenth of the start and find nothing; `keep_steady` enables them again
    from server.serve import serve as run

    run(settings.model_copy(update={"server": section}), _announce)


def _announce(address: str) -> None:
    from server.page import NOT_BUILT, is_built

    log = logging.getLogger("server")
    log.info("serving %s (Ctrl-C ends it)", address)
    if not is_built():
        log.warning(NOT_BUILT)
    print(address, flush=True)
