"""A real arm, and the operator who is asked about it at the terminal. Both are pretended: every arm here is a mock."""

import sys
from collections.abc import Callable

import pytest
import typer

from daq.driver.controller import Identity
from daq.owner import start
from daq_cli.app import consent

REAL = """
from daq.driver.controller import Identity
from daq.owner.process import main
Identity.simulated = property(lambda _: False)
raise SystemExit(main())
"""
"""An owner whose controller says of itself that it is no mock."""


def pretend_real_arm(monkeypatch: pytest.MonkeyPatch) -> None:
    """The controller says of itself that it is no mock."""
    monkeypatch.setattr(Identity, "simulated", property(lambda _: False))
    monkeypatch.setattr(start, "PROGRAM", (sys.executable, "-c", REAL))


def asked_operator(monkeypatch: pytest.MonkeyPatch, answer: Callable[[str], bool]) -> None:
    """The arm is real, and a person at the terminal answers the question that is given to `answer`."""
    pretend_real_arm(monkeypatch)
    monkeypatch.setattr(consent, "can_be_asked", lambda: True)
    monkeypatch.setattr(typer, "confirm", lambda question, **_: answer(question))
