"""`daq hide`: the demonstration in a terminal."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated

import typer

from daq_cli.app.context import JsonOption, console, print_json

app = typer.Typer(add_completion=False)
OUTCOMES = {
    "named": "named rightly, and alone",
    "among": "among the effects that the records leave open",
    "joint": "the joint is right, the effect is not",
    "missed": "missed: nothing significant was found",
    "wrong": "wrong",
}


@app.command()
def hide(
    effect: Annotated[str | None, typer.Option(help="The effect to hide (default: the mock draws one).")] = None,
    joint: Annotated[int | None, typer.Option(min=1, max=6, help="The joint to hide it on.")] = None,
    folder: Annotated[Path | None, typer.Option(help="Folder that keeps the traces (default: none are kept).")] = None,
    json: JsonOption = False,
) -> None:
    """Hide an effect in the mock, let a diagnosis look for it, and reveal the secret.

    The seal is the SHA-256 of the secret, shown before anything is recorded: nothing can be changed afterwards.
    """
    from daq.contracts.machine import load_machine
    from daq.contracts.service.hidden import HideRequest
    from daq.traces.reader import read_trace
    from daq_cli.app.progress import shown_progress
    from extras.demonstration.hidden import EXPERIMENTS, draw, opened, record
    from model.discrepancy.options import DiagnosisOptions
    from model.discrepancy.workflow import diagnose
    from model.machine_model.model import base_model

    machine = load_machine("ma2000")
    sealed = draw(HideRequest(effect=effect, joint=joint))
    with TemporaryDirectory() as temporary:
        place = folder or Path(temporary)
        if not json:
            console().print(f"sealed: {sealed.seal}")
            console().print("recording 72 s of motion in lock-step, then looking for what is missing")
        fitted, held = (read_trace(record(sealed, name, machine, place).trace) for name in EXPERIMENTS)
        with shown_progress("diagnosing") as progress:
            found = diagnose(base_model(machine), [fitted], [held], DiagnosisOptions(most_steps=1), progress)
    secret = opened(sealed, found, machine)
    if json:
        print_json({"seal": sealed.seal, "answer": found.summary, "secret": secret.model_dump(mode="json")})
        return
    print(f"answer  {found.summary}")
    print(f"secret  {secret.called}: {OUTCOMES[secret.outcome]}")
    for number in secret.numbers:
        answer = "not given" if number.found is None else f"{number.found:.4g}"
        print(f"        {number.called} {number.hidden:.4g} {number.unit}, in the answer {answer}")
    print(f"check   python -m mock_controller.reveal {secret.seed} | sha256sum")
