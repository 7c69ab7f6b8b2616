"""The operator's consent before a real arm moves: given with --yes, or asked for if there is a terminal."""

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
    """Whether a person can be asked: only a person can consent, so a pipe is not enough."""
    return console().is_terminal and sys.stdin.isatty()


@dataclass(frozen=True)
class ConsentPrompt:
    """Asks for the operator's consent to something that a real arm will do.

    given:   whether the operator consented beforehand, with --yes
    what:    what will happen, in the words of the question
    refused: the same, in the words of the refusal
    """

    given: bool
    what: str = "it will move"
    refused: str = "it moves"

    def for_gains_of(self, memory_map: MemoryMap) -> ConsentPrompt:
        """The same, which says where this memory map lets no limp joint be seen."""
        return self if memory_map.has_gains else replace(self, what=f"{self.what}; {GAINS_UNKNOWN}")

    def agreed(self, url: str) -> bool:
        """Asks the person at this terminal; returns False if nobody can be asked."""
        return can_be_asked() and typer.confirm(
            f"{url} is a real arm, and {self.what}. Is its workspace clear?", err=True
        )

    def require(self, url: str, identity: Identity | None) -> None:
        """Raises SafetyError for a real arm at `url` unless the operator agreed, or agrees when asked."""
        if lacks_consent(identity, self.given) and not self.agreed(url):
            raise SafetyError(f"{url} is a real arm: {self.refused} only with the operator's consent (--yes)")
