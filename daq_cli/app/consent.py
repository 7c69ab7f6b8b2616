"""The operator's word before a real arm moves: asked for where a person can be asked."""

from __future__ import annotations

import sys

import typer

from daq.contracts.errors import SafetyError
from daq_cli.app.context import console


def can_be_asked() -> bool:
    """Consent is a person's: what comes through a pipe is nobody's word."""
    return console().is_terminal and sys.stdin.isatty()


def agreed(url: str, what: str = "it will move") -> bool:
    """Whether a person at this terminal agrees to `what`; no when nobody can be asked."""
    return can_be_asked() and typer.confirm(f"{url} is a real arm, and {what}. Is its workspace clear?", err=True)


def require_consent(url: str, *, simulated: bool, consent: bool, what: str, refused: str) -> None:
    """The operator's word, by --yes or at the terminal, before a real arm does `what`. Raises SafetyError without it,
    which says what is `refused`."""
    if not simulated and not consent and not agreed(url, what):
        raise SafetyError(f"{url} is a real arm: {refused} only with the operator's consent (--yes)")
