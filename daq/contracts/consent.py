"""The operator's consent, without which a real arm does not move."""

from __future__ import annotations

from typing import Protocol

from daq.contracts.errors import SpecError


class Identity(Protocol):
    """A controller's identity."""

    @property
    def simulated(self) -> bool:
        """Whether the controller is simulated, without an arm."""


def lacks_consent(identity: Identity | None, given: bool) -> bool:
    """Whether a real arm would move without the operator's consent. While no controller is connected, nothing moves."""
    return identity is not None and not identity.simulated and not given


def require_word(moves_real_arm: object) -> bool:
    """Returns the consent. Raises SpecError for any value other than True and False, even a truthy one."""
    if not isinstance(moves_real_arm, bool):
        raise SpecError(f"moves_real_arm = {moves_real_arm!r:.40}: must be True (the operator consents) or False")
    return moves_real_arm
