"""The operator's consent, without which a real arm does not move."""

from __future__ import annotations

from typing import Protocol

from daq.contracts.errors import SpecError


class Identity(Protocol):
    """What a controller says about itself."""

    @property
    def simulated(self) -> bool:
        """Whether no arm is behind it."""


def lacks_consent(identity: Identity | None, given: bool) -> bool:
    """Whether a real arm would move without the operator's consent. While no controller is connected, nothing moves."""
    return identity is not None and not identity.simulated and not given


def require_word(moves_real_arm: object) -> bool:
    """The consent, False where it is not given. Raises SpecError for any value other than True and False, even one that
    is truthy."""
    if not isinstance(moves_real_arm, bool):
        raise SpecError(f"moves_real_arm = {moves_real_arm!r:.40}: True is the operator's consent, and False is none")
    return moves_real_arm
