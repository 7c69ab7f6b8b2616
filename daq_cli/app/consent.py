"""The operator's consent before a real arm moves: given by --yes, or requested at the terminal."""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, TypeVar

import typer

from daq.contracts.consent import Identity, lacks_consent
from daq.contracts.errors import SafetyError
from daq.contracts.limp import GAINS_UNKNOWN
from daq_cli.app.context import console

if TYPE_CHECKING:
    from firmware_protocol.memory_map import MemoryMap

T = TypeVar("T")


def can_be_asked() -> bool:
    """Whether a person can be asked. Only a person can consent, so a pipe is not enough."""
    return console().is_terminal and sys.stdin.isatty()


@dataclass(frozen=True)
class ConsentPrompt:
    """Requests the operator's consent to an action of a real arm.

    given:   whether the operator consented beforehand, by --yes
    what:    the action, in the words of the question
    refused: the action, in the words of the refusal
    """

    given: bool
    what: str = "it will move"
    refused: str = "it moves"

    def for_gains_of(self, memory_map: MemoryMap) -> ConsentPrompt:
        """Returns a prompt that warns if limp joints cannot be detected with this memory map."""
        return self if memory_map.has_gains else replace(self, what=f"{self.what}; {GAINS_UNKNOWN}")

    def agreed(self, url: str) -> bool:
        """Asks the person at this terminal. Returns False if nobody can be asked."""
        return can_be_asked() and typer.confirm(
            f"{url} is a real arm, and {self.what}. Is its workspace clear?", err=True
        )

    def require(self, url: str, identity: Identity | None) -> None:
        """Raises SafetyError for a real arm at `url`, unless the operator has consented or consents when asked."""
        if lacks_consent(identity, self.given) and not self.agreed(url):
            raise SafetyError(f"{url} is a real arm: {self.refused} only with the operator's consent (--yes)")
