"""`daq stop`: stops every robot at once, from any terminal, without asking first."""

from __future__ import annotations

from typing import TYPE_CHECKING

import typer

from daq.contracts import exit_codes
from daq_cli.app.context import JsonOption, invocation, print_json
from daq_cli.robot.access import robot_of

if TYPE_CHECKING:
    from daq.acquisition.stop_socket import StopAnswer, StopAttempt

app = typer.Typer(add_completion=False)


@app.command()
def stop(context: typer.Context, json: JsonOption = False) -> None:
    """Freeze every robot that is being moved, and the configured one: set points become the measured posture.

    With --server this stops the robots of that service; with DAQ_SERVER, those and the ones that are moved from here.

    The exit code is 0 when every stop was confirmed by its board, and 3 when one was NOT DELIVERED or NOT CONFIRMED, or
    there was no robot. A program's stop never replaces the hardware's own.
    """
    from daq_cli.app import early_stop

    here = invocation(context).stops_here
    answers = [_answer(attempt) for attempt in early_stop.attempts()] if here else []
    answers += robot_of(context).stop({answer.port for answer in answers})
    if json:
        print_json([answer.as_data() for answer in answers])
    elif not answers:
        print("no robot is being moved from here, and none is configured: nothing to stop")
    else:
        for answer in answers:
            print(_line(answer))
    if not answers or not all(answer.confirmed for answer in answers):
        raise typer.Exit(exit_codes.NOT_REACHED)


def _answer(attempt: StopAttempt) -> StopAnswer:
    from daq.acquisition.stop_socket import StopAnswer

    silent = "the process that moves it did not answer"
    return attempt.answer or StopAnswer(robot=attempt.robot, delivered=False, confirmed=False, text=silent)


def _line(answer: StopAnswer) -> str:
    if answer.confirmed:
        line = f"{answer.robot}: stopped, confirmed by the board: set points frozen at tick {answer.tick}"
        return f"{line}. {answer.text}" if answer.text else line
    if answer.delivered:
        return f"{answer.robot}: stop sent, NOT CONFIRMED by the board: {answer.text}. Use the emergency stop."
    return f"{answer.robot}: stop NOT DELIVERED: {answer.text}. Use the emergency stop."
