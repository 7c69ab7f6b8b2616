"""`daq stop`: at once, from any terminal, never asking first."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

import typer

from daq.contracts import exit_codes
from daq.contracts.errors import DaqError
from daq_cli.app.context import Invocation, JsonOption, invocation, print_json

if TYPE_CHECKING:
    from daq.acquisition.stop_socket import StopAnswer, StopAttempt

app = typer.Typer(add_completion=False)


@app.command()
def stop(context: typer.Context, json: JsonOption = False) -> None:
    """Freeze every robot that is being moved, and the configured one: set points become the measured posture.

    With --server the robots of that service; with DAQ_SERVER those and the ones that are moved from here.

    Ends with 0 when every stop was confirmed by its board, with 3 when one was NOT DELIVERED or NOT CONFIRMED, or there
    was no robot. A program's stop never replaces the hardware's own.
    """
    from daq_cli.app import early_stop

    call = invocation(context)
    here = call.server is None or call.server_by_default
    answers = [_answered(attempt) for attempt in early_stop.attempts()] if here else []
    if call.server is None:
        answers += _stop_configured(call, {answer.port for answer in answers})
    else:
        from daq_cli.robot.remote.stop import stop_at_server

        answers += stop_at_server(call)
    if json:
        print_json([answer.as_data() for answer in answers])
    elif not answers:
        print("no robot is being moved from here, and none is configured: nothing to stop")
    else:
        for answer in answers:
            print(_told(answer))
    if not answers or not all(answer.confirmed for answer in answers):
        raise typer.Exit(exit_codes.NOT_REACHED)


def _stop_configured(call: Invocation, reached: set[str]) -> list[StopAnswer]:
    """The robot of the command line or the configuration, unless a process that holds its port has been asked.

    A configuration that cannot be read is no reason not to have stopped the others; it is told.
    """
    try:
        url = call.port_option or call.settings.robot.port
        name = "robot" if call.port_option else call.settings.robot.name
    except DaqError as error:
        return [_undelivered("configured robot", "", str(error))]
    if url is None or url.startswith("mock://") or _device(url) in map(_device, reached):
        return []
    from daq.acquisition.port_stop import stop_at_port

    return [stop_at_port(name, url)]


def _device(url: str) -> object:
    """What a port's URL is about, however it is written; the text itself where it is no URL."""
    from daq.transport.url import SerialPort, TcpPort, TransportError, parse_port_url

    try:
        port = parse_port_url(url)
    except TransportError:
        return url
    match port:
        case SerialPort(device):
            return os.path.realpath(device)
        case TcpPort(host, number):
            return host.lower(), number
    return url


def _answered(attempt: StopAttempt) -> StopAnswer:
    return attempt.answer or _undelivered(attempt.robot, "", "the process that moves it did not answer")


def _undelivered(robot: str, port: str, why: str) -> StopAnswer:
    from daq.acquisition.stop_socket import StopAnswer

    return StopAnswer(robot=robot, port=port, delivered=False, confirmed=False, text=why)


def _told(answer: StopAnswer) -> str:
    if answer.confirmed:
        told = f"{answer.robot}: stopped, confirmed by the board: set points frozen at tick {answer.tick}"
        return f"{told}. {answer.text}" if answer.text else told
    if answer.delivered:
        return f"{answer.robot}: stop sent, NOT CONFIRMED by the board: {answer.text}. Use the emergency stop."
    return f"{answer.robot}: stop NOT DELIVERED: {answer.text}. Use the emergency stop."
