"""The operator's word before a real arm moves: given with --yes, or asked for where a person can be asked."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

import typer

from daq.contracts.errors import SafetyError
from daq_cli.app.context import console

T = TypeVar("T")


def can_be_asked() -> bool:
    """Only a person can consent: what comes through a pipe is nobody's word."""
    return console().is_terminal and sys.stdin.isatty()


@dataclass(frozen=True)
class Consent:
    """What the operator is asked to agree to before a real arm does it.

    given: agreed beforehand, with --yes. what: what will happen, as the question says it. refused: the same, as the
    refusal says it.
    """

    given: bool
    what: str = "it will move"
    refused: str = "it moves"

    def agreed(self, url: str) -> bool:
        """Whether a person at this terminal agrees now; no when nobody can be asked."""
        return can_be_asked() and typer.confirm(
            f"{url} is a real arm, and {self.what}. Is its workspace clear?", err=True
        )

    def require(self, url: str, *, simulated: bool) -> None:
        """Raises SafetyError for a real arm at `url` unless the operator agreed, or agrees when asked."""
        if not simulated and not self.given and not self.agreed(url):
            raise SafetyError(f"{url} is a real arm: {self.refused} only with the operator's consent (--yes)")

    def attempt(self, url: str, action: Callable[[bool], T], missing: type[SafetyError]) -> T:
        """`action` with the consent that was given; where it raises `missing`, once more when a person agrees.

        So nobody holds the port while the question is on the screen, and a stop gets through.
        """
        try:
            return action(self.given)
        except missing:
            if not self.agreed(url):
                raise
        return action(True)
