"""Steps of a demonstration: draws a secret, records experiments, and reveals the secret.

The mock's side draws and reveals secrets in separate processes. In between, this side knows only a seed, which means
nothing without the mock. A diagnosis gets only the traces, which do not contain the seed.
"""

from __future__ import annotations

import json
import os
import secrets
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from daq.child import last_words
from daq.contracts.effects import effect_names
from daq.contracts.errors import DaqError, SpecError
from daq.contracts.machine import Machine
from daq.contracts.service.hidden import HiddenNumber, HideChoice, HideRequest, OpenedSecret, Outcome
from daq.owner.client import OwnerOnDemand
from daq.owner.messages import Finished, Open
from daq.trajectories.presets import preset
from model.discrepancy.diagnosis import Diagnosis, FoundValue
from model.effects.names import effect_name, effect_on
from model.machine_model.effect_parameters import effect_parameters
from model.machine_model.parameter import Parameter
from model.trial.conventions import true_parameters
from model.trial.score import score
from model.trial.truth import Detectability, Truth, parse_truth

EXPERIMENTS = ("diagnostic", "held-out")
"""Presets that are recorded: the first is fitted, the second held out."""


class HidingError(DaqError):
    """A demonstration that cannot continue; the text is one line."""


@dataclass(frozen=True)
class Sealed:
    """A seed, and the SHA-256 of its secret."""

    seed: int
    seal: str


@cache
def choices() -> tuple[HideChoice, ...]:
    """Returns the effects that the mock can hide."""
    known, names = _told("hide", "--list"), effect_names()
    return tuple(HideChoice(called=effect_name(one["effect"]), line=names[one["effect"]].line, **one) for one in known)


def draw(request: HideRequest) -> Sealed:
    """Lets the mock's side draw. Raises SpecError for an effect that it cannot hide there."""
    known = {one.effect: one for one in choices()}
    if request.effect is not None and request.effect not in known:
        raise SpecError(f"effect {request.effect}: cannot be hidden; allowed are {', '.join(known)}")
    possible = [one for one in known.values() if request.effect in (None, one.effect)]
    if request.joint is not None and not any(request.joint in one.joints for one in possible):
        on = sorted({joint for one in possible for joint in one.joints})
        allowed = f"on joints {', '.join(map(str, on))}" if on else "on the whole arm, without a joint"
        raise SpecError(f"joint {request.joint}: nothing can be hidden there; allowed is {allowed}")
    words = [word for key, value in request if value is not None for word in (f"--{key}", str(value))]
    return Sealed(**_told("hide", *words))


def record(
    sealed: Sealed, name: str, machine: Machine, folder: Path, made: Callable[[OwnerOnDemand], None] = lambda _: None
) -> Finished:
    """Records a preset on the arm of a seed in lock-step, at full speed, and returns how the run ended.

    `made` gets the object that can halt it. Raises HidingError.
    """
    spec = preset(name).spec.model_copy(
        update={"name": f"hidden-{name}", "notes": "a demonstration on the mock, recorded in lock-step"}
    )
    opening = Open(
        url=f"mock://?lock_step=1&secret={sealed.seed}&seed={secrets.randbelow(2**28)}",
        machine=machine,
        limits=machine.limits,
        folder=folder,
        robot=f"demonstration-{secrets.token_hex(4)}",  # its stop socket: it is not the robot's own mock
    )
    with OwnerOnDemand(opening) as owner:
        made(owner)
        finished = owner.run(spec)
    if finished.outcome != "complete":
        raise HidingError(f"the recording of {name} ended early: {finished.reason or finished.outcome}")
    return finished


def opened(sealed: Sealed, answer: Diagnosis | None, machine: Machine) -> OpenedSecret:
    """Returns the secret beside an answer, scored as in blind trials; None if the search has none."""
    truth = parse_truth(_told("reveal", str(sealed.seed)))
    (hidden,) = truth.effects
    return OpenedSecret(
        seed=sealed.seed,
        effect=hidden.known_as,
        joints=hidden.joints,
        called=effect_on(hidden.known_as, hidden.joints),
        numbers=_numbers(truth, answer, machine),
        outcome=_outcome(truth, answer, machine),
    )


def _outcome(truth: Truth, answer: Diagnosis | None, machine: Machine) -> Outcome:
    if answer is None:
        return "unanswered"
    judged = score(truth, Detectability(seed=truth.seed, d_prime=0.0), answer, machine)
    place = judged.joint_right is not False
    if answer.verdict == "nothing-significant":
        return "missed"
    if judged.named_right and place:
        return "named"
    if judged.in_answer and place:
        return "among"
    return "joint" if judged.joint_right else "wrong"


def _numbers(truth: Truth, answer: Diagnosis | None, machine: Machine) -> tuple[HiddenNumber, ...]:
    """Returns the hidden effect's parameters, in the model's conventions if they have one, else in the mock's."""
    (hidden,) = truth.effects
    steps = () if answer is None else answer.steps
    found = {name: value for step in steps if step.adopted for name, value in step.parameters.items()}
    numbers: list[HiddenNumber] = []
    for joint in hidden.joints or (None,):
        on = () if joint is None else (joint,)
        parameters = {p.part: p for p in effect_parameters(machine, hidden.known_as, on, shared=False)}
        true = true_parameters(hidden, joint, truth, machine)
        numbers += [_number(parameters[part], value, found) for part, value in true.items() if part in parameters]
    if numbers:
        return tuple(numbers)
    own = hidden.at(hidden.joints[0] if hidden.joints else None)
    return tuple(HiddenNumber(called=name, unit="", hidden=value) for name, value in own.items() if name != "joint")


def _number(parameter: Parameter, hidden: float, found: dict[str, FoundValue]) -> HiddenNumber:
    value = found.get(parameter.name)
    told = {} if value is None else {"found": value.value, "low": value.low, "high": value.high}
    return HiddenNumber(called=parameter.part, unit=parameter.unit, hidden=hidden, **told)


def _told(module: str, *words: str) -> Any:
    """Returns the line of JSON that a program of the mock's side prints. Raises HidingError."""
    done = subprocess.run(
        [sys.executable, "-m", f"mock_controller.{module}", *words],
        env={"OPENBLAS_NUM_THREADS": "1"} | os.environ,
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        raise HidingError(f"the mock hides nothing: {last_words(done.stderr)}")
    return json.loads(done.stdout)
